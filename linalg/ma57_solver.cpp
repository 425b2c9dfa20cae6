#include "linalg/ma57_solver.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <new>

#include "linalg/blas_threads.hpp"
#include "linalg/library_lock.hpp"
#include "linalg/ordering.hpp"
#include "linalg/solver_library.hpp"

namespace ipminmax {
namespace {

// Pivot thresholds of Ipopt's interface to MA57.
constexpr double kPivotTolerance = 1e-8, kPivotToleranceMax = 1e-4;
constexpr double kNullPivot = 1e-12;  ///< as in MUMPS, rows being scaled

// Values of INFO(1), from MA57's specification.
constexpr int kNoRealSpace = -3, kNoIntegerSpace = -4, kSingular = 4;

/// Space beyond the forecast, which knows no delayed pivots.
constexpr double kSpace = 1.2;

std::size_t as_size(int i) { return static_cast<std::size_t>(i); }

/// At least `needed` entries and half as many again as there are. Throws std::bad_alloc, also beyond what an int counts.
template <class Vector>
void enlarge(Vector& vector, int needed) {
  const double wanted = std::max(kSpace * needed, 1.5 * static_cast<double>(vector.size()));
  if (wanted > std::numeric_limits<int>::max()) throw std::bad_alloc();
  vector.resize(static_cast<std::size_t>(wanted));
}

int size_of(const auto& vector) { return static_cast<int>(vector.size()); }

}  // namespace

/// Fortran's calling convention: everything by address.
struct Ma57Solver::Library {
  template <class Function>
  static Function* find(std::initializer_list<const char*> names) {
    return reinterpret_cast<Function*>(solver_function(LinearSolver::Ma57, names));
  }
  using Defaults = void(double* cntl, int* icntl);
  Defaults* defaults = find<Defaults>({"ma57id_", "ma57id", "MA57ID"});
  using Analyse = void(const int* n, const int* ne, const int* irn, const int* jcn,
                       const int* lkeep, int* keep, int* iwork, const int* icntl, int* info,
                       double* rinfo);
  Analyse* analyse = find<Analyse>({"ma57ad_", "ma57ad", "MA57AD"});
  using Factor = void(const int* n, const int* ne, const double* a, double* fact, const int* lfact,
                      int* ifact, const int* lifact, const int* lkeep, const int* keep, int* iwork,
                      const int* icntl, const double* cntl, int* info, double* rinfo);
  Factor* factor = find<Factor>({"ma57bd_", "ma57bd", "MA57BD"});
  using Solve = void(const int* job, const int* n, const double* fact, const int* lfact,
                     const int* ifact, const int* lifact, const int* nrhs, double* rhs,
                     const int* lrhs, double* work, const int* lwork, int* iwork, const int* icntl,
                     int* info);
  Solve* solve = find<Solve>({"ma57cd_", "ma57cd", "MA57CD"});
};

Ma57Solver::Ma57Solver(const SymmetricSolverOptions& options)
    : options_(options), pivot_tolerance_(kPivotTolerance) {}

Analysis Ma57Solver::analyze(const SymmetricMatrix& matrix, std::span<const std::int8_t>) {
  if (!library_) library_ = std::make_shared<const Library>();
  try {
    const Ordering wanted = options_.ordering == Ordering::Pord ? Ordering::Amd : options_.ordering;
    OrderingChoice choice = choose_ordering(matrix, wanted);
    order_ = std::move(choice.new_index);
    analysis_.ordering = choice.ordering;
    return analyze_in_order(matrix);
  } catch (const std::bad_alloc&) {
    return {};
  }
}

Analysis Ma57Solver::analyze_in_order(const SymmetricMatrix& matrix) {
  factorized_ = false;
  dimension_ = matrix.dimension();
  analysis_.ok = true;
  if (dimension_ == 0) return analysis_;
  const int n = dimension_, ne = matrix.nonzeros();
  std::vector<int> irn(as_size(ne)), jcn(as_size(ne));
  for (int j = 0; j < n; ++j) {
    for (int p = matrix.column_starts()[as_size(j)]; p < matrix.column_starts()[as_size(j) + 1];
         ++p) {
      irn[as_size(p)] = matrix.rows()[as_size(p)] + 1;
      jcn[as_size(p)] = j + 1;
    }
  }
  library_->defaults(cntl_.data(), icntl_.data());
  cntl_[1] = kNullPivot;
  for (std::size_t k = 0; k < 4; ++k) icntl_[k] = -1;  // streams of messages: none
  icntl_[4] = 0;
  icntl_[5] = 1;  // the order is given, in KEEP
  icntl_[6] = 1;  // threshold pivoting
  icntl_[7] = 1;  // without space: end, do not wait for more
  const int lkeep = 5 * n + ne + std::max(n, ne) + 42;
  keep_.assign(as_size(lkeep), 0);
  std::ranges::transform(order_, keep_.begin(), [](Index place) { return place + 1; });
  iwork_.resize(5 * as_size(n));
  const LibraryLock lock;
  library_->analyse(&n, &ne, irn.data(), jcn.data(), &lkeep, keep_.data(), iwork_.data(),
                    icntl_.data(), info_.data(), rinfo_.data());
  analysis_.ok = info_[0] >= 0;
  if (!analysis_.ok) return analysis_;
  analysis_.factor_entries = info_[4];
  analysis_.flops = rinfo_[1];
  enlarge(fact_, info_[8]);
  enlarge(ifact_, info_[9]);
  return analysis_;
}

std::unique_ptr<SymmetricSolver> Ma57Solver::same_analysis(const SymmetricMatrix& matrix,
                                                           std::span<const std::int8_t>) const {
  try {
    auto other = std::make_unique<Ma57Solver>(options_);
    other->library_ = library_;
    other->order_ = order_;
    other->analysis_.ordering = analysis_.ordering;
    return other->analyze_in_order(matrix).ok ? std::move(other) : nullptr;
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}

/// INFO(1) of the last attempt.
int Ma57Solver::factorize_with_enough_space(const SymmetricMatrix& matrix) {
  const int n = dimension_, ne = matrix.nonzeros(), lkeep = size_of(keep_);
  cntl_[0] = pivot_tolerance_;
  for (;;) {
    const int lfact = size_of(fact_), lifact = size_of(ifact_);
    library_->factor(&n, &ne, matrix.values().data(), fact_.data(), &lfact, ifact_.data(), &lifact,
                     &lkeep, keep_.data(), iwork_.data(), icntl_.data(), cntl_.data(), info_.data(),
                     rinfo_.data());
    if (info_[0] == kNoRealSpace) {
      enlarge(fact_, info_[16]);
    } else if (info_[0] == kNoIntegerSpace) {
      enlarge(ifact_, info_[17]);
    } else {
      return info_[0];
    }
  }
}

Factorization Ma57Solver::factorize(const SymmetricMatrix& matrix, Certainty) {
  factorized_ = false;
  if (!std::isfinite(matrix.max_norm())) return {};
  Factorization result;
  if (dimension_ > 0) {
    const LibraryLock lock;
    const SequentialBlas sequential(analysis_.flops);
    try {
      const int status = factorize_with_enough_space(matrix);
      if (status < 0) return {};
      const int rank = status == kSingular ? info_[24] : dimension_;
      result.inertia.negative = info_[23];
      result.inertia.zero = dimension_ - rank;
      result.inertia.positive = rank - info_[23];
    } catch (const std::bad_alloc&) {
      return {.status = FactorizationStatus::OutOfMemory};
    }
  }
  factorized_ = result.inertia.zero == 0;
  result.status = factorized_ ? FactorizationStatus::Ok : FactorizationStatus::Singular;
  return result;
}

void Ma57Solver::solve_in_place(std::span<double> rhs, Index columns) {
  if (!factorized_) {
    std::fill(rhs.begin(), rhs.end(), std::numeric_limits<double>::quiet_NaN());
    return;
  }
  if (dimension_ == 0) return;
  if (work_.size() < rhs.size()) work_.resize(rhs.size());
  const int job = 1;  // A u = b
  const int n = dimension_, lfact = size_of(fact_), lifact = size_of(ifact_),
            lwork = size_of(work_);
  const LibraryLock lock;
  const SequentialBlas sequential(analysis_.flops);
  library_->solve(&job, &n, fact_.data(), &lfact, ifact_.data(), &lifact, &columns, rhs.data(), &n,
                  work_.data(), &lwork, iwork_.data(), icntl_.data(), info_.data());
}

double Ma57Solver::predict_inverse_product_flops(const SparseColumns& b) const {
  return 4.0 * static_cast<double>(analysis_.factor_entries) * b.columns();
}

/// Ipopt's rule.
bool Ma57Solver::increase_quality() {
  if (!(pivot_tolerance_ < kPivotToleranceMax)) return false;
  pivot_tolerance_ = std::min(kPivotToleranceMax, std::pow(pivot_tolerance_, 0.75));
  return true;
}

void Ma57Solver::reset_quality() { pivot_tolerance_ = kPivotTolerance; }

}  // namespace ipminmax
