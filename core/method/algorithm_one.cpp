#include <algorithm>
#include <cstddef>

#include "core/method/algorithm_one.hpp"
#include "core/method/barrier.hpp"
#include "core/point/residual.hpp"

namespace ipminmax {
namespace {

/// Halvings of a step whose end point the model cannot evaluate.
constexpr int kMaxCuts = 40;
/// minmax_residual_watchdog: residuals looked back on, and the shortest step it asks for.
constexpr std::size_t kWatchedResiduals = 10;
constexpr double kShortestWatchedStep = 1e-3;

bool is_finite(const Step& step) {
  return step.v.allFinite() && step.lambda.allFinite() && step.z_lower.allFinite() &&
         step.z_upper.allFinite();
}

}  // namespace

AlgorithmOne::AlgorithmOne(CanonicalProblem& canonical, KktSystem& kkt,
                           InertiaCorrection& correction, const SolverOptions& options,
                           Counts& counts)
    : canonical_(canonical),
      kkt_(kkt),
      correction_(correction),
      options_(options),
      counts_(counts) {
  rhs_ = step_ = zero_step(canonical);
  trial_c_.setZero(canonical.constraints());
  last_residuals_.reserve(kWatchedResiduals + 1);
}

std::optional<Status> AlgorithmOne::step(Point& point, double mu, IterationInfo& info) {
  if (auto status = compute_step(point, mu, info)) return status;
  before_ = point;
  const auto status = options_.minmax_residual_watchdog ? watched_step(point, mu, info)
                                                        : take_step(point, 1.0, mu, info);
  if (status) point = before_;
  return status;
}

std::optional<Regularization> AlgorithmOne::prescribed() const {
  if (options_.minmax_pure_newton) return Regularization{};
  if (options_.minmax_prescribed_delta_x < 0.0) return std::nullopt;
  return Regularization{.x = options_.minmax_prescribed_delta_x,
                        .y = options_.minmax_prescribed_delta_y};
}

bool AlgorithmOne::factorize(bool frozen, double mu, IterationInfo& info) {
  const auto fixed = prescribed();
  if (fixed) shift_ = *fixed;
  if (fixed || frozen) {
    const Factorization f = kkt_.factorize(shift_);
    if (f.status == FactorizationStatus::Ok) {
      info.shifts.full = f.inertia;
      return true;
    }
    if (fixed) {
      message_ = "the KKT matrix with the prescribed shifts is singular";
      return false;
    }
  }
  const auto shift = correction_.correct(mu);
  if (!shift) {
    message_ = "no shift of the Hessian gives the KKT matrix the expected inertia";
    return false;
  }
  shift_ = *shift;
  info.shifts = correction_.findings();
  return true;
}

std::optional<Status> AlgorithmOne::compute_step(const Point& point, double mu,
                                                 IterationInfo& info) {
  newton_residual(canonical_, point.iterate, point.evaluation, point.dual, mu, rhs_);
  kkt_.assemble(point.iterate, point.evaluation);
  const double residual_norm =
      barrier_error(canonical_, point.iterate, point.evaluation, point.dual, mu, options_.s_max)
          .norm();
  const bool frozen = residual_norm <= options_.minmax_freeze_tol;
  for (;;) {
    const Index raises = counts_.instability_raises;
    if (!factorize(frozen, mu, info)) return Status::InertiaCorrectionFailed;
    info.delta_x = shift_.x;
    info.delta_y = shift_.y;
    info.step_kind = counts_.instability_raises > raises ? 'i'
                     : shift_ == Regularization{}        ? 'n'
                                                         : 's';
    if (kkt_.solve(point.evaluation, rhs_, step_) && is_finite(step_)) return std::nullopt;
    if (!kkt_.increase_quality()) {
      message_ = "the Newton system cannot be solved accurately";
      return Status::LinearSolverFailed;
    }
  }
}

std::optional<Status> AlgorithmOne::take_step(Point& point, double longest, double mu,
                                              IterationInfo& info) {
  const double tau = boundary_fraction(mu, options_);
  StepLength alpha = largest_step(canonical_, point.iterate, step_, tau);
  // One step length for everything, as in Algorithm 1.
  alpha.primal = alpha.dual = std::min({alpha.primal, alpha.dual, longest});
  EvaluationStatus status = EvaluationStatus::Ok;
  for (info.trials = 1; info.trials <= kMaxCuts; ++info.trials) {
    trial_ = point.iterate;
    advance(step_, alpha, trial_);
    status = canonical_.values(trial_.v, point.evaluation.f, trial_c_);
    if (status == EvaluationStatus::Ok) break;
    alpha.primal = alpha.dual = 0.5 * alpha.primal;
  }
  if (status != EvaluationStatus::Ok) {
    return evaluation_failure(status, "at every point tried along the step");
  }
  info.alpha_primal = alpha.primal;
  info.alpha_dual = alpha.dual;
  info.step_norm = canonical_.variables() > 0 ? step_.v.lpNorm<Eigen::Infinity>() : 0.0;
  std::swap(point.iterate, trial_);
  std::swap(point.evaluation.c, trial_c_);
  clip_bound_multipliers(canonical_, mu, options_.kappa_sigma, point.iterate);
  status = canonical_.derivatives(point.iterate.v, point.iterate.lambda, point.evaluation);
  if (status != EvaluationStatus::Ok) return evaluation_failure(status, "at an iterate");
  return std::nullopt;
}

std::optional<Status> AlgorithmOne::watched_step(Point& point, double mu, IterationInfo& info) {
  // Halve the step while the residual exceeds the largest of the last few.
  for (double longest = 1.0;; longest *= 0.5) {
    if (auto status = take_step(point, longest, mu, info)) return status;
    dual_residual(canonical_, point.iterate, point.evaluation, point.dual);
    const double norm =
        barrier_error(canonical_, point.iterate, point.evaluation, point.dual, mu, options_.s_max)
            .norm();
    const bool falls =
        last_residuals_.empty() || norm <= *std::ranges::max_element(last_residuals_);
    if (falls || longest < kShortestWatchedStep) {
      last_residuals_.push_back(norm);
      if (last_residuals_.size() > kWatchedResiduals)
        last_residuals_.erase(last_residuals_.begin());
      return std::nullopt;
    }
    point = before_;
  }
}

Status AlgorithmOne::evaluation_failure(EvaluationStatus status, std::string_view where) {
  message_ = canonical_.evaluation_error() + " " + std::string(where);
  return status == EvaluationStatus::NotFinite ? Status::InvalidNumber : Status::EvaluationFailed;
}

}  // namespace ipminmax
