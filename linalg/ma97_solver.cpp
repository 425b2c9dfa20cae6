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

// Layout of HSL_MA97's C interface in double precision, whose structures end with room to grow.
struct Ma97Control {
  int f_arrays, action, nemin;
  double multiplier;
  int ordering, print_level, scaling;
  double small, u;
  int unit_diagnostics, unit_error, unit_warning;
  long factor_min;
  int solve_blas3;
  long solve_min;
  int solve_mf;
  double consist_tol;
  int unused_integers[5];
  double unused_reals[10];
};
struct Ma97Info {
  int flag, flag68, flag77, matrix_dup, matrix_rank, matrix_outrange, matrix_missing_diag, maxdepth,
      maxfront, num_delay;
  long num_factor, num_flops;
  int num_neg, num_sup, num_two, ordering, stat;
  int unused_integers[5];
  double unused_reals[10];
};

constexpr int kInOrder = 0;
/// MC77: entries of each row and column about 1, so that a pivot of `small` has a meaning.
constexpr int kEquilibration = 2;
constexpr double kNullPivotOfMa97 = 1e-12;  ///< as the null pivots of MUMPS
constexpr int kIndefinite = 4;              ///< real, symmetric

struct Ma97Library : SolverLibrary {
  using SolverLibrary::SolverLibrary;
  void (*defaults)(Ma97Control*) = find({"ma97_default_control_d"});
  void (*analyse)(int check, int n, const int* starts, const int* rows, const double* values,
                  void** analysis, const Ma97Control*, Ma97Info*,
                  int* order) = find({"ma97_analyse_d"});
  void (*factor)(int type, const int* starts, const int* rows, const double* values,
                 void** analysis, void** factors, const Ma97Control*, Ma97Info*,
                 double* scale) = find({"ma97_factor_d"});
  void (*solve)(int job, int columns, double* x, int leading, void** analysis, void** factors,
                const Ma97Control*, Ma97Info*) = find({"ma97_solve_d"});
  void (*free)(void**, void**) = find({"ma97_finalise_d"});
};

/// What MA97 has allocated.
struct Ma97Factors : Uncopied {
  explicit Ma97Factors(std::shared_ptr<const Ma97Library> from) : library(std::move(from)) {
    library->defaults(&control);
    control.f_arrays = 0;
    control.action = 1;  // a singular matrix is factorized, too
    control.ordering = kInOrder;
    control.print_level = -1;
    control.scaling = kEquilibration;
    control.small = kNullPivotOfMa97;
  }
  ~Ma97Factors() { library->free(&analysis, &factors); }

  /// False: it failed. Throws std::bad_alloc.
  [[nodiscard]] bool succeeded() const {
    if (info.flag < 0 && info.stat != 0) throw std::bad_alloc();
    return info.flag >= 0;
  }

  std::shared_ptr<const Ma97Library> library;
  Ma97Control control{};
  Ma97Info info{};
  void* analysis = nullptr;
  void* factors = nullptr;
};

class Ma97Solver final : public SolverFrom<Ma97Solver, Ma97Library> {
 public:
  using SolverFrom::SolverFrom;

 private:
  [[nodiscard]] bool analyze_in_order(const SymmetricMatrix& matrix) override {
    factors_ = std::make_unique<Ma97Factors>(library_);
    std::vector<int> places(order_.begin(), order_.end());  // MA97 writes what it makes of it
    library_->analyse(0, dimension_, matrix.column_starts().data(), matrix.rows().data(), nullptr,
                      &factors_->analysis, &factors_->control, &factors_->info, places.data());
    analysis_.factor_entries = factors_->info.num_factor;
    analysis_.flops = static_cast<double>(factors_->info.num_flops);
    return factors_->succeeded();
  }

  [[nodiscard]] bool factorize_values(const SymmetricMatrix& matrix, Pivots& pivots) override {
    Ma97Factors& f = *factors_;
    f.control.u = pivot_tolerance_;
    const SequentialBlas sequential(analysis_.flops);
    library_->factor(kIndefinite, matrix.column_starts().data(), matrix.rows().data(),
                     matrix.values().data(), &f.analysis, &f.factors, &f.control, &f.info, nullptr);
    pivots = {.negative = f.info.num_neg, .rank = f.info.matrix_rank};
    return f.succeeded();
  }

  void solve_with_factors(std::span<double> rhs, Index columns) override {
    constexpr int kWholeSystem = 0;
    const SequentialBlas sequential(analysis_.flops);
    library_->solve(kWholeSystem, columns, rhs.data(), dimension_, &factors_->analysis,
                    &factors_->factors, &factors_->control, &factors_->info);
  }

  std::unique_ptr<Ma97Factors> factors_;
};

}  // namespace

std::unique_ptr<SymmetricSolver> make_ma97(const SymmetricSolverOptions& options) {
  return std::make_unique<Ma97Solver>(options, LinearSolver::Ma97);
}

}  // namespace ipminmax
