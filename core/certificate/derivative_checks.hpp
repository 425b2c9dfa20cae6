#pragma once

#include <optional>
#include <vector>

#include "core/certificate/active_set.hpp"
#include "core/differences/directional_check.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// Direction of little curvature of both matrices, by two inverse iterations each, and an upper
/// estimate of the least curvature, scaled.
struct LittleCurvature {
  Vector direction;  ///< canonical lengths; with a generic part, so that errors of all rows show
  double least = 1.0;
  Index variable = -1;  ///< canonical, the one that moves most along the least; -1: no factors
};
/// Work arrays of the following functions, kept from call to call.
struct CurvatureArrays {
  LittleCurvature found;
  NewtonResidual rhs;
  Step solution;
  Vector step;
  Eigen::ArrayXd largest;
  std::vector<bool> held;  ///< variables at active bounds, and slacks
  DifferenceArrays differences;
};
/// Writes arrays.found. assembled: derivatives in the factorized matrices; null: there are no
/// factors. is_scaled: whether these derivatives are scaled.
void find_little_curvature(const CanonicalProblem& canonical, KktSystem& kkt,
                           const VariableScaling& scaling, const Evaluation* assembled,
                           bool is_scaled, CurvatureArrays& arrays);

/// Compares W with a difference of gradients along the direction of little curvature, to a tenth of
/// that curvature. Returns the row of W that disagrees most; empty: none, or the model is undefined
/// on both sides of the point. lambda: for which W was evaluated. arrays: after
/// find_little_curvature.
[[nodiscard]] std::optional<Deviation> find_wrong_row(CanonicalProblem& canonical,
                                                      const Point& point, const Vector& lambda,
                                                      const VariableScaling& scaling,
                                                      CurvatureArrays& arrays);

/// Work arrays of the check of a vertex.
struct CornerArrays {
  Vector here, there;  ///< gradients of the Lagrangian
  Vector balanced, step, predicted, longest;
};

}  // namespace ipminmax
