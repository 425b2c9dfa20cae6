#pragma once

#include <vector>

#include "core/certificate/active_set.hpp"
#include "core/point/point.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// Copies of y that serve inactive robust constraints (CanonicalProblem::owners): where they stand
/// does not matter to x, and they have no curvature of their own (lambda_r goes to 0). In the test
/// they are held, and Max's rows on them left out.
struct InactiveCopies {
  std::vector<Index> variables;
  std::vector<bool> rows;  ///< per canonical constraint, or empty
};
[[nodiscard]] InactiveCopies inactive_copies(const CanonicalProblem& canonical,
                                             const Iterate& iterate,
                                             const VariableScaling& scaling);

/// Second-order test of the robust constraints at a point whose K_yy, over (y, lambda_y), is right:
/// is K_yy with their rows right too, In = (m_y, n_y + m_r, 0)?
///
/// Eliminating y leaves -(D - T) on the rows lambda_r, D = s / z of their slacks and T_rs = -J_r
/// K_yy^-1 J_s', so that D - T must be positive definite. T vanishes where each active constraint
/// is stationary in its own y. Where it exceeds D, Max can violate the constraint at second order
/// for a gain of first: Violated. Inactive constraints are left out. The inactive copies are held.
/// set: of the bounds at the solution.
/// proximal: curvature taken from Max's, per canonical variable, or empty. The KKT matrices are
/// left at other values.
[[nodiscard]] SecondOrder test_robust_rows(const CanonicalProblem& canonical, KktSystem& kkt,
                                           const Point& point, const ActiveBounds& set,
                                           const VariableScaling& scaling,
                                           const std::vector<Index>& inactive,
                                           const Eigen::VectorXd& proximal);

}  // namespace ipminmax
