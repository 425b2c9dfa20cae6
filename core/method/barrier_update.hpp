#pragma once

#include <algorithm>
#include <optional>

#include "core/method/barrier.hpp"
#include "core/method/step_method.hpp"
#include "core/point/residual.hpp"

namespace ipminmax {

/// The barrier parameter of a solve and the rule by which it changes: mu_strategy,
/// minmax_barrier_rule.
class BarrierUpdate : MethodContext {
 public:
  /// first: where the solve begins.
  BarrierUpdate(const MethodContext& context, const Point& first)
      : MethodContext(context),
        least_(final_barrier(options_, canonical_.user_objective_scale())),
        mu_(std::max(options_.mu_init, least_)) {
    if (options_.mu_strategy == BarrierStrategy::Adaptive) static_cast<void>(change_rule(first));
  }

  [[nodiscard]] double mu() const { return mu_; }
  /// Chooses the parameter of the next step from a point that the last one led to. True: another
  /// one than before.
  [[nodiscard]] bool update(const Point& point, const StepReport& last) {
    // Algorithm 1 decreases b after a step, so not before the first.
    if (options_.minmax_barrier_rule == BarrierRule::Paper && limit_.iteration == 0) {
      return false;
    }
    const double before = mu_;
    if (adaptive_) {
      BarrierState now;
      now.residual = squared_residual(canonical_, point).total();
      now.merit = {point.evaluation.c.lpNorm<1>(), point.evaluation.f};
      now.average = complementarity_of(canonical_, point.iterate).average;
      now.barrier_error = measured_barrier_error(canonical_, point, mu_).scaled;
      now.step_accepted = last.kind != StepKind::Leap && last.kind != StepKind::Restoration;
      mu_ = adaptive_->next(
          mu_, now, [&] { return ask_oracle(point); },
          [&](double from) { return monotone(point, from); });
    } else {
      mu_ = monotone(point, mu_);
    }
    return mu_ != before;
  }

  /// Another search begins: with the first parameter.
  void begin_anew() {
    mu_ = std::max(options_.mu_init, least_);
    forget_progress();
  }

  /// The other mu_strategy from this point on. False: without bounds there is none.
  [[nodiscard]] bool change_rule(const Point& point) {
    const Complementarity products = complementarity_of(canonical_, point.iterate);
    if (products.bounds == 0) return false;
    if (adaptive_) {
      adaptive_.reset();
      return true;
    }
    adaptive_.emplace(options_, least_,
                      least_adaptive_barrier(options_, canonical_.user_objective_scale()),
                      products.average);
    rhs_ = step_ = affine_ = zero_step(canonical_);
    return true;
  }

  /// The iterates have moved elsewhere: earlier ones no longer compare.
  void forget_progress() {
    if (adaptive_) adaptive_->reset();
  }

  /// At a first-order point: the oracle's parameter may be far above the complementarity reached.
  void settle() {
    if (adaptive_) mu_ = std::min(mu_, least_);
  }

 private:
  [[nodiscard]] double monotone(const Point& point, double from) const {
    const auto error = [&](double mu) { return measured_barrier_error(canonical_, point, mu); };
    return next_barrier(
        from, least_, [&](double mu) { return error(mu).scaled; },
        [&](double mu) { return error(mu).norm(); }, options_);
  }

  [[nodiscard]] std::optional<double> ask_oracle(const Point& point) {
    const Complementarity products = complementarity_of(canonical_, point.iterate);
    if (options_.mu_oracle == BarrierOracle::Loqo) return loqo_barrier(products);

    // The Newton step to mu = 0, with shifts of its own: the step's memory of shifts stays as it
    // is.
    InertiaCorrection correction = correction_;
    const KktSystem::Counting counting(kkt_, FactorizationCause::Barrier);
    newton_residual(canonical_, point, 0.0, rhs_);
    kkt_.assemble(point.iterate, point.evaluation);
    if (!correction.correct(mu_) || !kkt_.solve(point.evaluation, rhs_, step_)) return std::nullopt;
    if (options_.mu_oracle == BarrierOracle::Probing) {
      return probing_barrier(canonical_, point.iterate, step_, work_);
    }
    affine_ = step_;
    const double average = products.average;
    set_zero(rhs_);
    rhs_.v = -average * canonical_.damping();
    for (const Index i : canonical_.lower_bounded()) rhs_.z_lower[i] = average;
    for (const Index i : canonical_.upper_bounded()) rhs_.z_upper[i] = average;
    if (!kkt_.solve(point.evaluation, rhs_, step_)) return std::nullopt;
    return quality_function_barrier(canonical_, point.iterate, squared_residual(canonical_, point),
                                    affine_, step_, options_.tau_min, work_);
  }

  double least_;  ///< final_barrier
  double mu_;
  std::optional<AdaptiveBarrier> adaptive_;  ///< empty for mu_strategy monotone
  NewtonResidual rhs_;
  Step step_;
  Step affine_;  ///< of the quality function
  OracleWork work_;
};

}  // namespace ipminmax
