#pragma once

#include "core/certificate/test_context.hpp"

namespace ipminmax {

/// At mu_target > 0 the point solves the barrier problem, in which no bound is active and all
/// curvature counts.
[[nodiscard]] SecondOrder judge_barrier_problem(TestContext& c, const Point& given);

}  // namespace ipminmax
