#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/model/canonical_problem.hpp"
#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "linalg/numbers.hpp"

// From the canonical problem back to the model's units.

namespace ipminmax {

void CanonicalProblem::restore(const Iterate& iterate, Result& result) {
  const ProblemStructure& s = structure_;
  const bool finite = load(iterate.v);
  result.v = model_v_;
  result.lambda.assign(s.constraint_players.size(), 0.0);
  result.z_lower.assign(s.variable_players.size(), 0.0);
  result.z_upper.assign(s.variable_players.size(), 0.0);
  for_each_of_model(map_.model_variable, [&](Index i, std::size_t model) {
    const double factor = sign(i) * variable_scale(i) / objective_scale_;
    result.z_lower[model] = factor * iterate.z_lower[i];
    result.z_upper[model] = factor * iterate.z_upper[i];
    if (options_.honor_original_bounds) {
      result.v[model] =
          std::clamp(result.v[model], s.variable_lower[model], s.variable_upper[model]);
    }
  });
  for (Index j = 0; j < constraints(); ++j) {
    const double value = iterate.lambda[j] * constraint_scale(j) / objective_scale_;
    if (const Index fixed = map_.fixing_variable[j]; fixed >= 0) {
      set_fixed_multiplier(model_variable(fixed), -value, result);
    } else {
      result.lambda[at(model_constraint(j))] = value;
    }
  }
  if (finite) restore_fixed_multipliers(result);
  restore_values(finite, result);
}

void CanonicalProblem::write_scaling(UserScaling& factors) const {
  factors.objective = objective_scale_;
  factors.variables.assign(structure_.variable_players.size(), 1.0);
  factors.constraints.assign(structure_.constraint_players.size(), 1.0);
  for_each_of_model(map_.model_variable, [&](Index i, std::size_t model) {
    factors.variables[model] = variable_scale(i);
  });
  for_each_of_model(map_.model_constraint, [&](Index j, std::size_t model) {
    factors.constraints[model] = constraint_scale(j);
  });
}

void CanonicalProblem::restore_values(bool finite, Result& result) {
  bool new_point = true;
  result.objective = kNaN;
  if (result.v == objective_point_) {
    result.objective = objective_value_;
  } else if (finite) {
    ++counts_.objective;
    if (!ask([&] {
          return problem_.objective(result.v, std::exchange(new_point, false), result.objective);
        })) {
      result.objective = kNaN;
    }
  }
  result.constraints.assign(structure_.constraint_players.size(), kNaN);
  if (result.constraints.empty()) return;
  if (result.v == constraints_point_) {
    result.constraints = constraint_values_;
  } else if (finite) {
    ++counts_.constraints;
    if (!ask([&] { return problem_.constraints(result.v, new_point, result.constraints); })) {
      std::ranges::fill(result.constraints, kNaN);
    }
  }
  new_point_ = true;
}

std::optional<Index> CanonicalProblem::violated_constant_constraint() const {
  if (constraint_values_.empty()) return std::nullopt;
  const std::vector<bool>& varies = map_.varies;
  for (const auto j : indices(varies)) {
    if (varies[j] || map_.constraint_of_model[j] < 0) continue;
    const double tolerance = options_.constr_viol_tol;
    if (structure_.constraint_lower[j] - constraint_values_[j] > tolerance ||
        constraint_values_[j] - structure_.constraint_upper[j] > tolerance) {
      return static_cast<Index>(j);
    }
  }
  return std::nullopt;
}

double CanonicalProblem::bound_violation(double value, double lower, double upper) const {
  const bool bounded = lower > options_.nlp_lower_bound_inf || upper < options_.nlp_upper_bound_inf;
  return bounded ? largest(0.0, largest(lower - value, value - upper)) : 0.0;
}

double CanonicalProblem::violation(const Result& result) const {
  const ProblemStructure& s = structure_;
  double most = 0.0;
  for (const auto i : indices(s.variable_players)) {
    most = largest(most, bound_violation(result.v[i], s.variable_lower[i], s.variable_upper[i]));
  }
  for (const auto j : indices(s.constraint_players)) {
    most = largest(
        most, bound_violation(result.constraints[j], s.constraint_lower[j], s.constraint_upper[j]));
  }
  return most;
}

Index CanonicalProblem::most_violated_constraint(const Result& result) const {
  const ProblemStructure& s = structure_;
  Index found = 0;
  double most = 0.0;
  for (const auto j : indices(s.constraint_players)) {
    const double violation =
        bound_violation(result.constraints[j], s.constraint_lower[j], s.constraint_upper[j]);
    if (!(violation > most)) continue;
    most = violation;
    found = static_cast<Index>(j);
  }
  return found;
}

void CanonicalProblem::restore_fixed_multipliers(Result& result) {
  // A fixed variable's bounds balance grad f + J' lambda.
  if (options_.fixed_variable_treatment == FixedVariableTreatment::MakeParameterNodual) return;
  const bool any_fixed = std::any_of(map_.variable_of_model.begin(), map_.variable_of_model.end(),
                                     [](Index i) { return i < 0; });
  if (!any_fixed) return;
  ++counts_.gradient;
  if (!ask([&] { return problem_.gradient(result.v, true, model_gradient_); })) return;
  counts_.jacobian += model_jacobian_.empty() ? 0 : 1;
  if (!model_jacobian_.empty() &&
      !ask([&] { return problem_.jacobian(result.v, false, model_jacobian_); }))
    return;
  for (const auto k : indices(structure_.jacobian)) {
    const auto [row, col] = structure_.jacobian[k];
    model_gradient_[col] += model_jacobian_[k] * result.lambda[at(row)];
  }
  for (const auto i : indices(map_.variable_of_model)) {
    // Where the derivative does not exist there is no multiplier.
    if (map_.variable_of_model[i] >= 0 || !std::isfinite(model_gradient_[i])) continue;
    set_fixed_multiplier(static_cast<Index>(i), model_gradient_[i], result);
  }
}

void CanonicalProblem::set_fixed_multiplier(Index model_variable, double slope,
                                            Result& result) const {
  // z_L - z_U = slope, on the side that gives the owner's sign.
  const auto i = at(model_variable);
  const double sign = structure_.variable_players[i] == Player::Max ? -1.0 : 1.0;
  result.z_lower[i] = sign * std::max(sign * slope, 0.0);
  result.z_upper[i] = sign * std::max(-sign * slope, 0.0);
}

}  // namespace ipminmax
