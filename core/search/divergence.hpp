#pragma once

#include <string>

#include "core/method/restoration.hpp"
#include "core/method/step_method.hpp"
#include "core/search/first_order_test.hpp"
#include "core/search/outcome.hpp"

namespace ipminmax {

/// Whether a variable of the range has left the size of its bounds and of the start far behind, and
/// f goes on getting better for the player, whose variables the range holds.
[[nodiscard]] bool has_run_away(CanonicalProblem& canonical, const Point& point,
                                IndexRange variables);

/// Changes status and message of the point at which a search failed, if the failure is one of
/// numbers and the cause is that the variables or f grow without bound.
void name_divergence(const MethodContext& context, const Point& point, Status& status,
                     std::string& message);

/// Whether Newton's method, continued from a first-order point without curvature, leads outward
/// through points that all meet the tolerances, in a direction in which f still gets better. Where
/// f is constant along it the point is a solution, however far a barrier pulls.
[[nodiscard]] bool runs_to_infinity(const MethodContext& context, const Point& from, double mu,
                                    FirstOrderTest& test);

/// Whether the value at a maximum over y that is not unique, which is constant along the flat
/// directions of y there, differs on the way back along them to the start: the iterates came to a
/// plateau, and elsewhere it is none of a maximum.
[[nodiscard]] bool is_on_plateau(const MethodContext& context, const Point& found, double mu);

/// Where Y(x) is empty for every x near, no branch of inner maxima is followed for long. A local
/// minimum of the violation over both players' variables tells that from a search that is lost: the
/// outcome then becomes that point, with the constraint that is violated most. Costs a restoration
/// where the search failed at an infeasible point.
void name_infeasibility(const MethodContext& context, const ProblemStructure& structure,
                        const Restorer& restorer, SearchOutcome& outcome);

}  // namespace ipminmax
