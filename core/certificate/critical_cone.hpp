#pragma once

#include <optional>

#include "core/certificate/active_set.hpp"

namespace ipminmax {

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
