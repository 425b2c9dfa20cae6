#pragma once

#include <vector>

namespace ipminmax {

/// Points of a model, or of one player in it: as many values each.
using Points = std::vector<std::vector<double>>;

}  // namespace ipminmax
