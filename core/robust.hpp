#pragma once

#include <memory>
#include <span>
#include <vector>

#include "multistart.hpp"
#include "options.hpp"
#include "problem.hpp"
#include "result.hpp"
#include "solver.hpp"

namespace IPMINMAX_API ipminmax {

/// Answer of solve_robust: what run() (answer.hpp) finds, with parts of its result side by side.
struct RobustResult {
  /// Of the problem with the copies of y, in the shape of the model: v holds x and, for a variable
  /// that a constraint has copies of, its value in the worst case with the largest multiplier; a
  /// constraint's multiplier is the sum of those of its worst cases. Objective and constraints are
  /// those of v; certificate and errors are those of the problem with the copies. Counts,
  /// iterations, factorizations and times are those of all solves and maximizations together.
  Result result;
  std::vector<RobustWorstCase> worst_cases;  ///< ordered by constraint, first found first
  Index solves = 0;                          ///< of problems with copies
  Index maximizations = 0;                   ///< of single constraints over y
  /// Largest violation, over all robust constraints and all y looked at, of the returned x; NaN
  /// when nothing was looked at.
  double largest_violation = 0.0;
  /// Worst cases of f among the worst cases, where f was treated as a robust constraint: with a
  /// certificate, x minimizes the largest of so many local worst cases. 0: f is that of one y.
  Index branches = 0;
  Index starts = 1;      ///< of x
  Index best_start = 0;  ///< the answer's
  /// With minmax_starts above 1: certified points, the smallest objective first.
  std::vector<DistinctPoint> points;
};

/// A problem in which f itself stands in a robust constraint: min t, f(x, y) <= t for every y. The
/// variable t is the last one, the constraint too. t starts at f of the model's start.
[[nodiscard]] std::unique_ptr<Problem> make_epigraph(Problem& model);

/// Whether the model has a constraint of Min that reads a Max variable.
[[nodiscard]] bool has_robust_constraints(const ProblemStructure& structure);

/// Solves a model with robust constraints g(x, y) <= 0 for every y. Each gets copies of its own of
/// the Max variables that it reads, and of the Max constraints on these, where f or another
/// constraint reads them too; a model in which each robust constraint has its own Max variables is
/// left as it is.
///
/// Unless minmax_worst_case_starts is 0 each robust constraint is then maximized over all of y, at
/// the x found, from as many starts as it says, by default from 8 and, where these find different
/// maxima, more; a maximum that violates it by more than minmax_worst_case_tol of the range of its
/// values becomes another worst case with a copy of y of its own, and the solve goes on from there,
/// until none is found; where copies do not come to rest, fixed worst cases decide. Where
/// minmax_epigraph is set, f is treated likewise: then x minimizes the largest of the local worst
/// cases met, kinks included. With minmax_epigraph_at_kinks that happens only after a search that
/// ended without a local minmax, from where it ended. Both are refused (InvalidOption) with a
/// negative factor of the objective, by which y minimizes f, and change nothing without Max
/// variables.
///
/// With minmax_starts N > 1 all of this is done from N starts of x, as in multistart(), and the
/// best answer is returned.
///
/// A certified answer is a strict local solution of the semi-infinite problem reduced to the worst
/// cases listed; other worst cases are excluded as far as the search over y saw. Exceptions of the
/// model pass through; the limit of iterations holds for each solve, those of time for all
/// together.
[[nodiscard]] RobustResult solve_robust(Problem& model, const SolverOptions& options,
                                        const SolveObserver& observer = {});

}  // namespace ipminmax
