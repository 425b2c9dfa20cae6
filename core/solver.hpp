#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string_view>

#include "options.hpp"
#include "problem.hpp"
#include "result.hpp"

namespace ipminmax {

/// State of the method after an iteration; iteration 0 is the starting point. Quantities of the
/// step are those of the step that led here and zero at iteration 0.
///
/// Iterations of a feasibility restoration are told, too, with restoration set and the number of the
/// iteration that waits for it. Objective and error.primal are then those of the model (the objective
/// NaN where undefined); mu, the step and the other errors are those of the restoration problem.
struct IterationInfo {
  Index iteration = 0;
  bool restoration = false;
  double objective = 0.0;  ///< unscaled
  KktError error;          ///< primal: to the relaxed bounds (bound_relax_factor), unlike in Result
  double mu = 0.0;
  double step_norm = 0.0;  ///< infinity norm of the primal step
  double delta_x = 0.0;    ///< Hessian shift of the Min variables (the paper's epsilon_x)
  double delta_y = 0.0;    ///< Hessian shift of the Max variables (the paper's epsilon_y)
  double alpha_dual = 0.0;
  double alpha_primal = 0.0;
  char step_kind = ' ';                 ///< one letter, see core/algorithm.md
  Index trials = 0;                     ///< trial points of the line search
  Index factorizations_full = 0;        ///< of K since the last call
  Index factorizations_inner = 0;       ///< of K_yy since the last call
  Index factorizations_complement = 0;  ///< of the complement of K_yy in K since the last call
  std::span<const double> v;            ///< the iterate, n; valid during the callback
  /// What the solve would return if the callback stopped it now, for the callback's use only. Each
  /// call evaluates objective and constraints, with fixed variables also their derivatives.
  std::function<Result()> result;
};

/// What a solve tells while it runs. Every member may be empty.
struct SolveObserver {
  /// Called once per iteration including 0, and in those of a restoration; false stops with
  /// Status::UserStop at the iterate.
  std::function<bool(const IterationInfo&)> on_iteration;
  /// Messages a user should see (warnings, changes of phase), without line end.
  std::function<void(std::string_view)> message;
};

using IterationCallback = std::function<bool(const IterationInfo&)>;

/// Solves the problem. Never throws for what the model or the numbers do; exceptions thrown by the
/// model's functions pass through, std::bad_alloc gives Status::OutOfMemory.
[[nodiscard]] Result solve(Problem& problem, const SolverOptions& options,
                           const IterationCallback& on_iteration = {});
[[nodiscard]] Result solve(Problem& problem, const SolverOptions& options,
                           const SolveObserver& observer);

struct KeptWork;

/// Solves again and again models of the same structure, whose numbers may differ: objective,
/// constraint functions, values of bounds, starting point; so may the options. Kept from one solve
/// to the next are
///   - the orderings and symbolic factorizations: Counts::analyses of the next Result is 0,
///   - the gradient-based scaling,
///   - the shifts last used (unless minmax_warm_start_shifts is off or the last solve failed).
/// The structure is compared each time: when players, patterns, or the kinds of bounds and
/// constraints have changed (absent, one-sided, equal), or an option that one of the three depends
/// on, what no longer fits is made anew. For one thread at a time.
class RepeatedSolver {
 public:
  RepeatedSolver();
  ~RepeatedSolver();
  RepeatedSolver(RepeatedSolver&&) noexcept;
  RepeatedSolver& operator=(RepeatedSolver&&) noexcept;

  /// As the function solve. After an exception of the model the next solve begins anew.
  [[nodiscard]] Result solve(Problem& problem, const SolverOptions& options,
                             const SolveObserver& observer = {});

  /// Forgets what was kept.
  void reset();

 private:
  std::unique_ptr<KeptWork> kept_;
};

/// A solve inside a solve: no feasibility restoration and no certificate of its own.
[[nodiscard]] Result solve_nested(Problem& problem, const SolverOptions& options,
                                  const SolveObserver& observer);

}  // namespace ipminmax
