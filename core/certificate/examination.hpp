#pragma once

#include "core/certificate/case.hpp"

namespace ipminmax {

/// The test of a point that is not clear at first look, with pivoting: which bounds are active, and
/// Newton's method towards the solution of their equations, until W changes by less than its
/// curvature on the way.
[[nodiscard]] SecondOrder examine(Case& c, const Point& given);

}  // namespace ipminmax
