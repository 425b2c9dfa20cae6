#pragma once

#include <span>
#include <vector>

#include "core/model/forwarding_problem.hpp"
#include "core/model/robust_copies.hpp"

namespace ipminmax {

/// max over y of side * g(x, y) for one robust constraint g of the model, y in Y(x), x held; side
/// -1 is for its lower bound. Variables and constraints are the model's: those that the row does
/// not involve are fixed and absent.
class RowOverY final : public ForwardingProblem {
 public:
  /// v: n, x and where y starts.
  RowOverY(Problem& model, Index constraint, double side, std::vector<double> v);

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override;
  [[nodiscard]] bool user_scaling(UserScaling& scaling) override;
  [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override;
  [[nodiscard]] bool gradient(std::span<const double> v, bool new_v,
                              std::span<double> grad) override;
  [[nodiscard]] bool hessian(std::span<const double> v, bool new_v, double sigma,
                             std::span<const double> lambda, bool new_lambda,
                             std::span<double> values) override;
  [[nodiscard]] bool hessian_errors(std::span<const double> v, double sigma,
                                    std::span<const double> lambda,
                                    std::span<double> row_errors) override;

 private:
  [[nodiscard]] std::span<const double> weights(double sigma, std::span<const double> lambda);

  ProblemStructure structure_;
  Index constraint_;
  double side_;
  std::vector<double> start_;
  std::vector<double> g_, lambda_, jacobian_;
};

}  // namespace ipminmax
