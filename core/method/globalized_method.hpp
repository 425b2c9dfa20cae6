#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "core/kkt/system.hpp"
#include "core/method/blocks.hpp"
#include "core/method/curvature_escape.hpp"
#include "core/method/filter.hpp"
#include "core/method/parameters.hpp"
#include "core/method/restoration.hpp"
#include "core/method/stall_detection.hpp"
#include "core/method/step_method.hpp"
#include "core/model/initial_point.hpp"
#include "core/model/kept.hpp"
#include "core/model/norms.hpp"
#include "core/point/point.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

/// Ipopt's watchdog for minimizations: after shortened steps in a row, full steps that need not
/// improve on the point they leave, as long as one of the first few improves on the point where it
/// began.
struct Watchdog {
  bool active = false;
  Index trials = 0;
  Index shortened_steps = 0;  ///< in a row
  // Where it began.
  Point point;
  Step step;
  Merit from;
  double slope = 0.0;
  double alpha = 1.0;
  StepReport report;

  [[nodiscard]] bool is_due() const {
    constexpr Index kTrigger = 10;  // watchdog_shortened_iter_trigger of [Ipopt]
    return active || shortened_steps >= kTrigger;
  }
  void count(bool shortened) { shortened_steps = shortened ? shortened_steps + 1 : 0; }
  /// What it began with means nothing any more.
  void end() {
    active = false;
    shortened_steps = 0;
  }
};

/// What a GlobalizedMethod works with, kept from one to the next.
struct GlobalizedArrays {
  Filter inner_filter_, filter_;
  Watchdog watchdog_;
};

/// The globalized method, docs/algorithm.md: the minimizer descends on phi(x), the local maximum
/// over y, estimated by the barrier value plus the predicted gain of the inner Newton step.
/// Without Max variables this is Ipopt's filter line search.
class GlobalizedMethod final : public StepMethod, Kept<GlobalizedArrays>, MethodContext {
 public:
  /// first: where the search begins. The workspace is the method's while it makes a step.
  GlobalizedMethod(const MethodContext& context, Restorer restorer, const Point& first,
                   GlobalizedArrays& arrays, Workspace& workspace)
      : Kept(&arrays),
        MethodContext(context),
        restorer_(std::move(restorer)),
        stalls_(canonical_.x().size() + canonical_.y().size(), kkt_.layout().dimension()),
        outer_(context, first, inner_filter_, workspace) {
    watchdog_.end();
    constexpr Index kEntries = 100;  // set aside at once
    filter_.begin_anew(at(std::min(options_.max_iter, kEntries)));
    filter_.set_scale(violation(first.evaluation.c, canonical_.min_constraints()));
    if (!has_max()) filter_.minimize();
  }

  [[nodiscard]] StepReport step(const Point& from, double mu, Point& to) override {
    Run run{.here = &from, .to = to, .mu = mu};
    static_cast<void>(has_max() ? minmax_step(run) : outer_step(run));
    // A step that fails may have come some way.
    run.report.moved = run.here == &to;
    return std::move(run.report);
  }

  [[nodiscard]] StepReport escape(const Point& from, double mu,
                                  const std::optional<WrongCurvature>& wrong, Point& to) override {
    const KktSystem::Counting counting(kkt_, FactorizationCause::Curvature);
    Run run{.here = &from, .to = to, .mu = mu};
    filter_.reset();
    run.report.kind = StepKind::Escape;
    const bool inner_wrong = has_max() && wrong && wrong->owner == Player::Max;
    if (has_max() && !outer_.inner.direction(from, mu, outer_.direction)) return {};
    const Regularization& shift = outer_.direction.shift;
    // A direction that looks flat may rise all the same.
    const bool along_y = inner_wrong || shift.y > 0.0 || (shift.proximal_y && !wrong);
    run.report.moved = along_y ? escape_inner(run, wrong, inner_wrong) : escape_outer(run, wrong);
    return std::move(run.report);
  }

