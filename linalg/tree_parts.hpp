#pragma once

#include <span>

#include "linalg/array.hpp"
#include "linalg/elimination_tree.hpp"

namespace ipminmax {

/// What an elimination by rows takes, in nanoseconds of a usual machine.
struct EliminationCost {
  double row = 0.0;     ///< of A
  double entry = 0.0;   ///< of L
  double update = 0.0;  ///< of one entry by another
};

/// Of each row, counted: from L's entries in it and those before it in their columns.
[[nodiscard]] Array<double> row_costs(const EliminationTree& tree, const FactorPattern& pattern,
                                      const EliminationCost& cost);

/// Rows in sets that can be eliminated at the same time, each in ascending order: a row needs those
/// of its own subtree alone. The rest is eliminated last.
struct TreeParts {
  Array<Index> rows;       ///< of the first set, of the next, ..., and the rest
  Array<Index> starts{0};  ///< of each set, and of the rest
  double cost = 0.0;       ///< of all rows
  double longest = 0.0;    ///< of the most expensive set and the rest
  [[nodiscard]] int count() const { return static_cast<int>(starts.size()) - 1; }
  [[nodiscard]] std::span<const Index> part(int p) const;
  [[nodiscard]] std::span<const Index> rest() const;
};

/// At most so many sets, of which each is worth least_part at least; no set at all, and all rows in
/// the rest, where that saves too little. Deterministic.
[[nodiscard]] TreeParts split(const EliminationTree& tree, std::span<const double> row_costs,
                              int most_parts, double least_part);

/// The parts of a factorization by that many threads: none where it takes less than about a
/// millisecond by its counted operations. Throws std::bad_alloc.
[[nodiscard]] TreeParts parts_for_threads(const EliminationTree& tree, const FactorPattern& pattern,
                                          const EliminationCost& cost, int threads);

/// Whether a factorization is large enough for threads: entries of L without its diagonal, and
/// operations, below * (below + 2) of a column with so many entries below the diagonal.
[[nodiscard]] bool is_worth_threads(Index dimension, double entries, double operations);

/// The place of each row in an order of elimination with no more fill, whose tree divides in two
/// where that of the given one does not: a chain is eliminated from both ends. Empty where
/// that gains too little. Throws std::bad_alloc.
[[nodiscard]] Array<Index> order_for_two_parts(const Lists& a);

}  // namespace ipminmax
