#include <cstdint>
#include <memory>
#include <new>
#include <span>
#include <utility>
#include <vector>

#include "linalg/blas_threads.hpp"
#include "linalg/loaded_solver.hpp"
#include "linalg/uncopied.hpp"

namespace ipminmax {
namespace {

// Layout of SPRAL's C interface (spral_ssids.h of 2016 to 2025), whose structures end with room to
// grow.
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
constexpr int kGivenOrder = 0;
/// Entries of each row and column about 1: a pivot of `small` has a meaning then.
constexpr int kNormEquilibration = 4;
constexpr double kSmallPivot = 1e-12;  ///< as the null pivots of MUMPS

struct SpralLibrary : SolverLibrary {
  using SolverLibrary::SolverLibrary;
  void (*default_options)(Options*) = find({"spral_ssids_default_options"});
  void (*analyse)(bool check, int n, int* order, const int* starts, const int* rows,
                  const double* values, void** analysis, const Options*,
                  Inform*) = find({"spral_ssids_analyse_ptr32"});
  void (*factor)(bool definite, const int* starts, const int* rows, const double* values,
                 double* scale, void* analysis, void** factors, const Options*,
                 Inform*) = find({"spral_ssids_factor_ptr32"});
  void (*solve)(int job, int columns, double* x, int leading, void* analysis, void* factors,
                const Options*, Inform*) = find({"spral_ssids_solve"});
  int (*free)(void**, void**) = find({"spral_ssids_free"});
};

/// What SPRAL has allocated.
struct SpralFactors : Uncopied {
  explicit SpralFactors(std::shared_ptr<const SpralLibrary> from) : library(std::move(from)) {
    library->default_options(&options);
    options.array_base = 0;
    options.print_level = -1;
    options.ordering = kGivenOrder;
    options.use_gpu = false;
    options.scaling = kNormEquilibration;
    options.action = true;  // a singular matrix is factorized, too
    options.small = kSmallPivot;
  }
  ~SpralFactors() { library->free(&analysis, &factors); }

  /// False: it failed. Throws std::bad_alloc, SolverUnavailable.
  [[nodiscard]] bool succeeded() const {
    if (inform.flag == kAllocation) throw std::bad_alloc();
    if (inform.flag == kNoCancellation) {
      throw SolverUnavailable(
          "SPRAL needs OMP_CANCELLATION=TRUE in the environment from the program's start on");
    }
    return inform.flag >= 0;
  }

  std::shared_ptr<const SpralLibrary> library;
  Options options{};
  Inform inform{};
  void* analysis = nullptr;
  void* factors = nullptr;
};

class SpralSolver final : public SolverFrom<SpralSolver, SpralLibrary> {
 public:
  using SolverFrom::SolverFrom;

 private:
  [[nodiscard]] bool analyze_in_order(const SymmetricMatrix& matrix) override {
    factors_ = std::make_unique<SpralFactors>(library_);
    std::vector<int> places(order_.begin(), order_.end());  // SPRAL writes what it makes of it
    library_->analyse(false, dimension_, places.data(), matrix.column_starts().data(),
                      matrix.rows().data(), nullptr, &factors_->analysis, &factors_->options,
                      &factors_->inform);
    analysis_.factor_entries = factors_->inform.num_factor;
    analysis_.flops = static_cast<double>(factors_->inform.num_flops);
    return factors_->succeeded();
  }

  [[nodiscard]] bool factorize_values(const SymmetricMatrix& matrix, Pivots& pivots) override {
    SpralFactors& f = *factors_;
    f.options.u = pivot_tolerance_;
    const SequentialBlas sequential(analysis_.flops);
    library_->factor(false, matrix.column_starts().data(), matrix.rows().data(),
                     matrix.values().data(), nullptr, f.analysis, &f.factors, &f.options,
                     &f.inform);
    pivots = {.negative = f.inform.num_neg, .rank = f.inform.matrix_rank};
    return f.succeeded();
  }

  void solve_with_factors(std::span<double> rhs, Index columns) override {
    constexpr int kWholeSolve = 0;
    const SequentialBlas sequential(analysis_.flops);
    library_->solve(kWholeSolve, columns, rhs.data(), dimension_, factors_->analysis,
                    factors_->factors, &factors_->options, &factors_->inform);
  }

  std::unique_ptr<SpralFactors> factors_;
};

}  // namespace

std::unique_ptr<SymmetricSolver> make_spral(const SymmetricSolverOptions& options) {
  return std::make_unique<SpralSolver>(options, LinearSolver::Spral);
}

}  // namespace ipminmax
