#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string_view>

#include "result.hpp"

namespace IPMINMAX_API ipminmax {

struct UserScaling;  // problem.hpp

/// Inertias seen while the shifts of a step were chosen, at the point where the step begins. They
/// count the slack rows, as in Certificate; those that were not needed are empty.
struct ShiftFindings {
  std::optional<Inertia> inner_at_zero;  ///< of K_yy (the paper's J_yy) without shift
  std::optional<Inertia> full_at_zero;   ///< of K (the paper's J_zz) without shift
  std::optional<Inertia> inner;          ///< of K_yy with the step's delta_y
  std::optional<Inertia> full;           ///< of K with the step's delta_x, delta_y
  /// The mu in (0, 1) of line 7 of Algorithm 1 at which K + mu E was tested; 0 where line 7 had
  /// nothing to do.
  double line7_mu = 0.0;
};

/// State of the method after an iteration; iteration 0 is the starting point. Quantities of the
/// step are those of the step that led here and zero at iteration 0.
///
/// Iterations of a feasibility restoration are told, too, with restoration set and the number of
/// the iteration that waits for it. Objective and error.primal are then those of the model (the
/// objective NaN where undefined); mu, the step and the other errors are those of the restoration
/// problem.
///
/// Iterations of a maximization over y at a held x are told with over_y set. All members are then
/// about the maximization: objective is f or a constraint (negated for its lower bound), v is x and
/// the y reached, result() what the maximization would return. A stop returns the best point of the
/// finished solves. In a proof over y objective is the bound, and result() has no point.
struct IterationInfo {
  Index iteration = 0;
  bool restoration = false;
  bool over_y = false;
  double objective = 0.0;  ///< unscaled
  KktError error;          ///< primal: to the relaxed bounds (bound_relax_factor), unlike in Result
  double mu = 0.0;
  /// |g(z, mu)|_inf at the iterate, of the scaled problem with slacks (docs/algorithm.md,
  /// "Canonical problem"): Algorithm 1 compares it with b, delta_s and delta_epsilon.
  double barrier_error = 0.0;
  double step_norm = 0.0;  ///< infinity norm of the primal step
  double delta_x = 0.0;    ///< Hessian shift of the Min variables (the paper's epsilon_x)
  double delta_y = 0.0;    ///< Hessian shift of the Max variables (the paper's epsilon_y)
  double alpha_dual = 0.0;
  double alpha_primal = 0.0;
  char step_kind = ' ';            ///< one letter, see docs/log.md
  ShiftFindings shifts;            ///< of Algorithm 1 and of the joint steps; empty in other steps
  Index trials = 0;                ///< trial points of the line search
  Index factorizations_full = 0;   ///< of K since the last call
  Index factorizations_inner = 0;  ///< of K_yy since the last call
  Index factorizations_complement = 0;  ///< of the complement of K_yy in K since the last call
  std::span<const double> v;            ///< the iterate, n; valid during the callback
  /// What the solve would return if the callback stopped it now, for the callback's use only. Each
  /// call evaluates objective and constraints, with fixed variables also their derivatives.
  std::function<Result()> result;
  /// Writes the factors by which the solve has scaled the model, in the model's order, for the
  /// callback's use only.
  std::function<void(UserScaling&)> scaling;
};

using IterationCallback = std::function<bool(const IterationInfo&)>;

/// What a solve tells while it runs. Every member may be empty.
struct SolveObserver {
  /// Called once per iteration including 0, and in those of a restoration; false stops with
  /// Status::UserStop at the iterate.
  std::function<bool(const IterationInfo&)> on_iteration;
  /// Messages a user should see (warnings, changes of phase), without line end.
  std::function<void(std::string_view)> message;
};

/// What several starts tell while they run. Every member may be empty. Calls come from several
/// threads, one at a time.
struct MultistartObserver {
  /// Called once per iteration of every start, see SolveObserver; false stops all starts.
  std::function<bool(Index start, const IterationInfo&)> on_iteration;
  /// Called when a start has ended, in the order of their ends.
  std::function<void(Index start, const Result&)> on_result;
  /// Messages of a start a user should see, without line end.
  std::function<void(Index start, std::string_view)> message;
};

}  // namespace ipminmax