  void barrier_changed() override {
    filter_.reset();
    watchdog_.end();
    stalls_.barrier_changed();
    least_residual_ = kInfinity;
    soft_steps_ = 0;
  }

 private:
  /// What is known of K without shifts. Right: the block's step is the Newton step.
  enum class UnshiftedStep : std::uint8_t { Unknown, Wrong, Right };
  /// A step under way.
  struct Run {
    const Point* here;  ///< the point left, or what was reached on the way: then &to
    Point& to;
    double mu;
    UnshiftedStep unshifted_step = UnshiftedStep::Unknown;  ///< at here
    StepReport report{};
  };
  struct Block {
    GlobalizedMethod& owner;
    Run& run;
    OuterBlock::Bound bound{};  ///< of merits worth looking at
    // Of a move along a curvature
    double alpha_primal = 0.0;

    [[nodiscard]] const Point& from() const { return *run.here; }
    [[nodiscard]] Point& trial() const { return owner.outer_.trial; }
    [[nodiscard]] Eigen::VectorXd& corrected_c() const { return owner.outer_.corrected_c; }

    [[nodiscard]] Trial evaluate(double slope, StepLength alpha) const {
      owner.outer_.set_trial(from(), owner.outer_.step, alpha, run.mu);
      ++run.report.trials;
      return owner.outer_.evaluate_trial(run.mu, slope, alpha.primal, bound);
    }
    [[nodiscard]] std::optional<StepLength> correct(const Eigen::VectorXd& c) const {
      ++run.report.trials;
      return owner.outer_.correct(from(), run.mu, c);
    }
    [[nodiscard]] Trial evaluate_corrected(double slope, double alpha) const {
      return owner.outer_.evaluate_trial(run.mu, slope, alpha, {});
    }
    void passed(bool dominated) const { owner.count_dominated(dominated); }
    [[nodiscard]] bool complete() const {
      return owner.has_max() || evaluate_derivatives(owner.canonical_, trial());
    }

    void set_trial(const Eigen::VectorXd& direction, double length) {
      Step& along = owner.outer_.corrected;
      set_zero(along);
      along.v = length * direction;
      const StepLength alpha =
          largest_step(owner.canonical_, from().iterate, along, parameters::kProgress);
      alpha_primal = alpha.primal;
      owner.outer_.set_trial(from(), along, alpha, run.mu);
      ++run.report.trials;
    }
    [[nodiscard]] Trial evaluate_move(double length) const {
      return owner.outer_.evaluate_trial(run.mu, 1.0, length, {});
    }
    [[nodiscard]] Trial improve(const Trial& moved) const {
      if (!moved.usable || owner.has_max()) return moved;
      return owner.outer_.return_to_constraints(from(), run.mu, moved);
    }
  };

  // Each either moves, or gives a reason to end the search, or neither (false).
  [[nodiscard]] bool minmax_step(Run& run) {
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
    return goes_on(run, stalls_.check_progress(outer_.merit(*run.here, mu))) && outer_step(run);
  }

  /// Whether a fast step may lead from one residual to another: below the least of this mu, or,
  /// where a barrier bends the way to it, for a few steps above it.
  [[nodiscard]] bool contracts(double before, double after) {
    if (least_residual_ == kInfinity) least_residual_ = before;
    // kappa_f of the least residual of fast steps [G]
    if (after <= parameters::kProgress * least_residual_) {
      least_residual_ = after;
      steps_above_least_ = 0;
      return true;
    }
    constexpr int kMostAboveLeast = 3;
    const bool bends = !canonical_.lower_bounded().empty() || !canonical_.upper_bounded().empty();
    return bends && after <= parameters::fast::kGrowth * least_residual_ &&
           ++steps_above_least_ <= kMostAboveLeast;
  }

