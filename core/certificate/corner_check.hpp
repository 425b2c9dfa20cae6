#pragma once

#include "core/certificate/bound_classes.hpp"

namespace ipminmax {

/// At a vertex no curvature shows where gradients jump, so these are compared with what W predicts
/// a small step inside the active bounds and inequalities of each player, and of each in two
/// directions. One gradient and Jacobian for each of them; none without active bounds.
///
/// Returns a variable whose gradient no longer has the sign that its multipliers balance, or -1.
/// scratch: of the model's sizes, values are overwritten.
[[nodiscard]] Index multiplier_lost_inside(CanonicalProblem& canonical, const Point& point,
                                           const BoundClasses& classes, const Units& units,
                                           const SolverOptions& options, Evaluation& scratch);

}  // namespace ipminmax
