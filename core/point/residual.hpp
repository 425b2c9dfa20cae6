#pragma once

#include "core/model/canonical_problem.hpp"
#include "core/model/iterate.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// What of a BarrierError is the same for every mu.
struct ErrorParts {
  double primal = 0.0;
  double dual_min = 0.0;
  double dual_max = 0.0;
  double s_d = 1.0, s_c = 1.0;  ///< of Waechter and Biegler 2006, eq. (5)
};

/// A point with everything that the method reads there.
struct Point {
  Iterate iterate;
  Evaluation evaluation;
  Eigen::VectorXd dual;                  ///< gradient of the Lagrangian, see renew_dual
  KktError error = KktError::unknown();  ///< where measured
  ErrorParts parts{};                    ///< of the error, where measured
};

/// dual = grad f + J' lambda + sign (z_upper - z_lower), sign = +1 for Min and -1 for Max.
void renew_dual(const CanonicalProblem& canonical, Point& point);

/// Largest entry of dual in Max's variables, of copies that of their own rows' Lagrangian.
[[nodiscard]] double max_error(const CanonicalProblem& canonical, const Point& point);

/// Errors of the first-order conditions of the barrier problem with parameter mu (the paper's
/// g(z, b)), in canonical units.
struct BarrierError {
  double primal = 0.0;
  double dual_min = 0.0;
  double dual_max = 0.0;
  double complementarity = 0.0;
  double scaled = 0.0;  ///< Ipopt's E_mu
  /// |g(z, b)|_inf of the paper.
  [[nodiscard]] double norm() const;
};
[[nodiscard]] ErrorParts error_parts(const CanonicalProblem& canonical, const Point& point,
                                     double s_max);
/// Of a point that has its dual.
[[nodiscard]] BarrierError barrier_error(const CanonicalProblem& canonical, const Point& point,
                                         double mu, double s_max);
/// The same of a point that has been measured where it is now.
[[nodiscard]] BarrierError measured_barrier_error(const CanonicalProblem& canonical,
                                                  const Point& point, double mu);

/// Errors of a point with its parts at mu in the model's units, total in canonical units.
[[nodiscard]] KktError kkt_error(const CanonicalProblem& canonical, const Point& point, double mu);

/// Right-hand side -g(z, mu) of the Newton system, damping included.
void newton_residual(const CanonicalProblem& canonical, const Point& point, double mu,
                     NewtonResidual& rhs);

/// The Jacobian of the Newton system where there are copies. A copy's multipliers are weight times
/// those of its own row's maximum, (lambda~, z~), and its equations, over weight, are
///
///     g_y + J_yy' lambda~ + z~_lower - z~_upper = 0,  c_y = 0,  distances z~ = mu
///
/// whatever lambda_r is. With weight d(lambda~), weight d(z~) for their steps lambda_r drops out of
/// them, and what it does to x's rows is by the gradient of the row's own Lagrangian,
/// g_x + lambda~' J_yx. In the row itself the same gradient stands for that of max_y g: y answers x
/// so that the rest is O(mu). Its right-hand side is -c_r - lambda~' c_y.
void row_jacobian(const CanonicalProblem& canonical, const Iterate& iterate,
                  const Evaluation& evaluation, std::vector<double>& jacobian);

}  // namespace ipminmax
