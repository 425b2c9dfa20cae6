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
  if (!find_outer_step(run)) {
    if (can_restore(*run.here) && !limit_.expired()) return restore(run);
    return fail(run, Status::InertiaCorrectionFailed,
                "no shift of the Hessian gives the KKT matrix the expected inertia");
  }
  if (search(run)) return true;
  if (limit_.expired()) return fail_by_limit(run);  // no other step in haste
  return without_line_search(run);
}

bool GlobalizedMethod::without_line_search(Run& run) {
  if (soft_step(run)) return true;
  if (can_restore(*run.here)) return restore(run);
  if (has_max()) return leap(run);
  const Eigen::VectorXd& c = run.here->evaluation.c;
  const bool exactly_feasible = max_norm(c) <= parameters::kSmall * options_.tol;
  if (restorer_.solve && !exactly_feasible) return restore(run);
  return fail(run, Status::TinyStep, "no acceptable step found");
}

bool GlobalizedMethod::search(Run& run) {
  const Point& from = *run.here;
  SearchLine line{.from = outer_.estimate(from, run.mu),
                  .longest = outer_.longest_step(from, run.mu),
                  .trials = has_max() ? parameters::kFew : parameters::kHalvings};
  line.slope = outer_.slope(from, run.mu);
  line.smallest = filter_.smallest_step(line.from, line.slope);
  last_slope_ = std::abs(line.slope);
  if (has_max()) {
    // phi is known along one branch of inner maxima only: no step far out of its neighbourhood.
    const double longest = outer::kLongStep * (1.0 + max_norm(from.iterate.v));
    line.longest.primal =
        std::min(line.longest.primal, longest / std::max(max_norm(outer_.step.v), longest));
  }
  Block block{.owner = *this, .run = run};
  const SearchEnd end = filter_search(block, filter_, line, limit_);
  if (!end.accepted) return false;
  accept(run);
  run.report.alpha_primal = end.alpha.primal;
  run.report.alpha_dual = end.alpha.dual;
  if (end.corrected) run.report.kind = StepKind::Corrected;
  soft_steps_ = 0;
  return true;
}

}  // namespace ipminmax
