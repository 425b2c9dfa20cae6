#include <algorithm>
#include <cmath>
#include <cstddef>
#include <new>
#include <utility>

#include "linalg/blas_threads.hpp"
#include "linalg/lapack_solver.hpp"
#include "linalg/memory_limit.hpp"
#include "linalg/numbers.hpp"

// Rook pivoting: the factor L is bounded, so a block of D that is rounding counts as an eigenvalue
// zero. With partial pivoting L may be huge beside a tiny block of D, whose sign then matters.
extern "C" {
// The last argument is Fortran's hidden length of uplo.
void dsytrf_rook_(const char* uplo, const int* n, double* a, const int* lda, int* ipiv,
                  double* work, const int* lwork, int* info, std::size_t uplo_length);
void dsytrs_rook_(const char* uplo, const int* n, const int* nrhs, const double* a, const int* lda,
                  const int* ipiv, double* b, const int* ldb, int* info, std::size_t uplo_length);
}

namespace ipminmax {

namespace {

/// Rows up to which calls of BLAS take longer than its work.
constexpr Index kTiny = 24;

/// The power of two next to 1 / sqrt(norm); 1 for an empty row.
double equilibrating_factor(double norm) {
  if (norm >= 0.5 && norm < 4.0) return 1.0;
  return norm > 0.0 ? std::ldexp(1.0, -std::ilogb(norm) / 2) : 1.0;
}

/// Counts pivots as they come.
struct PivotCounter {
  double zero_below = 0.0;
  Factorization result{};

  /// scaled: an eigenvalue of a diagonal block of the equilibrated factor; unscaled: of the matrix.
  void count(double scaled, double unscaled) {
    if (!(std::abs(scaled) > zero_below)) {
      ++result.inertia.zero;
    } else {
      ++(scaled > 0.0 ? result.inertia.positive : result.inertia.negative);
    }
    result.smallest_pivot = std::min(result.smallest_pivot, std::abs(unscaled));
  }
};

struct EigenvaluePair {
  double larger, smaller;  // in absolute value
};

/// Eigenvalues of [a b; b c], the smaller one without cancellation.
EigenvaluePair eigenvalues(double a, double b, double c) {
  const double mean = 0.5 * (a + c);
  const double radius = std::hypot(0.5 * (a - c), b);
  const double larger = mean >= 0.0 ? mean + radius : mean - radius;
  if (larger == 0.0) return {0.0, 0.0};
  return {larger, a * (c / larger) - b * (b / larger)};
}

}  // namespace

Analysis LapackSolver::analyze(const SymmetricMatrix& matrix, std::span<const std::int8_t>) {
  factorized_ = false;
  dimension_ = matrix.dimension();
  const double n = dimension_;
  Analysis analysis{false, Ordering::Amd, static_cast<std::int64_t>(n * (n + 1.0) / 2.0),
                    operations()};
  const auto size = at(dimension_);
  if (!blas_has_memory()) return analysis;
  try {
    dense_.resize(size * size);
    scale_.resize(size);
    row_norms_.resize(size);
    interchanges_.resize(size);
    if (dimension_ > kTiny) {
      int info = 0;
      const int query = -1;
      double work_size = 1.0;
      dsytrf_rook_("L", &dimension_, dense_.data(), &dimension_, interchanges_.data(), &work_size,
                   &query, &info, 1);
      work_.resize(std::max<std::size_t>(1, static_cast<std::size_t>(work_size)));
    }
  } catch (const std::bad_alloc&) {
    return analysis;
  }
  analysis.ok = true;
  return analysis;
}

double LapackSolver::operations() const {
  const double n = dimension_;
  return n * n * n / 3.0;
}

std::unique_ptr<SymmetricSolver> LapackSolver::same_analysis(
    const SymmetricMatrix& matrix, std::span<const std::int8_t> signs) const {
  auto other = std::make_unique<LapackSolver>();
  return other->analyze(matrix, signs).ok ? std::move(other) : nullptr;
}

/// scale_ so that the largest entry of every row of S A S is about 1 (Ruiz's iteration). Not where
/// the scale of a row would overflow: next to nothing is left of it beside huge rows.
void LapackSolver::equilibrate(const SymmetricMatrix& matrix) {
  const auto starts = matrix.column_starts();
  const auto rows = matrix.rows();
  const auto values = matrix.values();
  std::fill(scale_.begin(), scale_.end(), 1.0);
  constexpr int kSweeps = 4;
  constexpr double kLargestScale = 0x1p600;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    std::fill(row_norms_.begin(), row_norms_.end(), 0.0);
    for (std::size_t j = 0; j < scale_.size(); ++j) {
      const double scale = scale_[j];
      double largest = row_norms_[j];
      for (auto p = at(starts[j]); p < at(starts[j + 1]); ++p) {
        const auto i = at(rows[p]);
        const double magnitude = std::abs(values[p]) * scale_[i] * scale;
        row_norms_[i] = std::max(row_norms_[i], magnitude);
        largest = std::max(largest, magnitude);
      }
      row_norms_[j] = largest;  // its diagonal entry is in the loop
    }
    bool changed = false;
    for (std::size_t i = 0; i < scale_.size(); ++i) {
      const double factor = equilibrating_factor(row_norms_[i]);
      changed = changed || factor != 1.0;
      scale_[i] = std::min(scale_[i] * factor, kLargestScale);
    }
    if (!changed) break;
  }
}

