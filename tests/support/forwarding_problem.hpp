#pragma once

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "core/model/forwarding_problem.hpp"
#include "core/result.hpp"

namespace ipminmax::testing {

using ipminmax::ForwardingProblem;

/// Passes everything on and counts.
class CountingProblem : public ForwardingProblem {
 public:
  using ForwardingProblem::ForwardingProblem;

  [[nodiscard]] const Counts& counts() const { return counts_; }

  [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override {
    ++counts_.objective;
    return ForwardingProblem::objective(v, new_v, f);
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool new_v,
                              std::span<double> grad) override {
    ++counts_.gradient;
    return ForwardingProblem::gradient(v, new_v, grad);
  }
  [[nodiscard]] bool constraints(std::span<const double> v, bool new_v,
                                 std::span<double> g) override {
    ++counts_.constraints;
    return ForwardingProblem::constraints(v, new_v, g);
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool new_v,
                              std::span<double> values) override {
    ++counts_.jacobian;
    return ForwardingProblem::jacobian(v, new_v, values);
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool new_v, double sigma,
                             std::span<const double> lambda, bool new_lambda,
                             std::span<double> values) override {
    ++counts_.hessian;
    return ForwardingProblem::hessian(v, new_v, sigma, lambda, new_lambda, values);
  }

 private:
  Counts counts_;
};

/// The same problem from another starting point, multipliers included when there are any.
class StartedProblem final : public ForwardingProblem {
 public:
  StartedProblem(Problem& problem, std::vector<double> v)
      : ForwardingProblem(problem), v_(std::move(v)) {}
  /// From the answer of a solve.
  StartedProblem(Problem& problem, const Result& result)
      : ForwardingProblem(problem),
        v_(result.v),
        lambda_(result.lambda),
        z_lower_(result.z_lower),
        z_upper_(result.z_upper) {}

  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    std::ranges::copy(v_, start.v.begin());
    if (!start.needs_multipliers) return true;
    if (z_lower_.size() != v_.size()) return false;
    std::ranges::copy(lambda_, start.lambda.begin());
    std::ranges::copy(z_lower_, start.z_lower.begin());
    std::ranges::copy(z_upper_, start.z_upper.begin());
    return true;
  }

 private:
  std::vector<double> v_, lambda_, z_lower_, z_upper_;
};

}  // namespace ipminmax::testing
