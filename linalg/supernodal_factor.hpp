#pragma once

#include <cstddef>
#include <span>

#include "linalg/array.hpp"
#include "linalg/elimination_tree.hpp"
#include "linalg/tree_parts.hpp"
#include "linalg/workers.hpp"

namespace ipminmax {

/// Factors L D L', without pivoting, of a matrix whose order of elimination is a postorder of its
/// elimination tree. Columns of L with nearly the same rows are a supernode, one dense panel. What
/// it leaves of the rows below it, a dense update matrix, is added to the supernode that comes next
/// in the tree, its parent (multifrontal, Duff and Reid 1983).
class SupernodalFactor {
 public:
  /// lower: the matrix by rows, columns left of the diagonal; places: of these entries, and of the
  /// diagonals, in its values. threads: of one factorization, at most. Throws std::bad_alloc, also
  /// where an Index cannot count L's entries.
  SupernodalFactor(const Lists& lower, std::span<const Index> places,
                   std::span<const Index> diagonal_places, const EliminationTree& tree,
                   int threads);

  /// Of the matrix with gamma weights_i added to its diagonal; allocates nothing. False: a pivot is
  /// zero or not finite.
  [[nodiscard]] bool factorize(std::span<const double> values, std::span<const double> weights,
                               double gamma);
  /// L D L' x = b in place, both in the order of elimination.
  void solve(std::span<double> x) const;
  [[nodiscard]] std::span<const double> pivots() const { return pivots_; }
  /// visit(row, value) for the entries of column j of L, without its unit diagonal.
  template <class Visit>
  void for_each_of_column(std::size_t j, Visit&& visit) const {
    const Supernode& s = supernodes_[supernode_of_[j]];
    const std::size_t width = at(s.width), k = j - at(s.first);
    for (std::size_t i = k + 1; i < at(s.height); ++i) {
      const std::size_t row = i < width ? at(s.first) + i : at(rows_[at(s.rows) + i - width]);
      visit(row, panels_[at(s.panel) + i * width + k]);
    }
  }
  [[nodiscard]] int threads() const { return parts_.count(); }

 private:
  struct Supernode {
    Index first = 0, width = 0;  ///< its columns
    Index height = 0;            ///< of the panel: its columns' rows, and those below
    Index rows = 0;              ///< where those below begin in rows_ and in_parent_
    Index panel = 0;             ///< where it begins in panels_, by rows
    double zeros = 0.0;          ///< entries of the panel that L has not
    /// Where in updates_ the update matrix is made, lower triangle by rows, and where it stays.
    std::size_t made = 0, update = 0;
    [[nodiscard]] std::size_t below() const { return at(height - width); }
    [[nodiscard]] std::size_t update_size() const { return below() * (below() + 1) / 2; }
  };
  [[nodiscard]] std::span<const Index> rows_below(const Supernode& s) const {
    return std::span(rows_).subspan(at(s.rows), s.below());
  }
  void find_supernodes(const EliminationTree& tree);
  void find_rows(const Lists& entry_rows);
  void place_entries(const Lists& entry_rows);
  void divide(int threads);
  void place_updates();
  [[nodiscard]] bool eliminate(std::span<const Index> supernodes, std::span<const double> values,
                               std::span<const double> weights, double gamma, double* packed);
  void add_update(const Supernode& child, const Supernode& parent);
  [[nodiscard]] bool eliminate_columns(const Supernode& s, double* packed);
  void make_update(const Supernode& s, double* packed);

  Array<Supernode> supernodes_;
  Array<Index> supernode_of_;  // each column
  Array<Index> parents_;       // of supernodes
  Lists children_;
  Array<Index> rows_;       // below each panel, ascending
  Array<Index> in_parent_;  // the rows that these are of the parent's panel
  // Entries of the matrix by supernode: places in its values and in panels_.
  Lists entries_;
  Array<Index> targets_;
  Array<Index> diagonal_places_;
  TreeParts parts_;
  Array<double> panels_, updates_, pivots_;
  Array<double> packed_;  // by part: rows of L D, four together
  std::size_t packed_size_ = 0;
  Array<char> broken_;  // by part
  Workers workers_;
};

}  // namespace ipminmax