  /// What the linear system of a fast step may leave: a share of what quadratic convergence would,
  /// by the last contraction, or of tol. error: at the point left.
  [[nodiscard]] Accuracy forcing(double error) const {
    constexpr double kFirstContraction = 0.1, kShare = 0.1, kOfTol = 1e-2;
    const double last = fast_contraction_ > 0.0 ? fast_contraction_ : kFirstContraction;
    return {.residual = std::max(kShare * last * last * error, kOfTol * options_.tol)};
  }

  [[nodiscard]] bool fast_step(Run& run) {
    // Both inertias right without shifts and the residual contracts: Newton's method.
    namespace parameter = parameters::fast;
    const Point& from = *run.here;
    const double mu = run.mu;
    outer_.assemble(from, mu);
    run.unshifted_step = UnshiftedStep::Wrong;
    Regularization shift = outer_.direction.shift;
    shift.y = 0.0;
    outer_.factors = correction_.factorize_unshifted(KktPart::Full, mu, from.evaluation, shift);
    const double before = measured_barrier_error(canonical_, from, mu).norm();
    if (!kkt_.has_expected_inertia(outer_.factors) || !outer_.solve(from, forcing(before))) {
      return false;
    }
    run.unshifted_step = UnshiftedStep::Right;
    // No untested step far out of the neighbourhood, as from where curvature nearly vanishes.
    if (max_norm(outer_.step.v) > parameters::kLongStep * (1.0 + max_norm(from.iterate.v)))
      return false;
    const StepLength alpha = outer_.longest_step(from, mu);
    if (!go_along_step(run, alpha)) return false;
    Point& trial = outer_.trial;
    const double after = outer_.norm_error(trial, mu);
    if (!contracts(before, after) || !evaluate_second_derivatives(canonical_, trial)) {
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
    run.report.alpha = alpha;
    run.report.step_norm = max_norm(outer_.step.v);
    run.report.kind = StepKind::Newton;
    inner_right_at_ = trial.evaluation.hessian_call;
    move_to_trial(run);
    filter_.reset();
    return true;
  }

  [[nodiscard]] bool inner_phase(Run& run, double target) {
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
      stalls_.watch_branch(estimate, outer_.merit(run.to, run.mu).phi);
      return true;
    }
    if (limit_.expired()) return fail_by_limit(run);
    const bool y_ran_away = outcome == InnerMaximizer::Outcome::Unbounded;
    static_cast<void>(goes_on(run, stalls_.inner_phase_failed(y_ran_away)));
    return false;
  }

  [[nodiscard]] bool joint_step(Run& run) {
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

  [[nodiscard]] bool outer_step(Run& run) {
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
      constexpr int kTrials = 4, kTrialsOfExactValues = 10;
      const int trials = !has_max()    ? parameters::kHalvings
                         : inner_exact ? kTrialsOfExactValues
                                       : kTrials;
      if (search(run, trials, is_watched)) return true;
      if (limit_.expired()) return fail_by_limit(run);  // no other step in haste
      // Rejections may be the fault of phi's estimate: make it exact and search once more.
      if (inner_exact || outer_.direction.largest_gain() <= parameters::kZero) break;
      inner_exact = true;
      const double estimate = outer_.merit(*run.here, run.mu).phi;
      if (!exact_inner_maximum(run)) {  // the branch ends before its maximum
        return limit_.expired() ? fail_by_limit(run) : untested_full_step(run);
      }
      stalls_.watch_branch(estimate, outer_.merit(*run.here, run.mu).phi);
    }
    return without_line_search(run);
  }

