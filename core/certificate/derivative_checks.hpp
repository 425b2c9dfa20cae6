#pragma once

#include <vector>

#include "core/certificate/active_set.hpp"
#include "core/differences/directional_check.hpp"

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
/// Work arrays of the check of a vertex.
struct CornerArrays {
  Vector here, there;  ///< gradients of the Lagrangian
  Vector balanced, step, predicted, longest;
};

}  // namespace ipminmax
