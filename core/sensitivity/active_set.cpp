#include "core/sensitivity/active_set.hpp"

#include <algorithm>

#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// Neither dominates when multiplier and distance differ by less than this factor.
constexpr double kStrictRatio = 100.0;

struct Side {
  double distance = 0.0;
  double multiplier = 0.0;
};

struct Finding {
  bool active = false;
  bool weak = false;
};

Finding judge(const Side& side, double scale) {
  const double distance = std::max(side.distance, 0.0);
  const double multiplier = std::max(side.multiplier, 0.0) / scale;
  return {.active = multiplier > distance,
          .weak = multiplier <= kStrictRatio * distance && distance <= kStrictRatio * multiplier};
}

}  // namespace

Bounds bounds_of(const ProblemStructure& structure, const SolverOptions& options) {
  Bounds bounds{structure.variable_lower, structure.variable_upper, structure.constraint_lower,
                structure.constraint_upper};
  for (auto* lower : {&bounds.variable_lower, &bounds.constraint_lower}) {
    for (double& value : *lower) {
      if (value <= options.nlp_lower_bound_inf) value = -kInfinity;
    }
  }
  for (auto* upper : {&bounds.variable_upper, &bounds.constraint_upper}) {
    for (double& value : *upper) {
      if (value >= options.nlp_upper_bound_inf) value = kInfinity;
    }
  }
  return bounds;
}

std::string place_name(const ProblemStructure& structure, bool of_constraint, Index index) {
  const auto& names = of_constraint ? structure.constraint_names : structure.variable_names;
  const std::string kind = of_constraint ? "constraint " : "variable ";
  const auto i = static_cast<std::size_t>(index);
  return i < names.size() ? kind + names[i] : kind + std::to_string(index);
}

ActiveSet active_set_of(const ProblemStructure& structure, const Bounds& bounds,
                        const Result& result, const std::vector<double>& reduced_gradient,
                        double gradient_norm, std::vector<std::string>& weak) {
  const double scale = std::max(1.0, gradient_norm);
  weak.clear();
  const auto hold = [&](bool of_constraint, std::size_t i, double lower_bound, double upper_bound,
                        double value, double pressure) {
    if (lower_bound == upper_bound) return Hold::Fixed;
    const Finding lower = judge({value - lower_bound, pressure}, scale);
    const Finding upper = judge({upper_bound - value, -pressure}, scale);
    if (lower.weak || upper.weak) {
      weak.push_back(place_name(structure, of_constraint, static_cast<Index>(i)) + " at its " +
                     (lower.weak ? "lower" : "upper") + " bound");
    }
    return lower.active ? Hold::Lower : upper.active ? Hold::Upper : Hold::Free;
  };
  ActiveSet active;
  for (std::size_t i = 0; i < structure.variable_players.size(); ++i) {
    active.variables.push_back(hold(false, i, bounds.variable_lower[i], bounds.variable_upper[i],
                                    result.v[i],
                                    sign_of(structure.variable_players[i]) * reduced_gradient[i]));
  }
  for (std::size_t j = 0; j < structure.constraint_players.size(); ++j) {
    active.constraints.push_back(
        hold(true, j, bounds.constraint_lower[j], bounds.constraint_upper[j], result.constraints[j],
             -sign_of(structure.constraint_players[j]) * result.lambda[j]));
  }
  return active;
}

}  // namespace ipminmax
