#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/kkt/inertia_correction.hpp"
#include "core/kkt/system.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/point/merit.hpp"
#include "core/point/step_length.hpp"
#include "core/solver.hpp"

namespace ipminmax {

/// The paper's Algorithm 1: Newton steps with shifts that give both matrices the expected inertia,
/// one step length for everything, no line search.
class AlgorithmOne {
 public:
  AlgorithmOne(CanonicalProblem& canonical, KktSystem& kkt, InertiaCorrection& correction,
               const SolverOptions& options, Counts& counts);

  /// One iteration: moves the point, with functions and derivatives at its end, and describes the
  /// step in info. A status ends the solve, the point left as it was; message() says more.
  [[nodiscard]] std::optional<Status> step(Point& point, double mu, IterationInfo& info);

  [[nodiscard]] const std::string& message() const { return message_; }

 private:
  [[nodiscard]] std::optional<Status> compute_step(const Point& point, double mu,
                                                   IterationInfo& info);
  [[nodiscard]] std::optional<Status> take_step(Point& point, double longest, double mu,
                                                IterationInfo& info);
  [[nodiscard]] std::optional<Status> watched_step(Point& point, double mu, IterationInfo& info);
  /// The shifts that do not depend on the matrices: of pure Newton, or the options'.
  [[nodiscard]] std::optional<Regularization> prescribed() const;
  [[nodiscard]] bool factorize(bool frozen, double mu, IterationInfo& info);
  [[nodiscard]] Status evaluation_failure(EvaluationStatus status, std::string_view where);

  CanonicalProblem& canonical_;
  KktSystem& kkt_;
  InertiaCorrection& correction_;
  const SolverOptions& options_;
  Counts& counts_;

  NewtonResidual rhs_;
  Step step_;
  Iterate trial_;
  Eigen::VectorXd trial_c_;
  Regularization shift_;                ///< of the last step, kept in the freeze neighbourhood
  Point before_;                        ///< left by the step
  std::vector<double> last_residuals_;  ///< of the watchdog
  std::string message_;
};

}  // namespace ipminmax
