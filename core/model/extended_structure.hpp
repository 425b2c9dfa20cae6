#pragma once

#include <string>

#include "core/problem.hpp"

namespace ipminmax {

/// Adds a variable to the structure of a model that is extended; the name is used where the others
/// have one. Returns its index.
inline Index add_variable(ProblemStructure& s, Player player, double lower, double upper,
                          std::string name) {
  if (!s.variable_names.empty()) s.variable_names.push_back(std::move(name));
  s.variable_players.push_back(player);
  s.variable_lower.push_back(lower);
  s.variable_upper.push_back(upper);
  return static_cast<Index>(s.variable_players.size()) - 1;
}

/// The same with a constraint, still without entries.
inline Index add_constraint(ProblemStructure& s, Player player, double lower, double upper,
                            std::string name) {
  if (!s.constraint_names.empty()) s.constraint_names.push_back(std::move(name));
  s.constraint_players.push_back(player);
  s.constraint_lower.push_back(lower);
  s.constraint_upper.push_back(upper);
  return static_cast<Index>(s.constraint_players.size()) - 1;
}

}  // namespace ipminmax
