#pragma once

#include "core/model/budget.hpp"
#include "core/search/kept_work.hpp"

namespace ipminmax {

/// One solve of a model with second derivatives: the best of a list of searches, all within one
/// budget of iterations. Where too few degrees of freedom are left without the fixed variables,
/// their bounds are moved apart, as in Ipopt. kept: of the last solve, replaced by that of this
/// one; null: nothing is kept.
[[nodiscard]] Result run_searches(Problem& problem, const SolverOptions& options, Budget& budget,
                                  const SolveObserver& observer, KeptWork* kept);

}  // namespace ipminmax
