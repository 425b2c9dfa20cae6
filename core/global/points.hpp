#pragma once

#include <cmath>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/problem.hpp"

namespace ipminmax {

/// Points of a model, or of one player in it: as many values each.
using Points = std::vector<std::vector<double>>;

/// Throws std::invalid_argument if v, which the message calls `what`, has not n values.
inline void require_size(const std::string& what, const ProblemStructure& s,
                         std::span<const double> v) {
  const std::size_t n = s.variable_players.size();
  if (v.size() != n) {
    throw std::invalid_argument(what + " has " + std::to_string(v.size()) + " values for " +
                                std::to_string(n) + " variables");
  }
}

/// The same if they are not finite.
inline void require_point(const std::string& what, const ProblemStructure& s,
                          std::span<const double> v) {
  require_size(what, s, v);
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (!std::isfinite(v[i]))
      throw std::invalid_argument(what + " is not finite in variable " + std::to_string(i));
  }
}

}  // namespace ipminmax
