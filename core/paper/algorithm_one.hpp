#pragma once

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/method/barrier.hpp"
#include "core/method/parameters.hpp"
#include "core/method/step_method.hpp"
#include "core/model/norms.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// The shifts that do not depend on the matrices: none of pure Newton, or the options'.
[[nodiscard]] inline std::optional<Regularization> prescribed_shift(const SolverOptions& options) {
  if (options.minmax_pure_newton) return Regularization{};
  if (options.minmax_prescribed_delta_x < 0.0) return std::nullopt;
  return Regularization{.x = options.minmax_prescribed_delta_x,
                        .y = options.minmax_prescribed_delta_y};
}

/// The paper's Algorithm 1: Newton steps with shifts that give both matrices the expected inertia,
/// one step length for everything, no line search.
class AlgorithmOne final : public StepMethod, MethodContext {
  static constexpr std::size_t kCompared = 10;  ///< residuals that a step's is compared with

 public:
  explicit AlgorithmOne(const MethodContext& context) : MethodContext(context) {
    rhs_ = step_ = zero_step(canonical_);
    last_residuals_.reserve(kCompared + 1);
  }

  [[nodiscard]] StepReport step(const Point& from, double mu, Point& to) override {
    StepReport report;
    if (!compute_step(from, mu, report)) return report;
    report.moved = options_.minmax_residual_watchdog ? watched_step(from, mu, to, report)
                                                     : take_step(from, 1.0, mu, to, report);
    return report;
  }

 private:
  static bool is_finite(const Step& step) {
    return step.v.allFinite() && step.lambda.allFinite() && step.z_lower.allFinite() &&
           step.z_upper.allFinite();
  }

  /// The Newton step at a point. False: the report says why not.
  [[nodiscard]] bool compute_step(const Point& from, double mu, StepReport& report) {
    newton_residual(canonical_, from, mu, rhs_);
    kkt_.assemble(from.iterate, from.evaluation);
    const double residual_norm = barrier_error(canonical_, from, mu, options_.s_max).norm();
    const bool frozen = residual_norm <= options_.minmax_freeze_tol;
    for (;;) {
      const Index raises = counts_.instability_raises;
      if (!factorize(frozen, mu, report)) return false;
      report.delta_x = shift_.x;
      report.delta_y = shift_.y;
      report.kind = counts_.instability_raises > raises ? StepKind::Instability
                    : shift_ == Regularization{}        ? StepKind::Newton
                                                        : StepKind::Shifted;
      if (kkt_.solve(from.evaluation, rhs_, step_) && is_finite(step_)) return true;
      if (!kkt_.increase_quality()) {
        report.fail(Status::LinearSolverFailed, "the Newton system cannot be solved accurately");
        return false;
      }
    }
  }

  /// Along the step as far as the bounds, the longest length allowed and the functions admit.
  [[nodiscard]] bool take_step(const Point& from, double longest, double mu, Point& to,
                               StepReport& report) {
    StepLength alpha =
        largest_step(canonical_, from.iterate, step_, boundary_fraction(mu, options_));
    // One step length for everything, as in Algorithm 1.
    alpha.primal = alpha.dual = std::min({alpha.primal, alpha.dual, longest});
    bool defined = false;
    for (report.trials = 1; report.trials <= parameters::kHalvings; ++report.trials) {
      to.iterate = from.iterate;
      advance(canonical_, step_, alpha, to.iterate);
      defined = evaluate_values(canonical_, to);
      if (defined) break;
      alpha.primal = alpha.dual = 0.5 * alpha.primal;
    }
    if (!defined) return fail("at every point tried along the step", report);
    report.alpha = alpha;
    report.step_norm = max_norm(step_.v);
    clip_bound_multipliers(canonical_, mu, options_.kappa_sigma, to.iterate);
    return evaluate_derivatives(canonical_, to) || fail("at an iterate", report);
  }

  [[nodiscard]] bool watched_step(const Point& from, double mu, Point& to, StepReport& report) {
    // Halve the step while the residual exceeds the largest of the last few.
    for (double longest = 1.0;; longest *= 0.5) {
      if (!take_step(from, longest, mu, to, report)) return false;
      const double norm = barrier_error(canonical_, to, mu, options_.s_max).norm();
      const bool falls =
          last_residuals_.empty() || norm <= *std::ranges::max_element(last_residuals_);
      constexpr double kShortest = 1e-3;
      if (falls || longest < kShortest) {
        last_residuals_.push_back(norm);
        if (last_residuals_.size() > kCompared) last_residuals_.erase(last_residuals_.begin());
        return true;
      }
    }
  }

  [[nodiscard]] bool factorize(bool frozen, double mu, StepReport& report) {
    const auto fixed = prescribed_shift(options_);
    if (fixed) shift_ = *fixed;
    if (fixed || frozen) {
      const Factorization f = kkt_.factorize(shift_, Certainty::Usual);
      if (f.status == FactorizationStatus::Ok) {
        report.shifts.full = f.inertia;
        return true;
      }
      if (fixed) {
        report.fail(Status::InertiaCorrectionFailed,
                    "the KKT matrix with the prescribed shifts is singular");
        return false;
      }
    }
    const auto shift = correction_.correct(mu);
    if (!shift) {
      report.fail(Status::InertiaCorrectionFailed,
                  "no shift of the Hessian gives the KKT matrix the expected inertia");
      return false;
    }
    shift_ = *shift;
    report.shifts = correction_.findings();
    return true;
  }

  bool fail(std::string_view where, StepReport& report) const {
    report.fail(canonical_.evaluation_status(),
                canonical_.evaluation_error() + " " + std::string(where));
    return false;
  }

  NewtonResidual rhs_;
  Step step_;
  Regularization shift_;                ///< of the last step, kept in the freeze neighbourhood
  std::vector<double> last_residuals_;  ///< of the watchdog
};

}  // namespace ipminmax
