#pragma once

#include <span>

#include "linalg/array.hpp"
#include "linalg/triplet.hpp"

namespace ipminmax {

// A symmetric matrix by rows in the order of elimination: of each the columns, in any order, none
// beyond the row.

/// Entries of each column of L without its diagonal; parent: of each row in the tree.
[[nodiscard]] Array<Index> column_lengths(const Lists& a, Array<Index>& parent);

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

}  // namespace ipminmax
