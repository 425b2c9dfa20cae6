#pragma once

#include <functional>

#include "core/certificate/active_set.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// Result of the Newton step to the solution of the active set's equations.
struct NewtonTest {
  bool done = false;       ///< both steps were computed and the model could be evaluated
  bool set_holds = false;  ///< multipliers and distances at the end confirm the active set
  /// Bounds to be released: weakly active ones of Max whose multiplier becomes negative, and those
  /// whose multiplier only comes from bound_relax_factor.
  std::vector<Index> released;
  /// Contraction rate: the simplified Newton step (same matrix) from the end of the probe step,
  /// over the probe step, over 1 + kContraction. Accepted up to kContraction (for x^3 at 0: 1/4).
  double contraction = 0.0;
  Index changing = -1;  ///< bound whose class changes, if one does
  Index left_in = -1;   ///< variable that the simplified Newton step moves most
  Vector error;         ///< per variable, scaled: twice the row sums of the change of W on the way
  std::vector<double> hessian_change;  ///< on the way, per triplet, canonical units
  double step = 0.0;                   ///< longest entry of the step, scaled
  /// Jacobian variation: sum of the scaled changes of a row of an active constraint on the way, for
  /// the worst row; inner: of Max's rows in Max's variables.
  double jacobian_variation = 0.0, inner_variation = 0.0;
  Index varying_row = -1;  ///< constraint whose row changes most
  /// End of the step: 99 percent of the way to active bounds. Multipliers of inactive constraints
  /// are zero, those of active bounds balance the gradient, the others keep z s.
  Iterate end;

  /// Clears the result. Arrays keep their memory.
  void clear() {
    done = set_holds = false;
    released.clear();
    hessian_change.clear();
    error.setZero();
    contraction = step = jacobian_variation = inner_variation = 0.0;
    changing = left_in = varying_row = -1;
  }
};

/// Solves with the matrix K of the system, assembled as kSufficient, at zero shift.
using KktSolve = std::function<bool(const NewtonResidual& rhs, Step& step)>;

}  // namespace ipminmax