/// dense_ = S A S
void LapackSolver::load_values(const SymmetricMatrix& matrix) {
  const auto starts = matrix.column_starts();
  const auto rows = matrix.rows();
  const auto values = matrix.values();
  const std::size_t n = scale_.size();
  std::fill(dense_.begin(), dense_.end(), 0.0);
  for (std::size_t j = 0; j < n; ++j) {
    double* column = dense_.data() + j * n;
    const double scale = scale_[j];
    for (auto p = at(starts[j]); p < at(starts[j + 1]); ++p) {
      const auto i = at(rows[p]);
      column[i] = values[p] * scale_[i] * scale;
    }
  }
}

/// Inertia from the 1x1 and 2x2 blocks of the factor.
Factorization LapackSolver::count_pivots() {
  const std::size_t n = scale_.size();
  // Rounding errors of the factorization are a small multiple of n eps, entries being about 1.
  const double zero_below = 8.0 * static_cast<double>(n) * kEpsilon;
  PivotCounter counter{.zero_below = zero_below};
  counter.result.smallest_pivot = n > 0 ? kInfinity : 0.0;

  // Interchanges move rows, so the scales of the pivot rows are found by following them.
  std::vector<double>& scale = row_norms_;
  scale = scale_;
  for (std::size_t k = 0; k < n;) {
    const auto d = [&](std::size_t i, std::size_t j) { return dense_[i + j * n]; };
    if (interchanges_[k] > 0) {
      std::swap(scale[k], scale[at(interchanges_[k] - 1)]);
      counter.count(d(k, k), d(k, k) / (scale[k] * scale[k]));
      k += 1;
    } else {
      std::swap(scale[k], scale[at(-interchanges_[k] - 1)]);
      std::swap(scale[k + 1], scale[at(-interchanges_[k + 1] - 1)]);
      const double s = scale[k];
      const double t = scale[k + 1];
      const auto scaled = eigenvalues(d(k, k), d(k + 1, k), d(k + 1, k + 1));
      const auto unscaled =
          eigenvalues(d(k, k) / (s * s), d(k + 1, k) / (s * t), d(k + 1, k + 1) / (t * t));
      counter.count(scaled.larger, unscaled.larger);
      counter.count(scaled.smaller, unscaled.smaller);
      k += 2;
    }
  }
  counter.result.status =
      counter.result.inertia.zero > 0 ? FactorizationStatus::Singular : FactorizationStatus::Ok;
  return counter.result;
}

