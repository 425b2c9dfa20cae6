#pragma once

#include "core/model/canonical_problem.hpp"
#include "core/model/iterate.hpp"

namespace ipminmax {

/// Whether a search with Max variables that fails is begun anew elsewhere.
[[nodiscard]] bool makes_new_starts(const SolverOptions& options);

/// The number-th other starting point (from 1) of a search that failed from the model's: uniform in
/// the box of the bounds; where a bound is missing or far away, within a reach around the model's
/// point (odd numbers) or around zero (even ones), which changes from pair to pair: starts that ran
/// to infinity are worth another look nearer by. The same for every run. Slacks and multipliers are
/// zero.
[[nodiscard]] Iterate restart_point(const CanonicalProblem& canonical, const Iterate& start,
                                    Index number);

/// Whether every variable of x and y has two bounds.
[[nodiscard]] bool is_box(const CanonicalProblem& canonical);

}  // namespace ipminmax
