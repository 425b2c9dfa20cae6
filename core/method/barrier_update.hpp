#pragma once

#include <optional>

#include "core/method/barrier.hpp"
#include "core/method/step_method.hpp"

namespace ipminmax {

/// The barrier parameter of a solve and the rule by which it changes: mu_strategy,
/// minmax_barrier_rule.
class BarrierUpdate {
 public:
  /// first: where the solve begins.
  BarrierUpdate(const MethodContext& context, const Point& first);

  [[nodiscard]] double mu() const { return mu_; }
  /// Chooses the parameter of the next step from a point that the last one led to. True: another
  /// one than before.
  [[nodiscard]] bool update(const Point& point, const StepReport& last);
  /// Another search begins: with the first parameter.
  void begin_anew();
  /// The other mu_strategy from this point on. False: without bounds there is none.
  [[nodiscard]] bool change_rule(const Point& point);
  /// The iterates have moved elsewhere: earlier ones no longer compare.
  void forget_progress();
  /// At a first-order point: the oracle's parameter may be far above the complementarity reached.
  void settle();

 private:
  [[nodiscard]] double monotone(const Point& point, double from) const;
  [[nodiscard]] std::optional<double> ask_oracle(const Point& point);

  MethodContext context_;
  double least_;  ///< final_barrier
  double mu_;
  std::optional<AdaptiveBarrier> adaptive_;  ///< empty for mu_strategy monotone
  NewtonResidual rhs_;
  Step step_;
  Step affine_;  ///< of the quality function
  OracleWork work_;
};

}  // namespace ipminmax
