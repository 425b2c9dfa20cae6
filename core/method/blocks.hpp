#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/method/barrier.hpp"
#include "core/method/curvature_escape.hpp"
#include "core/method/filter.hpp"
#include "core/method/parameters.hpp"
#include "core/method/step_method.hpp"
#include "core/model/indices.hpp"
#include "core/point/point.hpp"
#include "core/point/workspace.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

/// Newton step of the inner maximization at fixed x.
struct InnerDirection {
  Step* step;
  double mu = -1.0;          ///< barrier parameter of the step
  double gain = 0.0;         ///< q: predicted increase of the barrier objective
  double copies_gain = 0.0;  ///< the same of the constraints that copies serve, together
  Regularization shift{};    ///< of K_yy
  KktFactors factors{};      ///< of K_yy
  std::uint64_t jacobian_call = 0, hessian_call = 0;  ///< of the point's derivatives
  [[nodiscard]] double largest_gain() const {
    return std::max(std::abs(gain), std::abs(copies_gain));
  }
};

/// Maximizes the barrier objective over (y, s_y) at fixed x: Newton steps from K_yy alone, filter
/// on (violation of the Max constraints, minus value), second-order correction. Robust constraints,
/// which Max tries to violate, enter the value as lambda_r' c_r with lambda_r held, so that a copy
/// of y that belongs to one of them maximizes it whether Min satisfies it or not.
class InnerMaximizer : MethodContext {
 public:
  /// first: where the search begins.
  InnerMaximizer(const MethodContext& context, const Point& first, Filter& filter,
                 const Parts& left)
      : MethodContext(context), parts(left), filter_(filter) {
    trial_ = first;
    for (Step* step : {&rhs_, &correction_step_}) set_zero(canonical_, *step);
    more_ = rhs_;
    filter_.begin_anew(at(parameters::inner::kSteps));
  }

  Parts parts;                            ///< what is left of the workspace
  Step& correction_step_ = parts.step();  ///< of corrections and escapes: used up at once

  enum class Outcome : std::uint8_t {
    Maximum,     ///< in sight, and the gain at most the target
    AboveBound,  ///< feasible with a value above the bound: phi(x) is larger still
    NotFound,    ///< no maximum within the allowed steps or the time limit
    Unbounded    ///< y runs away
  };

  /// Assembles K_yy at the point and factorizes it, shifted as needed, unless that was the last
  /// factorization; false: no shift helps.
  [[nodiscard]] bool direction(const Point& point, double mu, InnerDirection& out) {
    kkt_.assemble_inner(point.iterate, point.evaluation);
    for (;;) {
      out.shift = {};
      if (!correction_.correct_inner(mu, out.shift, &point.evaluation)) return false;
      if (solve(point, mu, out)) return true;
      if (!kkt_.increase_quality()) return false;
    }
  }

  /// The same where a maximum is in sight; false where none is.
  [[nodiscard]] bool unshifted_direction(const Point& point, double mu, InnerDirection& out) {
    return has_maximum_in_sight(point, mu, out.shift) && solve(point, mu, out);
  }

  /// Whether K_yy is right at the point, up to what InertiaCorrection::factorize_unshifted adds.
  [[nodiscard]] bool has_maximum_in_sight(const Point& point, double mu, Regularization& shift) {
    kkt_.assemble_inner(point.iterate, point.evaluation);
    shift = {};
    return kkt_.has_expected_inner_inertia(
        correction_.factorize_unshifted(KktPart::Inner, mu, point.evaluation, shift));
  }

