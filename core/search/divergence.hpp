#pragma once

#include <string>

#include "core/method/step_method.hpp"
#include "core/search/first_order_test.hpp"

namespace ipminmax {

/// Whether a variable of the range has left the size of its bounds and of the start far behind.
[[nodiscard]] bool has_run_away(const CanonicalProblem& canonical, const Point& point,
                                IndexRange variables);

/// Numbers that stopped a method whose iterates had run away say little; the running away does:
/// status and message of the point where a search ended, changed where that is so.
void name_divergence(const CanonicalProblem& canonical, const Point& point, Status& status,
                     std::string& message);

/// Whether Newton's method, continued from a first-order point without curvature, leads outward
/// through points that all meet the tolerances, or whether the second derivatives have died out.
[[nodiscard]] bool runs_to_infinity(const MethodContext& context, const Point& from, double mu,
                                    const FirstOrderTest& test);

}  // namespace ipminmax
