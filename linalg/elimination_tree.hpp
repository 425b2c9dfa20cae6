#pragma once

#include <span>

#include "linalg/array.hpp"
#include "linalg/triplet.hpp"

namespace ipminmax {

// A symmetric matrix by rows in the order of elimination: of each the columns, in any order, none
// beyond the row.

/// Elimination tree of a matrix L D L', and the lengths of L's columns (Liu 1990).
struct EliminationTree {
  Array<Index> parent;            ///< of each row; -1: a root
  Array<Index> column_starts{0};  ///< of L without its diagonal; dimension + 1
  [[nodiscard]] Index dimension() const { return static_cast<Index>(parent.size()); }
  [[nodiscard]] Index entries() const { return column_starts.back(); }
};

/// Throws std::bad_alloc, also where an Index cannot count L's entries.
[[nodiscard]] EliminationTree elimination_tree(const Lists& a);

/// Where L has entries beside its diagonal.
struct FactorPattern {
  Array<Index> rows;        ///< of each column (EliminationTree::column_starts), ascending
  Array<Index> row_starts;  ///< dimension + 1
  Array<Index> columns;     ///< of each row, descendants before their ancestors
};

/// Throws std::bad_alloc.
[[nodiscard]] FactorPattern factor_pattern(const Lists& a, const EliminationTree& tree);

/// The rows, children before their parents, every subtree without a gap.
[[nodiscard]] Array<Index> postorder(std::span<const Index> parent);

/// The place of each row in an order of elimination without fill in L + L', in which `last` comes
/// last: maximum cardinality search (Tarjan and Yannakakis 1984). Throws std::bad_alloc.
[[nodiscard]] Array<Index> order_without_fill(const EliminationTree& tree,
                                              const FactorPattern& pattern, Index last);

}  // namespace ipminmax
