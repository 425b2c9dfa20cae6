#include <cstddef>

#include "core/model/model_shape.hpp"

namespace ipminmax {
namespace {

std::vector<std::uint8_t> kinds(const std::vector<Player>& players,
                                const std::vector<double>& lower, const std::vector<double>& upper,
                                const SolverOptions& options) {
  enum : unsigned { kMax = 1, kLower = 2, kUpper = 4, kEqual = 8 };
  std::vector<std::uint8_t> result(players.size());
  for (std::size_t i = 0; i < players.size(); ++i) {
    unsigned kind = 0;
    if (players[i] == Player::Max) kind |= kMax;
    if (lower[i] > options.nlp_lower_bound_inf) kind |= kLower;
    if (upper[i] < options.nlp_upper_bound_inf) kind |= kUpper;
    if (lower[i] == upper[i]) kind |= kEqual;
    result[i] = static_cast<std::uint8_t>(kind);
  }
  return result;
}

}  // namespace

ModelShape shape_of(const ProblemStructure& s, const SolverOptions& options) {
  return {
      .variables = kinds(s.variable_players, s.variable_lower, s.variable_upper, options),
      .constraints = kinds(s.constraint_players, s.constraint_lower, s.constraint_upper, options),
      .jacobian = s.jacobian,
      .hessian = s.hessian,
      .fixed_variable_treatment = options.fixed_variable_treatment};
}

}  // namespace ipminmax
