#pragma once

#include <span>
#include <vector>

#include "linalg/triplet.hpp"

namespace ipminmax {

/// A symmetric matrix by rows in the order of elimination: row k has the columns
/// columns[starts[k]] to columns[starts[k + 1] - 1], in any order, none beyond k.
struct LowerRows {
  std::span<const Index> starts;  ///< dimension + 1
  std::span<const Index> columns;
  [[nodiscard]] Index dimension() const { return static_cast<Index>(starts.size()) - 1; }
};

/// Elimination tree of a matrix L D L', and the lengths of L's columns (Liu 1990).
struct EliminationTree {
  std::vector<Index> parent;            ///< of each row; -1: a root
  std::vector<Index> column_starts{0};  ///< of L without its diagonal; dimension + 1
  [[nodiscard]] Index dimension() const { return static_cast<Index>(parent.size()); }
  [[nodiscard]] Index entries() const { return column_starts.back(); }
};

/// Throws std::bad_alloc, also where an Index cannot count L's entries.
[[nodiscard]] EliminationTree elimination_tree(const LowerRows& a);

/// Where L has entries beside its diagonal.
struct FactorPattern {
  std::vector<Index> rows;        ///< of each column (EliminationTree::column_starts), ascending
  std::vector<Index> row_starts;  ///< dimension + 1
  std::vector<Index> columns;     ///< of each row, descendants before their ancestors
};

/// Throws std::bad_alloc.
[[nodiscard]] FactorPattern factor_pattern(const LowerRows& a, const EliminationTree& tree);

/// What an elimination by rows takes, in nanoseconds of a usual machine.
struct EliminationCost {
  double row = 0.0;     ///< of A
  double entry = 0.0;   ///< of L
  double update = 0.0;  ///< of one entry by another
};

/// Of each row, counted: from L's entries in it and those before it in their columns.
[[nodiscard]] std::vector<double> row_costs(const EliminationTree& tree,
                                            const FactorPattern& pattern,
                                            const EliminationCost& cost);

/// Rows in sets that can be eliminated at the same time, each in ascending order: a row needs those
/// of its own subtree alone. The rest is eliminated last.
struct TreeParts {
  std::vector<Index> rows;       ///< of the first set, of the next, ..., and the rest
  std::vector<Index> starts{0};  ///< of each set, and of the rest
  double cost = 0.0;             ///< of all rows
  double longest = 0.0;          ///< of the most expensive set and the rest
  [[nodiscard]] int count() const { return static_cast<int>(starts.size()) - 1; }
  [[nodiscard]] std::span<const Index> part(int p) const;
  [[nodiscard]] std::span<const Index> rest() const;
};

/// At most so many sets, of which each is worth least_part at least; no set at all, and all rows in
/// the rest, where that saves too little. Deterministic.
[[nodiscard]] TreeParts split(const EliminationTree& tree, std::span<const double> row_costs,
                              int most_parts, double least_part);

/// The parts of a factorization by that many threads: none where it takes less than about half a
/// millisecond by its counted operations. Throws std::bad_alloc.
[[nodiscard]] TreeParts parts_for_threads(const EliminationTree& tree, const FactorPattern& pattern,
                                          const EliminationCost& cost, int threads);

}  // namespace ipminmax