  /// Moves y, s_y and their multipliers of the point; out is the direction at its end, and is used
  /// at its beginning where it is_known there.
  [[nodiscard]] Outcome maximize(Point& point, double mu, double target, int max_steps,
                                 double upper_bound, InnerDirection& out) {
    const KktSystem::Counting counting(kkt_, FactorizationCause::InnerAscent);
    filter_.reset();
    filter_.set_scale(theta(point));
    start_v_ = point.iterate.v;
    const double start_norm = tail_norm(start_v_, canonical_.y().begin);
    int far_shifted_steps = 0;
    for (int k = 0;; ++k) {
      const bool known = k == 0 && out.mu == mu && is_known(out, point);
      if (!known && !direction(point, mu, out)) return Outcome::NotFound;
      const double violated = theta(point);
      const bool in_sight = out.shift.y == 0.0;
      if (in_sight && out.largest_gain() <= target &&
          violated <= std::max(feasible_theta(mu), target)) {
        return Outcome::Maximum;
      }
      if (violated <= feasible_theta(mu) &&
          barrier_objective(canonical_, point.iterate.v, point.evaluation.f, mu) > upper_bound) {
        return Outcome::AboveBound;
      }
      double moved = 0.0;  // in a box nothing runs away
      for (Index i = canonical_.y().begin; i < canonical_.variables(); ++i) {
        if (std::isinf(canonical_.lower()[i]) || std::isinf(canonical_.upper()[i]))
          moved = std::max(moved, std::abs(point.iterate.v[i] - start_v_[i]));
      }
      constexpr int kMostFarSteps = 3;
      const bool shifted = !in_sight || out.shift.proximal_y;
      if (shifted && moved > parameters::kLongStep * (1.0 + start_norm) &&
          ++far_shifted_steps > kMostFarSteps) {
        return Outcome::Unbounded;
      }
      if (k >= max_steps || limit_.expired()) return Outcome::NotFound;
      constexpr double kOfMu = 1e-3;
      const bool stationary = error(point, mu) <= std::max(options_.tol, kOfMu * std::min(1.0, mu));
      if (!in_sight && stationary) {
        if (!escape(point, mu, out.factors)) return Outcome::NotFound;
      } else if (!search(point, mu, out)) {
        return Outcome::NotFound;
      }
    }
  }

  /// Whether it is the direction at the point, with its factors at hand.
  [[nodiscard]] bool is_known(const InnerDirection& direction, const Point& point) const {
    return direction.hessian_call != 0 && direction.hessian_call == point.evaluation.hessian_call &&
           direction.jacobian_call == point.evaluation.jacobian_call &&
           kkt_.are_current_inner(direction.factors);
  }

  /// leave along the direction of the largest curvature, by the factors of K_yy.
  [[nodiscard]] bool escape(Point& point, double mu, const KktFactors& factors) {
    const InverseIteration how{.variables = {canonical_.y().begin, canonical_.variables()}};
    return turn_to_curvature(how, rhs_, correction_step_,
                             [&](const NewtonResidual& rhs, Step& step) {
                               return kkt_.solve_inner(factors, point.evaluation, rhs, step);
                             }) &&
           leave(point, mu, rhs_.v);
  }

  /// Moves y, s_y along a direction (or against it) in which the value rises to second order; x
  /// stays. False: it does not.
  [[nodiscard]] bool leave(Point& point, double mu, const Eigen::VectorXd& direction) {
    const Index n = canonical_.max_size();
    auto along = more_.z_upper.tail(n);
    along = direction.tail(n);
    along.normalize();
    value_gradient(point, mu);
    if (gradient_.tail(n).dot(along) < 0.0) along = -along;
    const CurvatureMove move{.from = merit(point, mu),
                             .size = 1.0 + tail_norm(point.iterate.v, canonical_.y().begin)};
    trial_.evaluation = point.evaluation;
    Block block{.owner = *this,
                .point = point,
                .mu = mu,
                .step = correction_step_,
                .factors = kkt_.inner_factors()};
    if (!move_along_curvature(block, move, along, limit_)) return false;
    std::swap(point, trial_);
    filter_.reset();
    return true;
  }

  /// Whether the Max constraints hold closely enough to compare values.
  [[nodiscard]] bool feasible(const Point& point, double mu) const {
    return theta(point) <= feasible_theta(mu);
  }
  [[nodiscard]] static double feasible_theta(double mu) { return 1e-6 * std::max(1.0, mu); }

  /// Error of the inner first-order conditions at mu.
  [[nodiscard]] double error(const Point& point, double mu) const {
    const Iterate& z = point.iterate;
    double error = std::max(max_error(canonical_, point),
                            tail_norm(point.evaluation.c, canonical_.max_constraints().begin));
    for_each_bound(canonical_, z.v, [&](Index i, int side, double distance) {
      if (!canonical_.owned_by_max(i)) return;
      const double own = multiplier_of(z, i, side) / canonical_.weight(i, z);
      error = std::max(error, std::abs(distance * own - mu));
    });
    return error;
  }

