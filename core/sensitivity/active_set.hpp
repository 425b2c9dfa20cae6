#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"
#include "core/sensitivity.hpp"

namespace ipminmax {

/// What holds a variable or constraint.
enum class Hold : std::uint8_t {
  Free,   ///< nothing: a free variable, an inactive or absent constraint
  Lower,  ///< its lower bound
  Upper,
  Fixed  ///< equal bounds; a variable held from outside
};

struct ActiveSet {
  std::vector<Hold> variables;    ///< n
  std::vector<Hold> constraints;  ///< m
  friend bool operator==(const ActiveSet&, const ActiveSet&) = default;
};

/// Bounds with absent ones at infinity.
struct Bounds {
  std::vector<double> variable_lower, variable_upper;      ///< n
  std::vector<double> constraint_lower, constraint_upper;  ///< m
};
[[nodiscard]] Bounds bounds_of(const ProblemStructure& structure, const SolverOptions& options);

/// +1 for Min, -1 for Max: times this, multipliers of lower bounds (z_lower, -lambda) and of upper
/// ones (z_upper, lambda) are >= 0.
[[nodiscard]] inline double sign_of(Player player) { return player == Player::Min ? 1.0 : -1.0; }

/// The active set of a solution: a bound is active where its multiplier, over max(1, |grad f|),
/// exceeds the distance to it. weak: names of those where neither dominates.
/// reduced_gradient: grad f + J'lambda (n).
[[nodiscard]] ActiveSet active_set_of(const ProblemStructure& structure, const Bounds& bounds,
                                      const Result& result,
                                      const std::vector<double>& reduced_gradient,
                                      double gradient_norm, std::vector<std::string>& weak);

/// "variable 3", or the model's name for it.
[[nodiscard]] std::string place_name(const ProblemStructure& structure, bool of_constraint,
                                     Index index);

}  // namespace ipminmax
