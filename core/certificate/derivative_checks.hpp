#pragma once

#include <optional>
#include <vector>

#include "core/certificate/active_set.hpp"
#include "core/differences/directional_check.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// Little curvature of the two matrices, by two inverse iterations each: an upper estimate of the
/// least, scaled (no entry of W_yy exceeds 1, nor does one of W_xx).
struct LittleCurvature {
  Vector direction;  ///< canonical lengths; with a generic part, so that all of W counts
  double least = 1.0;
  Index variable = -1;  ///< canonical, the one that moves most along the least; -1: no factors
};
/// What the following work with, kept from call to call.
struct CurvatureArrays {
  LittleCurvature found;
  NewtonResidual rhs;
  Step solution;
  Vector step;
  Eigen::ArrayXd largest;
  std::vector<bool> held;  ///< variables at active bounds, and slacks
  DifferenceArrays differences;
};
/// In arrays.found. The matrices were factorized; assembled: their derivatives; null: there are no
/// factors. is_scaled: whether those are.
void find_little_curvature(const CanonicalProblem& canonical, KktSystem& kkt,
                           const VariableScaling& scaling, const Evaluation* assembled,
                           bool is_scaled, CurvatureArrays& arrays);

/// A certificate is a statement about W, so W is compared with a difference of gradients along the
/// direction of little curvature, to a tenth of it. The row of W that disagrees; empty: none, or
/// the model is undefined on both sides of the point. lambda: for which W was evaluated. arrays:
/// after find_little_curvature.
[[nodiscard]] std::optional<Deviation> find_wrong_row(CanonicalProblem& canonical,
                                                      const Point& point, const Vector& lambda,
                                                      const VariableScaling& scaling,
                                                      CurvatureArrays& arrays);

/// What the check of a vertex works with, kept from one to the next.
struct CornerArrays {
  Vector here, there;  ///< gradients of the Lagrangian
  Vector balanced, step, predicted, longest;
};

}  // namespace ipminmax