Factorization LapackSolver::factorize(const SymmetricMatrix& matrix, Certainty) {
  factorized_ = false;
  if (!std::isfinite(matrix.max_norm())) return {};
  if (dimension_ == 0) {
    factorized_ = true;
    return {.status = FactorizationStatus::Ok};
  }
  equilibrate(matrix);
  load_values(matrix);
  if (dimension_ <= kTiny) {
    factorize_tiny();
  } else {
    int info = 0;
    const int work_size = static_cast<int>(work_.size());
    const SequentialBlas sequential(operations());
    dsytrf_rook_("L", &dimension_, dense_.data(), &dimension_, interchanges_.data(), work_.data(),
                 &work_size, &info, 1);
    if (info < 0) return {};  // info > 0: an exactly zero pivot, counted below
  }
  Factorization result = count_pivots();
  factorized_ = result.status == FactorizationStatus::Ok;
  return result;
}

/// A pivot of the rook's search: step rows from k on, after k and `first`, then the last row of the
/// step and `last` have been interchanged.
struct LapackSolver::RookPivot {
  std::size_t step = 1, first = 0, last = 0;
};

/// From the diagonal entry of column k along rows and columns, to the largest entry of both its row
/// and its column, unless a diagonal one on the way is large enough.
LapackSolver::RookPivot LapackSolver::find_pivot(std::size_t k) const {
  const double share = (1.0 + std::sqrt(17.0)) / 8.0;  // bounds the growth of one step
  const std::size_t n = scale_.size();
  const auto entry = [&](std::size_t i, std::size_t j) {
    return std::abs(dense_[std::max(i, j) + std::min(i, j) * n]);
  };
  // Largest entry beside the diagonal in a row of what is left.
  const auto largest_of_row = [&](std::size_t row) {
    std::size_t largest = row == k ? std::min(k + 1, n - 1) : k;
    for (std::size_t j = k; j < n; ++j) {
      if (j != row && entry(row, j) > entry(row, largest)) largest = j;
    }
    return largest;
  };
  std::size_t row = k, next = largest_of_row(k);
  double size = next == row ? 0.0 : entry(row, next);
  if (next == row || entry(k, k) >= share * size) return {.step = 1, .first = k, .last = k};
  for (;;) {
    const std::size_t after = largest_of_row(next);
    const double size_after = entry(next, after);
    if (entry(next, next) >= share * size_after) return {.step = 1, .first = k, .last = next};
    if (after == row || !(size_after > size)) return {.step = 2, .first = row, .last = next};
    row = std::exchange(next, after);
    size = size_after;
  }
}

/// Rows and columns i < j of what is left from column k on.
void LapackSolver::interchange(std::size_t k, std::size_t i, std::size_t j) {
  if (i == j) return;
  const std::size_t n = scale_.size();
  double* a = dense_.data();
  for (std::size_t c = k; c < i; ++c) std::swap(a[i + c * n], a[j + c * n]);
  for (std::size_t c = i + 1; c < j; ++c) std::swap(a[c + i * n], a[j + c * n]);
  for (std::size_t r = j + 1; r < n; ++r) std::swap(a[r + i * n], a[r + j * n]);
  std::swap(a[i + i * n], a[j + j * n]);
}

