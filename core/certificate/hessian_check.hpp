#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "core/certificate/units.hpp"
#include "core/differences/directional_check.hpp"
#include "core/kkt/system.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// Factors, and what of the point's variables may move.
struct CurvatureTrial {
  const Units& units;
  const Evaluation* assembled;         ///< the factorized matrices' derivatives; null: none are
  bool in_units = true;                ///< whether those are in units
  std::function<bool(Index)> is_held;  ///< variables at active bounds, and slacks
};

/// Little curvature of the two matrices, by two inverse iterations each: an upper estimate of the
/// least, in units (no entry of W_yy exceeds 1, nor does one of W_xx).
struct LittleCurvature {
  Eigen::VectorXd direction;  ///< canonical lengths; with a generic part, so that all of W counts
  double least = 1.0;
  Index variable = -1;  ///< canonical, the one that moves most along the least; -1: no factors
};
/// What the following work with, kept from call to call.
struct CurvatureArrays {
  LittleCurvature found;
  NewtonResidual rhs;
  Step solution;
  Eigen::VectorXd step;
  Eigen::ArrayXd largest;
  std::vector<bool> held;
  DifferenceArrays differences;
};
/// In arrays.found.
void find_little_curvature(const CanonicalProblem& canonical, KktSystem& kkt,
                           const CurvatureTrial& trial, CurvatureArrays& arrays);

/// A certificate is a statement about W, so W is compared with a difference of gradients along the
/// direction of little curvature, to a tenth of it. The row of W that disagrees; empty: none, or
/// the model is undefined on both sides of the point. lambda: for which W was evaluated. arrays:
/// after find_little_curvature.
[[nodiscard]] std::optional<Deviation> find_wrong_row(CanonicalProblem& canonical,
                                                      const Point& point,
                                                      const Eigen::VectorXd& lambda,
                                                      const Units& units, CurvatureArrays& arrays);

}  // namespace ipminmax
