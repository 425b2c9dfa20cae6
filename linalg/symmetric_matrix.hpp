#pragma once

#include <memory>
#include <span>

#include "linalg/array.hpp"
#include "linalg/triplet.hpp"

namespace ipminmax {

/// Symmetric sparse matrix with a fixed pattern, which copies share; only values change after
/// construction.
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

  [[nodiscard]] Index dimension() const { return static_cast<Index>(column_starts().size()) - 1; }
  [[nodiscard]] Index nonzeros() const { return static_cast<Index>(rows().size()); }
  [[nodiscard]] std::span<const Index> column_starts() const {
    return pattern_->column_starts;
  }                                                                             ///< dimension+1
  [[nodiscard]] std::span<const Index> rows() const { return pattern_->rows; }  ///< nonzeros
  [[nodiscard]] std::span<const double> values() const { return values_; }      ///< nonzeros
  [[nodiscard]] std::span<double> values() { return values_; }

  /// Position in values() of each triplet given to the constructor, in their order.
  [[nodiscard]] std::span<const Index> triplet_positions() const { return pattern_->positions; }

  /// Position in values() of the diagonal entry (i, i).
  [[nodiscard]] Index diagonal_position(Index i) const { return pattern_->column_starts[i]; }

  /// visit(row, column, position in values()) for every entry, column by column.
  template <class Visit>
  void for_each_entry(Visit&& visit) const {
    const auto& [starts, rows, positions] = *pattern_;
    for (Index j = 0; j < dimension(); ++j) {
      for (Index p = starts[j]; p < starts[j + 1]; ++p) visit(rows[p], j, p);
    }
  }
  /// The same for the entries below the diagonal.
  template <class Visit>
  void for_each_below(Visit&& visit) const {
    for_each_entry([&](Index i, Index j, Index p) {
      if (i != j) visit(i, j, p);
    });
  }

  void set_zero() { values_.assign(rows().size(), 0.0); }
  /// Copies have no values before they are set to zero.
  void drop_values() { Array<double>().swap(values_); }

  /// product = A x; both of length dimension, not overlapping.
  void multiply(std::span<const double> x, std::span<double> product) const;

  /// Largest absolute value of an entry, 0 when empty.
  [[nodiscard]] double max_norm() const;

 private:
  struct Pattern {
    Array<Index> column_starts{0};
    Array<Index> rows, positions;
  };
  std::shared_ptr<const Pattern> pattern_ = std::make_shared<Pattern>();
  Array<double> values_;
};

}  // namespace ipminmax
