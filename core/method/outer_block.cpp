#include <algorithm>
#include <cmath>
#include <utility>

#include "core/method/barrier.hpp"
#include "core/method/outer_block.hpp"
#include "core/method/parameters.hpp"
#include "core/point/residual.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

OuterBlock::OuterBlock(const MethodContext& context, const Point& first, OuterArrays& arrays)
    : Kept(&arrays),
      inner(context, first, inner_arrays),
      canonical_(context.canonical),
      kkt_(context.kkt),
      correction_(context.correction),
      options_(context.options) {
  trial = first;
  for (Step* zero : {&rhs, &step, &corrected}) set_zero(canonical_, *zero);
  direction.clear(canonical_);
  trial_direction.clear(canonical_);
  gradient_ = rhs.v;
  corrected_c = rhs.lambda;
}

Merit OuterBlock::merit(const Point& point, double mu) const {
  return {violation(point.evaluation.c, canonical_.min_constraints()),
          barrier_objective(canonical_, point.iterate.v, point.evaluation.f, mu)};
}

Merit OuterBlock::estimate(const Point& point, double mu) const {
  Merit result = merit(point, mu);
  if (has_max()) result.phi += direction.gain;
  return result;
}

double OuterBlock::norm_error(const Point& point, double mu) const {
  return barrier_error(canonical_, point, mu, options_.s_max).norm();
}

void OuterBlock::assemble(const Point& point, double mu) {
  kkt_.assemble(point.iterate, point.evaluation);
  newton_residual(canonical_, point, mu, rhs);
}

bool OuterBlock::find_step(const Point& point, double mu, Regularization& shift, bool zero_fails) {
  assemble(point, mu);
  for (;;) {
    Regularization found = shift;
    const Evaluation* at = has_max() ? &point.evaluation : nullptr;
    if (!correction_.correct_full(mu, found, at, zero_fails && shift.y == 0.0)) return false;
    factors = kkt_.factors();
    if (solve(point)) {
      shift = found;
      return true;
    }
    if (!kkt_.increase_quality()) return false;
  }
}

StepLength OuterBlock::longest_step(const Point& point, double mu) const {
  return largest_step(canonical_, point.iterate, step, boundary_fraction(mu, options_));
}

double OuterBlock::slope(const Point& point, double mu) {
  // d/dx of phi along d_x: grad_x f_b + W_xy d_Y + J_yx' (lambda_y + dlambda_Y).
  barrier_gradient(canonical_, point, mu, gradient_);
  const Index y = canonical_.y().begin;
  if (has_max()) {
    const auto hessian = canonical_.hessian();
    for (std::size_t k = 0; k < hessian.size(); ++k) {
      const auto [row, col] = hessian[k];  // row >= col: row is the Max variable of a mixed entry
      if (row >= y && col < y && canonical_.served_slack(row) < 0) {
        gradient_[col] += point.evaluation.hessian[k] * direction.step.v[row];
      }
    }
    const auto jacobian = canonical_.jacobian();
    for (std::size_t k = 0; k < jacobian.size(); ++k) {
      const auto [row, col] = jacobian[k];
      if (col < y && canonical_.max_constraints().contains(row) &&
          canonical_.slack_served_by_constraint(row) < 0) {
        gradient_[col] +=
            point.evaluation.jacobian[k] * (point.iterate.lambda[row] + direction.step.lambda[row]);
      }
    }
  }
  return gradient_.head(y).dot(step.v.head(y));
}

void OuterBlock::set_trial(const Point& from, const Step& along, StepLength alpha, double mu) {
  trial.iterate = from.iterate;
  // Minimizations go as Ipopt's do.
  advance(canonical_, along, alpha, trial.iterate,
          has_max() ? InequalityLength::Dual : InequalityLength::Primal);
  clip_bound_multipliers(canonical_, mu, options_.kappa_sigma, trial.iterate);
}

double tolerated_gain(double share, double phi) {
  namespace parameter = parameters::inner;
  const double size = 1.0 + std::abs(phi);
  return std::max(std::min(share, parameters::kLittle * size), parameter::kRoundingShare * size);
}

double OuterBlock::Bound::operator()(double alpha, double theta) const {
  if (filter_ == nullptr) return kInfinity;
  const Merit& from = line_->from;
  // The first trial may be worth a second-order correction.
  const bool correctable = alpha == line_->longest.primal && theta >= from.theta && theta > 0.0;
  if (!correctable) return filter_->largest_acceptable(from, line_->slope, alpha, theta);
  // phi above this cannot be accepted when there is no violation to reduce.
  return from.theta == 0.0 ? from.phi : kInfinity;
}

Trial OuterBlock::evaluate_trial(double mu, double slope, double alpha, const Bound& bound) {
  Trial result;
  if (evaluate_values(canonical_, trial) != EvaluationStatus::Ok) return result;
  if (has_max()) {
    // phi(x) is at least the value at any feasible y.
    const Merit least = merit(trial, mu);
    const double upper_bound = bound(alpha, least.theta);
    if (inner.feasible(trial, mu) && least.phi > upper_bound) return result;
    // A trial point must keep a local maximum over y in sight.
    if (evaluate_derivatives(canonical_, trial) != EvaluationStatus::Ok) return result;
    if (!find_trial_direction(mu)) return result;
    const double allowed = tolerated_gain(parameters::inner::kSlopeShare * alpha * std::abs(slope),
                                          merit(trial, mu).phi);
    if (trial_direction.largest_gain() > allowed &&
        inner.maximize(trial, mu, allowed, parameters::kFew, upper_bound, trial_direction) !=
            InnerMaximizer::Outcome::Maximum) {
      return result;
    }
  }
  result.merit = merit(trial, mu);
  if (has_max()) result.merit.phi += trial_direction.gain;
  result.usable = std::isfinite(result.merit.phi);
  return result;
}

std::optional<StepLength> OuterBlock::correct(const Point& from, double mu,
                                              const Eigen::VectorXd& c) {
  newton_residual(canonical_, from, mu, rhs);
  rhs.lambda = -c;
  if (!kkt_.solve(factors, from.evaluation, rhs, corrected)) return std::nullopt;
  const StepLength alpha =
      largest_step(canonical_, from.iterate, corrected, boundary_fraction(mu, options_));
  set_trial(from, corrected, alpha, mu);
  return alpha;
}

Trial OuterBlock::return_to_constraints(const Point& from, double mu, Trial reached) {
  // A direction of curvature is tangent to the constraints, which bend: Newton steps on c with the
  // matrix factorized at the point.
  set_zero(rhs);
  best_ = trial;
  for (int k = 0; k < parameters::escape::kConstraintSteps && reached.merit.theta > options_.tol;
       ++k) {
    rhs.lambda = -trial.evaluation.c;
    Step& back = corrected;
    if (!kkt_.solve(factors, from.evaluation, rhs, back)) break;
    back.lambda.setZero();
    back.z_lower.setZero();
    back.z_upper.setZero();
    before_ = trial;
    const double alpha =
        largest_step(canonical_, before_.iterate, back, parameters::kProgress).primal;
    set_trial(before_, back, {.primal = alpha, .dual = 0.0}, mu);
    const Trial next = evaluate_trial(mu, 1.0, 1.0, {});
    if (!next.usable || !(next.merit.theta < reached.merit.theta)) break;
    reached = next;
    best_ = trial;
  }
  std::swap(trial, best_);
  return reached;
}

}  // namespace ipminmax
