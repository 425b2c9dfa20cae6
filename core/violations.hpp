#pragma once

#include <optional>
#include <vector>

#include "options.hpp"
#include "problem.hpp"
#include "result.hpp"

namespace IPMINMAX_API ipminmax {

/// By how much a point violates the first-order conditions, entry by entry, in the model's units
/// and order. An entry without a bound is zero.
struct Violations {
  std::vector<double> lower_bound;            ///< n, max(x_L - x, 0)
  std::vector<double> upper_bound;            ///< n, max(x - x_U, 0)
  std::vector<double> lower_complementarity;  ///< n, (x - x_L) z_L; 0 for a fixed variable
  std::vector<double> upper_complementarity;  ///< n, (x_U - x) z_U; 0 for a fixed variable
  std::vector<double> lagrangian_gradient;    ///< n, grad f + J' lambda - z_L + z_U
  std::vector<double> constraint;             ///< m, max(g_L - g, g - g_U, 0)
  /// m, (g_U - g) lambda if lambda presses against g_U (positive for a constraint of Min, negative
  /// for one of Max), else (g_L - g) lambda; (c - g) lambda for an equation g = c. This is Ipopt's
  /// convention. If Result::objective_scale is negative, the signs of lambda and so the sides are
  /// reversed, as in Ipopt.
  std::vector<double> constraint_complementarity;
};

/// Converts a point (v, constraints, lambda, z_lower, z_upper) to the units of the solve. factors:
/// what IterationInfo::scaling writes.
void scale(const ProblemStructure& structure, const UserScaling& factors, Result& point);

/// Returns the violations at the point of a result (v, lambda, z_lower, z_upper, constraints, not
/// scaled). Evaluates gradient and Jacobian; returns nothing if one is undefined there. factors: to
/// get the violations in the units of the solve; null: in the model's.
[[nodiscard]] std::optional<Violations> violations_at(Problem& problem, const Result& point,
                                                      const SolverOptions& options,
                                                      const UserScaling* factors = nullptr);

}  // namespace ipminmax
