#pragma once

#include <optional>

#include "core/certificate/active_set.hpp"

namespace ipminmax {

/// Inertias of the two matrices, and how much a system with each amplifies a generic right-hand
/// side: moderate numbers show that the gradients of the equalities are independent.
struct InertiaTest {
  bool inner = false;
  bool full = false;
  double inner_response = 0.0;
  double full_response = 0.0;
  [[nodiscard]] bool both() const { return inner && full; }
};

/// Whether the inertias are right for every Hessian within the error and with the margin taken away
/// from both players' curvature, doubtful bounds at their worst: the sufficient conditions hold. K
/// is left factorized with the margin in it (and the error, if there is one). proximal: taken from
/// the curvature of all of Max's variables besides, as of f - proximal |y - y*|^2 / 2.
[[nodiscard]] InertiaTest survives(ActiveSetSystem& system, const Eigen::VectorXd& error,
                                   double margin, double proximal = 0.0);
/// The same with K from another system, in which Max has fewer answers: phi is at least what these
/// give.
[[nodiscard]] InertiaTest survives_narrowed(ActiveSetSystem& system, ActiveSetSystem& narrow,
                                            const Eigen::VectorXd& error, double margin);
/// K_yy alone.
[[nodiscard]] InertiaTest inner_survives(ActiveSetSystem& system, const Eigen::VectorXd& error,
                                         double margin, double proximal = 0.0);
/// Whether the inertias are right for some Hessian within the error with the margin given to both,
/// doubtful bounds at their best and constraints relaxed by multiplier_shift: else the necessary
/// conditions are violated. inner_right: that of K_yy is known to be.
[[nodiscard]] InertiaTest helped(ActiveSetSystem& system, const Eigen::VectorXd& error,
                                 double margin, double multiplier_shift, bool inner_right);

/// Least t'Ct over t >= 0 with |t| = 1 in units in which C's diagonal is one; t: where. A clearly
/// negative diagonal entry: -1; one that is nothing: 0. All faces are looked at [Kaplan 2000].
[[nodiscard]] double least_over_cone(const Eigen::MatrixXd& matrix, Eigen::VectorXd& t);

/// The least curvature over a cone of directions.
struct LeastInCone {
  double least = 0.0;         ///< over the curvature along its edges
  Eigen::VectorXd direction;  ///< where it is attained, in units, slacks included
};

/// Where bounds and inequalities of a player are weakly active, d is a critical direction when it
/// leads into each of them by t >= 0 and stays tangent to the other active constraints. The least
/// d'Wd, the others answering, is t'Ct; of Max -d'Wd with x held.
///
/// The system assembled with all doubtful bounds fixed, K (of Max: K_yy) factorized and right;
/// added: what its diagonal has more than W, per canonical variable. Empty: a system could not be
/// solved accurately, or the faces are too many.
[[nodiscard]] std::optional<LeastInCone> least_in_cone(ActiveSetSystem& system,
                                                       const Eigen::VectorXd& added,
                                                       Player owner = Player::Min);

}  // namespace ipminmax
