#pragma once

#include <span>
#include <vector>

#include "core/problem.hpp"

namespace ipminmax {

/// First derivatives of a model at one point.
struct FirstDerivatives {
  std::vector<double> gradient;  ///< n
  std::vector<double> jacobian;  ///< in the order of the structure's triplets
};

/// Evaluates gradient and Jacobian together, in the model's own units, and counts the calls.
class FirstDerivativeSource {
 public:
  explicit FirstDerivativeSource(Problem& model) : model_(model) {}

  /// False where one of them is undefined or not finite. What is not wanted stays as it is.
  [[nodiscard]] bool evaluate(std::span<const double> v, FirstDerivatives& derivatives,
                              bool want_gradient = true, bool want_jacobian = true);

  [[nodiscard]] Index gradients() const { return gradients_; }
  [[nodiscard]] Index jacobians() const { return jacobians_; }

 private:
  Problem& model_;
  Index gradients_ = 0;
  Index jacobians_ = 0;
};

}  // namespace ipminmax
