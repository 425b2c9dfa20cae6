#pragma once

#include <string>

#include "core/method/restoration.hpp"
#include "core/method/step_method.hpp"
#include "core/search/first_order_test.hpp"
#include "core/search/outcome.hpp"

namespace ipminmax {

/// Whether a variable of the range has left the size of its bounds and of the start far behind.
[[nodiscard]] bool has_run_away(const CanonicalProblem& canonical, const Point& point,
                                IndexRange variables);

/// Numbers that stopped a method whose iterates had run away say little; the running away does:
/// status and message of the point where a search ended, changed where that is so.
void name_divergence(const CanonicalProblem& canonical, const Point& point, Status& status,
                     std::string& message);

/// Whether a minimization has gone that far beyond its start that it may be on its way to infinity.
[[nodiscard]] bool is_far_out(const CanonicalProblem& canonical, const Point& point);

/// Shifted Newton steps, which move along curvature alone: from beside a flat valley to a
/// first-order point at its bottom. False: not reached.
[[nodiscard]] bool step_into_valley(const MethodContext& context, double mu,
                                    const FirstOrderTest& test, Point& point);

/// Whether Newton's method, continued from such a point and brought back to the bottom after each
/// step, leads outward and downward.
[[nodiscard]] bool valley_leads_to_infinity(const MethodContext& context, const Point& bottom,
                                            double mu, const FirstOrderTest& test);

/// Whether Newton's method, continued from a first-order point without curvature, leads outward
/// through points that all meet the tolerances, or whether the second derivatives have died out.
[[nodiscard]] bool runs_to_infinity(const MethodContext& context, const Point& from, double mu,
                                    const FirstOrderTest& test);

/// Where Y(x) is empty for every x near, no branch of inner maxima is followed for long. A local
/// minimum of the violation over both players' variables tells that from a search that is lost: the
/// outcome then becomes that point, with the constraint that is violated most. Costs a restoration
/// where the search failed at an infeasible point.
void name_infeasibility(const MethodContext& context, const ProblemStructure& structure,
                        const Restorer& restorer, SearchOutcome& outcome);

}  // namespace ipminmax
