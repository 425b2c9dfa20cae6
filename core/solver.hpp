#pragma once

#include <memory>

#include "iteration.hpp"
#include "options.hpp"
#include "problem.hpp"
#include "result.hpp"

namespace IPMINMAX_API ipminmax {

/// Solves the problem as the options ask, other starts, other y, robust constraints and branches
/// included: the best point of run() (answer.hpp), with its four statements (result.hpp). Never
/// throws for what the model or the numbers do; exceptions thrown by the model's functions pass
/// through, std::bad_alloc gives OutOfMemory.
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
///   - the arrays,
///   - the shifts last used (unless minmax_warm_start_shifts is off or the last solve failed),
///   - with robust constraints, none of the above but their worst cases: with warm_start_init_point
///     the next solve starts at these; the check over y looks at minmax_worst_case_starts others as
///     ever.
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
  /// The same into a result, whose arrays are used again: as long as nothing changes but numbers, a
  /// solve that goes as the one before allocates nothing.
  void solve(Problem& problem, const SolverOptions& options, const SolveObserver& observer,
             Result& result);

  /// Worst cases of robust constraints at which the next solve starts, instead of those of the
  /// last one, if it is a warm start: as moved one stage ahead.
  void start_at(std::vector<RobustWorstCase> worst_cases);

  /// Forgets what was kept.
  void reset();

 private:
  std::unique_ptr<KeptWork> kept_;
};

}  // namespace ipminmax