  [[nodiscard]] bool exact_inner_maximum(Run& run) {
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

  [[nodiscard]] bool without_line_search(Run& run) {
    if (soft_step(run)) return true;
    if (can_restore(*run.here)) return restore(run);
    if (has_max()) return untested_full_step(run);
    // Points of long ago may be all that rejects.
    filter_.reset();
    if (search(run, parameters::kHalvings, false)) return true;
    const Eigen::VectorXd& c = run.here->evaluation.c;
    constexpr double kExact = 1e-2;  // of tol
    const bool exactly_feasible = max_norm(c) <= kExact * options_.tol;
    if (restorer_.solve && !exactly_feasible) return restore(run);
    return fail(run, Status::TinyStep, "no acceptable step found");
  }

  /// False: an ordinary search is due, from the point and with the step that it went back to.
  [[nodiscard]] bool watched_step(Run& run) {
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
    constexpr int kTrials = 3;  // watchdog_trial_iter_max of [Ipopt]
    if (improves || (may_wait && ++watchdog.trials <= kTrials)) {
      if (improves) {
        if (verdict == Filter::Verdict::Sufficient) filter_.add(watchdog.from);
        watchdog.end();
      }
      accept(run);
      run.report.alpha = alpha;
      run.report.kind = StepKind::Watchdog;
      return true;
    }
    return_to_watched(run);
    return false;
  }

  /// To the point where the watchdog began, and the step from there.
  void return_to_watched(Run& run) {
    Watchdog& watchdog = watchdog_;
    watchdog.end();
    std::swap(run.to, watchdog.point);
    run.here = &run.to;
    std::swap(outer_.step, watchdog.step);
    const Index trials = run.report.trials;
    run.report = watchdog.report;
    run.report.trials = trials;
  }

  [[nodiscard]] bool search(Run& run, int trials, bool first_fails) {
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
      const double longest = parameters::outer::kLongStep * (1.0 + max_norm(from.iterate.v));
      line.longest.primal =
          std::min(line.longest.primal, longest / std::max(max_norm(outer_.step.v), longest));
    }
    Block block{.owner = *this, .run = run, .bound = OuterBlock::Bound(filter_, line)};
    const SearchEnd end = filter_search(block, filter_, line, limit_);
    if (!end.accepted) return false;
    accept(run);
    run.report.alpha = end.alpha;
    if (end.corrected) run.report.kind = StepKind::Corrected;
    watchdog_.count(end.cuts > 0);
    soft_steps_ = 0;
    return true;
  }

  [[nodiscard]] bool soft_step(Run& run) {
    // Near rounding no merit function sees the progress that the residual still makes.
    constexpr int kMostSoftSteps = 10;  // max_soft_resto_iters of [Ipopt]
    if (soft_steps_ >= kMostSoftSteps) return false;
    const Point& from = *run.here;
    const StepLength alpha = outer_.longest_step(from, run.mu);
    const double both = std::min(alpha.primal, alpha.dual);
    if (!go_along_step(run, {both, both}) ||
        !(outer_.norm_error(outer_.trial, run.mu) <=
          parameters::kSoftContraction * outer_.norm_error(from, run.mu)) ||
        !evaluate_second_derivatives(canonical_, outer_.trial) ||
        (has_max() && !outer_.find_trial_direction(run.mu))) {
      return false;
    }
    run.report.alpha = {both, both};
    run.report.kind = StepKind::Soft;
    accept(run);
    ++soft_steps_;
    return true;
  }

  [[nodiscard]] bool untested_full_step(Run& run) {
    // No step is acceptable: take a long one all the same, finitely often.
    if (!goes_on(run, stalls_.count(StallSign::NoStep))) return false;
    if (!untested_step(run, outer_.longest_step(*run.here, run.mu))) return false;
    run.report.kind = StepKind::UntestedFull;
    return true;
  }

  /// The trial point along the step, with functions and first derivatives. False: undefined.
  [[nodiscard]] bool go_along_step(Run& run, StepLength alpha) {
    outer_.set_trial(*run.here, outer_.step, alpha, run.mu);
    ++run.report.trials;
    return evaluate_values(canonical_, outer_.trial) &&
           evaluate_first_derivatives(canonical_, outer_.trial);
  }

  /// As far along the step as all functions are defined.
  [[nodiscard]] bool untested_step(Run& run, StepLength alpha) {
    Point& trial = outer_.trial;
    for (int cuts = 0; cuts < parameters::kHalvings; ++cuts, alpha.primal *= 0.5) {
      if (!go_along_step(run, alpha) || !evaluate_second_derivatives(canonical_, trial)) continue;
      if (!trial.dual.allFinite()) {  // the multipliers overflow
        alpha.dual *= 0.5;
        continue;
      }
      move_to_trial(run);
      filter_.reset();
      run.report.alpha = alpha;
      return true;
    }
    return fail(run, Status::EvaluationFailed, canonical_.evaluation_error());
  }

