#include "core/model/initial_point.hpp"

#include <algorithm>

namespace ipminmax {

std::optional<std::vector<double>> model_start(Problem& model) {
  const std::size_t n = model.structure().variable_players.size();
  const std::size_t m = model.structure().constraint_players.size();
  // Models that do not look whether multipliers are wanted write them all the same.
  std::vector<double> v(n), lambda(m), z_lower(n), z_upper(n);
  StartingPoint start{
      .v = v, .needs_multipliers = false, .lambda = lambda, .z_lower = z_lower, .z_upper = z_upper};
  if (!model.starting_point(start)) return std::nullopt;
  return v;
}

void start_bound_multipliers(const CanonicalProblem& canonical, const SolverOptions& options,
                             Iterate& start) {
  const auto first = [&](double given, double distance) {
    if (options.warm_start_init_point) {
      return std::clamp(
          given, options.warm_start_mult_bound_push,
          std::max(options.warm_start_mult_init_max, options.warm_start_mult_bound_push));
    }
    return options.bound_mult_init_method == BoundMultiplierInit::MuBased
               ? options.mu_init / distance
               : options.bound_mult_init_val;
  };
  for_each_bound(canonical, start.v, [&](Index i, int side, double distance) {
    multiplier_of(start, i, side) = first(multiplier_of(start, i, side), distance);
  });
  if (!options.warm_start_init_point) weigh_copies(canonical, start);
}

void weigh_copies(const CanonicalProblem& canonical, Iterate& start) {
  if (!canonical.has_copies()) return;
  for (Index i = canonical.y().begin; i < canonical.variables(); ++i) {
    const double weight = canonical.weight(i, start);
    start.z_lower[i] *= weight;
    start.z_upper[i] *= weight;
  }
}

void start_robust_multipliers(const CanonicalProblem& canonical, Iterate& start) {
  for (const Index j : canonical.robust_constraints()) {
    const Index slack = canonical.slack_of(j);
    start.lambda[j] = start.z_upper[slack] - start.z_lower[slack];
  }
}

void start_constraint_multipliers(const CanonicalProblem& canonical, const SolverOptions& options,
                                  Iterate& start) {
  start.lambda.setZero(canonical.constraints());
  if (options.bound_mult_init_method != BoundMultiplierInit::MuBased) return;
  for (Index j = 0; j < canonical.constraints(); ++j) {
    const Index slack = canonical.slack_of(j);
    if (slack < 0) continue;
    start.lambda[j] = canonical.sign(slack) * (start.z_upper[slack] - start.z_lower[slack]);
  }
}

}  // namespace ipminmax
