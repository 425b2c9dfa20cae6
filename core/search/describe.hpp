#pragma once

#include "core/method/step_method.hpp"
#include "core/search/outcome.hpp"

namespace ipminmax {

/// Objective, constraints, multipliers and errors of a point in the model's units, and what the
/// certificate, which stays, says of its kind.
void describe(CanonicalProblem& canonical, const SolverOptions& options, const Point& point,
              Result& result);

/// What the outcome of a search is to the caller. A success is finite.
void describe(CanonicalProblem& canonical, const SolverOptions& options,
              const SearchOutcome& outcome, Result& result);

}  // namespace ipminmax
