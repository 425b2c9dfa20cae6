#pragma once

#include <Eigen/Core>

#include "core/model/canonical_problem.hpp"
#include "core/model/iterate.hpp"
#include "core/point/residual.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// A point at the iterate with room for its functions, all zero.
[[nodiscard]] Point unevaluated_point(const CanonicalProblem& canonical, const Iterate& iterate);
/// The same in a point that is there.
void begin_at(const CanonicalProblem& canonical, const Iterate& iterate, Point& point);

/// Objective and constraints at the point.
[[nodiscard]] bool evaluate_values(CanonicalProblem& canonical, Point& point);
/// First derivatives at the point, and dual with them.
[[nodiscard]] bool evaluate_first_derivatives(CanonicalProblem& canonical, Point& point);
[[nodiscard]] bool evaluate_second_derivatives(CanonicalProblem& canonical, Point& point);
/// First and second derivatives at the point, and dual with them.
[[nodiscard]] bool evaluate_derivatives(CanonicalProblem& canonical, Point& point);
/// Values and first derivatives at the point, and dual with them; NaN what is undefined there.
void evaluate_where_defined(CanonicalProblem& canonical, Point& point);

/// Renews error from the functions at the point and its dual.
void measure(const CanonicalProblem& canonical, const SolverOptions& options, Point& point);

/// Renews dual first, where multipliers are not those that it was made of.
void measure_anew(const CanonicalProblem& canonical, const SolverOptions& options, Point& point);

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
