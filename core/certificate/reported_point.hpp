#pragma once

#include "core/certificate/stage.hpp"

namespace ipminmax {

/// After Newton steps on the way to the certified solution: whether the point that is returned is
/// that one, or as near as makes no difference. c.moved and c.mu may move there.
[[nodiscard]] bool reports_solution(Case& c, const Stage& stage, const Point& given);

/// Whether the bounds are clearly what they were guessed to be at the solution, and that is
/// reported.
[[nodiscard]] bool guess_holds(Case& c, const Stage& stage, const Point& given);

}  // namespace ipminmax
