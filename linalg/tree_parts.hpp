#pragma once

#include <span>

#include "linalg/array.hpp"

namespace ipminmax {

/// Nodes of an elimination tree in sets that can be eliminated at the same time, each in ascending
/// order: a node needs those of its own subtree alone. The rest is eliminated last.
struct TreeParts {
  Array<Index> nodes;      ///< of the first set, of the next, ..., and the rest
  Array<Index> starts{0};  ///< of each set, and of the rest
  [[nodiscard]] int count() const { return static_cast<int>(starts.size()) - 1; }
  [[nodiscard]] std::span<const Index> part(int p) const;
  [[nodiscard]] std::span<const Index> rest() const;
};

/// At most a set for each thread; no set at all, and all nodes in the rest, where that saves too
/// little, or all take less than about a millisecond. parent: of each node, -1 for a root; costs:
/// of each node, in nanoseconds of a usual machine. Deterministic. Throws std::bad_alloc.
[[nodiscard]] TreeParts parts_for_threads(std::span<const Index> parent,
                                          std::span<const double> costs, int threads);

}  // namespace ipminmax
