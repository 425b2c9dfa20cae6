#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/method/barrier.hpp"
#include "core/method/filter_search.hpp"
#include "core/method/inner_maximizer.hpp"
#include "core/method/parameters.hpp"
#include "core/method/step_method.hpp"
#include "core/model/indices.hpp"
#include "core/point/point.hpp"
#include "core/point/residual.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

/// What an inner Newton step may still promise to gain where phi is estimated: that share, but less
/// than phi itself says and more than its rounding.
[[nodiscard]] inline double tolerated_gain(double share, double phi) {
  namespace parameter = parameters::inner;
  constexpr double kMostOfPhi = 0.1;
  const double size = 1.0 + std::abs(phi);
  return std::max(std::min(share, kMostOfPhi * size), parameter::kRoundingShare * size);
}

/// What an OuterBlock works with, kept from one to the next.
struct OuterArrays {
  InnerArrays inner_arrays;
  Point trial;
  InnerDirection direction;        ///< inner Newton step at the current point
  InnerDirection trial_direction;  ///< at the trial point
  NewtonResidual rhs;
  Step step;
  Step corrected;               ///< another step, of corrections and escapes
  Eigen::VectorXd corrected_c;  ///< right-hand side of second-order corrections
  Eigen::VectorXd gradient_;
  Point before_, best_;  ///< on the way back to the constraints
};

/// The minimizer's side of the globalized method: the Newton step through K, and phi(x), estimated
/// by the barrier value plus the predicted gain of the inner Newton step, along it. Without Max
/// variables phi is the barrier objective.
class OuterBlock : public Kept<OuterArrays>, MethodContext {
 public:
  /// The largest merit phi worth looking at where the violation is theta.
  class Bound {
   public:
    Bound() = default;  ///< none
    Bound(const Filter& filter, const SearchLine& line) : filter_(&filter), line_(&line) {}
    double operator()(double alpha, double theta) const {
      if (filter_ == nullptr) return kInfinity;
      const Merit& from = line_->from;
      // The first trial may be worth a second-order correction.
      const bool correctable = alpha == line_->longest.primal && theta >= from.theta && theta > 0.0;
      if (!correctable) return filter_->largest_acceptable(from, line_->slope, alpha, theta);
      // phi above this cannot be accepted when there is no violation to reduce.
      return from.theta == 0.0 ? from.phi : kInfinity;
    }

   private:
    const Filter* filter_ = nullptr;
    const SearchLine* line_ = nullptr;
  };

  /// first: where the search begins.
  OuterBlock(const MethodContext& context, const Point& first, OuterArrays& arrays)
      : Kept(&arrays), MethodContext(context), inner(context, first, inner_arrays) {
    trial = first;
    for (Step* zero : {&rhs, &step, &corrected}) set_zero(canonical_, *zero);
    direction.clear(canonical_);
    trial_direction.clear(canonical_);
    gradient_ = rhs.v;
    corrected_c = rhs.lambda;
  }

  /// Violation of the Min constraints and f_b.
  [[nodiscard]] Merit merit(const Point& point, double mu) const {
    return {violation(point.evaluation.c, canonical_.min_constraints()),
            barrier_objective(canonical_, point.iterate.v, point.evaluation.f, mu)};
  }

  /// The same with phi estimated, at the point that direction belongs to.
  [[nodiscard]] Merit estimate(const Point& point, double mu) const {
    Merit result = merit(point, mu);
    if (has_max()) result.phi += direction.gain;
    return result;
  }

  [[nodiscard]] double norm_error(const Point& point, double mu) const {
    return barrier_error(canonical_, point, mu, options_.s_max).norm();
  }

  /// Right-hand side and matrices at the point.
  void assemble(const Point& point, double mu) {
    kkt_.assemble(point.iterate, point.evaluation);
    newton_residual(canonical_, point, mu, rhs);
  }

