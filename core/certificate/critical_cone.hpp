#pragma once

#include <optional>
#include <vector>

#include "core/certificate/active_set.hpp"

namespace ipminmax {

/// Where k bounds and inequalities of a player are weakly active, d is a critical direction when it
/// leads into each of them by t >= 0 and stays tangent to the other active constraints. The least
/// d'Wd, y answering, is then t'Ct; of Max -d'Wd with x held.
struct CriticalCone {
  Eigen::MatrixXd curvature;                ///< C, k x k, in units
  std::vector<Eigen::VectorXd> directions;  ///< d for t a unit vector, in units, slacks included
};

/// The system assembled with all doubtful bounds fixed, K (of Max: K_yy) factorized and right;
/// added: what its diagonal has more than W, per canonical variable. Empty: a system could not be
/// solved accurately, or there are too many doubtful bounds.
[[nodiscard]] std::optional<CriticalCone> critical_cone(ActiveSetSystem& system,
                                                        const Eigen::VectorXd& added,
                                                        Player owner = Player::Min);

}  // namespace ipminmax
