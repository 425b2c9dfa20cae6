#pragma once

#include <random>

namespace ipminmax {

/// Uniform in [0, 1), equal on every platform, which std::uniform_real_distribution is not.
[[nodiscard]] inline double uniform(std::mt19937_64& generator) {
  return static_cast<double>(generator() >> 11U) * 0x1p-53;
}

}  // namespace ipminmax
