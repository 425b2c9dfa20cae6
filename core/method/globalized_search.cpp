#include <algorithm>
#include <cmath>
#include <utility>

#include "core/method/globalized_block.hpp"
#include "core/method/parameters.hpp"
#include "core/model/norms.hpp"
#include "linalg/numbers.hpp"

// The outer step: filter line search along the Newton step of K, and what is done where it fails.

namespace ipminmax {

namespace outer = parameters::outer;

bool GlobalizedMethod::find_outer_step(Run& run) {
  Regularization shift;
  if (has_max()) {
    shift = outer_.direction.shift;
    shift.x = shift.lambda_x = 0.0;
  }
  // The fast step's solution may be a rough one.
  const bool at_hand =
      run.unshifted_step == UnshiftedStep::Right && shift.y == 0.0 && outer_.solve(*run.here);
  if (at_hand) shift = outer_.factors.shift;
  if (!at_hand &&
      !outer_.find_step(*run.here, run.mu, shift, run.unshifted_step == UnshiftedStep::Wrong)) {
    return false;
  }
  run.report.delta_x = shift.x;
  run.report.delta_y = shift.y;
  run.report.step_norm = max_norm(outer_.step.v);
  run.report.kind = shift.x > 0.0 ? StepKind::Shifted : StepKind::Filter;
  return true;
}

bool GlobalizedMethod::outer_step(Run& run) {
  bool inner_exact = !has_max();
  for (;;) {
    // A watchdog's full step may have led to where there is none.
    const bool found = find_outer_step(run);
    const bool goes_back = !found && watchdog_.active && !limit_.expired();
    if (goes_back) return_to_watched(run);
    if (!found && !goes_back) {
      if (can_restore(*run.here) && !limit_.expired()) return restore(run);
      return fail(run, Status::InertiaCorrectionFailed,
                  "no shift of the Hessian gives the KKT matrix the expected inertia");
    }
    const bool is_watched = !has_max() && (goes_back || watchdog_.is_due());
    if (is_watched && !goes_back && watched_step(run)) return true;
    const int trials = !has_max()    ? parameters::kHalvings
                       : inner_exact ? parameters::kPatience
                                     : parameters::kFew;
    if (search(run, trials, is_watched)) return true;
    if (limit_.expired()) return fail_by_limit(run);  // no other step in haste
    // Rejections may be the fault of phi's estimate: make it exact and search once more.
    if (inner_exact || outer_.direction.largest_gain() <= parameters::kZero) break;
    inner_exact = true;
    const double estimate = outer_.merit(*run.here, run.mu).phi;
    if (!exact_inner_maximum(run)) {  // the branch ends before its maximum
      return limit_.expired() ? fail_by_limit(run) : leap(run);
    }
    patience_.watch_branch(estimate, outer_.merit(*run.here, run.mu).phi);
  }
  return without_line_search(run);
}

bool GlobalizedMethod::exact_inner_maximum(Run& run) {
  outer_.trial = *run.here;
  if (outer_.inner.maximize(outer_.trial, run.mu, parameters::kZero, parameters::inner::kSteps,
                            kInfinity, outer_.direction) != InnerMaximizer::Outcome::Maximum) {
    return false;
  }
  move_to_trial(run);
  run.unshifted_step = UnshiftedStep::Unknown;
  filter_.reset();
  return true;
}

bool GlobalizedMethod::without_line_search(Run& run) {
  if (soft_step(run)) return true;
  if (can_restore(*run.here)) return restore(run);
  if (has_max()) return leap(run);
  // Points of long ago may be all that rejects.
  filter_.reset();
  if (search(run, parameters::kHalvings, false)) return true;
  const Eigen::VectorXd& c = run.here->evaluation.c;
  const bool exactly_feasible = max_norm(c) <= parameters::kSmall * options_.tol;
  if (restorer_.solve && !exactly_feasible) return restore(run);
  return fail(run, Status::TinyStep, "no acceptable step found");
}

bool GlobalizedMethod::search(Run& run, int trials, bool first_fails) {
  const Point& from = *run.here;
  SearchLine line{.from = outer_.estimate(from, run.mu),
                  .longest = outer_.longest_step(from, run.mu),
                  .trials = trials,
                  .first_fails = first_fails};
  line.slope = outer_.slope(from, run.mu);
  line.smallest = filter_.smallest_step(line.from, line.slope);
  last_slope_ = std::abs(line.slope);
  if (has_max()) {
    // phi is known along one branch of inner maxima only: no step far out of its neighbourhood.
    const double longest = outer::kLongStep * (1.0 + max_norm(from.iterate.v));
    line.longest.primal =
        std::min(line.longest.primal, longest / std::max(max_norm(outer_.step.v), longest));
  }
  Block block{.owner = *this, .run = run, .bound = OuterBlock::Bound(filter_, line)};
  const SearchEnd end = filter_search(block, filter_, line, limit_);
  if (!end.accepted) return false;
  accept(run);
  run.report.alpha_primal = end.alpha.primal;
  run.report.alpha_dual = end.alpha.dual;
  if (end.corrected) run.report.kind = StepKind::Corrected;
  watchdog_.count(end.cuts > 0);
  soft_steps_ = 0;
  return true;
}

void GlobalizedMethod::count_dominated(bool dominated) {
  if (has_max() || filter_resets_ >= outer::kFilterResets) return;
  dominated_steps_ = dominated ? dominated_steps_ + 1 : 0;
  if (dominated_steps_ < outer::kFilterResets) return;
  filter_.reset();
  ++filter_resets_;
  dominated_steps_ = 0;
}

/// False: an ordinary search is due, from the point and with the step that it went back to.
bool GlobalizedMethod::watched_step(Run& run) {
  const Point& from = *run.here;
  Watchdog& watchdog = watchdog_;
  if (!watchdog.active) {
    watchdog.point = from;
    watchdog.step = outer_.step;
    watchdog.from = outer_.merit(from, run.mu);
    watchdog.slope = outer_.slope(from, run.mu);
    watchdog.report = run.report;
    watchdog.trials = 0;
    watchdog.active = true;
  }
  const StepLength alpha = outer_.longest_step(from, run.mu);
  if (watchdog.trials == 0) watchdog.alpha = alpha.primal;
  Block block{.owner = *this, .run = run};
  const Trial trial = block.evaluate(watchdog.slope, alpha);
  const bool defined = trial.usable && block.complete();
  const auto verdict = filter_.test(watchdog.from, watchdog.slope, watchdog.alpha, trial.merit);
  const bool improves = defined && Filter::accepted(verdict);
  // A full step to where the solve would end as diverging is nothing to wait for.
  const bool may_wait =
      defined && max_norm(outer_.trial.iterate.v) <= options_.diverging_iterates_tol;
  // watchdog_trial_iter_max of [Ipopt]
  if (improves || (may_wait && ++watchdog.trials <= parameters::kEnough)) {
    if (improves) {
      if (verdict == Filter::Verdict::Sufficient) filter_.add(watchdog.from);
      watchdog.end();
    }
    accept(run);
    run.report.alpha_primal = alpha.primal;
    run.report.alpha_dual = alpha.dual;
    run.report.kind = StepKind::Watchdog;
    return true;
  }
  return_to_watched(run);
  return false;
}

/// To the point where the watchdog began, and the step from there.
void GlobalizedMethod::return_to_watched(Run& run) {
  Watchdog& watchdog = watchdog_;
  watchdog.end();
  std::swap(run.to, watchdog.point);
  run.here = &run.to;
  std::swap(outer_.step, watchdog.step);
  const Index trials = run.report.trials;
  run.report = watchdog.report;
  run.report.trials = trials;
}

}  // namespace ipminmax
