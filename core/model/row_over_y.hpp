#pragma once

#include <span>
#include <vector>

#include "core/model/forwarding_problem.hpp"
#include "core/model/robust_copies.hpp"
#include "core/options.hpp"

namespace ipminmax {

/// A point of the maximization of a robust constraint over y: variables (n, x among them) and
/// multipliers in the model's shapes, signs as in Result; without lambda no multipliers are known.
struct RowPoint {
  std::vector<double> v, lambda{}, z_lower{}, z_upper{};
};

/// The scope without what follows from the rest and has no say in the row, as the states of a
/// trajectory behind the one that the row reads: again and again a Max variable without bounds that
/// one equation alone reads, in which its factor is a constant, goes with that equation.
[[nodiscard]] RobustScope without_consequences(Problem& model, const RobustScope& scope,
                                               Index constraint, std::span<const double> start,
                                               const SolverOptions& options);

/// max over y of side * g(x, y) for one robust constraint g of the model, y in Y(x), x held; side
/// -1 is for its lower bound. Variables and constraints are the model's: those that the row does
/// not involve are fixed and absent.
class RowOverY final : public ForwardingProblem {
 public:
  RowOverY(Problem& model, const RobustScope& scope, Index constraint, double side);

  /// Where the next solve begins and at which x.
  void start_at(const RowPoint& start);

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
  std::vector<bool> free_;  ///< n
  RowPoint start_;
  std::vector<double> g_, lambda_, jacobian_;
};

}  // namespace ipminmax