  [[nodiscard]] bool restore(Run& run) {
    const Point& from = *run.here;
    // Where a branch of inner maxima ends, restorations may go round in circles.
    if (has_max() && !goes_on(run, stalls_.count(StallSign::Infeasible))) return false;
    // The violation that counts is that of both players: Max constraints are restored with Min's.
    const double start_theta = from.evaluation.c.lpNorm<1>();
    filter_.add(outer_.estimate(from, run.mu));
    const auto acceptable = [&](const Eigen::VectorXd& v, const Eigen::VectorXd& c) {
      const double theta = c.lpNorm<1>();
      // kappa_resto of [WB, 3.3]
      if (theta > parameters::kProgress * start_theta) return false;
      double f = 0.0;
      if (!canonical_.objective(v, f)) return false;
      return has_max() || filter_.acceptable({theta, barrier_objective(canonical_, v, f, run.mu)});
    };
    Point& restored = outer_.trial;
    restored.iterate = from.iterate;
    restored.evaluation = from.evaluation;
    const Index granted = limit_.left_to_restore();
    Index left = granted;
    const auto outcome =
        restore_feasibility(canonical_, options_, run.mu, acceptable, restorer_, restored, left);
    limit_.restoration += granted - left;
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
    if (has_max()) return untested_full_step(run);
    return fail(
        run, Status::RestorationFailed,
        outcome == RestorationOutcome::Unproved
            ? "the feasibility restoration ended at a minimum or a saddle of the violation, which "
              "linear_solver ldlt cannot tell apart\nuse linear_solver auto or mumps"
            : "the feasibility restoration failed");
  }

  [[nodiscard]] bool begin_at_restored(Run& run) {
    // Multipliers start anew: bounds at mu / s, constraints by least squares.
    Point& restored = outer_.trial;
    Iterate& iterate = restored.iterate;
    for_each_bound(canonical_, iterate.v, [&](Index i, int side, double distance) {
      multiplier_of(iterate, i, side) = run.mu / distance;
    });
    weigh_copies(canonical_, iterate);
    bool defined =
        evaluate_values(canonical_, restored) && evaluate_first_derivatives(canonical_, restored);
    if (defined) {
      start_multipliers(canonical_, kkt_, options_, restored);
      defined = evaluate_derivatives(canonical_, restored);
    }
    if (!defined) {
      return fail(run, Status::EvaluationFailed,
                  canonical_.evaluation_error() + " where the feasibility restoration ended");
    }
    move_to_trial(run);
    soft_steps_ = 0;
    run.report.kind = StepKind::Restoration;
    run.report.alpha = StepLength{};
    return true;
  }

  [[nodiscard]] bool escape_inner(Run& run, const std::optional<WrongCurvature>& wrong,
                                  bool along_given) {
    run.to = *run.here;
    InnerMaximizer& inner = outer_.inner;
    if (along_given || outer_.direction.shift.proximal_y) {
      const bool left = along_given ? inner.leave(run.to, run.mu, wrong->direction)
                                    : inner.escape(run.to, run.mu, outer_.direction.factors);
      if (!left || !inner.direction(run.to, run.mu, outer_.direction)) return false;
    }
    const auto outcome = inner.maximize(run.to, run.mu, inner_target(run.to, run.mu),
                                        parameters::inner::kSteps, kInfinity, outer_.direction);
    return outcome == InnerMaximizer::Outcome::Maximum ||
           outcome == InnerMaximizer::Outcome::NotFound;
  }

