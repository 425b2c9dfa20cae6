#include "linalg/loaded_solver.hpp"

#include <algorithm>
#include <cmath>
#include <new>
#include <utility>

#include "linalg/numbers.hpp"
#include "linalg/ordering.hpp"

namespace ipminmax {
namespace {

// Pivot thresholds of Ipopt's interfaces to MA57 and SPRAL.
constexpr double kPivotTolerance = 1e-8, kPivotToleranceMax = 1e-4;

}  // namespace

LoadedSolver::LoadedSolver(const SymmetricSolverOptions& options, LinearSolver kind)
    : options_(options), kind_(kind), pivot_tolerance_(kPivotTolerance) {}

Analysis LoadedSolver::analyze(const SymmetricMatrix& matrix, std::span<const std::int8_t>) {
  load_library();
  try {
    const Ordering wanted = options_.ordering == Ordering::Pord ? Ordering::Amd : options_.ordering;
    OrderingChoice choice = choose_ordering(matrix, wanted);
    order_ = std::move(choice.new_index);
    analysis_.ordering = choice.ordering;
    return analyze_with_order(matrix);
  } catch (const std::bad_alloc&) {
    return {};
  }
}

Analysis LoadedSolver::analyze_with_order(const SymmetricMatrix& matrix) {
  factorized_ = false;
  dimension_ = matrix.dimension();
  analysis_.ok = dimension_ == 0 || analyze_in_order(matrix);
  return analysis_;
}

std::unique_ptr<SymmetricSolver> LoadedSolver::same_analysis(const SymmetricMatrix& matrix,
                                                             std::span<const std::int8_t>) const {
  try {
    std::unique_ptr<LoadedSolver> other = another();
    other->order_ = order_;
    other->analysis_.ordering = analysis_.ordering;
    return other->analyze_with_order(matrix).ok ? std::move(other) : nullptr;
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}

Factorization LoadedSolver::factorize(const SymmetricMatrix& matrix, Certainty) {
  factorized_ = false;
  if (!std::isfinite(matrix.max_norm())) return {};
  Pivots pivots;
  try {
    if (dimension_ > 0 && !factorize_values(matrix, pivots)) return {};
  } catch (const std::bad_alloc&) {
    return {.status = FactorizationStatus::OutOfMemory};
  }
  Factorization result;
  result.inertia.negative = pivots.negative;
  result.inertia.zero = dimension_ - pivots.rank;
  result.inertia.positive = pivots.rank - pivots.negative;
  factorized_ = result.inertia.zero == 0;
  result.status = factorized_ ? FactorizationStatus::Ok : FactorizationStatus::Singular;
  return result;
}

void LoadedSolver::solve_in_place(std::span<double> rhs, Index columns) {
  if (!factorized_) {
    std::fill(rhs.begin(), rhs.end(), kNaN);
    return;
  }
  if (dimension_ > 0) solve_with_factors(rhs, columns);
}

double LoadedSolver::predict_inverse_product_flops(const SparseColumns& b) const {
  return 4.0 * static_cast<double>(analysis_.factor_entries) * b.columns();
}

/// Ipopt's rule.
bool LoadedSolver::increase_quality() {
  if (!(pivot_tolerance_ < kPivotToleranceMax)) return false;
  pivot_tolerance_ = std::min(kPivotToleranceMax, std::pow(pivot_tolerance_, 0.75));
  return true;
}

void LoadedSolver::reset_quality() { pivot_tolerance_ = kPivotTolerance; }

}  // namespace ipminmax
