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
/// K_yy alone.
[[nodiscard]] InertiaTest inner_survives(ActiveSetSystem& system, const Eigen::VectorXd& error,
                                         double margin, double proximal = 0.0);
/// Whether the inertias are right for some Hessian within the error with the margin given to both,
/// doubtful bounds at their best and constraints relaxed by multiplier_shift: else the necessary
/// conditions are violated. inner_right: that of K_yy is known to be.
[[nodiscard]] InertiaTest helped(ActiveSetSystem& system, const Eigen::VectorXd& error,
                                 double margin, double multiplier_shift, bool inner_right);

}  // namespace ipminmax
