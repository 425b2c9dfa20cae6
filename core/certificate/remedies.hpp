#pragma once

#include "core/certificate/test_context.hpp"

namespace ipminmax {

/// The second-order test of a point that is not clear: candidates for the solution near by, and
/// what remedies make of them, in the order of certificate.hpp.
[[nodiscard]] SecondOrder examine(TestContext& c, const Point& given);

}  // namespace ipminmax
