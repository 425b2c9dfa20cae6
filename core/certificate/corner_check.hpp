#pragma once

#include "core/certificate/bound_classes.hpp"

namespace ipminmax {

/// What the check works with, kept from one to the next.
struct CornerArrays {
  Eigen::VectorXd here, there;  ///< gradients of the Lagrangian
  Eigen::VectorXd balanced, step, predicted, longest;
};

/// At a vertex no curvature shows where gradients jump, so these are compared with what W predicts
/// a small step inside the active bounds and inequalities of each player of a game who has no free
/// variable, in two directions. One gradient and Jacobian for each of them.
///
/// Returns a variable whose gradient no longer has the sign that its multipliers balance, or -1.
/// scratch: of the model's sizes, values are overwritten.
[[nodiscard]] Index multiplier_lost_inside(CanonicalProblem& canonical, const Point& point,
                                           const BoundClasses& classes, const Units& units,
                                           const SolverOptions& options, Evaluation& scratch,
                                           CornerArrays& arrays);

}  // namespace ipminmax
