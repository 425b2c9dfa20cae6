#pragma once

#include <functional>
#include <span>

#include <support/forwarding_problem.hpp>

namespace ipminmax::testing {

/// Another problem with an objective and derivatives that the caller has changed.
class ChangedProblem final : public ForwardingProblem {
 public:
  using Change = std::function<void(std::span<double> values)>;

  using ForwardingProblem::ForwardingProblem;
  Change of_objective, of_gradient, of_jacobian, of_hessian;  ///< empty: as they are

  [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override {
    return ForwardingProblem::objective(v, new_v, f) && apply(of_objective, {&f, 1});
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool new_v,
                              std::span<double> grad) override {
    return ForwardingProblem::gradient(v, new_v, grad) && apply(of_gradient, grad);
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool new_v,
                              std::span<double> values) override {
    return ForwardingProblem::jacobian(v, new_v, values) && apply(of_jacobian, values);
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool new_v, double sigma,
                             std::span<const double> lambda, bool new_lambda,
                             std::span<double> values) override {
    return ForwardingProblem::hessian(v, new_v, sigma, lambda, new_lambda, values) &&
           apply(of_hessian, values);
  }

 private:
  static bool apply(const Change& change, std::span<double> values) {
    if (change) change(values);
    return true;
  }
};

}  // namespace ipminmax::testing
