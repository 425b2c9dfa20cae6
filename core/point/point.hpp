#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "core/model/canonical_problem.hpp"
#include "core/model/iterate.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// Step of zeros in the shapes of the problem.
[[nodiscard]] Step zero_step(const CanonicalProblem& canonical);
/// The same in a step that is there.
void set_zero(const CanonicalProblem& canonical, Step& step);
void set_zero(Step& step);

struct StepLength {
  double primal = 1.0;  ///< of v and lambda
  double dual = 1.0;    ///< of z_lower and z_upper
};

/// How far lambda of inequalities goes.
enum class InequalityLength : std::uint8_t {
  Primal,  ///< as v and all lambda: Ipopt's alpha_for_y primal
  Dual     ///< as the multipliers of the slack's bounds: the slack stays stationary
};

/// Largest steps in (0, 1] that keep at least (1 - tau) of every distance to a bound and of every
/// bound multiplier.
[[nodiscard]] StepLength largest_step(const CanonicalProblem& canonical, const Iterate& iterate,
                                      const Step& step, double tau);

/// iterate += alpha step; v stays where the step changes it by its rounding alone.
void advance(const CanonicalProblem& canonical, const Step& step, StepLength alpha,
             Iterate& iterate, InequalityLength inequalities = InequalityLength::Primal);

/// Keeps bound multipliers within [mu / (kappa s), kappa mu / s], s the distance to the bound:
/// Waechter and Biegler 2006, eq. (16).
void clip_bound_multipliers(const CanonicalProblem& canonical, double mu, double kappa,
                            Iterate& iterate);

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
