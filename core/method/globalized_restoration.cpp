#include "core/method/first_multipliers.hpp"
#include "core/method/globalized_method.hpp"
#include "core/method/parameters.hpp"
#include "core/model/initial_point.hpp"
#include "core/model/norms.hpp"

// Feasibility restoration as a step.

namespace ipminmax {

bool GlobalizedMethod::can_restore(const Point& point) const {
  return restorer_.solve && max_norm(point.evaluation.c) > parameters::kPlenty * options_.tol;
}

bool GlobalizedMethod::restore(Run& run) {
  const Point& from = *run.here;
  // Where a branch of inner maxima ends, restorations may go round in circles.
  if (has_max() && !goes_on(run, patience_.set_back(Setback::Infeasible))) return false;
  // The violation that counts is that of both players: Max constraints are restored with Min's.
  const double start_theta = from.evaluation.c.lpNorm<1>();
  filter_.add(outer_.estimate(from, run.mu));
  const auto acceptable = [&](const Eigen::VectorXd& v, const Eigen::VectorXd& c) {
    const double theta = c.lpNorm<1>();
    // kappa_resto of [WB, 3.3]
    if (theta > parameters::kProgress * start_theta) return false;
    double f = 0.0;
    if (canonical_.objective(v, f) != EvaluationStatus::Ok) return false;
    return has_max() || filter_.acceptable({theta, barrier_objective(canonical_, v, f, run.mu)});
  };
  const Index granted = budget_.left_to_restore();
  Index left = granted;
  Point& restored = outer_.trial;
  restored.iterate = from.iterate;
  restored.evaluation = from.evaluation;
  const auto outcome =
      restore_feasibility(canonical_, options_, run.mu, acceptable, restorer_, restored, left);
  budget_.restoration += granted - left;
  switch (outcome) {
    case RestorationOutcome::Restored:
      return begin_at_restored(run);
    case RestorationOutcome::LocallyInfeasible:
      if (!has_max()) {  // the point that shows it
        evaluate_where_defined(canonical_, restored);
        move_to_trial(run);
      }
      return fail(run, Status::LocallyInfeasible,
                  "the violation of the constraints is at a local minimum");
    case RestorationOutcome::Stopped:
      return limit_.expired() ? fail_by_limit(run) : fail(run, Status::MaxIterations);
    case RestorationOutcome::UserStop:
      evaluate_where_defined(canonical_, restored);
      move_to_trial(run);
      return fail(run, Status::UserStop);
    case RestorationOutcome::Unproved:
    case RestorationOutcome::Failed:
      break;
  }
  if (has_max()) return leap(run);
  return fail(
      run, Status::RestorationFailed,
      outcome == RestorationOutcome::Unproved
          ? "the feasibility restoration ended at a minimum or a saddle of the violation, which "
            "linear_solver ldlt cannot tell apart\nuse linear_solver auto or mumps"
          : "the feasibility restoration failed");
}

bool GlobalizedMethod::begin_at_restored(Run& run) {
  // Multipliers start anew: bounds at mu / s, constraints by least squares.
  Point& restored = outer_.trial;
  Iterate& iterate = restored.iterate;
  for_each_bound(canonical_, iterate.v, [&](Index i, int side, double distance) {
    multiplier_of(iterate, i, side) = run.mu / distance;
  });
  weigh_copies(canonical_, iterate);
  bool defined = evaluate_values(canonical_, restored) == EvaluationStatus::Ok &&
                 evaluate_first_derivatives(canonical_, restored) == EvaluationStatus::Ok;
  if (defined) {
    start_multipliers(canonical_, kkt_, options_, restored);
    defined = evaluate_derivatives(canonical_, restored) == EvaluationStatus::Ok;
  }
  if (!defined) {
    return fail(run, Status::EvaluationFailed,
                canonical_.evaluation_error() + " where the feasibility restoration ended");
  }
  move_to_trial(run);
  soft_steps_ = 0;
  run.report.kind = StepKind::Restoration;
  run.report.alpha_primal = run.report.alpha_dual = 1.0;
  return true;
}

}  // namespace ipminmax
