#pragma once

#include <optional>

#include "core/options.hpp"
#include "core/point/point.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// Ipopt's termination test.
[[nodiscard]] bool is_within_tolerances(const KktError& error, const SolverOptions& options);
[[nodiscard]] bool is_within_acceptable_tolerances(const KktError& error,
                                                   const SolverOptions& options);

/// Whether the iterates meet the tolerances of the first-order conditions, or the acceptable ones
/// for long enough. As Ipopt's, and the gradient of the Lagrangian is small beside its terms: s_d
/// and the scaling of f can hide any gradient.
class FirstOrderTest {
 public:
  FirstOrderTest(const CanonicalProblem& canonical, const SolverOptions& options)
      : canonical_(canonical), options_(options) {}

  [[nodiscard]] bool is_met(const Point& point) {
    return is_within_tolerances(point.error, options_) && is_balanced(point, options_.tol);
  }
  [[nodiscard]] bool is_acceptable(const Point& point);

  /// At each iterate: Solved, SolvedToAcceptableLevel, or nothing yet.
  [[nodiscard]] std::optional<Status> passed(const Point& point);
  /// The iterates have moved elsewhere: acceptable ones are counted anew.
  void begin_anew() { acceptable_ = at_rest_ = 0; }

 private:
  /// Of the entries that exceed a tolerance in the model's units.
  [[nodiscard]] bool is_balanced(const Point& point, double tolerance);

  /// Whether the model's variables stay where they are while multipliers grow: there are none.
  [[nodiscard]] bool is_at_rest(const Iterate& iterate);

  const CanonicalProblem& canonical_;
  const SolverOptions& options_;
  Eigen::VectorXd terms_, by_rounding_;
  Index acceptable_ = 0;  ///< iterates in a row
  Index at_rest_ = 0;     ///< iterates at rest_point_
  Eigen::VectorXd rest_point_;
  double rest_multiplier_ = 0.0;  ///< the largest one there
  double last_objective_ = 0.0;
};

}  // namespace ipminmax