 private:
  [[nodiscard]] bool solve(const Point& point, double mu, InnerDirection& out) {
    newton_residual(canonical_, point, mu, rhs_);
    out.mu = mu;
    out.factors = kkt_.inner_factors();
    out.jacobian_call = point.evaluation.jacobian_call;
    out.hessian_call = point.evaluation.hessian_call;
    const Step& step = *out.step;
    if (!kkt_.solve_inner(out.factors, point.evaluation, rhs_, *out.step)) return false;
    // q = grad f_b' p + p'Hp/2 with H p = -grad f_b - J'(lambda + dlambda) and J p = -c.
    value_gradient(point, mu);
    const Index n = canonical_.max_size();
    const Index m = canonical_.max_constraints().size();
    out.gain =
        0.5 *
        (gradient_.tail(n).dot(step.v.tail(n)) +
         (point.iterate.lambda.tail(m) + step.lambda.tail(m)).dot(point.evaluation.c.tail(m)));
    if (canonical_.has_copies()) divide_gain(point, out);
    return std::isfinite(out.gain) && std::isfinite(out.copies_gain);
  }
  static double tail_norm(const Eigen::VectorXd& v, Index begin) {
    const auto size = v.size() - begin;
    return size > 0 ? v.tail(size).lpNorm<Eigen::Infinity>() : 0.0;
  }

  struct Block {
    InnerMaximizer& owner;
    const Point& point;
    double mu;
    const Step& step;
    const KktFactors& factors;

    const Point& from() const { return point; }
    Point& trial() const { return owner.trial_; }
    Eigen::VectorXd& corrected_c() const { return owner.corrected_c_; }

    Trial merit() const {
      if (!evaluate_values(owner.canonical_, trial())) return {};
      return {.usable = true, .merit = owner.merit(trial(), mu)};
    }
    Trial evaluate(double /*slope*/, StepLength alpha) const {
      owner.move(point, step, alpha, mu, trial());
      return merit();
    }
    std::optional<StepLength> correct(const Eigen::VectorXd& c) const {
      newton_residual(owner.canonical_, point, mu, owner.rhs_);
      owner.rhs_.lambda = -c;
      Step& corrected = owner.correction_step_;
      if (!owner.kkt_.solve_inner(factors, point.evaluation, owner.rhs_, corrected))
        return std::nullopt;
      const StepLength a = largest_step(owner.canonical_, point.iterate, corrected,
                                        boundary_fraction(mu, owner.options_));
      owner.move(point, corrected, a, mu, trial());
      return a;
    }
    Trial evaluate_corrected(double /*slope*/, double /*alpha*/) const { return merit(); }
    static void passed(bool /*dominated*/) {}
    bool complete() const { return evaluate_derivatives(owner.canonical_, trial()); }

    void set_trial(const auto& along, double length) const {
      Step& d = owner.correction_step_;
      set_zero(d);
      d.v.tail(along.size()) = length * along;
      owner.move(point, d, largest_step(owner.canonical_, point.iterate, d, parameters::kProgress),
                 mu, trial());
    }
    Trial evaluate_move(double /*length*/) const { return merit(); }
    static Trial improve(const Trial& trial) { return trial; }
  };
  [[nodiscard]] double theta(const Point& point) const {
    return violation(point.evaluation.c, canonical_.max_constraints());
  }
  [[nodiscard]] Merit merit(const Point& point, double mu) const {
    return {theta(point), -value(point, mu)};
  }

  [[nodiscard]] bool search(Point& point, double mu, const InnerDirection& direction) {
    const Step& d = *direction.step;
    const double length = tail_norm(d.v, canonical_.y().begin);
    const double longest =
        parameters::kLongStep * (1.0 + tail_norm(point.iterate.v, canonical_.y().begin));
    SearchLine line{
        .from = merit(point, mu),
        .longest = largest_step(canonical_, point.iterate, d, boundary_fraction(mu, options_)),
        .trials = std::numeric_limits<int>::max()};
    if (length > longest) line.longest.primal = std::min(line.longest.primal, longest / length);
    const Index n = canonical_.max_size();
    line.slope = -gradient_.tail(n).dot(d.v.tail(n));
    line.smallest = std::max(filter_.smallest_step(line.from, line.slope), parameters::kConstant);
    trial_.evaluation = point.evaluation;
    Block block{.owner = *this, .point = point, .mu = mu, .step = d, .factors = direction.factors};
    if (!filter_search(block, filter_, line, limit_).accepted) return false;
    std::swap(point, trial_);
    canonical_.keep_distances(point.iterate, mu);
    return true;
  }

  [[nodiscard]] double value(const Point& point, double mu) const {
    const Iterate& z = point.iterate;
    double value = barrier_objective(canonical_, z.v, point.evaluation.f, mu) +
                   barrier_of_copies(canonical_, z.v, mu);
    for (const Index j : canonical_.robust_constraints()) {
      value += z.lambda[j] / own_weight(j, z) * point.evaluation.c[j];
    }
    return value;
  }

