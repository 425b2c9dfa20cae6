#include "linalg/ma97_solver.hpp"

#include <new>
#include <utility>
#include <vector>

#include "linalg/blas_threads.hpp"
#include "linalg/solver_library.hpp"

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

}  // namespace

struct Ma97Solver::Library {
  template <class Function>
  static Function* find(const char* name) {
    return reinterpret_cast<Function*>(solver_function(LinearSolver::Ma97, {name}));
  }
  void (*defaults)(Ma97Control*) = find<void(Ma97Control*)>("ma97_default_control_d");
  using Analyse = void(int check, int n, const int* starts, const int* rows, const double* values,
                       void** analysis, const Ma97Control*, Ma97Info*, int* order);
  Analyse* analyse = find<Analyse>("ma97_analyse_d");
  using Factor = void(int type, const int* starts, const int* rows, const double* values,
                      void** analysis, void** factors, const Ma97Control*, Ma97Info*,
                      double* scale);
  Factor* factor = find<Factor>("ma97_factor_d");
  using Solve = void(int job, int columns, double* x, int leading, void** analysis, void** factors,
                     const Ma97Control*, Ma97Info*);
  Solve* solve = find<Solve>("ma97_solve_d");
  void (*free)(void**, void**) = find<void(void**, void**)>("ma97_finalise_d");
};

/// What MA97 has allocated.
struct Ma97Solver::Factors {
  explicit Factors(std::shared_ptr<const Library> from) : library(std::move(from)) {
    library->defaults(&control);
    control.f_arrays = 0;
    control.action = 1;  // a singular matrix is factorized, too
    control.ordering = kInOrder;
    control.print_level = -1;
    control.scaling = kEquilibration;
    control.small = kNullPivotOfMa97;
  }
  ~Factors() { library->free(&analysis, &factors); }
  Factors(const Factors&) = delete;
  Factors& operator=(const Factors&) = delete;

  /// False: it failed. Throws std::bad_alloc.
  [[nodiscard]] bool succeeded() const {
    if (info.flag < 0 && info.stat != 0) throw std::bad_alloc();
    return info.flag >= 0;
  }

  std::shared_ptr<const Library> library;
  Ma97Control control{};
  Ma97Info info{};
  void* analysis = nullptr;
  void* factors = nullptr;
};

Ma97Solver::Ma97Solver(const SymmetricSolverOptions& options) : LoadedSolver(options) {}

Ma97Solver::~Ma97Solver() = default;

void Ma97Solver::load_library() {
  if (!library_) library_ = std::make_shared<const Library>();
}

std::unique_ptr<LoadedSolver> Ma97Solver::another() const {
  auto other = std::make_unique<Ma97Solver>(options());
  other->library_ = library_;
  return other;
}

bool Ma97Solver::analyze_in_order(const SymmetricMatrix& matrix) {
  factors_ = std::make_unique<Factors>(library_);
  std::vector<int> places(order().begin(), order().end());  // MA97 writes what it makes of it
  library_->analyse(0, dimension(), matrix.column_starts().data(), matrix.rows().data(), nullptr,
                    &factors_->analysis, &factors_->control, &factors_->info, places.data());
  analysis().factor_entries = factors_->info.num_factor;
  analysis().flops = static_cast<double>(factors_->info.num_flops);
  return factors_->succeeded();
}

bool Ma97Solver::factorize_values(const SymmetricMatrix& matrix, Pivots& pivots) {
  Factors& f = *factors_;
  f.control.u = pivot_tolerance();
  const SequentialBlas sequential(analysis().flops);
  library_->factor(kIndefinite, matrix.column_starts().data(), matrix.rows().data(),
                   matrix.values().data(), &f.analysis, &f.factors, &f.control, &f.info, nullptr);
  pivots = {.negative = f.info.num_neg, .rank = f.info.matrix_rank};
  return f.succeeded();
}

void Ma97Solver::solve_with_factors(std::span<double> rhs, Index columns) {
  constexpr int kWholeSystem = 0;
  const SequentialBlas sequential(analysis().flops);
  library_->solve(kWholeSystem, columns, rhs.data(), dimension(), &factors_->analysis,
                  &factors_->factors, &factors_->control, &factors_->info);
}

}  // namespace ipminmax
