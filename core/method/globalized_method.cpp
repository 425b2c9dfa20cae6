#include <algorithm>
#include <utility>

#include "core/method/globalized_method.hpp"
#include "core/model/norms.hpp"

// The order of the steps; search, restoration and escape stand in files of their own.

namespace ipminmax {

GlobalizedMethod::GlobalizedMethod(const MethodContext& context, Restorer restorer,
                                   const Point& first, GlobalizedArrays& arrays)
    : Kept(&arrays),
      canonical_(context.canonical),
      kkt_(context.kkt),
      correction_(context.correction),
      options_(context.options),
      limit_(context.limit),
      budget_(context.budget),
      restorer_(std::move(restorer)),
      patience_(canonical_.x().size() + canonical_.y().size(), kkt_.layout().dimension()),
      outer_(context, first, outer_arrays_) {
  watchdog_.begin_anew();
  filter_.begin_anew(at(std::min(options_.max_iter, parameters::kPlenty)));
  filter_.set_scale(violation(first.evaluation.c, canonical_.min_constraints()));
  if (!has_max()) filter_.minimize();
}

void GlobalizedMethod::barrier_changed() {
  filter_.reset();
  watchdog_.end();
  patience_.barrier_changed();
  least_residual_ = kInfinity;
  soft_steps_ = 0;
}

bool GlobalizedMethod::fail(Run& run, Status status, std::string message) {
  run.report.fail(status, std::move(message));
  return false;
}

bool GlobalizedMethod::fail_by_limit(Run& run) const { return fail(run, *limit_.exceeded()); }

bool GlobalizedMethod::goes_on(Run& run, const std::optional<Patience::End>& end) const {
  if (!end) return true;
  std::string message(end->message);
  if (end->status == Status::NoLocalMinmaxFound) {
    message += ": " + patience_.setbacks().describe(canonical_, run.here->iterate.v);
  }
  return fail(run, end->status, std::move(message));
}

void GlobalizedMethod::move_to_trial(Run& run) {
  std::swap(run.to, outer_.trial);
  run.here = &run.to;
}

void GlobalizedMethod::accept(Run& run) {
  move_to_trial(run);
  std::swap(outer_.direction, outer_.trial_direction);
}

StepReport GlobalizedMethod::step(const Point& from, double mu, Point& to) {
  Run run{.here = &from, .to = to, .mu = mu};
  static_cast<void>(has_max() ? minmax_step(run) : outer_step(run));
  // A step that fails may have come some way.
  run.report.moved = run.here == &to;
  return std::move(run.report);
}

double GlobalizedMethod::inner_target(const Point& point, double mu) const {
  const double share = canonical_.has_max_bounds() ? parameters::kSmall * mu
                                                   : parameters::inner::kSlopeShare * last_slope_;
  return tolerated_gain(share, outer_.merit(point, mu).phi);
}

bool GlobalizedMethod::minmax_step(Run& run) {
  // The inner Newton step is not computed before it is needed; the factorization of an accepted
  // trial point is still at hand.
  const Point& from = *run.here;
  const double mu = run.mu;
  InnerDirection& direction = outer_.direction;
  const bool at_hand = outer_.inner.is_known(direction, from);
  bool known = at_hand && direction.mu == mu;
  bool right = (at_hand && direction.shift.y == 0.0) ||
               (inner_right_at_ != 0 && inner_right_at_ == from.evaluation.hessian_call);
  const auto find_direction = [&] {
    if (!known) known = outer_.inner.direction(from, mu, direction);
    return known || fail(run, Status::InertiaCorrectionFailed,
                         "no shift of the Max variables gives K_yy the expected inertia");
  };
  if (!right) {
    if (!find_direction()) return false;
    right = direction.shift.y == 0.0;
  }
  if (right && fast_step(run)) return true;
  fast_contraction_ = 0.0;
  least_residual_ = kInfinity;
  steps_above_least_ = 0;
  if (!find_direction()) return false;

  const double target = inner_target(from, mu);
  const bool inner_solved = direction.shift.y == 0.0 && direction.largest_gain() <= target;
  if (!inner_solved && !inner_phase(run, target)) return !run.report.failure && joint_step(run);
  return goes_on(run, patience_.check_progress(outer_.merit(*run.here, mu))) && outer_step(run);
}

bool GlobalizedMethod::inner_phase(Run& run, double target) {
  const InnerDirection& direction = outer_.direction;
  const double estimate =
      outer_.merit(*run.here, run.mu).phi + (direction.shift.y == 0.0 ? direction.gain : 0.0);
  run.to = *run.here;
  const auto outcome = outer_.inner.maximize(run.to, run.mu, target, parameters::inner::kSteps,
                                             kInfinity, outer_.direction);
  run.unshifted_step = UnshiftedStep::Unknown;
  if (outcome == InnerMaximizer::Outcome::Maximum) {
    run.here = &run.to;
    filter_.reset();
    patience_.watch_branch(estimate, outer_.merit(run.to, run.mu).phi);
    return true;
  }
  if (limit_.expired()) return fail_by_limit(run);
  const bool y_ran_away = outcome == InnerMaximizer::Outcome::Unbounded;
  static_cast<void>(goes_on(run, patience_.inner_phase_failed(y_ran_away)));
  return false;
}

/// What the linear system of a fast step may leave: a share of what quadratic convergence would, by
/// the last contraction, or of tol. error: at the point left.
Accuracy GlobalizedMethod::forcing(double error) const {
  const double last = fast_contraction_ > 0.0 ? fast_contraction_ : parameters::kLittle;
  return {.residual = std::max(parameters::kLittle * last * last * error,
                               parameters::kSmall * options_.tol)};
}

/// Whether a fast step may lead from one residual to another: below the least of this mu, or, where
/// a barrier bends the way to it, for a few steps above it.
bool GlobalizedMethod::contracts(double before, double after) {
  if (least_residual_ == kInfinity) least_residual_ = before;
  // kappa_f of the least residual of fast steps [G]
  if (after <= parameters::kProgress * least_residual_) {
    least_residual_ = after;
    steps_above_least_ = 0;
    return true;
  }
  const bool bends = !canonical_.lower_bounded().empty() || !canonical_.upper_bounded().empty();
  return bends && after <= parameters::fast::kGrowth * least_residual_ &&
         ++steps_above_least_ <= parameters::kEnough;
}

bool GlobalizedMethod::fast_step(Run& run) {
  // Both inertias right without shifts and the residual contracts: Newton's method.
  namespace parameter = parameters::fast;
  const Point& from = *run.here;
  const double mu = run.mu;
  outer_.assemble(from, mu);
  run.unshifted_step = UnshiftedStep::Wrong;
  Regularization shift = outer_.direction.shift;
  shift.y = 0.0;
  outer_.factors =
      correction_.factorize_unshifted(InertiaCorrection::Matrix::Full, mu, from.evaluation, shift);
  const double before = measured_barrier_error(canonical_, from, mu).norm();
  if (!kkt_.has_expected_inertia(outer_.factors) || !outer_.solve(from, forcing(before))) {
    return false;
  }
  run.unshifted_step = UnshiftedStep::Right;
  // No untested step far out of the neighbourhood, as from where curvature nearly vanishes.
  if (max_norm(outer_.step.v) > parameters::kLongStep * (1.0 + max_norm(from.iterate.v)))
    return false;
  const StepLength alpha = outer_.longest_step(from, mu);
  Point& trial = outer_.trial;
  outer_.set_trial(from, outer_.step, alpha, mu);
  ++run.report.trials;
  if (evaluate_values(canonical_, trial) != EvaluationStatus::Ok ||
      evaluate_first_derivatives(canonical_, trial) != EvaluationStatus::Ok) {
    return false;
  }
  const double after = outer_.norm_error(trial, mu);
  if (!contracts(before, after) ||
      evaluate_second_derivatives(canonical_, trial) != EvaluationStatus::Ok) {
    return false;
  }
  const double contraction = after / before;
  const bool full = alpha.primal == 1.0 && alpha.dual == 1.0;
  // In the paper's freeze neighbourhood, where full steps contract faster and faster, K alone is
  // factorized. The certificate tests both matrices.
  const bool frozen =
      full && contraction <= std::min(parameter::kFreezeContraction, fast_contraction_);
  if (!frozen) {
    if (!outer_.has_trial_maximum_in_sight(mu)) return false;
    outer_.direction.shift = outer_.trial_direction.shift;  // for K there
  }
  fast_contraction_ = full ? contraction : 0.0;
  run.report.alpha_primal = alpha.primal;
  run.report.alpha_dual = alpha.dual;
  run.report.step_norm = max_norm(outer_.step.v);
  run.report.kind = StepKind::Newton;
  inner_right_at_ = trial.evaluation.hessian_call;
  move_to_trial(run);
  filter_.reset();
  return true;
}

bool GlobalizedMethod::joint_step(Run& run) {
  // Algorithm 1 of the paper: no inner maximum is in reach from here.
  const Point& from = *run.here;
  outer_.assemble(from, run.mu);
  const auto shift = correction_.correct(run.mu);
  outer_.factors = kkt_.factors();
  if (!shift || !outer_.solve(from)) {
    return fail(run, Status::InertiaCorrectionFailed,
                "no shift of the Hessian gives the KKT matrix the expected inertia");
  }
  StepLength alpha = outer_.longest_step(from, run.mu);
  const double longest = parameters::kLongStep * (1.0 + max_norm(from.iterate.v));
  const double length = max_norm(outer_.step.v);
  if (length > longest) alpha.primal = std::min(alpha.primal, longest / length);
  if (!untested_step(run, alpha)) return false;
  run.report.delta_x = shift->x;
  run.report.delta_y = shift->y;
  run.report.shifts = correction_.findings();
  run.report.step_norm = length;
  run.report.kind = StepKind::Joint;
  return true;
}

bool GlobalizedMethod::leap(Run& run) {
  // No step is acceptable: take a long one all the same, finitely often.
  if (!goes_on(run, patience_.set_back(Setback::NoStep))) return false;
  if (!untested_step(run, outer_.longest_step(*run.here, run.mu))) return false;
  run.report.kind = StepKind::Leap;
  return true;
}

/// As far along the step as all functions are defined.
bool GlobalizedMethod::untested_step(Run& run, StepLength alpha) {
  Point& trial = outer_.trial;
  for (int cuts = 0; cuts < parameters::kHalvings; ++cuts, alpha.primal *= 0.5) {
    outer_.set_trial(*run.here, outer_.step, alpha, run.mu);
    ++run.report.trials;
    if (evaluate_values(canonical_, trial) != EvaluationStatus::Ok ||
        evaluate_derivatives(canonical_, trial) != EvaluationStatus::Ok) {
      continue;
    }
    if (!trial.dual.allFinite()) {  // the multipliers overflow
      alpha.dual *= 0.5;
      continue;
    }
    move_to_trial(run);
    filter_.reset();
    run.report.alpha_primal = alpha.primal;
    run.report.alpha_dual = alpha.dual;
    return true;
  }
  return fail(run, Status::EvaluationFailed, canonical_.evaluation_error());
}

bool GlobalizedMethod::soft_step(Run& run) {
  // Near rounding no merit function sees the progress that the residual still makes.
  // max_soft_resto_iters of [Ipopt]
  if (soft_steps_ >= parameters::kPatience) return false;
  const Point& from = *run.here;
  const StepLength alpha = outer_.longest_step(from, run.mu);
  const double both = std::min(alpha.primal, alpha.dual);
  Point& trial = outer_.trial;
  outer_.set_trial(from, outer_.step, {both, both}, run.mu);
  ++run.report.trials;
  if (evaluate_values(canonical_, trial) != EvaluationStatus::Ok ||
      evaluate_first_derivatives(canonical_, trial) != EvaluationStatus::Ok) {
    return false;
  }
  if (!(outer_.norm_error(trial, run.mu) <=
        parameters::kSoftContraction * outer_.norm_error(from, run.mu))) {
    return false;
  }
  if (evaluate_second_derivatives(canonical_, trial) != EvaluationStatus::Ok) return false;
  if (has_max() && !outer_.find_trial_direction(run.mu)) return false;
  run.report.alpha_primal = run.report.alpha_dual = both;
  run.report.kind = StepKind::Soft;
  accept(run);
  ++soft_steps_;
  return true;
}

}  // namespace ipminmax
