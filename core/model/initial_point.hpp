#pragma once

#include <optional>
#include <vector>

#include "core/model/canonical_problem.hpp"
#include "core/model/iterate.hpp"
#include "core/options.hpp"
#include "core/problem.hpp"

namespace ipminmax {

/// The variables of the model's starting point, which may not be finite; none: it gives none.
[[nodiscard]] std::optional<std::vector<double>> model_start(Problem& model);

/// First bound multipliers: bound_mult_init_val, or mu_init over the distance to the bound; of a
/// warm start those given, at least warm_start_mult_bound_push.
void start_bound_multipliers(const CanonicalProblem& canonical, const SolverOptions& options,
                             Iterate& start);

/// Bound multipliers of copies of y, given for their own rows, times the rows' multipliers.
void weigh_copies(const CanonicalProblem& canonical, Iterate& start);

/// Multipliers of robust constraints follow those of their slacks' bounds, lambda = z_upper -
/// z_lower: with another sign Max would help Min.
void start_robust_multipliers(const CanonicalProblem& canonical, Iterate& start);

/// Multipliers of the constraints where no others are known: zero, and with mu-based bound
/// multipliers those of inequalities at that of their slack, lambda = sign (z_upper - z_lower), so
/// that the slack is stationary.
void start_constraint_multipliers(const CanonicalProblem& canonical, const SolverOptions& options,
                                  Iterate& start);

}  // namespace ipminmax
