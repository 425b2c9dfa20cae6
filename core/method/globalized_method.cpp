#include <algorithm>
#include <cmath>
#include <limits>

#include "core/method/barrier.hpp"
#include "core/method/globalized_method.hpp"
#include "core/method/restoration.hpp"
#include "core/model/initial_point.hpp"
#include "core/point/norms.hpp"
#include "core/point/residual.hpp"
#include "core/point/step_length.hpp"

namespace ipminmax {
namespace {

// Constants of the prototype study, see core/algorithm.md.
constexpr double kInnerFraction = 0.5;      // theta: |q| against the predicted outer decrease
constexpr double kInnerRelative = 0.1;      // t_in: |q| against |f_b|
constexpr double kInnerErrorFactor = 10.0;  // kappa_y: E_y against mu
constexpr double kFastContraction = 0.9;    // kappa_f
constexpr double kFreezeContraction = 0.1;
constexpr Index kFastPause = 2;
constexpr int kInnerSteps = 50;
constexpr int kInnerCorrections = 4;
constexpr Index kSlowSteps = 4;
constexpr double kSlowLength = 0.13;
// Setbacks before the search is given up, to begin anew elsewhere: cheap where there are few
// variables, so after a few.
constexpr Index kFewestSetbacks = 3;
constexpr Index kMostSetbacks = 15;
constexpr Index kVariablesPerSetback = 10;
// Iterations after which the fewest setbacks suffice, from the model's start and from others.
constexpr Index kLongSearch = 20;
constexpr Index kLongRepeatedSearch = 12;
constexpr Index kMaxEscapes = 30;
constexpr Index kMaxJointSteps = 40;
constexpr double kLongStep = 4.0;
constexpr double kBranchJump = 1e-2;
constexpr double kProgress = 0.9;  // of the violation
constexpr double kSmallProgress = 1e-4;
constexpr Index kStaleSteps = 8;
constexpr Index kMaxSoftSteps = 10;
constexpr double kSoftContraction = 0.9999;
constexpr int kSecondOrderSteps = 4;
constexpr double kSecondOrderDecrease = 0.99;       // kappa_soc
constexpr double kRestorationDecrease = 0.9;        // kappa_resto
constexpr double kLargestRestoredMultiplier = 1e3;  // bound_mult_reset_threshold of Ipopt
// Violation over tol below which nothing is restored, or not even where nothing else is left.
constexpr double kAlmostFeasible = 1e2;
constexpr double kFeasible = 1e-2;
constexpr int kConstraintSteps = 8;  // back to the constraints after an escape
// Directions of curvature: inverse iterations, the change of the Rayleigh quotient that ends them,
// and the factor between lengths tried.
constexpr int kInverseIterations = 60;
constexpr int kInverseIterationsWithMax = 6;
constexpr double kSettledQuotient = 1e-2;
constexpr double kEscapeDecrease = 0.5;
constexpr double kClearEscapeDecrease = 0.25;
constexpr double kShortestEscape = 1e-6;
constexpr double kShortestClearEscape = 0.1;
// Relative gain of an escape, and where curvature decides nothing.
constexpr double kLeastGain = 1e-10;
constexpr double kClearGain = 1e-6;
constexpr int kMaxTrials = 60;
// Of Ipopt: watchdog_shortened_iter_trigger, watchdog_trial_iter_max, filter_reset_trigger,
// max_filter_resets.
constexpr Index kShortenedBeforeWatchdog = 10;
constexpr Index kWatchdogTrials = 3;
constexpr Index kDominatedBeforeReset = 5;
constexpr Index kFilterResets = 5;
constexpr int kRoughTrials = 4;  // with an inexact inner maximum
constexpr int kExactTrials = 10;
constexpr double kExactGain = 1e-9;   // |q| of an exact one
constexpr Index kFilterPairs = 1000;  // that need no allocation
constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

GlobalizedMethod::GlobalizedMethod(CanonicalProblem& canonical, KktSystem& kkt,
                                   InertiaCorrection& correction, const SolverOptions& options,
                                   TimeLimit& limit, Counts& counts, bool allow_restoration,
                                   bool repeated)
    : canonical_(canonical),
      kkt_(kkt),
      correction_(correction),
      options_(options),
      limit_(limit),
      counts_(counts),
      allow_restoration_(allow_restoration),
      repeated_(repeated),
      inner_(canonical, kkt, correction, options, limit),
      max_setbacks_(std::min(
          kFewestSetbacks + (canonical.x().size() + canonical.y().size()) / kVariablesPerSetback,
          kMostSetbacks)) {
  rhs_ = step_ = correction_step_ = back_step_ = zero_step(canonical);
  direction_.step = trial_direction_.step = rhs_;
  gradient_ = rhs_.v;
  corrected_c_ = rhs_.lambda;
  filter_.reserve(static_cast<std::size_t>(std::min(options.max_iter, kFilterPairs)));
}

void GlobalizedMethod::start(const Point& point) {
  trial_ = before_ = best_trial_ = point;
  inner_.start(point);
  filter_.set_scale(violation(point.evaluation.c, canonical_.min_constraints()));
}

void GlobalizedMethod::barrier_changed() {
  filter_.reset();
  watchdog_.active = false;
  shortened_steps_ = 0;
  best_ = {kInfinity, kInfinity};
  stale_steps_ = 0;
  soft_steps_ = 0;
}

bool GlobalizedMethod::evaluate_values(Point& point) {
  return canonical_.values(point.iterate.v, point.evaluation.f, point.evaluation.c) ==
         EvaluationStatus::Ok;
}

bool GlobalizedMethod::evaluate_derivatives(Point& point) {
  if (canonical_.derivatives(point.iterate.v, point.iterate.lambda, point.evaluation) !=
      EvaluationStatus::Ok) {
    return false;
  }
  dual_residual(canonical_, point.iterate, point.evaluation, point.dual);
  return true;
}

bool GlobalizedMethod::evaluate_residual(Point& point) {
  if (!evaluate_values(point) ||
      canonical_.first_derivatives(point.iterate.v, point.evaluation) != EvaluationStatus::Ok) {
    return false;
  }
  dual_residual(canonical_, point.iterate, point.evaluation, point.dual);
  return true;
}

bool GlobalizedMethod::evaluate_hessian(Point& point) {
  return canonical_.second_derivatives(point.iterate.v, point.iterate.lambda, point.evaluation) ==
         EvaluationStatus::Ok;
}

Merit GlobalizedMethod::merit(const Point& point, double mu) const {
  return {violation(point.evaluation.c, canonical_.min_constraints()),
          barrier_objective(canonical_, point.iterate.v, point.evaluation.f, mu)};
}

double GlobalizedMethod::norm_error(const Point& point, double mu) const {
  return barrier_error(canonical_, point.iterate, point.evaluation, point.dual, mu, options_.s_max)
      .norm();
}

double GlobalizedMethod::inner_target(const Point& point, double mu) const {
  const double value = std::abs(merit(point, mu).phi);
  double target = std::min(kInnerFraction * last_slope_, kInnerRelative * (1.0 + value));
  if (canonical_.has_max_bounds()) target = std::min(target, std::max(1e-2 * mu, 1e-13));
  return std::max(target, 1e-14 * (1.0 + value));
}

void GlobalizedMethod::set_trial(const Point& from, const Step& step, double alpha_primal,
                                 double alpha_dual, double mu) {
  trial_.iterate = from.iterate;
  advance(step, {alpha_primal, alpha_dual}, trial_.iterate);
  clip_bound_multipliers(canonical_, mu, options_.kappa_sigma, trial_.iterate);
}

void GlobalizedMethod::accept(Point& point) {
  std::swap(point, trial_);
  std::swap(direction_, trial_direction_);
  direction_known_ = has_max();
  inner_right_ = false;
}

std::optional<Status> GlobalizedMethod::step(Point& point, double mu, IterationInfo& info) {
  info.trials = 0;
  ++steps_;
  if (!has_max()) return outer_step(point, mu, info);

  // Inner Newton step at this point, not before it is needed; the factorization of an accepted
  // trial point is still at hand.
  bool known = direction_known_ && direction_.mu == mu;
  bool right = inner_right_ || (direction_known_ && direction_.shift.y == 0.0);
  forget_direction();
  const auto find_direction = [&] {
    if (!known) known = inner_.direction(point, mu, direction_);
    return known;
  };
  const auto without_direction = [&] {
    message_ = "no shift of the Max variables gives K_yy the expected inertia";
    return Status::InertiaCorrectionFailed;
  };
  if (!right) {
    if (!find_direction()) return without_direction();
    right = direction_.shift.y == 0.0;
  }
  unshifted_step_ = UnshiftedStep::Unknown;
  inner_overwritten_ = false;
  if (right && fast_pause_ == 0) {
    if (fast_step(point, mu, info)) return std::nullopt;
    fast_pause_ = kFastPause;
  } else if (fast_pause_ > 0) {
    --fast_pause_;
  }
  fast_contraction_ = 0.0;
  if (!known) inner_overwritten_ = false;
  if (!find_direction()) return without_direction();

  const double target = inner_target(point, mu);
  const bool inner_solved =
      direction_.shift.y == 0.0 && std::abs(direction_.gain) <= target &&
      (!canonical_.has_max_bounds() || inner_.error(point, mu) <= kInnerErrorFactor * mu);
  if (!inner_solved) {
    if (inner_pause_ > 0) {
      --inner_pause_;
      return shifted_joint_step(point, mu, info);
    }
    const double estimate =
        merit(point, mu).phi + (direction_.shift.y == 0.0 ? direction_.gain : 0.0);
    before_ = point;
    const auto outcome =
        inner_.maximize(point, mu, target, kInnerSteps, kInfinity, direction_, !inner_overwritten_);
    unshifted_step_ = UnshiftedStep::Unknown;
    if (outcome != InnerMaximizer::Outcome::Maximum) {
      std::swap(point, before_);
      if (limit_.expired()) return limit_.exceeded();
      ++inner_failures_;
      inner_unbounded_ += outcome == InnerMaximizer::Outcome::Unbounded;
      if (auto status = set_back()) return status;
      inner_pause_ = (Index{1} << std::min<Index>(inner_failures_ - 1, 4)) - 1;
      return shifted_joint_step(point, mu, info);
    }
    filter_.reset();
    if (auto status = check_branch(estimate, point, mu)) return status;
  }
  inner_failures_ = 0;
  if (auto status = check_progress(point, mu)) return status;
  return outer_step(point, mu, info);
}

std::optional<Status> GlobalizedMethod::check_branch(double estimate, const Point& point,
                                                     double mu) {
  // phi above its estimate: another branch of inner maxima than the one descended on.
  const double value = merit(point, mu).phi;
  if (value <= estimate + kBranchJump * (1.0 + std::abs(value))) return std::nullopt;
  return set_back();
}

std::optional<Status> GlobalizedMethod::check_progress(const Point& point, double mu) {
  // Jumps between two branches too small for check_branch, to and fro over a kink.
  const Merit now = merit(point, mu);
  const bool better = now.theta < kProgress * best_.theta ||
                      now.phi < best_.phi - kSmallProgress * (1.0 + std::abs(best_.phi));
  if (better) {
    best_.theta = std::min(best_.theta, now.theta);
    best_.phi = std::min(best_.phi, now.phi);
    stale_steps_ = 0;
  } else if (++stale_steps_ >= kStaleSteps) {
    stale_steps_ = 0;
    return set_back();
  }
  return std::nullopt;
}

std::optional<Status> GlobalizedMethod::set_back() {
  const bool is_long = steps_ > (repeated_ ? kLongRepeatedSearch : kLongSearch);
  const Index allowed = is_long ? kFewestSetbacks : max_setbacks_;
  if (++setbacks_ <= allowed && joint_steps_ <= kMaxJointSteps) return std::nullopt;
  if (2 * inner_unbounded_ > setbacks_) {
    message_ = "the maximization over the Max variables looks unbounded";
    return Status::InnerUnbounded;
  }
  message_ = "the branches of inner maxima followed from here end or meet in a kink";
  return Status::NoLocalMinmaxFound;
}

bool GlobalizedMethod::newton_step(const Point& point, double mu, Regularization& shift) {
  kkt_.assemble(point.iterate, point.evaluation);
  newton_residual(canonical_, point.iterate, point.evaluation, point.dual, mu, rhs_);
  for (;;) {
    Regularization trial = shift;
    const bool zero_fails = unshifted_step_ == UnshiftedStep::Wrong && shift == Regularization{};
    if (!correction_.correct_full(mu, trial, zero_fails)) return false;
    if (kkt_.solve(point.evaluation, rhs_, step_)) {
      shift = trial;
      return true;
    }
    if (!kkt_.increase_quality()) return false;
  }
}

bool GlobalizedMethod::fast_step(Point& point, double mu, IterationInfo& info) {
  // Both inertias right without shifts and the residual contracts: Newton's method.
  kkt_.assemble(point.iterate, point.evaluation);
  newton_residual(canonical_, point.iterate, point.evaluation, point.dual, mu, rhs_);
  unshifted_step_ = UnshiftedStep::Wrong;
  if (!kkt_.has_expected_inertia(kkt_.factorize({})) ||
      !kkt_.solve(point.evaluation, rhs_, step_)) {
    return false;
  }
  unshifted_step_ = UnshiftedStep::Right;
  const StepLength alpha =
      largest_step(canonical_, point.iterate, step_, boundary_fraction(mu, options_));
  set_trial(point, step_, alpha.primal, alpha.dual, mu);
  ++info.trials;
  if (!evaluate_residual(trial_)) return false;
  const double contraction = norm_error(trial_, mu) / norm_error(point, mu);
  if (!(contraction <= kFastContraction) || !evaluate_hessian(trial_)) return false;
  // In the paper's freeze neighbourhood, where full steps contract faster and faster, K alone is
  // factorized. The certificate tests both matrices.
  const bool full = alpha.primal == 1.0 && alpha.dual == 1.0;
  const bool frozen = full && contraction <= std::min(kFreezeContraction, fast_contraction_);
  if (!frozen) {
    inner_overwritten_ = true;
    if (!inner_.has_maximum_in_sight(trial_)) return false;
  }
  fast_contraction_ = full ? contraction : 0.0;
  info.delta_x = info.delta_y = 0.0;
  info.alpha_primal = alpha.primal;
  info.alpha_dual = alpha.dual;
  info.step_norm = max_norm(step_.v);
  info.step_kind = 'n';
  std::swap(point, trial_);
  inner_right_ = true;
  filter_.reset();
  slow_steps_ = 0;
  return true;
}

std::optional<Status> GlobalizedMethod::shifted_joint_step(Point& point, double mu,
                                                           IterationInfo& info) {
  // Algorithm 1 of the paper: no inner maximum is in reach from here.
  ++joint_steps_;
  kkt_.assemble(point.iterate, point.evaluation);
  newton_residual(canonical_, point.iterate, point.evaluation, point.dual, mu, rhs_);
  const auto shift = correction_.correct(mu);
  if (!shift || !kkt_.solve(point.evaluation, rhs_, step_)) {
    message_ = "no shift of the Hessian gives the KKT matrix the expected inertia";
    return Status::InertiaCorrectionFailed;
  }
  StepLength alpha =
      largest_step(canonical_, point.iterate, step_, boundary_fraction(mu, options_));
  const double longest = 10.0 * (1.0 + max_norm(point.iterate.v));
  if (max_norm(step_.v) > longest) {
    alpha.primal = std::min(alpha.primal, longest / max_norm(step_.v));
  }
  if (auto status = step_untested(point, alpha, mu, info)) return status;
  info.delta_x = shift->x;
  info.delta_y = shift->y;
  info.shifts = correction_.findings();
  info.step_norm = max_norm(step_.v);
  info.step_kind = 'j';
  return std::nullopt;
}

std::optional<Status> GlobalizedMethod::step_untested(Point& point, StepLength alpha, double mu,
                                                      IterationInfo& info) {
  for (int cuts = 0; cuts < kMaxTrials; ++cuts, alpha.primal *= 0.5) {
    set_trial(point, step_, alpha.primal, alpha.dual, mu);
    ++info.trials;
    if (!evaluate_values(trial_) || !evaluate_derivatives(trial_)) continue;
    if (!trial_.dual.allFinite()) {  // the multipliers overflow
      alpha.dual *= 0.5;
      continue;
    }
    std::swap(point, trial_);
    forget_direction();
    filter_.reset();
    info.alpha_primal = alpha.primal;
    info.alpha_dual = alpha.dual;
    return std::nullopt;
  }
  message_ = canonical_.evaluation_error();
  return Status::EvaluationFailed;
}

double GlobalizedMethod::outer_slope(const Point& point, double mu) {
  // d/dx of phi along d_x: grad_x f_b + W_xy d_Y + J_yx' (lambda_y + dlambda_Y).
  barrier_gradient(canonical_, point, mu, gradient_);
  if (has_max()) {
    const Index y = canonical_.y().begin;
    const auto hessian = canonical_.hessian();
    for (std::size_t k = 0; k < hessian.size(); ++k) {
      const auto [row, col] = hessian[k];  // row >= col: row is the Max variable of a mixed entry
      if (row >= y && col < y) {
        gradient_[col] += point.evaluation.hessian[k] * direction_.step.v[row];
      }
    }
    const auto jacobian = canonical_.jacobian();
    for (std::size_t k = 0; k < jacobian.size(); ++k) {
      const auto [row, col] = jacobian[k];
      if (col < y && canonical_.max_constraints().contains(row)) {
        gradient_[col] += point.evaluation.jacobian[k] *
                          (point.iterate.lambda[row] + direction_.step.lambda[row]);
      }
    }
  }
  return gradient_.head(canonical_.y().begin).dot(step_.v.head(canonical_.y().begin));
}

GlobalizedMethod::Trial GlobalizedMethod::evaluate_trial(double mu, double slope, double alpha,
                                                         double upper_bound) {
  Trial result;
  if (!evaluate_values(trial_)) return result;
  if (has_max()) {
    // phi(x) is at least the value at any feasible y.
    if (inner_.feasible(trial_, mu) && merit(trial_, mu).phi > upper_bound) return result;
    // A trial point must keep a local maximum over y in sight.
    if (!evaluate_derivatives(trial_)) return result;
    if (!inner_.unshifted_direction(trial_, mu, trial_direction_)) return result;
    const double value = std::abs(merit(trial_, mu).phi);
    double allowed =
        std::min(kInnerFraction * alpha * std::abs(slope), kInnerRelative * (1.0 + value));
    allowed = std::max(allowed, 1e-14 * (1.0 + value));
    if (std::abs(trial_direction_.gain) > allowed &&
        inner_.maximize(trial_, mu, allowed, kInnerCorrections, upper_bound, trial_direction_,
                        true) != InnerMaximizer::Outcome::Maximum) {
      return result;
    }
  }
  result.merit = merit(trial_, mu);
  if (has_max()) result.merit.phi += trial_direction_.gain;
  result.usable = std::isfinite(result.merit.phi);
  return result;
}

std::optional<Status> GlobalizedMethod::outer_step(Point& point, double mu, IterationInfo& info) {
  bool inner_exact = !has_max();
  for (;;) {
    Regularization shift;
    if (has_max()) {
      shift = direction_.shift;
      shift.x = shift.lambda_x = 0.0;
    }
    const bool at_hand = unshifted_step_ == UnshiftedStep::Right && shift == Regularization{};
    if (!at_hand && !newton_step(point, mu, shift)) {
      if (can_restore(point) && !limit_.expired()) return restore(point, mu, info);
      message_ = "no shift of the Hessian gives the KKT matrix the expected inertia";
      return Status::InertiaCorrectionFailed;
    }
    info.delta_x = shift.x;
    info.delta_y = shift.y;
    info.step_norm = max_norm(step_.v);
    info.step_kind = shift.x > 0.0 ? 's' : 'f';
    bool skip_first = false;
    if (!has_max() && watched_step(point, mu, info, skip_first)) return std::nullopt;
    const int trials = !has_max() ? kMaxTrials : inner_exact ? kExactTrials : kRoughTrials;
    if (search(point, mu, trials, info, skip_first)) return std::nullopt;
    if (limit_.expired()) return limit_.exceeded();  // no other step in haste
    // Rejections may be the fault of phi's estimate: make it exact and search once more.
    if (inner_exact || std::abs(direction_.gain) <= kExactGain) break;
    inner_exact = true;
    before_ = point;
    if (inner_.maximize(point, mu, kExactGain, kInnerSteps, kInfinity, direction_, false) !=
        InnerMaximizer::Outcome::Maximum) {
      std::swap(point, before_);
      if (limit_.expired()) return limit_.exceeded();
      return leap(point, mu, info);  // the branch ends before its maximum
    }
    const double estimate = merit(before_, mu).phi;
    unshifted_step_ = UnshiftedStep::Unknown;
    filter_.reset();
    if (auto status = check_branch(estimate, point, mu)) return status;
  }
  if (soft_steps_ < kMaxSoftSteps && soft_step(point, mu, info)) {
    ++soft_steps_;
    return std::nullopt;
  }
  if (can_restore(point)) return restore(point, mu, info);
  if (has_max()) return leap(point, mu, info);
  // Points of long ago may be all that rejects.
  filter_.reset();
  if (search(point, mu, kMaxTrials, info, false)) return std::nullopt;
  const bool exactly_feasible =
      point.evaluation.c.size() == 0 ||
      point.evaluation.c.lpNorm<Eigen::Infinity>() <= kFeasible * options_.tol;
  if (allow_restoration_ && !exactly_feasible) return restore(point, mu, info);
  message_ = "no acceptable step found";
  return Status::TinyStep;
}

bool GlobalizedMethod::can_restore(const Point& point) const {
  return allow_restoration_ && point.evaluation.c.size() > 0 &&
         point.evaluation.c.lpNorm<Eigen::Infinity>() > kAlmostFeasible * options_.tol;
}

std::optional<Status> GlobalizedMethod::restore(Point& point, double mu, IterationInfo& info) {
  // Where a branch of inner maxima ends, restorations may go round in circles.
  if (has_max()) {
    if (auto status = set_back()) return status;
  }
  // The violation that counts is that of both players: Max constraints are restored with Min's.
  const auto total = [&](const Eigen::VectorXd& c) { return c.lpNorm<1>(); };
  const double start_theta = total(point.evaluation.c);
  Merit from = merit(point, mu);
  if (has_max()) from.phi += direction_.gain;
  filter_.add(from);
  const auto acceptable = [&](const Eigen::VectorXd& v, const Eigen::VectorXd& c) {
    if (total(c) > kRestorationDecrease * start_theta) return false;
    double f = 0.0;
    if (canonical_.objective(v, f) != EvaluationStatus::Ok) return false;
    return has_max() || filter_.acceptable({total(c), barrier_objective(canonical_, v, f, mu)});
  };
  // The step back counts, too.
  const Index granted =
      std::max<Index>(0, options_.max_iter - info.iteration - 1 - counts_.restoration_iterations);
  Index allowed = granted;
  trial_.iterate = point.iterate;
  trial_.evaluation = point.evaluation;
  SolverOptions options = options_;
  limit_.pass_on(options);
  const auto outcome = restore_feasibility(canonical_, options, mu, acceptable,
                                           restoration_observer_, trial_, allowed);
  counts_.restoration_iterations += granted - allowed;
  switch (outcome) {
    case RestorationOutcome::Restored:
      break;
    case RestorationOutcome::LocallyInfeasible:
      message_ = "the violation of the constraints is at a local minimum";
      if (!has_max()) {  // the point that shows it
        std::swap(point, trial_);
        evaluate_where_defined(canonical_, point);  // f has not been asked for there
      }
      return Status::LocallyInfeasible;
    case RestorationOutcome::Stopped:
      return limit_.expired() ? limit_.exceeded() : Status::MaxIterations;
    case RestorationOutcome::UserStop:
      std::swap(point, trial_);
      evaluate_where_defined(canonical_, point);
      return Status::UserStop;
    case RestorationOutcome::Failed:
      if (has_max()) return leap(point, mu, info);
      message_ = "the feasibility restoration failed";
      return Status::RestorationFailed;
  }
  // Multipliers start anew: bounds at mu / s, constraints by least squares.
  for (const Index i : canonical_.lower_bounded()) {
    trial_.iterate.z_lower[i] =
        std::min(kLargestRestoredMultiplier, mu / canonical_.above_lower(i, trial_.iterate.v[i]));
  }
  for (const Index i : canonical_.upper_bounded()) {
    trial_.iterate.z_upper[i] =
        std::min(kLargestRestoredMultiplier, mu / canonical_.below_upper(i, trial_.iterate.v[i]));
  }
  const auto undefined = [&] {
    message_ = canonical_.evaluation_error() + " where the feasibility restoration ended";
    return Status::EvaluationFailed;
  };
  if (!evaluate_values(trial_) ||
      canonical_.first_derivatives(trial_.iterate.v, trial_.evaluation) != EvaluationStatus::Ok) {
    return undefined();
  }
  if (!kkt_.least_squares_multipliers(trial_.iterate, trial_.evaluation, trial_.iterate.lambda) ||
      trial_.iterate.lambda.lpNorm<Eigen::Infinity>() > options_.constr_mult_init_max) {
    trial_.iterate.lambda.setZero();
  }
  start_robust_multipliers(canonical_, trial_.iterate);
  if (!evaluate_derivatives(trial_)) return undefined();
  std::swap(point, trial_);
  forget_direction();
  soft_steps_ = 0;
  info.step_kind = 'R';
  info.alpha_primal = info.alpha_dual = 1.0;
  return std::nullopt;
}

void GlobalizedMethod::count_dominated(bool dominated) {
  if (has_max() || filter_resets_ >= kFilterResets) return;
  dominated_steps_ = dominated ? dominated_steps_ + 1 : 0;
  if (dominated_steps_ < kDominatedBeforeReset) return;
  filter_.reset();
  ++filter_resets_;
  dominated_steps_ = 0;
}

bool GlobalizedMethod::watched_step(Point& point, double mu, IterationInfo& info,
                                    bool& skip_first) {
  // Ipopt's watchdog: full steps that need not improve on the point they leave, as long as one of
  // the first few improves on the point where it began.
  skip_first = false;
  if (!watchdog_.active) {
    if (shortened_steps_ < kShortenedBeforeWatchdog) return false;
    watchdog_.point = point;
    watchdog_.step = step_;
    watchdog_.from = merit(point, mu);
    watchdog_.slope = outer_slope(point, mu);
    watchdog_.info = info;
    watchdog_.trials = 0;
    watchdog_.active = true;
  }
  const StepLength alpha =
      largest_step(canonical_, point.iterate, step_, boundary_fraction(mu, options_));
  if (watchdog_.trials == 0) watchdog_.alpha = alpha.primal;
  set_trial(point, step_, alpha.primal, alpha.dual, mu);
  ++info.trials;
  const Trial trial = evaluate_trial(mu, watchdog_.slope, alpha.primal, kInfinity);
  const bool defined = trial.usable && evaluate_derivatives(trial_);
  const auto verdict = filter_.test(watchdog_.from, watchdog_.slope, watchdog_.alpha, trial.merit);
  const bool improves = defined && Filter::accepted(verdict);
  if (improves || (defined && ++watchdog_.trials <= kWatchdogTrials)) {
    if (improves) {
      if (verdict == Filter::Verdict::Sufficient) filter_.add(watchdog_.from);
      watchdog_.active = false;
      shortened_steps_ = 0;
    }
    accept(point);
    info.alpha_primal = alpha.primal;
    info.alpha_dual = alpha.dual;
    info.step_kind = 'W';
    return true;
  }
  watchdog_.active = false;
  shortened_steps_ = 0;
  skip_first = true;
  std::swap(point, watchdog_.point);
  std::swap(step_, watchdog_.step);
  const Index trials = info.trials;
  const Index iteration = info.iteration;
  info = watchdog_.info;
  info.iteration = iteration;
  info.trials = trials;
  return false;
}

bool GlobalizedMethod::search(Point& point, double mu, int max_trials, IterationInfo& info,
                              bool skip_first) {
  const StepLength alpha =
      largest_step(canonical_, point.iterate, step_, boundary_fraction(mu, options_));
  const double slope = outer_slope(point, mu);
  last_slope_ = std::abs(slope);
  Merit from = merit(point, mu);
  if (has_max()) from.phi += direction_.gain;
  // phi above this cannot be accepted when there is no violation to reduce.
  const double upper_bound = from.theta == 0.0 ? from.phi : kInfinity;
  const double smallest = filter_.smallest_step(from, slope);
  info.alpha_dual = alpha.dual;

  double t = alpha.primal;
  if (has_max()) {
    // phi is known along one branch of inner maxima only: no step far out of its neighbourhood.
    const double longest = kLongStep * (1.0 + max_norm(point.iterate.v));
    t = std::min(t, longest / std::max(max_norm(step_.v), longest));
  }
  bool dominated = false;  // the last trial: by the filter alone
  for (int k = 0; k < max_trials && t >= smallest && !limit_.expired(); ++k, t *= 0.5) {
    if (k == 0 && skip_first) continue;
    set_trial(point, step_, t, alpha.dual, mu);
    ++info.trials;
    info.alpha_primal = t;
    const Trial trial = evaluate_trial(mu, slope, t, upper_bound);
    auto verdict = Filter::Verdict::Reject;
    if (trial.usable) {
      verdict = filter_.test(from, slope, t, trial.merit);
      if (Filter::accepted(verdict)) count_dominated(dominated);
      dominated = verdict == Filter::Verdict::Dominated;
      if (!Filter::accepted(verdict) && k == 0 && trial.merit.theta >= from.theta &&
          from.theta + trial.merit.theta > 0.0) {
        verdict = second_order_correction(point, mu, from, slope, t, trial.merit.theta, info);
      }
    }
    if (!Filter::accepted(verdict)) continue;
    if (!has_max() && !evaluate_derivatives(trial_)) continue;
    if (verdict == Filter::Verdict::Sufficient) filter_.add(from);
    accept(point);
    slow_steps_ = info.alpha_primal <= kSlowLength ? slow_steps_ + 1 : 0;
    shortened_steps_ = k > 0 ? shortened_steps_ + 1 : 0;
    soft_steps_ = 0;
    if (has_max() && slow_steps_ >= kSlowSteps) fast_pause_ = 0;
    return true;
  }
  return false;
}

Filter::Verdict GlobalizedMethod::second_order_correction(const Point& point, double mu,
                                                          const Merit& from, double slope,
                                                          double alpha, double first_theta,
                                                          IterationInfo& info) {
  constexpr auto kReject = Filter::Verdict::Reject;
  // Waechter and Biegler 2006, section 2.4: same matrix, c_soc = alpha c + c(trial).
  Eigen::VectorXd& c = corrected_c_;
  c = alpha * point.evaluation.c + trial_.evaluation.c;
  double last_theta = first_theta;
  const double tau = boundary_fraction(mu, options_);
  if (has_max()) kkt_.take_barrier_terms(point.iterate);
  for (int k = 0; k < kSecondOrderSteps; ++k) {
    newton_residual(canonical_, point.iterate, point.evaluation, point.dual, mu, rhs_);
    rhs_.lambda = -c;
    if (!kkt_.solve(point.evaluation, rhs_, correction_step_)) return kReject;
    const StepLength a = largest_step(canonical_, point.iterate, correction_step_, tau);
    set_trial(point, correction_step_, a.primal, a.dual, mu);
    ++info.trials;
    const Trial trial = evaluate_trial(mu, slope, alpha, kInfinity);
    if (!trial.usable) return kReject;
    const auto verdict = filter_.test(from, slope, alpha, trial.merit);
    if (Filter::accepted(verdict)) {
      info.alpha_primal = a.primal;
      info.alpha_dual = a.dual;
      info.step_kind = 'c';
      return verdict;
    }
    if (trial.merit.theta > kSecondOrderDecrease * last_theta) return kReject;
    last_theta = trial.merit.theta;
    c = a.primal * c + trial_.evaluation.c;
    if (has_max()) kkt_.take_barrier_terms(point.iterate);
  }
  return kReject;
}

bool GlobalizedMethod::soft_step(Point& point, double mu, IterationInfo& info) {
  // Near rounding no merit function sees the progress that the residual still makes.
  const StepLength alpha =
      largest_step(canonical_, point.iterate, step_, boundary_fraction(mu, options_));
  const double both = std::min(alpha.primal, alpha.dual);
  set_trial(point, step_, both, both, mu);
  ++info.trials;
  if (!evaluate_residual(trial_)) return false;
  if (!(norm_error(trial_, mu) <= kSoftContraction * norm_error(point, mu))) return false;
  if (!evaluate_hessian(trial_)) return false;
  if (has_max() && !inner_.unshifted_direction(trial_, mu, trial_direction_)) return false;
  info.alpha_primal = info.alpha_dual = both;
  info.step_kind = 'r';
  accept(point);
  return true;
}

std::optional<Status> GlobalizedMethod::leap(Point& point, double mu, IterationInfo& info) {
  // No step is acceptable: take a long one all the same, finitely often.
  if (auto status = set_back()) return status;
  const StepLength alpha =
      largest_step(canonical_, point.iterate, step_, boundary_fraction(mu, options_));
  if (auto status = step_untested(point, alpha, mu, info)) return status;
  slow_steps_ = 0;
  info.step_kind = 'l';
  return std::nullopt;
}

GlobalizedMethod::Trial GlobalizedMethod::back_to_constraints(const Point& point, double mu,
                                                              Trial trial) {
  // A direction of curvature is tangent to the constraints, which bend: Newton steps on c with the
  // matrix factorized at the point.
  set_zero(rhs_);
  Step& back = back_step_;
  best_trial_ = trial_;
  for (int k = 0; k < kConstraintSteps && trial.merit.theta > options_.tol; ++k) {
    rhs_.lambda = -trial_.evaluation.c;
    if (!kkt_.solve(point.evaluation, rhs_, back)) break;
    back.lambda.setZero();
    back.z_lower.setZero();
    back.z_upper.setZero();
    before_ = trial_;
    set_trial(before_, back, largest_step(canonical_, before_.iterate, back, 0.9).primal, 0.0, mu);
    const Trial next = evaluate_trial(mu, 1.0, 1.0, kInfinity);
    if (!next.usable || !(next.merit.theta < trial.merit.theta)) break;
    trial = next;
    best_trial_ = trial_;
  }
  std::swap(trial_, best_trial_);
  return trial;
}

/// Inverse iteration with the shifted K turns step_ to the direction of least curvature of phi.
bool GlobalizedMethod::turn_to_least_curvature(const Point& point, bool clear) {
  const Index nx = canonical_.y().begin;
  set_zero(rhs_);
  for (Index i = 0; i < nx; ++i) rhs_.v[i] = std::sin(1.0 + i);
  // A shift far above what K needs makes the iteration slow. Where little is at stake it ends when the
  // Rayleigh quotient of the inverse has settled.
  double last_quotient = kInfinity;
  for (int k = 0; k < (has_max() ? kInverseIterationsWithMax : kInverseIterations); ++k) {
    if (!kkt_.solve(point.evaluation, rhs_, step_)) return false;
    const double quotient = rhs_.v.head(nx).dot(step_.v.head(nx)) / rhs_.v.head(nx).squaredNorm();
    const double norm = step_.v.head(nx).norm();
    if (!(norm > 0.0)) return false;
    rhs_.v.head(nx) = step_.v.head(nx) / norm;
    step_.v /= norm;
    const bool settled =
        std::abs(quotient - last_quotient) <= kSettledQuotient * std::abs(quotient);
    if (settled && clear) break;
    last_quotient = quotient;
  }
  return true;
}

bool GlobalizedMethod::escape(Point& point, double mu, bool clear, IterationInfo& info,
                              const std::optional<WrongCurvature>& wrong) {
  if (++escapes_ > kMaxEscapes) return false;
  forget_direction();
  filter_.reset();
  info.trials = 0;
  if (has_max()) {
    if (!inner_.direction(point, mu, direction_)) return false;
    const bool inner_wrong = wrong && wrong->owner == Player::Max;
    if (inner_wrong &&
        (!inner_.leave(point, mu, wrong->direction) || !inner_.direction(point, mu, direction_))) {
      return false;
    }
    if (inner_wrong || direction_.shift.y > 0.0) {
      const auto outcome = inner_.maximize(point, mu, inner_target(point, mu), kInnerSteps,
                                           kInfinity, direction_, true);
      info.step_kind = 'e';
      return outcome == InnerMaximizer::Outcome::Maximum ||
             outcome == InnerMaximizer::Outcome::NotFound;
    }
  }
  Regularization shift = has_max() ? direction_.shift : Regularization{};
  if (!newton_step(point, mu, shift)) return false;
  if (wrong && wrong->owner == Player::Min) {
    step_.v = wrong->direction / wrong->direction.head(canonical_.y().begin).norm();
  } else if (!turn_to_least_curvature(point, clear)) {
    return false;
  }
  step_.lambda.setZero();
  step_.z_lower.setZero();
  step_.z_upper.setZero();
  Merit from = merit(point, mu);
  if (has_max()) from.phi += direction_.gain;
  if (outer_slope(point, mu) > 0.0) step_.v = -step_.v;
  // Twice the largest multiplier makes the violation's l1 norm an exact penalty.
  const double penalty = has_max() ? 0.0 : 2.0 * max_norm(point.iterate.lambda);
  const double length = 0.1 * (1.0 + max_norm(point.iterate.v));
  const double decrease = clear ? kClearEscapeDecrease : kEscapeDecrease;
  const double shortest = (clear ? kShortestClearEscape : kShortestEscape) * length;
  for (double t = length; t > shortest && !limit_.expired(); t *= decrease) {
    for (const double sign : {1.0, -1.0}) {
      correction_step_ = step_;
      correction_step_.v *= sign * t;
      const StepLength a = largest_step(canonical_, point.iterate, correction_step_, 0.9);
      set_trial(point, correction_step_, a.primal, a.dual, mu);
      ++info.trials;
      Trial trial = evaluate_trial(mu, 1.0, t, kInfinity);
      const double least_gain = (clear ? kClearGain : kLeastGain) * (1.0 + std::abs(from.phi));
      if (clear && trial.merit.phi > from.phi - least_gain) continue;
      if (trial.usable && !has_max()) trial = back_to_constraints(point, mu, trial);
      // A violation left over may not pay for the decrease.
      const double change = trial.merit.phi - from.phi + penalty * (trial.merit.theta - from.theta);
      if (!trial.usable || !(change < -least_gain)) continue;
      if (!has_max() && !evaluate_derivatives(trial_)) continue;
      accept(point);
      info.alpha_primal = a.primal;
      info.step_kind = 'e';
      return true;
    }
  }
  return false;
}

}  // namespace ipminmax
