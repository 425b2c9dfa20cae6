#pragma once

#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "core/problem.hpp"

namespace ipminmax {

/// How messages call what is added to a model.
struct Label {
  Index number = -1;  ///< index in the model, -1: none
  std::string name;
};

/// Adds the label of the element with index size.
inline void add_label(std::vector<std::string>& names, std::vector<Index>& numbers,
                      std::size_t size, Label label) {
  names.resize(size);
  names.push_back(std::move(label.name));
  if (numbers.empty()) {
    numbers.resize(size);
    std::iota(numbers.begin(), numbers.end(), 0);
  }
  numbers.push_back(label.number);
}

/// Adds a variable to the structure of a model that is extended. Returns its index.
inline Index add_variable(ProblemStructure& s, Player player, double lower, double upper,
                          Label label) {
  add_label(s.variable_names, s.variable_numbers, s.variable_players.size(), std::move(label));
  s.variable_players.push_back(player);
  s.variable_lower.push_back(lower);
  s.variable_upper.push_back(upper);
  return static_cast<Index>(s.variable_players.size()) - 1;
}

/// The same with a constraint, still without entries.
inline Index add_constraint(ProblemStructure& s, Player player, double lower, double upper,
                            Label label) {
  add_label(s.constraint_names, s.constraint_numbers, s.constraint_players.size(),
            std::move(label));
  s.constraint_players.push_back(player);
  s.constraint_lower.push_back(lower);
  s.constraint_upper.push_back(upper);
  return static_cast<Index>(s.constraint_players.size()) - 1;
}

}  // namespace ipminmax
