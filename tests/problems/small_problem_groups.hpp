#pragma once

#include <problems/small_problems.hpp>

namespace ipminmax::testing {

[[nodiscard]] std::vector<SmallProblem> unbounded_problems();
[[nodiscard]] std::vector<SmallProblem> bounded_problems();
[[nodiscard]] std::vector<SmallProblem> constrained_problems();

}  // namespace ipminmax::testing
