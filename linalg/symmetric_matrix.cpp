#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "linalg/symmetric_matrix.hpp"

namespace ipminmax {

namespace {

void check_entries(Index dimension, std::span<const Triplet> entries) {
  if (dimension < 0) {
    throw std::invalid_argument("SymmetricMatrix: negative dimension " + std::to_string(dimension));
  }
  const auto max_entries = at(std::numeric_limits<Index>::max() - dimension);
  if (entries.size() > max_entries) {
    throw std::length_error("SymmetricMatrix: more entries than an Index can count");
  }
  for (const Triplet& entry : entries) {
    if (!(0 <= std::min(entry.row, entry.col) && std::max(entry.row, entry.col) < dimension)) {
      throw std::invalid_argument("SymmetricMatrix: entry (" + std::to_string(entry.row) + ", " +
                                  std::to_string(entry.col) + ") is outside dimension " +
                                  std::to_string(dimension));
    }
  }
}

}  // namespace

SymmetricMatrix::SymmetricMatrix(Index dimension, std::span<const Triplet> entries) {
  check_entries(dimension, entries);
  const std::size_t n = at(dimension);
  const std::size_t triplets = entries.size();

  // The diagonal is appended as items triplets, ..., triplets + n - 1.
  const std::size_t items = triplets + n;
  const auto lower_row = [&](std::size_t k) {
    return k < triplets ? std::max(entries[k].row, entries[k].col)
                        : static_cast<Index>(k - triplets);
  };
  const auto lower_col = [&](std::size_t k) {
    return k < triplets ? std::min(entries[k].row, entries[k].col)
                        : static_cast<Index>(k - triplets);
  };

  // Two bucket sorts, by row and then (stably) by column, leave every column's rows ascending.
  const Lists by_row = collect(dimension, [&](auto&& add) {
    for (std::size_t k = 0; k < items; ++k) add(lower_row(k), static_cast<Index>(k));
  });
  const Lists sorted = collect(dimension, [&](auto&& add) {
    for (const Index k : by_row.items) add(lower_col(at(k)), k);
  });

  const auto pattern = std::make_shared<Pattern>();
  pattern_ = pattern;
  auto& [column_starts, rows, positions] = *pattern;
  column_starts.assign(n + 1, 0);
  rows.reserve(items);
  positions.resize(triplets);
  for (std::size_t j = 0; j < n; ++j) {
    Index last_row = -1;
    for (const Index item : sorted[static_cast<Index>(j)]) {
      const std::size_t k = at(item);
      const Index row = lower_row(k);
      if (row != last_row) rows.push_back(row);
      last_row = row;
      if (k < triplets) positions[k] = static_cast<Index>(rows.size()) - 1;
    }
    column_starts[j + 1] = static_cast<Index>(rows.size());
  }
  rows.shrink_to_fit();
  set_zero();
}

void SymmetricMatrix::multiply(std::span<const double> x, std::span<double> product) const {
  std::ranges::fill(product, 0.0);
  const auto& [starts, rows, positions] = *pattern_;
  for (Index j = 0; j < dimension(); ++j) {
    const double x_j = x[at(j)];
    double sum = values_[starts[j]] * x_j;
    for (Index p = starts[j] + 1; p < starts[j + 1]; ++p) {
      const std::size_t i = at(rows[p]);
      product[i] += values_[p] * x_j;
      sum += values_[p] * x[i];
    }
    product[at(j)] += sum;
  }
}

double SymmetricMatrix::max_norm() const {
  double norm = 0.0;
  for (const double value : values_) {
    const double magnitude = std::abs(value);
    if (!(magnitude <= norm)) norm = magnitude;  // true for NaN, too
    if (std::isnan(norm)) break;
  }
  return norm;
}

}  // namespace ipminmax
