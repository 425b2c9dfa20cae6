#include <algorithm>

#include "core/violations.hpp"

namespace ipminmax {

std::optional<Violations> violations_at(Problem& problem, const Result& point,
                                        const SolverOptions& options) {
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

  if (!problem.gradient(point.v, true, found.lagrangian_gradient)) return std::nullopt;
  std::vector<double> jacobian(s.jacobian.size());
  if (m > 0 && !problem.jacobian(point.v, false, jacobian)) return std::nullopt;
  for (std::size_t k = 0; k < jacobian.size(); ++k) {
    const auto [row, col] = s.jacobian[k];
    found.lagrangian_gradient[static_cast<std::size_t>(col)] +=
        jacobian[k] * point.lambda[static_cast<std::size_t>(row)];
  }
  const auto has_lower = [&](double bound) { return bound > options.nlp_lower_bound_inf; };
  const auto has_upper = [&](double bound) { return bound < options.nlp_upper_bound_inf; };
  for (std::size_t i = 0; i < n; ++i) {
    const double x = point.v[i], lower = s.variable_lower[i], upper = s.variable_upper[i];
    found.lagrangian_gradient[i] += point.z_upper[i] - point.z_lower[i];
    if (has_lower(lower)) found.lower_bound[i] = std::max(lower - x, 0.0);
    if (has_upper(upper)) found.upper_bound[i] = std::max(x - upper, 0.0);
    if (lower == upper) continue;
    if (has_lower(lower)) found.lower_complementarity[i] = (x - lower) * point.z_lower[i];
    if (has_upper(upper)) found.upper_complementarity[i] = (upper - x) * point.z_upper[i];
  }
  for (std::size_t j = 0; j < m; ++j) {
    const double g = point.constraints[j];
    const double lower = s.constraint_lower[j], upper = s.constraint_upper[j];
    const bool below = has_lower(lower), above = has_upper(upper);
    if (below) found.constraint[j] = std::max(lower - g, 0.0);
    if (above) found.constraint[j] = std::max(found.constraint[j], g - upper);
    const double lambda = point.lambda[j];
    const bool minimized =
        (s.constraint_players[j] == Player::Min) == (point.objective_scale > 0.0);
    const bool presses_up = (lambda > 0.0) == minimized;
    double& product = found.constraint_complementarity[j];
    if (lambda == 0.0) continue;
    if (presses_up && above) product = (upper - g) * lambda;
    if (!presses_up && below) product = (g - lower) * -lambda;
  }
  return found;
}

}  // namespace ipminmax
