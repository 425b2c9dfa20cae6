#pragma once

#include <functional>

#include "core/certificate/active_set.hpp"
#include "core/options.hpp"

namespace ipminmax {

/// What the Newton step to the solution of the active set's equations tells of a point.
struct NewtonTest {
  bool done = false;          ///< the steps could be computed and the model evaluated at the end
  bool classes_hold = false;  ///< multipliers and distances at the end confirm the classes
  /// Bounds that are not active: doubtful ones of Max that he leaves, for their multiplier is
  /// negative, and those whose multiplier comes from bound_relax_factor.
  std::vector<Index> released;
  /// Step that the curvature of the equations makes necessary at the end, over the step: Newton's
  /// method converges from a point where that is below 1/4 (it is 1/4 for x^3 at 0).
  double contraction = 0.0;
  Index changing = -1;    ///< bound whose class changes, if one does
  Index left_in = -1;     ///< variable that the second step moves most
  Eigen::VectorXd error;  ///< per variable, in units: bounds what W changes by on the way, twice
  std::vector<double> hessian_change;  ///< on the way, per triplet, canonical units
  double step = 0.0;                   ///< longest entry of the step, in units
  /// What the rows of active constraints change by on the way, sum of the entries of the worst one
  /// in units; inner: of Max's rows in his variables.
  double turn = 0.0, inner_turn = 0.0;
  Index turning = -1;  ///< constraint whose row changes most
  /// Iterate only; on the bounds to 99 percent, inactive multipliers of constraints zero.
  /// Multipliers of active bounds are those that balance the gradient, of others those that keep z
  /// s.
  Point end;

  /// Nothing found; arrays keep their room.
  void clear();
};

/// What test_newton works with, kept from call to call.
struct NewtonArrays {
  Eigen::VectorXd lambda;       ///< without those of rows that do not count
  Eigen::VectorXd dv, dlambda;  ///< Newton step
  Eigen::VectorXd gradient;     ///< of the Lagrangian, as predicted for its end
  Eigen::VectorXd trial, trial_v,
      trial_lambda;              ///< step that is tried, and its end
  Eigen::VectorXd fixed;         ///< way to the bounds of fixed variables
  Eigen::VectorXd force;         ///< gradient of the Lagrangian at the end; of slacks: -lambda
  Eigen::VectorXd row_v, row_c;  ///< minus a right-hand side
  Eigen::VectorXd back_v, back_lambda;  ///< from the end of the trial step
  Eigen::VectorXd change_v, change_c;
  Eigen::VectorXd second_v, second_lambda, probed;
  Eigen::VectorXd turns, inner_turns;
  Evaluation there;  ///< at the end of the trial step
  Evaluation end;    ///< where W is compared besides
  Eigen::VectorXd end_v;
  std::vector<double> counted;  ///< changes of W between free variables
};

/// Solves with the matrix K of the system, assembled as kSufficient, at zero shift. share: of the
/// solution, that its error may be.
using KktSolve = std::function<bool(const NewtonResidual& rhs, Step& step, double share)>;

/// W at the end of the step has no lambda of inactive inequalities. The change is measured at least
/// over a distance that rounding of the derivatives could explain. Of the point: iterate and
/// evaluation. is_part: solve's matrix is shifted, so that its step is part of the way alone, and W
/// may jump beyond its end.
void test_newton(CanonicalProblem& canonical, ActiveSetSystem& system, const Point& point,
                 const KktSolve& solve, bool is_part, const SolverOptions& options,
                 NewtonArrays& arrays, NewtonTest& test);

}  // namespace ipminmax
