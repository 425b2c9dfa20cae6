#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "core/method/step_method.hpp"
#include "core/point/step_length.hpp"

namespace ipminmax {

/// The shifts that do not depend on the matrices: none of pure Newton, or the options'.
[[nodiscard]] std::optional<Regularization> prescribed_shift(const SolverOptions& options);

/// The paper's Algorithm 1: Newton steps with shifts that give both matrices the expected inertia,
/// one step length for everything, no line search.
class AlgorithmOne final : public StepMethod {
 public:
  explicit AlgorithmOne(const MethodContext& context);

  [[nodiscard]] StepReport step(const Point& from, double mu, Point& to) override;

 private:
  /// The Newton step at a point. False: the report says why not.
  [[nodiscard]] bool compute_step(const Point& from, double mu, StepReport& report);
  /// Along the step as far as the bounds, the longest length allowed and the functions admit.
  [[nodiscard]] bool take_step(const Point& from, double longest, double mu, Point& to,
                               StepReport& report);
  [[nodiscard]] bool watched_step(const Point& from, double mu, Point& to, StepReport& report);
  [[nodiscard]] bool factorize(bool frozen, double mu, StepReport& report);
  void fail(EvaluationStatus status, std::string_view where, StepReport& report) const;

  MethodContext context_;
  NewtonResidual rhs_;
  Step step_;
  Regularization shift_;                ///< of the last step, kept in the freeze neighbourhood
  std::vector<double> last_residuals_;  ///< of the watchdog
};

}  // namespace ipminmax