/// As dsytrf_rook.
void LapackSolver::factorize_tiny() {
  const std::size_t n = scale_.size();
  for (std::size_t k = 0; k < n;) {
    const RookPivot pivot = find_pivot(k);
    double* l = dense_.data() + k * n;
    const auto to_index = [](std::size_t row) { return static_cast<Index>(row) + 1; };
    if (pivot.step == 1) {
      interchange(k, k, pivot.last);
      interchanges_[k] = to_index(pivot.last);
      for (std::size_t j = k + 1; j < n && l[k] != 0.0; ++j) {
        const double factor = l[j] / l[k];
        for (std::size_t i = j; i < n; ++i) dense_[i + j * n] -= l[i] * factor;
      }
      for (std::size_t i = k + 1; i < n && l[k] != 0.0; ++i) l[i] /= l[k];
      k += 1;
      continue;
    }
    double* next = l + n;
    interchange(k, k, pivot.first);
    interchange(k, k + 1, pivot.last);
    interchanges_[k] = -to_index(pivot.first);
    interchanges_[k + 1] = -to_index(pivot.last);
    // D = [p 1; 1 q] times the entry beside its diagonal
    const double beside = l[k + 1], p = l[k] / beside, q = next[k + 1] / beside;
    const double scale = 1.0 / ((p * q - 1.0) * beside);
    for (std::size_t j = k + 2; j < n; ++j) {
      const double first = (q * l[j] - next[j]) * scale;
      const double second = (p * next[j] - l[j]) * scale;
      for (std::size_t i = j; i < n; ++i) dense_[i + j * n] -= l[i] * first + next[i] * second;
      l[j] = first;  // read no more
      next[j] = second;
    }
    k += 2;
  }
}

/// As dsytrs_rook for one right-hand side b.
void LapackSolver::solve_tiny(double* b) const {
  const std::size_t n = scale_.size();
  const auto column = [&](std::size_t k) { return dense_.data() + k * n; };
  const auto interchange = [&](std::size_t k) {
    std::swap(b[k], b[at(std::abs(interchanges_[k]) - 1)]);
  };
  for (std::size_t k = 0; k < n;) {
    const double* l = column(k);
    interchange(k);
    if (interchanges_[k] > 0) {
      for (std::size_t i = k + 1; i < n; ++i) b[i] -= l[i] * b[k];
      b[k] /= l[k];
      k += 1;
      continue;
    }
    interchange(k + 1);
    const double* next = column(k + 1);
    for (std::size_t i = k + 2; i < n; ++i) b[i] -= l[i] * b[k] + next[i] * b[k + 1];
    // [p 1; 1 q] times the entry beside the diagonal: no overflow of the determinant.
    const double p = l[k] / l[k + 1], q = next[k + 1] / l[k + 1];
    const double first = b[k] / l[k + 1], second = b[k + 1] / l[k + 1];
    b[k] = (q * first - second) / (p * q - 1.0);
    b[k + 1] = (p * second - first) / (p * q - 1.0);
    k += 2;
  }
  const auto subtract_below = [&](std::size_t k, std::size_t from) {
    const double* l = column(k);
    for (std::size_t i = from; i < n; ++i) b[k] -= l[i] * b[i];
  };
  for (std::size_t k = n; k-- > 0;) {
    subtract_below(k, k + 1);
    if (interchanges_[k] < 0) {
      subtract_below(k - 1, k + 1);
      interchange(k);
      --k;
    }
    interchange(k);
  }
}

/// A^-1 = S (S A S)^-1 S
void LapackSolver::solve_in_place(std::span<double> rhs, Index columns) {
  if (!factorized_) {
    std::fill(rhs.begin(), rhs.end(), kNaN);
    return;
  }
  if (dimension_ == 0) return;
  const std::size_t n = scale_.size();
  const auto apply_scale = [&] {
    for (std::size_t k = 0; k < rhs.size(); k += n) {
      for (std::size_t i = 0; i < n; ++i) rhs[k + i] *= scale_[i];
    }
  };
  apply_scale();
  if (dimension_ <= kTiny) {
    for (std::size_t k = 0; k < rhs.size(); k += n) solve_tiny(rhs.data() + k);
    apply_scale();
    return;
  }
  int info = 0;
  const SequentialBlas sequential(operations());
  dsytrs_rook_("L", &dimension_, &columns, dense_.data(), &dimension_, interchanges_.data(),
               rhs.data(), &dimension_, &info, 1);
  apply_scale();
}

}  // namespace ipminmax
