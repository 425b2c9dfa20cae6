#include <algorithm>
#include <cmath>

#include "core/method/barrier.hpp"
#include "core/method/inner_maximizer.hpp"
#include "core/point/residual.hpp"
#include "core/point/step_length.hpp"

namespace ipminmax {
namespace {

constexpr double kSecondOrderDecrease = 0.99;  // kappa_soc
constexpr int kSecondOrderSteps = 4;
/// A step of y longer than this times (1 + |y|) is cut.
constexpr double kLongStep = 10.0;
/// Violation of the Max constraints, over max(1, mu), at which values are compared.
constexpr double kFeasible = 1e-6;
/// Growth of |y| that counts as running away.
constexpr double kRunaway = 1e4;
/// Shifted steps allowed once y has left its neighbourhood.
constexpr int kFarShiftedSteps = 3;
/// One per step at most.
constexpr std::size_t kFilterPairs = 64;

double tail_norm(const Eigen::VectorXd& v, Index begin) {
  const auto size = v.size() - begin;
  return size > 0 ? v.tail(size).lpNorm<Eigen::Infinity>() : 0.0;
}

}  // namespace

InnerMaximizer::InnerMaximizer(const MethodContext& context, const Point& first)
    : canonical_(context.canonical),
      kkt_(context.kkt),
      correction_(context.correction),
      options_(context.options),
      limit_(context.limit),
      trial_(first) {
  const CanonicalProblem& canonical = canonical_;
  for (Step* step : {&rhs_, &correction_step_}) *step = zero_step(canonical);
  gradient_ = start_v_ = rhs_.v;
  corrected_c_ = rhs_.lambda;
  filter_.reserve(kFilterPairs);
  if (canonical.robust_constraints().empty()) return;
  const auto jacobian = canonical.jacobian();
  for (std::size_t k = 0; k < jacobian.size(); ++k) {
    const auto [row, col] = jacobian[k];
    if (canonical.owned_by_max(col) && canonical.min_constraints().contains(row)) {
      robust_entries_.push_back(k);
    }
  }
}

double InnerMaximizer::value(const Point& point, double mu) const {
  double value = barrier_objective(canonical_, point.iterate.v, point.evaluation.f, mu);
  for (const Index j : canonical_.robust_constraints()) {
    value += point.iterate.lambda[j] * point.evaluation.c[j];
  }
  return value;
}

void InnerMaximizer::value_gradient(const Point& point, double mu) {
  barrier_gradient(canonical_, point, mu, gradient_);
  for (const std::size_t k : robust_entries_) {
    const auto [row, col] = canonical_.jacobian()[k];
    gradient_[col] += point.iterate.lambda[row] * point.evaluation.jacobian[k];
  }
}

bool InnerMaximizer::direction(const Point& point, double mu, InnerDirection& out) {
  kkt_.assemble_inner(point.iterate, point.evaluation);
  for (;;) {
    out.shift = {};
    if (!correction_.correct_inner(mu, out.shift)) return false;
    if (solve(point, mu, out)) return true;
    if (!kkt_.increase_quality()) return false;
  }
}

bool InnerMaximizer::has_maximum_in_sight(const Point& point) {
  kkt_.assemble_inner(point.iterate, point.evaluation);
  return kkt_.has_expected_inner_inertia(kkt_.factorize_inner({}));
}

bool InnerMaximizer::unshifted_direction(const Point& point, double mu, InnerDirection& out) {
  out.shift = {};
  return has_maximum_in_sight(point) && solve(point, mu, out);
}

bool InnerMaximizer::solve(const Point& point, double mu, InnerDirection& out) {
  newton_residual(canonical_, point, mu, rhs_);
  out.mu = mu;
  if (!kkt_.solve_inner(point.evaluation, rhs_, out.step)) return false;
  // q = grad f_b' p + p'Hp/2 with H p = -grad f_b - J'(lambda + dlambda) and J p = -c.
  value_gradient(point, mu);
  const Index n = canonical_.variables() - canonical_.y().begin;
  const Index m = canonical_.max_constraints().size();
  out.gain =
      0.5 *
      (gradient_.tail(n).dot(out.step.v.tail(n)) +
       (point.iterate.lambda.tail(m) + out.step.lambda.tail(m)).dot(point.evaluation.c.tail(m)));
  return std::isfinite(out.gain);
}

double InnerMaximizer::error(const Point& point, double mu) const {
  double error = std::max(tail_norm(point.dual, canonical_.y().begin),
                          tail_norm(point.evaluation.c, canonical_.max_constraints().begin));
  const Iterate& z = point.iterate;
  for (const Index i : canonical_.lower_bounded()) {
    if (!canonical_.owned_by_max(i)) continue;
    error = std::max(error, std::abs(canonical_.above_lower(i, z.v[i]) * z.z_lower[i] - mu));
  }
  for (const Index i : canonical_.upper_bounded()) {
    if (!canonical_.owned_by_max(i)) continue;
    error = std::max(error, std::abs(canonical_.below_upper(i, z.v[i]) * z.z_upper[i] - mu));
  }
  return error;
}

bool InnerMaximizer::evaluate_merit(Point& trial, double mu, Merit& merit) {
  if (evaluate_values(canonical_, trial) != EvaluationStatus::Ok) return false;
  merit.theta = violation(trial.evaluation.c, canonical_.max_constraints());
  merit.phi = -value(trial, mu);
  return true;
}

void InnerMaximizer::move(const Point& from, const Step& step, double alpha_primal,
                          double alpha_dual, double mu, Point& to) const {
  to.iterate = from.iterate;
  advance(step, {alpha_primal, alpha_dual}, to.iterate);
  clip_bound_multipliers(canonical_, mu, options_.kappa_sigma, to.iterate);
}

bool InnerMaximizer::search(Point& point, double mu, InnerDirection& direction) {
  Step& d = direction.step;
  const double length = tail_norm(d.v, canonical_.y().begin);
  const double longest = kLongStep * (1.0 + tail_norm(point.iterate.v, canonical_.y().begin));
  const double tau = boundary_fraction(mu, options_);
  StepLength alpha = largest_step(canonical_, point.iterate, d, tau);
  if (length > longest) alpha.primal = std::min(alpha.primal, longest / length);

  const Merit from{violation(point.evaluation.c, canonical_.max_constraints()), -value(point, mu)};
  const Index n = canonical_.variables() - canonical_.y().begin;
  const double slope = -gradient_.tail(n).dot(d.v.tail(n));
  const double smallest = std::max(filter_.smallest_step(from, slope), 1e-12);
  trial_.evaluation = point.evaluation;
  Merit to;
  const auto accept = [&](Filter::Verdict verdict) {
    if (evaluate_derivatives(canonical_, trial_) != EvaluationStatus::Ok) return false;
    if (verdict == Filter::Verdict::Sufficient) filter_.add(from);
    std::swap(point, trial_);
    canonical_.keep_distances(point.iterate, mu);
    return true;
  };
  bool first = true;
  for (double t = alpha.primal; t >= smallest && !limit_.expired(); t *= 0.5, first = false) {
    move(point, d, t, alpha.dual, mu, trial_);
    const bool defined = evaluate_merit(trial_, mu, to);
    if (defined) {
      const auto verdict = filter_.test(from, slope, t, to);
      if (Filter::accepted(verdict)) return accept(verdict);
    }
    if (!first || !defined || to.theta < from.theta) continue;
    // Second-order correction against the Maratos effect: same matrix, c = alpha c + c(trial).
    double last_theta = to.theta;
    Eigen::VectorXd& c = corrected_c_;
    c = t * point.evaluation.c + trial_.evaluation.c;
    for (int k = 0; k < kSecondOrderSteps; ++k) {
      newton_residual(canonical_, point, mu, rhs_);
      rhs_.lambda = -c;
      if (!kkt_.solve_inner(point.evaluation, rhs_, correction_step_)) break;
      const StepLength a = largest_step(canonical_, point.iterate, correction_step_, tau);
      move(point, correction_step_, a.primal, a.dual, mu, trial_);
      if (!evaluate_merit(trial_, mu, to)) break;
      const auto verdict = filter_.test(from, slope, t, to);
      if (Filter::accepted(verdict)) return accept(verdict);
      if (to.theta > kSecondOrderDecrease * last_theta) break;
      last_theta = to.theta;
      c = a.primal * c + trial_.evaluation.c;
    }
  }
  return false;
}

bool InnerMaximizer::escape(Point& point, double mu) {
  // Inverse iteration with the shifted K_yy turns to the direction of largest curvature.
  const Index n = canonical_.variables() - canonical_.y().begin;
  Step& w = correction_step_;
  set_zero(rhs_);
  for (Index i = 0; i < n; ++i) rhs_.v[canonical_.y().begin + i] = std::sin(1.0 + i);
  for (int k = 0; k < 4; ++k) {
    if (!kkt_.solve_inner(point.evaluation, rhs_, w)) return false;
    const double norm = w.v.tail(n).norm();
    if (!(norm > 0.0)) return false;
    rhs_.v.tail(n) = w.v.tail(n) / norm;
  }
  return leave(point, mu, rhs_.v);
}

bool InnerMaximizer::leave(Point& point, double mu, const Eigen::VectorXd& direction) {
  const Index n = canonical_.variables() - canonical_.y().begin;
  Step& d = correction_step_;
  set_zero(d);
  Eigen::VectorXd along = direction.tail(n).normalized();
  value_gradient(point, mu);
  if (gradient_.tail(n).dot(along) < 0.0) along = -along;
  const double length = 0.1 * (1.0 + tail_norm(point.iterate.v, canonical_.y().begin));
  const Merit from{violation(point.evaluation.c, canonical_.max_constraints()), -value(point, mu)};
  trial_.evaluation = point.evaluation;
  for (double t = length; t > 1e-6 * length && !limit_.expired(); t *= 0.5) {
    for (const double sign : {1.0, -1.0}) {
      d.v.tail(n) = sign * t * along;
      const StepLength a = largest_step(canonical_, point.iterate, d, 0.9);
      move(point, d, a.primal, a.dual, mu, trial_);
      Merit to;
      if (!evaluate_merit(trial_, mu, to)) continue;
      if (to.phi < from.phi - 1e-10 * (1.0 + std::abs(from.phi)) &&
          evaluate_derivatives(canonical_, trial_) == EvaluationStatus::Ok) {
        std::swap(point, trial_);
        filter_.reset();
        return true;
      }
    }
  }
  return false;
}

bool InnerMaximizer::feasible(const Point& point, double mu) const {
  return violation(point.evaluation.c, canonical_.max_constraints()) <=
         kFeasible * std::max(1.0, mu);
}

InnerMaximizer::Outcome InnerMaximizer::maximize(Point& point, double mu, double target,
                                                 int max_steps, double upper_bound,
                                                 InnerDirection& out, bool known) {
  filter_.reset();
  filter_.set_scale(violation(point.evaluation.c, canonical_.max_constraints()));
  start_v_ = point.iterate.v;
  const Index n = canonical_.variables() - canonical_.y().begin;
  const double start_norm = tail_norm(start_v_, canonical_.y().begin);
  int far_shifted_steps = 0;
  for (int k = 0;; ++k) {
    if ((k > 0 || !known) && !direction(point, mu, out)) return Outcome::NotFound;
    const double theta = violation(point.evaluation.c, canonical_.max_constraints());
    const double feasible_theta = kFeasible * std::max(1.0, mu);
    const bool unshifted = out.shift.y == 0.0;
    if (unshifted && std::abs(out.gain) <= target && theta <= std::max(feasible_theta, target)) {
      return Outcome::Maximum;
    }
    if (theta <= feasible_theta &&
        barrier_objective(canonical_, point.iterate.v, point.evaluation.f, mu) > upper_bound) {
      return Outcome::AboveBound;
    }
    const double norm = tail_norm(point.iterate.v, canonical_.y().begin);
    if (norm > kRunaway * (1.0 + start_norm)) return Outcome::Unbounded;
    const double moved = (point.iterate.v - start_v_).tail(n).lpNorm<Eigen::Infinity>();
    if (!unshifted && moved > kLongStep * (1.0 + start_norm) &&
        ++far_shifted_steps > kFarShiftedSteps) {
      return Outcome::Unbounded;
    }
    if (k >= max_steps || limit_.expired()) return Outcome::NotFound;
    const bool stationary = error(point, mu) <= std::max(options_.tol, 1e-3 * std::min(1.0, mu));
    if (!unshifted && stationary) {
      if (!escape(point, mu)) return Outcome::NotFound;
    } else if (!search(point, mu, out)) {
      // Rounding: a step predicted to gain nothing visible ends the search.
      const double here = value(point, mu);
      const bool rounding = unshifted && std::abs(out.gain) <= 1e-9 * (1.0 + std::abs(here)) &&
                            theta <= std::max(feasible_theta, target);
      return rounding ? Outcome::Maximum : Outcome::NotFound;
    }
  }
}

}  // namespace ipminmax
