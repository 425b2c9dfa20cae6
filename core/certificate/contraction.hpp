#pragma once

#include <functional>

#include "core/certificate/active_set.hpp"

namespace ipminmax {

/// What the Newton step to the solution of the active set's equations tells of a point.
struct NewtonTest {
  bool done = false;          ///< the steps could be computed and the model evaluated at the end
  bool classes_hold = false;  ///< multipliers and distances at the end confirm the classes
  /// Step that the curvature of the equations makes necessary at the end, over the step: Newton's
  /// method converges from a point where that is below 1/4 (it is 1/4 for x^3 at 0).
  double contraction = 0.0;
  Eigen::VectorXd error;  ///< per variable, in units: bounds what W changes by on the way, twice
  double step = 0.0;      ///< longest entry of the step, in units
  Point end;              ///< iterate only; on the bounds to 99 percent, inactive multipliers zero
};

/// Solves with the matrix K of the system, assembled as kSufficient, at zero shift.
using KktSolve = std::function<bool(const NewtonResidual& rhs, Step& step)>;

/// W at the end of the step has no lambda of inactive inequalities. The change is measured at least
/// over a distance that rounding of the derivatives could explain.
[[nodiscard]] NewtonTest test_newton(CanonicalProblem& canonical, ActiveSetSystem& system,
                                     const Iterate& iterate, const Evaluation& evaluation,
                                     const KktSolve& solve);

}  // namespace ipminmax
