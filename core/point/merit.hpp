#pragma once

#include "core/model/canonical_problem.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// Violation of a player's constraints (1-norm) and the barrier objective that the player wants
/// small, at one point.
struct Merit {
  double theta = 0.0;
  double phi = 0.0;
};

/// f - mu sum ln(Min distances to bounds) + mu sum ln(Max distances to bounds), damping included,
/// without the copies' distances: these belong to their rows.
[[nodiscard]] double barrier_objective(const CanonicalProblem& canonical, const Eigen::VectorXd& v,
                                       double f, double mu);

/// mu sum ln(copies' distances to bounds).
[[nodiscard]] double barrier_of_copies(const CanonicalProblem& canonical, const Eigen::VectorXd& v,
                                       double mu);

/// Gradient of the two together.
void barrier_gradient(const CanonicalProblem& canonical, const Point& point, double mu,
                      Eigen::VectorXd& gradient);

/// 1-norm of the constraints in a range.
[[nodiscard]] double violation(const Eigen::VectorXd& c, IndexRange constraints);

}  // namespace ipminmax
