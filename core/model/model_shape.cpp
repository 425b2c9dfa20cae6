#include <cstddef>

#include "core/model/model_shape.hpp"

namespace ipminmax {
namespace {

/// Player and kind of bounds.
std::uint8_t kind_of(Player player, double lower, double upper, const SolverOptions& options) {
  enum : unsigned { kMax = 1, kLower = 2, kUpper = 4, kEqual = 8 };
  unsigned kind = 0;
  if (player == Player::Max) kind |= kMax;
  if (lower > options.nlp_lower_bound_inf) kind |= kLower;
  if (upper < options.nlp_upper_bound_inf) kind |= kUpper;
  if (lower == upper) kind |= kEqual;
  return static_cast<std::uint8_t>(kind);
}

std::vector<std::uint8_t> kinds(const std::vector<Player>& players,
                                const std::vector<double>& lower, const std::vector<double>& upper,
                                const SolverOptions& options) {
  std::vector<std::uint8_t> result(players.size());
  for (std::size_t i = 0; i < players.size(); ++i) {
    result[i] = kind_of(players[i], lower[i], upper[i], options);
  }
  return result;
}

bool are_kinds(const std::vector<std::uint8_t>& kinds, const std::vector<Player>& players,
               const std::vector<double>& lower, const std::vector<double>& upper,
               const SolverOptions& options) {
  if (kinds.size() != players.size()) return false;
  for (std::size_t i = 0; i < players.size(); ++i) {
    if (kinds[i] != kind_of(players[i], lower[i], upper[i], options)) return false;
  }
  return true;
}

}  // namespace

bool has_shape(const ProblemStructure& s, const SolverOptions& options, const ModelShape& shape) {
  return are_kinds(shape.variables, s.variable_players, s.variable_lower, s.variable_upper,
                   options) &&
         are_kinds(shape.constraints, s.constraint_players, s.constraint_lower, s.constraint_upper,
                   options) &&
         shape.jacobian == s.jacobian && shape.hessian == s.hessian &&
         shape.fixed_variable_treatment == options.fixed_variable_treatment;
}

ModelShape shape_of(const ProblemStructure& s, const SolverOptions& options) {
  return {
      .variables = kinds(s.variable_players, s.variable_lower, s.variable_upper, options),
      .constraints = kinds(s.constraint_players, s.constraint_lower, s.constraint_upper, options),
      .jacobian = s.jacobian,
      .hessian = s.hessian,
      .fixed_variable_treatment = options.fixed_variable_treatment};
}

}  // namespace ipminmax
