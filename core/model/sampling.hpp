#pragma once

#include <algorithm>
#include <random>
#include <vector>

#include "core/problem.hpp"
#include "core/result.hpp"

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

/// The model's structure for those who choose points: a linear constraint on a single variable is a
/// bound of it, too. v: n values, where the model is evaluated.
[[nodiscard]] ProblemStructure with_bounds_of_rows(Problem& model, std::vector<double> v,
                                                   Counts& counts);

/// v and two random points within a tenth of its size and the bounds, at which a function shows
/// what it depends on.
[[nodiscard]] std::vector<std::vector<double>> points_around(const ProblemStructure& s,
                                                             const std::vector<double>& v);

}  // namespace ipminmax
