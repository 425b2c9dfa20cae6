#pragma once

#include <functional>
#include <optional>
#include <vector>

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

}  // namespace ipminmax
