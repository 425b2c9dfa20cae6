#pragma once

#include <algorithm>
#include <random>

namespace ipminmax {

/// Uniform in [0, 1), equal on every platform, which std::uniform_real_distribution is not.
[[nodiscard]] inline double uniform(std::mt19937_64& generator) {
  return static_cast<double>(generator() >> 11U) * 0x1p-53;
}

/// Where a variable is sampled.
struct SampledRange {
  double lower, upper;

  /// What lies within the reach of a center, which is moved inside first.
  [[nodiscard]] SampledRange around(double center, double reach) const {
    const double inside = std::clamp(center, lower, upper);
    return {std::max(lower, inside - reach), std::min(upper, inside + reach)};
  }
  /// Without that share at either end.
  [[nodiscard]] SampledRange without_ends(double share) const {
    const double margin = share * (upper - lower);
    return {lower + margin, upper - margin};
  }
  [[nodiscard]] double draw(std::mt19937_64& generator) const {
    const double t = uniform(generator);
    return (1.0 - t) * lower + t * upper;
  }
};

}  // namespace ipminmax
