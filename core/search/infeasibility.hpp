#pragma once

#include "core/method/restoration.hpp"
#include "core/method/step_method.hpp"
#include "core/search/outcome.hpp"

namespace ipminmax {

/// Where Y(x) is empty for every x near, no branch of inner maxima is followed for long. A local
/// minimum of the violation over both players' variables tells that from a search that is lost: the
/// outcome then becomes that point, with the constraint that is violated most. Costs a restoration
/// where the search failed at an infeasible point.
void name_infeasibility(const MethodContext& context, const ProblemStructure& structure,
                        const Restorer& restorer, SearchOutcome& outcome);

}  // namespace ipminmax
