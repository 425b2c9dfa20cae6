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

/// Answer of solve_robust: the answer of run() (answer.hpp), and parts of its result.
struct RobustResult {
  /// Result in the variables and constraints of the model. If constraints have copies of a Max
  /// variable, v holds its value in the worst case with the largest multiplier. A constraint's
  /// multiplier is the sum of those of its worst cases. Objective and constraints are those of v;
  /// certificate and errors are those of the problem with the copies. Counts, iterations,
  /// factorizations and times are those of all solves and maximizations together.
  Result result;
  std::vector<RobustWorstCase> worst_cases;  ///< ordered by constraint, first found first
  Index solves = 0;                          ///< number of solves of problems with copies
  Index maximizations = 0;                   ///< number of maximizations of a constraint over y
  /// Largest violation of a robust constraint at the returned x over all y examined; NaN if none
  /// was.
  double largest_violation = 0.0;
  /// Number of worst cases of f, if f was treated as a robust constraint: with a certificate x
  /// minimizes the largest of these local worst cases. 0: f has one y.
  Index branches = 0;
  Index starts = 1;      ///< number of starts of x
  Index best_start = 0;  ///< number of the start that led to the answer
  /// With minmax_starts above 1: certified points, the smallest objective first.
  std::vector<DistinctPoint> points;
};

/// Returns the epigraph form of a model: min t subject to f(x, y) <= t for every y. The variable t
/// and this constraint are the last ones; t starts at f of the model's start.
[[nodiscard]] std::unique_ptr<Problem> make_epigraph(Problem& model);

/// Returns whether a constraint of Min reads a Max variable.
[[nodiscard]] bool has_robust_constraints(const ProblemStructure& structure);

/// Solves a model with robust constraints g(x, y) <= 0 for every y.
///
/// Each robust constraint gets copies of the Max variables that it shares with f or with another
/// constraint, and of the Max constraints on them. Then each is maximized over all of y at the x
/// found, from minmax_worst_case_starts starts (0: not at all; default: 8, and more if these find
/// different maxima). A maximum that violates the constraint by more than minmax_worst_case_tol of
/// the range of its values becomes another worst case, with a copy of y of its own, and the model
/// is solved again, until no such maximum is found. If the copies do not converge, fixed worst
/// cases are used.
///
/// With minmax_epigraph f is treated in the same way: x minimizes the largest of the local worst
/// cases found, also at a kink. With minmax_epigraph_at_kinks this is done only after a search that
/// ended without a local minmax, from its last point. Both options are refused (InvalidOption) if
/// the factor of the objective is negative, and have no effect without Max variables.
///
/// With minmax_starts N > 1 all of this is done from N starts of x, as in multistart(), and the
/// best answer is returned.
///
/// A certified answer is a strict local solution of the semi-infinite problem reduced to the worst
/// cases listed; the search over y has found no other worst case. max_iter holds for each solve,
/// time limits for all together. Exceptions of the model pass through.
[[nodiscard]] RobustResult solve_robust(Problem& model, const SolverOptions& options,
                                        const SolveObserver& observer = {});

}  // namespace ipminmax
