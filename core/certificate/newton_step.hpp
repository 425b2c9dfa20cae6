#pragma once

#include <functional>

#include "core/certificate/active_set.hpp"
#include "core/options.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// What the Newton step to the solution of the active set's equations tells of a point.
struct NewtonTest {
  bool done = false;       ///< the steps could be computed and the model evaluated at the end
  bool set_holds = false;  ///< multipliers and distances at the end confirm the active set
  /// Bounds that are not active: weakly active ones of Max that he leaves, for their multiplier is
  /// negative, and those whose multiplier comes from bound_relax_factor.
  std::vector<Index> released;
  /// Contraction rate: step that the curvature of the equations makes necessary at the end, over
  /// the step. Newton's method converges from a point where that is below 1/4 (it is 1/4 for x^3
  /// at 0).
  double contraction = 0.0;
  Index changing = -1;  ///< bound whose class changes, if one does
  Index left_in = -1;   ///< variable that the second step moves most
  Vector error;         ///< per variable, scaled: bounds what W changes by on the way, twice
  std::vector<double> hessian_change;  ///< on the way, per triplet, canonical units
  double step = 0.0;                   ///< longest entry of the step, scaled
  /// Jacobian variation: what the rows of active constraints change by on the way, sum of the
  /// scaled entries of the worst one; inner: of Max's rows in his variables.
  double turn = 0.0, inner_turn = 0.0;
  Index turning = -1;  ///< constraint whose row changes most
  /// On the bounds to 99 percent, inactive multipliers of constraints zero. Multipliers of active
  /// bounds are those that balance the gradient, of others those that keep z s.
  Iterate end;

  /// Nothing found; arrays keep their room.
  void clear();
};

/// What test_newton works with, kept from call to call.
struct NewtonArrays {
  Vector lambda;       ///< without those of rows that do not count
  Vector dv, dlambda;  ///< Newton step
  Vector gradient;     ///< of the Lagrangian, as predicted for its end; of slacks: -lambda
  Vector trial, trial_v, trial_lambda;  ///< step that is tried, and its end
  Vector fixed;                         ///< way to the bounds of fixed variables
  Vector row_v, row_c;                  ///< minus a right-hand side
  Vector change_v, change_c, back_v, back_lambda;
  Vector second_v, second_lambda, probed;
  Evaluation there, end;        ///< at the end of the trial step; where W is compared besides
  std::vector<double> counted;  ///< changes of W between free variables
};

/// Solves with the matrix K of the system, assembled as kSufficient, at zero shift.
using KktSolve = std::function<bool(const NewtonResidual& rhs, Step& step)>;

}  // namespace ipminmax
