#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/method/barrier.hpp"
#include "core/method/curvature_escape.hpp"
#include "core/method/filter.hpp"
#include "core/method/filter_search.hpp"
#include "core/method/parameters.hpp"
#include "core/method/step_method.hpp"
#include "core/model/indices.hpp"
#include "core/model/kept.hpp"
#include "core/point/point.hpp"
#include "core/point/residual.hpp"
#include "core/point/step_length.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

/// Newton step of the inner maximization at fixed x.
struct InnerDirection {
  Step step{};
  double mu = -1.0;          ///< barrier parameter of the step
  double gain = 0.0;         ///< q: predicted increase of the barrier objective
  double copies_gain = 0.0;  ///< the same of the constraints that copies serve, together
  Regularization shift{};    ///< of K_yy
  KktFactors factors{};      ///< of K_yy
  std::uint64_t jacobian_call = 0, hessian_call = 0;  ///< of the point's derivatives

  /// Of no point, a step of zeros.
  void clear(const CanonicalProblem& canonical) {
    *this = InnerDirection{.step = std::move(step)};
    set_zero(canonical, step);
  }
  [[nodiscard]] double largest_gain() const {
    return std::max(std::abs(gain), std::abs(copies_gain));
  }
};

/// What an InnerMaximizer works with, kept from one to the next.
struct InnerArrays {
  Filter filter_;
  Point trial_;
  NewtonResidual rhs_;
  Step correction_step_;
  Eigen::VectorXd gradient_;                 ///< of the value
  Eigen::VectorXd along_;                    ///< direction of leave in y, s_y
  std::vector<std::size_t> robust_entries_;  ///< of the Jacobian: robust constraints in y
  Eigen::VectorXd corrected_c_;              ///< right-hand side of second-order corrections
  Eigen::VectorXd start_v_;                  ///< where maximize began
};

/// Maximizes the barrier objective over (y, s_y) at fixed x: Newton steps from K_yy alone, filter
/// on (violation of the Max constraints, minus value), second-order correction. Robust constraints,
/// which Max tries to violate, enter the value as lambda_r' c_r with lambda_r held, so that a copy
/// of y that belongs to one of them maximizes it whether Min satisfies it or not.
class InnerMaximizer : Kept<InnerArrays>, MethodContext {
 public:
  /// first: where the search begins.
  InnerMaximizer(const MethodContext& context, const Point& first, InnerArrays& arrays)
      : Kept(&arrays), MethodContext(context) {
    trial_ = first;
    for (Step* step : {&rhs_, &correction_step_}) set_zero(canonical_, *step);
    gradient_ = start_v_ = rhs_.v;
    along_ = rhs_.v.tail(canonical_.max_size());
    corrected_c_ = rhs_.lambda;
    filter_.begin_anew(at(parameters::inner::kSteps));
    robust_entries_.clear();
    if (canonical_.robust_constraints().empty()) return;
    const auto jacobian = canonical_.jacobian();
    for (const auto k : indices(jacobian)) {
      const auto [row, col] = jacobian[k];
      if (canonical_.owned_by_max(col) && canonical_.min_constraints().contains(row)) {
        robust_entries_.push_back(k);
      }
    }
  }

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
    along_ = direction.tail(n);
    along_.normalize();
    value_gradient(point, mu);
    if (gradient_.tail(n).dot(along_) < 0.0) along_ = -along_;
    const CurvatureMove move{.from = merit(point, mu),
                             .size = 1.0 + tail_norm(point.iterate.v, canonical_.y().begin)};
    trial_.evaluation = point.evaluation;
    Block block{.owner = *this,
                .point = point,
                .mu = mu,
                .step = correction_step_,
                .factors = kkt_.inner_factors()};
    if (!move_along_curvature(block, move, along_, limit_)) return false;
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
    if (!kkt_.solve_inner(out.factors, point.evaluation, rhs_, out.step)) return false;
    // q = grad f_b' p + p'Hp/2 with H p = -grad f_b - J'(lambda + dlambda) and J p = -c.
    value_gradient(point, mu);
    const Index n = canonical_.max_size();
    const Index m = canonical_.max_constraints().size();
    out.gain =
        0.5 *
        (gradient_.tail(n).dot(out.step.v.tail(n)) +
         (point.iterate.lambda.tail(m) + out.step.lambda.tail(m)).dot(point.evaluation.c.tail(m)));
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

    void set_trial(const Eigen::VectorXd& along, double length) const {
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
    const Step& d = direction.step;
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
    for (const std::size_t k : robust_entries_) {
      const auto [row, col] = canonical_.jacobian()[k];
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
      const double gain = 0.5 * gradient_[i] * out.step.v[i];
      (canonical_.robust_slack(i) >= 0 ? out.copies_gain : out.gain) += gain;
    }
    for (Index j = canonical_.max_constraints().begin; j < canonical_.constraints(); ++j) {
      const Index slack = canonical_.robust_slack_of_constraint(j);
      const double gain = 0.5 * (point.iterate.lambda[j] + out.step.lambda[j]) *
                          point.evaluation.c[j] / CanonicalProblem::weight_by(slack, point.iterate);
      (slack >= 0 ? out.copies_gain : out.gain) += gain;
    }
  }

  void move(const Point& from, const Step& step, StepLength alpha, double mu, Point& to) const {
    to.iterate = from.iterate;
    advance(canonical_, step, alpha, to.iterate, InequalityLength::Dual);
    clip_bound_multipliers(canonical_, mu, options_.kappa_sigma, to.iterate);
  }
};

}  // namespace ipminmax
