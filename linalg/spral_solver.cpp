#include "linalg/spral_solver.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "linalg/blas_threads.hpp"
#include "linalg/ordering.hpp"
#include "linalg/solver_library.hpp"

namespace ipminmax {
namespace {

// Layout of SPRAL's C interface (spral_ssids.h of 2016 to 2025), whose structures end with room to grow.
struct Options {
  int array_base, print_level, unit_diagnostics, unit_error, unit_warning, ordering, nemin;
  bool ignore_numa, use_gpu;
  std::int64_t min_gpu_work;
  float max_load_inbalance, gpu_perf_coeff;
  int scaling;
  std::int64_t small_subtree_threshold;
  int cpu_block_size;
  bool action;
  int pivot_method;
  double small, u;
  char unused[80];
};
struct Inform {
  int flag, matrix_dup, matrix_missing_diag, matrix_outrange, matrix_rank, maxdepth, maxfront,
      num_delay;
  std::int64_t num_factor, num_flops;
  int num_neg, num_sup, num_two, stat, cuda_error, cublas_error, maxsupernode;
  char unused[76];
};

enum Flag { kAllocation = -50, kNoCancellation = -53 };
constexpr int kOrderGiven = 0;
/// Entries of each row and column about 1: a pivot of `small` has a meaning then.
constexpr int kNormEquilibration = 4;
constexpr double kSmallPivot = 1e-12;  ///< as the null pivots of MUMPS
// Pivot thresholds of Ipopt's interface to SPRAL.
constexpr double kPivotTolerance = 1e-8, kPivotToleranceMax = 1e-4;

}  // namespace

struct SpralSolver::Library {
  template <class Function>
  static Function* find(const char* name) {
    return reinterpret_cast<Function*>(solver_function(LinearSolver::Spral, {name}));
  }
  void (*default_options)(Options*) = find<void(Options*)>("spral_ssids_default_options");
  using Analyse = void(bool check, int n, int* order, const int* starts, const int* rows,
                       const double* values, void** analysis, const Options*, Inform*);
  Analyse* analyse = find<Analyse>("spral_ssids_analyse_ptr32");
  using Factor = void(bool definite, const int* starts, const int* rows, const double* values,
                      double* scale, void* analysis, void** factors, const Options*, Inform*);
  Factor* factor = find<Factor>("spral_ssids_factor_ptr32");
  using Solve = void(int job, int columns, double* x, int leading, void* analysis, void* factors,
                     const Options*, Inform*);
  Solve* solve = find<Solve>("spral_ssids_solve");
  int (*free)(void**, void**) = find<int(void**, void**)>("spral_ssids_free");
};

/// What SPRAL has allocated.
struct SpralSolver::Factors {
  explicit Factors(std::shared_ptr<const Library> from) : library(std::move(from)) {
    library->default_options(&options);
    options.array_base = 0;
    options.print_level = -1;
    options.ordering = kOrderGiven;
    options.use_gpu = false;
    options.scaling = kNormEquilibration;
    options.action = true;  // a singular matrix is factorized, too
    options.small = kSmallPivot;
  }
  ~Factors() { library->free(&analysis, &factors); }
  Factors(const Factors&) = delete;
  Factors& operator=(const Factors&) = delete;

  /// False: it failed. Throws std::bad_alloc, SolverUnavailable.
  [[nodiscard]] bool succeeded() const {
    if (inform.flag == kAllocation) throw std::bad_alloc();
    if (inform.flag == kNoCancellation) {
      throw SolverUnavailable(
          "SPRAL needs OMP_CANCELLATION=TRUE in the environment from the program's start on");
    }
    return inform.flag >= 0;
  }

  std::shared_ptr<const Library> library;
  Options options{};
  Inform inform{};
  void* analysis = nullptr;
  void* factors = nullptr;
};

SpralSolver::SpralSolver(const SymmetricSolverOptions& options)
    : options_(options), pivot_tolerance_(kPivotTolerance) {}

SpralSolver::~SpralSolver() = default;

Analysis SpralSolver::analyze(const SymmetricMatrix& matrix, std::span<const std::int8_t>) {
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

Analysis SpralSolver::analyze_in_order(const SymmetricMatrix& matrix) {
  factorized_ = false;
  dimension_ = matrix.dimension();
  factors_ = std::make_unique<Factors>(library_);
  analysis_.ok = true;
  if (dimension_ == 0) return analysis_;
  std::vector<int> order(order_.begin(), order_.end());  // SPRAL writes what it has made of it
  library_->analyse(false, dimension_, order.data(), matrix.column_starts().data(),
                    matrix.rows().data(), nullptr, &factors_->analysis, &factors_->options,
                    &factors_->inform);
  analysis_.ok = factors_->succeeded();
  analysis_.factor_entries = factors_->inform.num_factor;
  analysis_.flops = static_cast<double>(factors_->inform.num_flops);
  return analysis_;
}

std::unique_ptr<SymmetricSolver> SpralSolver::same_analysis(const SymmetricMatrix& matrix,
                                                            std::span<const std::int8_t>) const {
  try {
    auto other = std::make_unique<SpralSolver>(options_);
    other->library_ = library_;
    other->order_ = order_;
    other->analysis_.ordering = analysis_.ordering;
    return other->analyze_in_order(matrix).ok ? std::move(other) : nullptr;
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}

Factorization SpralSolver::factorize(const SymmetricMatrix& matrix, Certainty) {
  factorized_ = false;
  if (!std::isfinite(matrix.max_norm())) return {};
  Factorization result;
  if (dimension_ > 0) {
    Factors& f = *factors_;
    f.options.u = pivot_tolerance_;
    const SequentialBlas sequential(analysis_.flops);
    library_->factor(false, matrix.column_starts().data(), matrix.rows().data(),
                     matrix.values().data(), nullptr, f.analysis, &f.factors, &f.options,
                     &f.inform);
    try {
      if (!f.succeeded()) return {};
    } catch (const std::bad_alloc&) {
      return {.status = FactorizationStatus::OutOfMemory};
    }
    result.inertia.negative = f.inform.num_neg;
    result.inertia.zero = dimension_ - f.inform.matrix_rank;
    result.inertia.positive = f.inform.matrix_rank - f.inform.num_neg;
  }
  factorized_ = result.inertia.zero == 0;
  result.status = factorized_ ? FactorizationStatus::Ok : FactorizationStatus::Singular;
  return result;
}

void SpralSolver::solve_in_place(std::span<double> rhs, Index columns) {
  if (!factorized_) {
    std::fill(rhs.begin(), rhs.end(), std::numeric_limits<double>::quiet_NaN());
    return;
  }
  if (dimension_ == 0) return;
  constexpr int kWholeSolve = 0;
  const SequentialBlas sequential(analysis_.flops);
  library_->solve(kWholeSolve, columns, rhs.data(), dimension_, factors_->analysis,
                  factors_->factors, &factors_->options, &factors_->inform);
}

double SpralSolver::predict_inverse_product_flops(const SparseColumns& b) const {
  return 4.0 * static_cast<double>(analysis_.factor_entries) * b.columns();
}

/// Ipopt's rule.
bool SpralSolver::increase_quality() {
  if (!(pivot_tolerance_ < kPivotToleranceMax)) return false;
  pivot_tolerance_ = std::min(kPivotToleranceMax, std::pow(pivot_tolerance_, 0.75));
  return true;
}

void SpralSolver::reset_quality() { pivot_tolerance_ = kPivotTolerance; }

}  // namespace ipminmax
