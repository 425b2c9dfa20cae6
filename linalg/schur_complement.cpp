#include <cmath>
#include <new>

#include "linalg/schur_complement.hpp"

#include "linalg/numbers.hpp"

namespace ipminmax {

namespace {

/// Entries of B' C^-1 B over those of K beyond which S has lost too many digits.
constexpr double kMaxGrowth = 1e8;

SymmetricMatrix full_pattern(Index dimension) {
  std::vector<Triplet> entries;
  entries.reserve(at(dimension) * (at(dimension) + 1) / 2);
  for (Index j = 0; j < dimension; ++j) {
    for (Index i = j; i < dimension; ++i) entries.push_back({i, j});
  }
  return {dimension, entries};
}

}  // namespace

SchurComplement::SchurComplement(const SymmetricMatrix& matrix, std::span<const Index> inner_row) {
  std::vector<Index> outer_index(inner_row.size(), -1);
  for (Index i = 0; i < matrix.dimension(); ++i) {
    if (inner_row[at(i)] >= 0) {
      inner_.push_back(i);
    } else {
      outer_index[at(i)] = outer_dimension();
      outer_.push_back(i);
    }
  }
  const Index outer = outer_dimension();
  complement_ = full_pattern(outer);
  if (!dense_.analyze(complement_, {}).ok) throw std::bad_alloc();

  // Of each column of B what take(row of C, position) says of its entries.
  const auto columns = [&](auto&& take) {
    return collect(outer, [&](auto&& add) {
      matrix.for_each_below([&](Index i, Index j, Index p) {
        const Index row = outer_index[at(i)], column = outer_index[at(j)];
        if (column >= 0 && row < 0) add(column, take(inner_row[at(i)], p));
        if (column < 0 && row >= 0) add(row, take(inner_row[at(j)], p));
      });
    });
  };
  coupling_rows_ = columns([](Index row, Index) { return row; });
  coupling_entries_ = columns([](Index, Index position) { return position; }).items;
  coupling_.resize(coupling_entries_.size());

  matrix.for_each_entry([&](Index i, Index j, Index p) {
    const Index row = outer_index[at(i)], column = outer_index[at(j)];
    if (column < 0 && row < 0) inner_entries_.push_back(p);
    if (column < 0 || row < 0) return;
    outer_entries_.push_back(p);
    outer_targets_.push_back(complement_.diagonal_position(column) + row - column);
  });
  product_.resize(at(outer) * at(outer));
  outer_rhs_.resize(outer_.size());
  inner_rhs_.resize(inner_.size());
}

double SchurComplement::predict_flops(const SymmetricSolver& inner) const {
  const double n = outer_dimension();
  return inner.predict_inverse_product_flops(coupling()) + n * n * n / 3.0;
}

void SchurComplement::extract_inner(const SymmetricMatrix& matrix, std::span<double> values) const {
  for (std::size_t k = 0; k < inner_entries_.size(); ++k) {
    values[k] = matrix.values()[at(inner_entries_[k])];
  }
}

bool SchurComplement::form(const SymmetricMatrix& matrix, SymmetricSolver& inner) {
  for (std::size_t k = 0; k < coupling_.size(); ++k) {
    coupling_[k] = matrix.values()[at(coupling_entries_[k])];
  }
  inner.inverse_product(coupling(), product_);
  const double limit = kMaxGrowth * matrix.max_norm();
  for (Index j = 0; j < outer_dimension(); ++j) {
    for (Index i = j; i < outer_dimension(); ++i) {
      // false for NaN, too
      if (!(std::abs(product_[at(i) + at(j) * outer_.size()]) <= limit)) return false;
    }
  }
  return true;
}

Factorization SchurComplement::factorize(const SymmetricMatrix& matrix) {
  const auto values = complement_.values();
  std::size_t position = 0;
  for (std::size_t j = 0; j < outer_.size(); ++j) {
    for (std::size_t i = j; i < outer_.size(); ++i) {
      values[position++] = -product_[i + j * outer_.size()];
    }
  }
  for (std::size_t k = 0; k < outer_entries_.size(); ++k) {
    values[at(outer_targets_[k])] += matrix.values()[at(outer_entries_[k])];
  }
  return dense_.factorize(complement_);
}

void SchurComplement::solve_in_place(SymmetricSolver& inner, std::span<double> rhs) {
  // S u = r - B' C^-1 s,  C w = s - B u
  for (std::size_t k = 0; k < inner_.size(); ++k) inner_rhs_[k] = rhs[at(inner_[k])];
  inner.solve_in_place(inner_rhs_);
  for (std::size_t j = 0; j < outer_.size(); ++j) {
    double sum = rhs[at(outer_[j])];
    for (auto p = at(coupling_rows_.starts[j]); p < at(coupling_rows_.starts[j + 1]); ++p) {
      sum -= coupling_[p] * inner_rhs_[at(coupling_rows_.items[p])];
    }
    outer_rhs_[j] = sum;
  }
  dense_.solve_in_place(outer_rhs_);
  for (std::size_t k = 0; k < inner_.size(); ++k) inner_rhs_[k] = rhs[at(inner_[k])];
  for (std::size_t j = 0; j < outer_.size(); ++j) {
    for (auto p = at(coupling_rows_.starts[j]); p < at(coupling_rows_.starts[j + 1]); ++p) {
      inner_rhs_[at(coupling_rows_.items[p])] -= coupling_[p] * outer_rhs_[j];
    }
    rhs[at(outer_[j])] = outer_rhs_[j];
  }
  inner.solve_in_place(inner_rhs_);
  for (std::size_t k = 0; k < inner_.size(); ++k) rhs[at(inner_[k])] = inner_rhs_[k];
}

}  // namespace ipminmax
