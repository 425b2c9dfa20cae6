#pragma once

#include <span>
#include <utility>
#include <vector>

#include "linalg/numbers.hpp"
#include "linalg/triplet.hpp"

namespace ipminmax {

/// Symmetric sparse matrix with a fixed pattern; only values change after construction.
///
/// Stores the lower triangle by columns (compressed), rows ascending. Every diagonal entry is in
/// the pattern, so that a multiple of the identity can always be added; the diagonal entry of
/// column j is the first of its column, at position column_starts()[j].
class SymmetricMatrix {
 public:
  SymmetricMatrix() = default;

  /// Pattern from triplets in any order. Entries above the diagonal are mirrored, duplicates share
  /// one position. Throws std::invalid_argument when an index is outside [0, dimension).
  SymmetricMatrix(Index dimension, std::span<const Triplet> entries);

  [[nodiscard]] Index dimension() const { return dimension_; }
  [[nodiscard]] Index nonzeros() const { return static_cast<Index>(rows_.size()); }
  [[nodiscard]] std::span<const Index> column_starts() const {
    return column_starts_;
  }                                                                         ///< dimension+1
  [[nodiscard]] std::span<const Index> rows() const { return rows_; }       ///< nonzeros
  [[nodiscard]] std::span<const double> values() const { return values_; }  ///< nonzeros
  [[nodiscard]] std::span<double> values() { return values_; }

  /// Position in values() of each triplet given to the constructor, in their order.
  [[nodiscard]] std::span<const Index> triplet_positions() const { return triplet_positions_; }
  /// Hands the positions over; triplet_positions() is empty afterwards.
  [[nodiscard]] std::vector<Index> take_triplet_positions() {
    return std::exchange(triplet_positions_, {});
  }

  /// Position in values() of the diagonal entry (i, i).
  [[nodiscard]] Index diagonal_position(Index i) const { return column_starts_[at(i)]; }

  /// visit(row, column, position in values()) for every entry, column by column.
  template <class Visit>
  void for_each_entry(Visit&& visit) const {
    for (Index j = 0; j < dimension_; ++j) {
      for (Index p = column_starts_[at(j)]; p < column_starts_[at(j) + 1]; ++p) {
        visit(rows_[at(p)], j, p);
      }
    }
  }
  /// The same for the entries below the diagonal.
  template <class Visit>
  void for_each_below(Visit&& visit) const {
    for_each_entry([&](Index i, Index j, Index p) {
      if (i != j) visit(i, j, p);
    });
  }

  void set_zero();

  /// product = A x; both of length dimension, not overlapping.
  void multiply(std::span<const double> x, std::span<double> product) const;

  /// Largest absolute value of an entry, 0 when empty.
  [[nodiscard]] double max_norm() const;

 private:
  Index dimension_ = 0;
  std::vector<Index> column_starts_{0};
  std::vector<Index> rows_;
  std::vector<double> values_;
  std::vector<Index> triplet_positions_;
};

}  // namespace ipminmax