  void value_gradient(const Point& point, double mu) {
    barrier_gradient(canonical_, point, mu, gradient_);
    if (canonical_.robust_constraints().empty()) return;
    const auto jacobian = canonical_.jacobian();
    for (const auto k : indices(jacobian)) {
      const auto [row, col] = jacobian[k];
      if (!canonical_.owned_by_max(col) || !canonical_.min_constraints().contains(row)) continue;
      gradient_[col] +=
          point.iterate.lambda[row] / own_weight(row, point.iterate) * point.evaluation.jacobian[k];
    }
  }

  /// Of a robust constraint that copies serve; 1 for others.
  [[nodiscard]] double own_weight(Index robust, const Iterate& iterate) const {
    if (!canonical_.has_copies()) return 1.0;
    const Index slack = canonical_.slack_of(robust);
    return canonical_.owners().has_copies[at(slack)] ? CanonicalProblem::weight_by(slack, iterate)
                                                     : 1.0;
  }

  /// Of f and of what copies serve: of each its own.
  void divide_gain(const Point& point, InnerDirection& out) const {
    out.gain = out.copies_gain = 0.0;
    for (Index i = canonical_.y().begin; i < canonical_.variables(); ++i) {
      const double gain = 0.5 * gradient_[i] * out.step->v[i];
      (canonical_.robust_slack(i) >= 0 ? out.copies_gain : out.gain) += gain;
    }
    for (Index j = canonical_.max_constraints().begin; j < canonical_.constraints(); ++j) {
      const Index slack = canonical_.robust_slack_of_constraint(j);
      const double gain = 0.5 * (point.iterate.lambda[j] + out.step->lambda[j]) *
                          point.evaluation.c[j] / CanonicalProblem::weight_by(slack, point.iterate);
      (slack >= 0 ? out.copies_gain : out.gain) += gain;
    }
  }

  Filter& filter_;
  Point& trial_ = parts.point();
  NewtonResidual& rhs_ = parts.step();
  Step& more_ = parts.step();
  Eigen::VectorXd& gradient_ = more_.v;          ///< of the value
  Eigen::VectorXd& start_v_ = more_.z_lower;     ///< where maximize began
  Eigen::VectorXd& corrected_c_ = more_.lambda;  ///< right-hand side of second-order corrections
};

/// What an inner Newton step may still promise to gain where phi is estimated: that share, but less
/// than phi itself says and more than its rounding.
[[nodiscard]] inline double tolerated_gain(double share, double phi) {
  namespace parameter = parameters::inner;
  constexpr double kMostOfPhi = 0.1;
  const double size = 1.0 + std::abs(phi);
  return std::max(std::min(share, kMostOfPhi * size), parameter::kRoundingShare * size);
}

/// The minimizer's side of the globalized method: the Newton step through K, and phi(x), estimated
/// by the barrier value plus the predicted gain of the inner Newton step, along it. Without Max
/// variables phi is the barrier objective.
class OuterBlock : MethodContext {
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
  OuterBlock(const MethodContext& context, const Point& first, Filter& inner_filter,
             Workspace& workspace)
      : MethodContext(context), inner(context, first, inner_filter, Parts(workspace)) {
    trial = first;
    for (Step* zero : {direction.step, trial_direction.step, &rhs, &step, &more_})
      set_zero(canonical_, *zero);
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
          gradient_[col] += point.evaluation.hessian[k] * direction.step->v[row];
        }
      }
      const auto jacobian = canonical_.jacobian();
      for (const auto k : indices(jacobian)) {
        const auto [row, col] = jacobian[k];
        if (col < y && canonical_.max_constraints().contains(row) &&
            canonical_.robust_slack_of_constraint(row) < 0) {
          gradient_[col] += point.evaluation.jacobian[k] *
                            (point.iterate.lambda[row] + direction.step->lambda[row]);
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
    move(from, along, alpha, mu, trial);
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
  Parts parts = inner.parts;
  Point& trial = parts.point();
  InnerDirection direction{&parts.step()};        ///< inner Newton step at the current point
  InnerDirection trial_direction{&parts.step()};  ///< at the trial point
  NewtonResidual& rhs = parts.step();
  Step& step = parts.step();
  Step& corrected = inner.correction_step_;
  Step& more_ = parts.step();
  Eigen::VectorXd& corrected_c = more_.lambda;  ///< right-hand side of second-order corrections
  Eigen::VectorXd& gradient_ = more_.v;
  /// On the way back to the constraints
  Point &before_ = parts.point(), &best_ = parts.point();
  KktFactors factors;  ///< of K
};

}  // namespace ipminmax
