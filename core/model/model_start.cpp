#include "core/model/model_start.hpp"

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

}  // namespace ipminmax