  /// The Newton step with shifts of x that K needs, given those of y; assembled anew. zero_fails: K
  /// is known to be wrong without shift.
  [[nodiscard]] bool find_step(const Point& point, double mu, Regularization& shift,
                               bool zero_fails) {
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

  /// The Newton step with factors.
  [[nodiscard]] bool solve(const Point& point, const Accuracy& accuracy = {}) {
    return kkt_.solve(factors, point.evaluation, rhs, step, accuracy);
  }

  /// As far along step as bounds allow.
  [[nodiscard]] StepLength longest_step(const Point& point, double mu) const {
    return largest_step(canonical_, point.iterate, step, boundary_fraction(mu, options_));
  }

  /// Directional derivative of phi along step.
  [[nodiscard]] double slope(const Point& point, double mu) {
    // d/dx of phi along d_x: grad_x f_b + W_xy d_Y + J_yx' (lambda_y + dlambda_Y).
    barrier_gradient(canonical_, point, mu, gradient_);
    const Index y = canonical_.y().begin;
    if (has_max()) {
      const auto hessian = canonical_.hessian();
      for (const auto k : indices(hessian)) {
        const auto [row, col] = hessian[k];  // row >= col: row is the Max variable of a mixed entry
        if (row >= y && col < y && canonical_.robust_slack(row) < 0) {
          gradient_[col] += point.evaluation.hessian[k] * direction.step.v[row];
        }
      }
      const auto jacobian = canonical_.jacobian();
      for (const auto k : indices(jacobian)) {
        const auto [row, col] = jacobian[k];
        if (col < y && canonical_.max_constraints().contains(row) &&
            canonical_.robust_slack_of_constraint(row) < 0) {
          gradient_[col] += point.evaluation.jacobian[k] *
                            (point.iterate.lambda[row] + direction.step.lambda[row]);
        }
      }
    }
    return gradient_.head(y).dot(step.v.head(y));
  }

  /// Of the trial point; the shift in trial_direction.
  [[nodiscard]] bool has_trial_maximum_in_sight(double mu) {
    const KktSystem::Counting counting(kkt_, FactorizationCause::TrialPoint);
    return inner.has_maximum_in_sight(trial, mu, trial_direction.shift);
  }

  void set_trial(const Point& from, const Step& along, StepLength alpha, double mu) {
    trial.iterate = from.iterate;
    // Minimizations go as Ipopt's do.
    advance(canonical_, along, alpha, trial.iterate,
            has_max() ? InequalityLength::Dual : InequalityLength::Primal);
    clip_bound_multipliers(canonical_, mu, options_.kappa_sigma, trial.iterate);
  }

  /// Merit of the trial point, its inner maximum first where there are Max variables: it must keep
  /// one in sight. None where phi is seen to lie above the bound, before K_yy is factorized if the
  /// value shows it.
  [[nodiscard]] Trial evaluate_trial(double mu, double slope, double alpha, const Bound& bound) {
    Trial result;
    if (!evaluate_values(canonical_, trial)) return result;
    if (has_max()) {
      // phi(x) is at least the value at any feasible y.
      const Merit least = merit(trial, mu);
      const double upper_bound = bound(alpha, least.theta);
      if (inner.feasible(trial, mu) && least.phi > upper_bound) return result;
      // A trial point must keep a local maximum over y in sight.
      if (!evaluate_derivatives(canonical_, trial)) return result;
      if (!find_trial_direction(mu)) return result;
      const double allowed = tolerated_gain(
          parameters::inner::kSlopeShare * alpha * std::abs(slope), merit(trial, mu).phi);
      constexpr int kInnerSteps = 4;
      if (trial_direction.largest_gain() > allowed &&
          inner.maximize(trial, mu, allowed, kInnerSteps, upper_bound, trial_direction) !=
              InnerMaximizer::Outcome::Maximum) {
        return result;
      }
    }
    result.merit = merit(trial, mu);
    if (has_max()) result.merit.phi += trial_direction.gain;
    result.usable = std::isfinite(result.merit.phi);
    return result;
  }

  /// trial_direction at the trial point; false: K_yy is wrong there.
  [[nodiscard]] bool find_trial_direction(double mu) {
    const KktSystem::Counting counting(kkt_, FactorizationCause::TrialPoint);
    return inner.unshifted_direction(trial, mu, trial_direction);
  }

  /// The trial point along the step for constraints with the values c, from a point with the
  /// factors.
  [[nodiscard]] std::optional<StepLength> correct(const Point& from, double mu,
                                                  const Eigen::VectorXd& c) {
    newton_residual(canonical_, from, mu, rhs);
    rhs.lambda = -c;
    if (!kkt_.solve(factors, from.evaluation, rhs, corrected)) return std::nullopt;
    const StepLength alpha =
        largest_step(canonical_, from.iterate, corrected, boundary_fraction(mu, options_));
    set_trial(from, corrected, alpha, mu);
    return alpha;
  }

  /// The trial point moved towards the constraints of the minimizer; no Max variables. from: the
  /// point of the factors.
  [[nodiscard]] Trial return_to_constraints(const Point& from, double mu, Trial reached) {
    // A direction of curvature is tangent to the constraints, which bend: Newton steps on c with
    // the matrix factorized at the point.
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

  InnerMaximizer inner;
  KktFactors factors;  ///< of K
};

}  // namespace ipminmax
