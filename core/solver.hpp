#pragma once

#include <memory>

#include "iteration.hpp"
#include "options.hpp"
#include "problem.hpp"
#include "result.hpp"

namespace IPMINMAX_API ipminmax {

/// Solves the problem as the options ask: from several starts of x, with a search over y, with
/// robust constraints, or with f in epigraph form. Returns the best point; run() (answer.hpp) also
/// returns the others. on_iteration or observer is called in every iteration and stops the solve
/// (UserStop) by returning false. A failure is a status, not an exception; exceptions of the model
/// pass through, and std::bad_alloc gives OutOfMemory.
[[nodiscard]] Result solve(Problem& problem, const SolverOptions& options,
                           const IterationCallback& on_iteration = {});
[[nodiscard]] Result solve(Problem& problem, const SolverOptions& options,
                           const SolveObserver& observer);

struct KeptWork;

/// Solves models of the same structure one after the other. Functions, values of bounds, starting
/// point and options may change between solves. Without robust constraints it keeps
///   - the orderings and symbolic factorizations: Counts::analyses of the next Result is 0,
///   - the arrays,
///   - with warm_start_init_point also the gradient-based scaling and, unless
///     minmax_warm_start_shifts is off or the last solve failed, the last shifts of the Hessian.
/// Without warm_start_init_point the answer is that of a solve by itself.
/// With robust constraints it keeps their worst cases instead, and the next solve starts at these
/// if warm_start_init_point is set. By default only every tenth solve searches a constraint fully
/// that is far from its limit (SearchOverY::age).
///
/// Each solve compares the structure. If players, patterns or the kinds of bounds (absent,
/// one-sided, equal) have changed, it computes again what no longer fits. One object may be used by
/// one thread at a time.
class RepeatedSolver {
 public:
  RepeatedSolver();
  ~RepeatedSolver();
  RepeatedSolver(RepeatedSolver&&) noexcept;
  RepeatedSolver& operator=(RepeatedSolver&&) noexcept;

  /// Solves as the function solve does. After an exception of the model nothing is kept.
  [[nodiscard]] Result solve(Problem& problem, const SolverOptions& options,
                             const SolveObserver& observer = {});
  /// Solves into `result`, whose arrays are used again. If only numbers change and the solve takes
  /// the same course as the last one, it allocates no memory.
  void solve(Problem& problem, const SolverOptions& options, const SolveObserver& observer,
             Result& result);

  /// Sets the worst cases at which the next solve starts, if warm_start_init_point is set; for
  /// example those of the last solve moved one stage ahead. They replace those of the last solve.
  void start_at(std::vector<RobustWorstCase> worst_cases);

  /// Forgets what was kept.
  void reset();

 private:
  std::unique_ptr<KeptWork> kept_;
};

}  // namespace ipminmax
