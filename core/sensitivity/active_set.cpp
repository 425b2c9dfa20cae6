#include "core/sensitivity/active_set.hpp"

#include <algorithm>

#include "core/certificate/bound_classes.hpp"
#include "core/certificate/parameters.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

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
    const auto found = [&](double distance, double multiplier, double strict_ratio) {
      return class_of(std::max(multiplier, 0.0) / scale, std::max(distance, 0.0), strict_ratio);
    };
    constexpr double kStrictRatio = parameters::certificate::kStrictRatio;
    const double above = value - lower_bound, below = upper_bound - value;
    const bool weak_below = found(above, pressure, kStrictRatio) == BoundClass::Doubtful;
    if (weak_below || found(below, -pressure, kStrictRatio) == BoundClass::Doubtful) {
      weak.push_back(place_name(structure, of_constraint, static_cast<Index>(i)) + " at its " +
                     (weak_below ? "lower" : "upper") + " bound");
    }
    if (found(above, pressure, 1.0) == BoundClass::Active) return Hold::Lower;
    return found(below, -pressure, 1.0) == BoundClass::Active ? Hold::Upper : Hold::Free;
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
