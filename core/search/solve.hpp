#pragma once

#include "core/model/budget.hpp"
#include "core/search/kept_work.hpp"

namespace ipminmax {

/// One solve: the best of a list of searches, all within one budget of iterations. kept: of the
/// last solve, replaced by that of this one; null: nothing is kept.
[[nodiscard]] Result run_searches(Problem& problem, const SolverOptions& options, Budget& budget,
                                  const SolveObserver& observer, KeptWork* kept);

}  // namespace ipminmax
