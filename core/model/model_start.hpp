#pragma once

#include <optional>
#include <vector>

#include "core/problem.hpp"

namespace ipminmax {

/// The variables of the model's starting point, which may not be finite; none: it gives none.
[[nodiscard]] std::optional<std::vector<double>> model_start(Problem& model);

}  // namespace ipminmax
