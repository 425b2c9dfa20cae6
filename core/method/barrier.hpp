#pragma once

#include <algorithm>
#include <functional>
#include <optional>
#include <vector>

#include "core/method/step_method.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/iterate.hpp"
#include "core/options.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

/// Least barrier parameter of a solve: min(tol, compl_inf_tol) / (kappa_epsilon + 1), as Ipopt's.
/// compl_inf_tol is unscaled, so the objective's scale factor, without its sign, multiplies it.
[[nodiscard]] double final_barrier(const SolverOptions& options, double objective_scale);

/// Barrier parameter after an accepted iterate. scaled_error(mu) is E_mu, norm(mu) is |g(z, mu)|.
[[nodiscard]] double next_barrier(double mu, double mu_final,
                                  const std::function<double(double)>& scaled_error,
                                  const std::function<double(double)>& norm,
                                  const SolverOptions& options);

/// Fraction-to-the-boundary parameter: tau = max(tau_min, 1 - mu).
[[nodiscard]] double boundary_fraction(double mu, const SolverOptions& options);

/// Complementarity products (distance to a bound) * z of an iterate.
struct Complementarity {
  double average = 0.0;
  double smallest = 0.0;
  Index bounds = 0;
};
[[nodiscard]] Complementarity complementarity_of(const CanonicalProblem& canonical,
                                                 const Iterate& iterate);

/// LOQO's rule, Nocedal, Waechter, Waltz 2009: small when the products are equal.
[[nodiscard]] double loqo_barrier(const Complementarity& products);

/// Memory of the oracles.
struct OracleWork {
  Step step;
  Iterate moved;
};

/// Mehrotra's probing: average (average after the step to mu = 0, over average)^3. affine: that
/// step.
[[nodiscard]] double probing_barrier(const CanonicalProblem& canonical, const Iterate& iterate,
                                     const Step& affine, OracleWork& work);

/// Squared residuals at mu = 0, each divided by its number of equations.
struct SquaredResidual {
  double dual = 0.0;
  double primal = 0.0;
  double complementarity = 0.0;
  [[nodiscard]] double total() const { return dual + primal + complementarity; }
};
[[nodiscard]] SquaredResidual squared_residual(const CanonicalProblem& canonical,
                                               const Point& point);

/// The mu whose Newton step, affine + mu / average * centering, cut at the bounds, leaves the least
/// residual by its linear model; Nocedal, Waechter, Waltz 2009, without its exact
/// line search. centering: the step's change from mu = 0 to the average complementarity.
[[nodiscard]] double quality_function_barrier(const CanonicalProblem& canonical,
                                              const Iterate& iterate,
                                              const SquaredResidual& residual, const Step& affine,
                                              const Step& centering, double tau_min,
                                              OracleWork& work);

/// What the adaptive strategy asks of the current point.
struct BarrierState {
  double residual = 0.0;       ///< squared, total
  Merit merit;                 ///< violation and objective, without barrier
  double average = 0.0;        ///< complementarity
  double barrier_error = 0.0;  ///< E_mu
  bool step_accepted = true;   ///< false: the line search found no acceptable step
};

/// mu_strategy adaptive: the oracle's mu while the iterates make progress, else Ipopt's monotone
/// rule until they do again. Waechter and Biegler's solver Ipopt; Nocedal, Waechter, Waltz 2009.
class AdaptiveBarrier {
 public:
  /// lowest: least mu of monotone phases; least_free: of the oracle.
  AdaptiveBarrier(const SolverOptions& options, double lowest, double least_free,
                  double first_average);

  /// oracle: empty when it has no answer. monotone(mu): the monotone rule.
  [[nodiscard]] double next(double mu, const BarrierState& now,
                            const std::function<std::optional<double>()>& oracle,
                            const std::function<double(double)>& monotone);

  /// Forgets the earlier points: the iterates have moved elsewhere.
  void reset();
  [[nodiscard]] bool is_free() const { return free_; }

 private:
  [[nodiscard]] bool progress(const BarrierState& now) const;
  void remember(const BarrierState& now);

  const SolverOptions& options_;
  double lowest_, least_free_, largest_;
  bool free_ = true;
  std::vector<double> residuals_;  ///< of the last iterations, oldest first
  std::vector<Merit> filter_;
};

/// Least mu of the oracles: mu_min, at most half the smaller tolerance, at least mu_target.
[[nodiscard]] double least_adaptive_barrier(const SolverOptions& options, double objective_scale);

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
      now.step_accepted = last.kind != StepKind::UntestedFull && last.kind != StepKind::Restoration;
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
