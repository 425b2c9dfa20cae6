#include <algorithm>
#include <cmath>
#include <random>

#include "core/method/parameters.hpp"
#include "core/model/uniform.hpp"
#include "core/search/restart.hpp"

namespace ipminmax {
namespace {

namespace parameter = parameters::restart;

}  // namespace

bool makes_new_starts(const SolverOptions& options) {
  return options.minmax_globalization == Globalization::Filter && !options.minmax_pure_newton &&
         options.minmax_max_restarts > 0;
}

Index restart_iterations(Index variables) {
  if (variables > parameter::kLargeProblem) return parameter::kIterationsOfLargeProblem;
  if (variables > 8) return parameter::kMostIterations;
  return std::min(parameter::kMostIterations, parameter::kIterationsPerCell << variables);
}

std::string describe_restarts(Index made, Index variables, const SolverOptions& options) {
  const std::string points = made == 1 ? " other starting point" : " other starting points";
  const std::string why = made >= options.minmax_max_restarts
                              ? "minmax_max_restarts allows no more"
                              : "new starts end after " +
                                    std::to_string(restart_iterations(variables)) +
                                    " iterations in all for " + std::to_string(variables) +
                                    " variables, minmax_starts makes more";
  return "nor from " + std::to_string(made) + points + ": " + why;
}

Index last_resort_iterations(const CanonicalProblem& canonical) {
  const Index variables = canonical.x().size() + canonical.y().size();
  if (variables <= 2 || variables > parameter::kLargeProblem) return 0;
  for (const IndexRange range : {canonical.x(), canonical.y()}) {
    for (Index i = range.begin; i < range.end; ++i) {
      if (!std::isfinite(canonical.upper()[i] - canonical.lower()[i])) return 0;
    }
  }
  return parameter::kLastResortIterations;
}

Iterate restart_point(const CanonicalProblem& canonical, const Iterate& start, Index number) {
  Iterate point;
  point.v.setZero(canonical.variables());
  point.lambda.setZero(canonical.constraints());
  point.z_lower.setZero(canonical.variables());
  point.z_upper.setZero(canonical.variables());
  std::mt19937_64 generator(static_cast<std::uint64_t>(number));
  for (const IndexRange range : {canonical.x(), canonical.y()}) {
    for (Index i = range.begin; i < range.end; ++i) {
      double lower = canonical.lower()[i];
      double upper = canonical.upper()[i];
      const double reach = parameter::kReach * std::max(1.0, std::abs(start.v[i]));
      if (!(upper - lower <= parameter::kWideInterval * reach)) {
        const double center = number % 2 != 0 ? start.v[i] : 0.0;
        const double inside = std::clamp(center, lower, upper);
        lower = std::max(lower, inside - reach);
        upper = std::min(upper, inside + reach);
      }
      point.v[i] =
          lower + (upper - lower) *
                      (parameter::kMargin + (1.0 - 2.0 * parameter::kMargin) * uniform(generator));
    }
  }
  return point;
}

}  // namespace ipminmax
