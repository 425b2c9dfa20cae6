#pragma once

#include "core/method/filter.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/point/iterate.hpp"

namespace ipminmax {

/// A point with everything that the method reads there.
struct Point {
  Iterate iterate;
  Evaluation evaluation;
  Eigen::VectorXd dual;  ///< gradient of the Lagrangian, see dual_residual
};

/// Values and first derivatives at the point, and dual with them; NaN what is undefined there.
void evaluate_where_defined(CanonicalProblem& canonical, Point& point);

/// f - mu sum ln(Min distances to bounds) + mu sum ln(Max distances to bounds), damping included.
[[nodiscard]] double barrier_objective(const CanonicalProblem& canonical, const Eigen::VectorXd& v,
                                       double f, double mu);

/// Gradient of the barrier objective.
void barrier_gradient(const CanonicalProblem& canonical, const Point& point, double mu,
                      Eigen::VectorXd& gradient);

/// 1-norm of the constraints in a range.
[[nodiscard]] double violation(const Eigen::VectorXd& c, IndexRange constraints);

}  // namespace ipminmax
