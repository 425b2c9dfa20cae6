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

/// Answer of solve_robust. A worst case is a y that a robust constraint was optimized against.
struct RobustResult {
  /// Result in the variables and constraints of the model. If a Max variable has several values,
  /// one for each worst case, v holds that of the worst case with the largest multiplier. The
  /// multiplier of a constraint is the sum over its worst cases. Objective and constraints are
  /// those of v; certificate and errors are those of the last problem solved, with a row for each
  /// worst case. Counts, iterations, factorizations and times are those of all solves and
  /// maximizations.
  Result result;
  std::vector<RobustWorstCase> worst_cases;  ///< ordered by constraint, the first found first
  Index solves = 0;                          ///< number of solves, each with other worst cases
  Index maximizations = 0;                   ///< number of maximizations of a constraint over y
  /// Largest violation of a robust constraint, in its own units, at the returned x over all y
  /// examined; NaN: none was examined. RobustWorstCase::range is the range to compare it with.
  double largest_violation = 0.0;
  /// Number of worst cases of f, if f was treated as a robust constraint (minmax_epigraph). At a
  /// certified answer x is a local minimum of the largest of them. 0: f was not.
  Index branches = 0;
  Index starts = 1;      ///< number of starts of x
  Index best_start = 0;  ///< index of the start that led to the answer, from 0
  /// Certified points, ranked as MultistartResult::points; empty unless minmax_starts is above 1.
  std::vector<DistinctPoint> points;
};

/// Returns the epigraph form of a model: min t subject to f(x, y) <= t for every y, and the model's
/// constraints. The variable t and this constraint come last; t starts at f of the model's start.
/// The model must live as long as what is returned.
[[nodiscard]] std::unique_ptr<Problem> make_epigraph(Problem& model);

/// Returns whether a constraint of Min reads a Max variable, by the Jacobian's structure.
[[nodiscard]] bool has_robust_constraints(const ProblemStructure& structure);

/// Solves a model with robust constraints: g(x, y) <= 0 for every y (docs/robust_constraints.md).
///
///   1. Optimize x against fixed worst cases. The first one is the y of the model's start.
///   2. Maximize each robust constraint over y at this x. A maximum whose violation is large enough
///      to count (docs/robust_constraints.md) is one more worst case.
///   3. After two such rounds, replace each worst case that is active, or nearly, by a copy: Max
///      variables of its own, which move with x and stay at a local maximum of the constraint.
///   4. Optimize x and the copies together, and test second-order conditions.
///   5. Maximize each constraint from minmax_worst_case_starts starts (default: 8, fewer if these
///      agree, more if they do not; 0: no search). A maximum that violates its constraint becomes
///      another copy; repeat from 4 until there is none.
///   6. If copies fail, return to 1 and 2 with all starts, until no y violates a constraint.
///
/// With minmax_epigraph f is treated as a robust constraint: x minimizes the largest of the local
/// worst cases found, also at a kink. With minmax_epigraph_at_kinks this is done only after a
/// search that ended without a local minmax, from its last point. Both options are refused
/// (InvalidOption) if the factor of the objective is negative, and have no effect without Max
/// variables.
///
/// With minmax_starts N > 1 all of this is done from N starts of x, as in multistart(), and the
/// best answer is returned.
///
/// A certified answer is a strict local solution of the problem in which each robust constraint
/// holds at the worst cases listed, and the search over y found no y that violates a constraint.
/// max_iter holds for each solve, limits of time for all together. A failure is a status;
/// exceptions of the model pass through.
[[nodiscard]] RobustResult solve_robust(Problem& model, const SolverOptions& options,
                                        const SolveObserver& observer = {});

}  // namespace ipminmax