  [[nodiscard]] bool escape_outer(Run& run, const std::optional<WrongCurvature>& wrong) {
    const Point& from = *run.here;
    const Index nx = canonical_.y().begin;
    Regularization shift = has_max() ? outer_.direction.shift : Regularization{};
    if (!outer_.find_step(from, run.mu, shift, false)) return false;
    Step& step = outer_.step;
    if (wrong && wrong->owner == Player::Min) {
      step.v = wrong->direction / wrong->direction.head(nx).norm();
    } else {
      const InverseIteration how{.variables = {0, nx}};
      if (!turn_to_curvature(how, outer_.rhs, step, [&](const NewtonResidual& rhs, Step& solution) {
            return kkt_.solve(outer_.factors, from.evaluation, rhs, solution);
          })) {
        return false;
      }
    }
    if (outer_.slope(from, run.mu) > 0.0) step.v = -step.v;

    CurvatureMove move{.from = outer_.estimate(from, run.mu),
                       .size = 1.0 + max_norm(from.iterate.v)};
    // Above the largest multiplier: an exact penalty of |c|_1.
    if (!has_max()) move.penalty = 2.0 * max_norm(from.iterate.lambda);
    Block block{.owner = *this, .run = run};
    if (!move_along_curvature(block, move, step.v, limit_)) return false;
    accept(run);
    run.report.alpha.primal = block.alpha_primal;
    return true;
  }

  [[nodiscard]] bool can_restore(const Point& point) const {
    constexpr double kClearViolation = 100.0;  // over tol
    return restorer_.solve && max_norm(point.evaluation.c) > kClearViolation * options_.tol;
  }

  [[nodiscard]] double inner_target(const Point& point, double mu) const {
    constexpr double kOfMu = 1e-2;
    const double share =
        canonical_.has_max_bounds() ? kOfMu * mu : parameters::inner::kSlopeShare * last_slope_;
    return tolerated_gain(share, outer_.merit(point, mu).phi);
  }

  [[nodiscard]] bool find_outer_step(Run& run) {
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

  /// False, and the run fails, where there is an end.
  [[nodiscard]] bool goes_on(Run& run, const std::optional<StallDetection::End>& end) const {
    if (!end) return true;
    std::string message(end->message);
    if (end->status == Status::NoLocalMinmaxFound) {
      message += ": " + stalls_.describe_signs(canonical_, run.here->iterate.v);
    }
    return fail(run, end->status, std::move(message));
  }

  static bool fail(Run& run, Status status, std::string message = {}) {
    run.report.fail(status, std::move(message));
    return false;
  }

  [[nodiscard]] bool fail_by_limit(Run& run) const { return fail(run, *limit_.exceeded()); }
  void move_to_trial(Run& run) {
    std::swap(run.to, outer_.trial);
    run.here = &run.to;
  }

  /// The same with the trial point's direction.
  void accept(Run& run) {
    move_to_trial(run);
    std::swap(outer_.direction, outer_.trial_direction);
  }

  void count_dominated(bool dominated) {
    if (has_max() || filter_resets_ >= parameters::outer::kFilterResets) return;
    dominated_steps_ = dominated ? dominated_steps_ + 1 : 0;
    if (dominated_steps_ < parameters::outer::kFilterResets) return;
    filter_.reset();
    ++filter_resets_;
    dominated_steps_ = 0;
  }

  Restorer restorer_;
  StallDetection stalls_;
  OuterBlock outer_;

  /// Second derivatives of the point at which a fast step ended, by their number: K_yy is right
  /// there, or taken to be, in the freeze neighbourhood.
  std::uint64_t inner_right_at_ = 0;
  double least_residual_ = kInfinity;  ///< of the fast steps in a row since mu changed
  int steps_above_least_ = 0;          ///< fast ones in a row
  double last_slope_ = 1e20;
  double fast_contraction_ = 0.0;  ///< of the residual by the last step; 0: that was not full, fast
  Index dominated_steps_ = 0;      ///< in a row whose last rejection was the filter's
  Index filter_resets_ = 0;
  Index soft_steps_ = 0;
};

}  // namespace ipminmax
