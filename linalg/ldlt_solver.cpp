#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <stdexcept>
#include <utility>

#include "linalg/ldlt_solver.hpp"

#include "linalg/numbers.hpp"

namespace ipminmax {

namespace {

// Flops per entry of L from which panels pay: level at 13 (bands) to 20 (grids).
constexpr double kSupernodesMinFlopsPerEntry = 20.0;

/// Diagonal of Gamma over gamma: not quite +-1, because equal weights of opposite sign cancel. The
/// pivots of W + Gamma for f = s |x - y|^2, W = 2 s [1 -1; -1 1], would be 2 s and gamma^2 / 2 s.
double gamma_weight(std::size_t row, std::int8_t sign) {
  constexpr double kGoldenRatio = 0.6180339887498949;
  const double spread = 0.75 + 0.25 * std::fmod(static_cast<double>(row) * kGoldenRatio, 1.0);
  return sign > 0 ? spread : -0.5 * spread;
}

}  // namespace

Analysis LdltSolver::analyze(const SymmetricMatrix& matrix, std::span<const std::int8_t> signs) {
  try {
    // PORD exists only inside MUMPS.
    const Ordering ordering =
        options_.ordering == Ordering::Pord ? Ordering::Best : options_.ordering;
    return analyze(matrix, signs, choose_ordering(matrix, ordering));
  } catch (const std::bad_alloc&) {
    return {};
  }
}

Analysis LdltSolver::analyze(const SymmetricMatrix& matrix, std::span<const std::int8_t> signs,
                             const OrderingChoice& ordering) {
  if (signs.size() != at(matrix.dimension())) {
    throw std::invalid_argument("LdltSolver: one sign per row is needed");
  }
  factorized_ = false;
  Analysis analysis{false, ordering.ordering, ordering.size.entries, ordering.size.flops};
  if (ordering.size.entries > std::numeric_limits<Index>::max()) return analysis;
  try {
    ordering_ = ordering.ordering;
    size_ = ordering.size;
    new_index_ = ordering.new_index;
    supernodes_ = nullptr;  // before the new ones
    pattern_ = {};
    build_pattern(matrix, signs);
    permuted_.resize(new_index_.size());
    if (size_.flops > kSupernodesMinFlopsPerEntry * static_cast<double>(size_.entries)) {
      make_supernodes(matrix, signs);
    } else {
      pattern_ = factor_pattern(lower_, tree_);
      values_.resize(at(tree_.entries()));
      columns_.resize(new_index_.size());
      row_.assign(new_index_.size(), 0.0);
    }
  } catch (const std::bad_alloc&) {
    return analysis;
  }
  analysis.ok = true;
  if (supernodes_) analysis.threads = std::max(supernodes_->threads(), 1);
  return analysis;
}

std::unique_ptr<SymmetricSolver> LdltSolver::same_analysis(
    const SymmetricMatrix& matrix, std::span<const std::int8_t> signs) const {
  auto other = std::make_unique<LdltSolver>(options_);
  return other->analyze_as(*this, matrix, signs).ok ? std::move(other) : nullptr;
}

Analysis LdltSolver::analyze_as(const LdltSolver& other, const SymmetricMatrix& matrix,
                                std::span<const std::int8_t> signs) {
  try {
    return analyze(matrix, signs, {other.ordering_, other.new_index_, other.size_});
  } catch (const std::bad_alloc&) {
    return {};
  }
}

void LdltSolver::build_pattern(const SymmetricMatrix& matrix, std::span<const std::int8_t> signs) {
  const Index n = matrix.dimension();
  // Of each row what take(column, place) says of its entries left of the diagonal.
  const auto lists = [&](auto&& take) {
    return collect(n, [&](auto&& add) {
      matrix.for_each_below([&](Index i, Index j, Index p) {
        const auto [column, row] = std::minmax(new_index_[i], new_index_[j]);
        add(row, take(column, p));
      });
    });
  };
  lower_ = lists([](Index column, Index) { return column; });
  lower_places_ = lists([](Index, Index place) { return place; }).items;
  couplings_.clear();
  matrix.for_each_below([&](Index i, Index j, Index p) {
    if (signs[at(i)] != signs[at(j)]) couplings_.push_back(p);
  });
  diagonal_places_.resize(at(n));
  gamma_weights_.resize(at(n));
  for (Index i = 0; i < n; ++i) {
    const Index k = new_index_[i];
    diagonal_places_[k] = matrix.diagonal_position(i);
    gamma_weights_[k] = gamma_weight(at(i), signs[at(i)]);
  }
  tree_ = elimination_tree(lower_);
}

void LdltSolver::make_supernodes(const SymmetricMatrix& matrix,
                                 std::span<const std::int8_t> signs) {
  const Array<Index> order = postorder(tree_.parent);
  if (!std::ranges::is_sorted(order)) {
    Array<Index> place(order.size());
    for (std::size_t k = 0; k < order.size(); ++k) place[order[k]] = static_cast<Index>(k);
    for (Index& k : new_index_) k = place[k];
    build_pattern(matrix, signs);
  }
  supernodes_ = std::make_unique<SupernodalFactor>(lower_, lower_places_, diagonal_places_, tree_,
                                                   options_.threads);
  lower_ = {};
  lower_places_ = diagonal_places_ = {};
}

double LdltSolver::suitable_gamma(const SymmetricMatrix& matrix) const {
  constexpr double kLargest = 1e3;  // over the option
  const auto values = matrix.values();
  double coupling = 1.0;
  for (const Index p : couplings_) coupling = std::max(coupling, std::abs(values[at(p)]));
  return options_.ldlt_gamma * std::min(coupling * coupling, kLargest);
}

Factorization LdltSolver::factorize(const SymmetricMatrix& matrix, Certainty) {
  return factorize_with(matrix, suitable_gamma(matrix));
}

Factorization LdltSolver::factorize_with(const SymmetricMatrix& matrix, double gamma) {
  factorized_ = false;
  Factorization result{.trust = {.pivoted = false, .perturbation = gamma}};
  const auto values = matrix.values();
  if (!(supernodes_ ? supernodes_->factorize(values, gamma_weights_, gamma)
                    : eliminate(values, gamma))) {
    return result;
  }
  double smallest = kInfinity;
  for (std::size_t j = 0; j < new_index_.size(); ++j) {
    ++(pivot(j) > 0.0 ? result.inertia.positive : result.inertia.negative);
    smallest = std::min(smallest, std::abs(pivot(j)));
  }
  result.smallest_pivot = smallest;
  result.status = FactorizationStatus::Ok;
  factorized_ = true;
  return result;
}

/// Rows of L one after the other, each from the columns of its entries (Davis 2005). False:
/// a pivot is zero or not finite.
bool LdltSolver::eliminate(std::span<const double> values, double gamma) {
  double* const y = row_.data();
  double* const l = values_.data();
  const Index* const rows = pattern_.rows.data();
  for (std::size_t k = 0; k < columns_.size(); ++k) {
    const std::size_t lower_end = at(lower_.starts[k + 1]);
    for (std::size_t p = at(lower_.starts[k]); p < lower_end; ++p) {
      y[lower_.items[p]] += values[at(lower_places_[p])];
    }
    double pivot = values[at(diagonal_places_[k])] + gamma * gamma_weights_[k];
    const std::size_t row_end = at(pattern_.row_starts[k + 1]);
    for (std::size_t r = at(pattern_.row_starts[k]); r < row_end; ++r) {
      const Index i = pattern_.columns[r];
      Column& column = columns_[i];
      const double y_i = y[i];
      y[i] = 0.0;
      for (Index p = column.begin; p < column.end; ++p) y[rows[p]] -= l[p] * y_i;
      const double l_ki = y_i / column.pivot;
      pivot -= l_ki * y_i;
      l[column.end++] = l_ki;
    }
    columns_[k] = {tree_.column_starts[k], tree_.column_starts[k], pivot};
    if (pivot == 0.0 || !std::isfinite(pivot)) return false;
  }
  return true;
}

void LdltSolver::solve_in_place(std::span<double> rhs, Index columns) {
  if (!factorized_) {
    std::fill(rhs.begin(), rhs.end(), kNaN);
    return;
  }
  const std::size_t n = new_index_.size();
  for (std::size_t c = 0; c < at(columns) && n > 0; ++c) solve_one(rhs.subspan(c * n, n));
}

void LdltSolver::solve_one(std::span<double> rhs) {
  double* const x = permuted_.data();
  const double* const l = values_.data();
  const Index* const rows = pattern_.rows.data();
  const std::size_t n = rhs.size();
  for (std::size_t i = 0; i < n; ++i) x[new_index_[i]] = rhs[i];
  if (supernodes_) supernodes_->solve(permuted_);
  for (std::size_t j = 0; j < n && !supernodes_; ++j) {
    const double x_j = x[j];
    if (x_j == 0.0) continue;
    for (Index p = columns_[j].begin; p < columns_[j].end; ++p) x[rows[p]] -= l[p] * x_j;
  }
  for (std::size_t j = n; j-- > 0 && !supernodes_;) {
    double x_j = x[j] / columns_[j].pivot;
    for (Index p = columns_[j].begin; p < columns_[j].end; ++p) x_j -= l[p] * x[rows[p]];
    x[j] = x_j;
  }
  for (std::size_t i = 0; i < n; ++i) rhs[i] = x[new_index_[i]];
}

void LdltSolver::ColumnRange::include(ColumnRange other) {
  if (other.begin == other.end) return;
  *this =
      begin == end ? other : ColumnRange{std::min(begin, other.begin), std::max(end, other.end)};
}

/// Columns of B with an entry in each row of the elimination order.
void LdltSolver::find_ranges(const SparseColumns& b, Array<ColumnRange>& ranges) const {
  for (Index k = 0; k < b.columns(); ++k) {
    for (Index p = b.starts[at(k)]; p < b.starts[at(k) + 1]; ++p) {
      ranges[new_index_[b.rows[at(p)]]].include({k, k + 1});
    }
  }
}

/// B' A^-1 B = Z' D^-1 Z with Z = L^-1 P B, one row of Z after the other. The columns that reach a
/// row lie in a range that only grows towards the root of the elimination tree.
void LdltSolver::inverse_product(const SparseColumns& b, std::span<double> product) {
  std::fill(product.begin(), product.end(), factorized_ ? 0.0 : kNaN);
  if (!factorized_) return;
  const auto columns = at(b.columns());
  const std::size_t n = new_index_.size();
  if (forward_.size() != n * columns) forward_.assign(n * columns, 0.0);
  if (ranges_.size() != n) ranges_.assign(n, {});
  find_ranges(b, ranges_);
  for (std::size_t k = 0; k < columns; ++k) {
    for (Index p = b.starts[k]; p < b.starts[k + 1]; ++p) {
      const Index row = new_index_[b.rows[at(p)]];
      forward_[at(row) * columns + k] += b.values[at(p)];
    }
  }
  for (std::size_t j = 0; j < n; ++j) {
    const ColumnRange range = ranges_[j];
    if (range.begin == range.end) continue;
    ranges_[j] = {};
    const std::size_t width = at(range.end - range.begin);
    double* z_j = &forward_[j * columns + at(range.begin)];
    const double inverse = 1.0 / pivot(j);
    for (std::size_t a = 0; a < width; ++a) {
      const double factor = z_j[a] * inverse;
      double* target = &product[(at(range.begin) + a) * columns + at(range.begin)];
      for (std::size_t i = a; i < width; ++i) target[i] += factor * z_j[i];
    }
    for_each_of_column(j, [&](std::size_t i, double value) {
      ranges_[i].include(range);
      double* z_i = &forward_[i * columns + at(range.begin)];
      for (std::size_t a = 0; a < width; ++a) z_i[a] -= value * z_j[a];
    });
    std::fill(z_j, z_j + width, 0.0);
  }
}

double LdltSolver::predict_inverse_product_flops(const SparseColumns& b) const {
  Array<ColumnRange> ranges(new_index_.size());
  find_ranges(b, ranges);
  double flops = 0.0;
  for (std::size_t j = 0; j < ranges.size(); ++j) {
    const double width = ranges[j].end - ranges[j].begin;
    const double entries = tree_.column_starts[j + 1] - tree_.column_starts[j];
    flops += width * (width + 2.0 * entries);
    const Index parent = tree_.parent[j];
    if (parent >= 0) ranges[parent].include(ranges[j]);
  }
  return flops;
}

}  // namespace ipminmax
