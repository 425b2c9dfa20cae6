#pragma once

#include "core/certificate/candidate.hpp"

namespace ipminmax {

/// After Newton steps on the way to the certified solution: whether the point that is returned is
/// that one, or as near as makes no difference. c.moved and c.mu may move there.
[[nodiscard]] bool reports_solution(TestContext& c, const Candidate& candidate, const Point& given);

/// Where the objective was scaled down a gradient that meets the tolerances may be large in the
/// model's units: the end of the Newton step is returned, if it is no worse otherwise.
void report_end(TestContext& c, const Point& given, const NewtonTest& newton);

}  // namespace ipminmax
