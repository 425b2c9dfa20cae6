#include <algorithm>
#include <cmath>
#include <utility>

#include "core/model/indices.hpp"
#include "core/violations.hpp"

namespace ipminmax {
namespace {

struct Bounds {
  const SolverOptions& options;
  [[nodiscard]] bool has_lower(double bound) const { return bound > options.nlp_lower_bound_inf; }
  [[nodiscard]] bool has_upper(double bound) const { return bound < options.nlp_upper_bound_inf; }
};

/// grad f + J' lambda; false where undefined.
bool add_gradients(Problem& problem, const Result& point, std::vector<double>& sum) {
  const ProblemStructure& s = problem.structure();
  if (!problem.gradient(point.v, true, sum)) return false;
  std::vector<double> jacobian(s.jacobian.size());
  if (!s.constraint_players.empty() && !problem.jacobian(point.v, false, jacobian)) return false;
  for (const auto k : indices(jacobian)) {
    const auto [row, col] = s.jacobian[k];
    sum[static_cast<std::size_t>(col)] += jacobian[k] * point.lambda[static_cast<std::size_t>(row)];
  }
  return true;
}

void add_variables(const ProblemStructure& s, const Result& point, const Bounds& bounds,
                   Violations& found) {
  for (const auto i : indices(point.v)) {
    const double x = point.v[i], lower = s.variable_lower[i], upper = s.variable_upper[i];
    found.lagrangian_gradient[i] += point.z_upper[i] - point.z_lower[i];
    const bool below = bounds.has_lower(lower), above = bounds.has_upper(upper);
    if (below) found.lower_bound[i] = std::max(lower - x, 0.0);
    if (above) found.upper_bound[i] = std::max(x - upper, 0.0);
    if (lower == upper) continue;
    if (below) found.lower_complementarity[i] = (x - lower) * point.z_lower[i];
    if (above) found.upper_complementarity[i] = (upper - x) * point.z_upper[i];
  }
}

/// sense: the sign of the factor of the multipliers.
void add_constraints(const ProblemStructure& s, const Result& point, const Bounds& bounds,
                     double sense, Violations& found) {
  for (const auto j : indices(point.constraints)) {
    const double g = point.constraints[j], lambda = point.lambda[j];
    const double lower = s.constraint_lower[j], upper = s.constraint_upper[j];
    const bool below = bounds.has_lower(lower), above = bounds.has_upper(upper);
    if (below) found.constraint[j] = std::max(lower - g, 0.0);
    if (above) found.constraint[j] = std::max(found.constraint[j], g - upper);
    if (lambda == 0.0) continue;
    const bool of_min = s.constraint_players[j] == Player::Min;
    const bool presses_up = (lambda * sense > 0.0) == of_min;
    double& product = found.constraint_complementarity[j];
    if (presses_up && above) product = (upper - g) * lambda;
    if (!presses_up && below) product = (g - lower) * -lambda;
  }
}

void scale(const UserScaling& factors, Violations& found) {
  const double f = factors.objective;
  for (const auto i : indices(factors.variables)) {
    const double x = factors.variables[i];
    found.lower_bound[i] *= x;
    found.upper_bound[i] *= x;
    found.lower_complementarity[i] *= f;  // the factors of x and of its multiplier cancel
    found.upper_complementarity[i] *= f;
    found.lagrangian_gradient[i] *= f / x;
  }
  for (const auto j : indices(factors.constraints)) {
    found.constraint[j] *= factors.constraints[j];
    found.constraint_complementarity[j] *= f;
  }
}

}  // namespace

void scale(const ProblemStructure& structure, const UserScaling& factors, Result& point) {
  const double f = factors.objective;
  for (const auto i : indices(point.v)) {
    const double x = factors.variables[i];
    point.v[i] *= x;
    // Of the multipliers of a fixed variable the one with the owner's sign is not zero.
    const bool fixed = structure.variable_lower[i] == structure.variable_upper[i];
    if (fixed && f < 0.0) std::swap(point.z_lower[i], point.z_upper[i]);
    point.z_lower[i] *= (fixed ? std::abs(f) : f) / x;
    point.z_upper[i] *= (fixed ? std::abs(f) : f) / x;
  }
  for (const auto j : indices(point.lambda)) {
    point.constraints[j] *= factors.constraints[j];
    point.lambda[j] *= f / factors.constraints[j];
  }
}

std::optional<Violations> violations_at(Problem& problem, const Result& point,
                                        const SolverOptions& options, const UserScaling* factors) {
  const ProblemStructure& s = problem.structure();
  const std::size_t n = s.variable_players.size();
  const std::size_t m = s.constraint_players.size();
  Violations found;
  for (auto* values : {&found.lower_bound, &found.upper_bound, &found.lower_complementarity,
                       &found.upper_complementarity, &found.lagrangian_gradient}) {
    values->assign(n, 0.0);
  }
  found.constraint.assign(m, 0.0);
  found.constraint_complementarity.assign(m, 0.0);
  if (!add_gradients(problem, point, found.lagrangian_gradient)) return std::nullopt;
  const Bounds bounds{options};
  add_variables(s, point, bounds, found);
  add_constraints(s, point, bounds, factors != nullptr ? factors->objective : 1.0, found);
  if (factors != nullptr) scale(*factors, found);
  return found;
}

}  // namespace ipminmax
