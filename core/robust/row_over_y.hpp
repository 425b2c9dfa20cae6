#pragma once

#include <algorithm>
#include <optional>
#include <span>
#include <vector>

#include "core/formulas/interval.hpp"
#include "core/model/forwarding_problem.hpp"
#include "core/robust/robust_copies.hpp"

namespace ipminmax {

/// max over y of side * g(x, y) for one robust constraint g of the model, y in Y(x), x held; side
/// -1 is for its lower bound. Variables and constraints are the model's: those that the row does
/// not involve are fixed and absent; these constraints are not evaluated but 0.
class RowOverY final : public Restructured {
 public:
  /// v: n, x and where y starts.
  RowOverY(Problem& model, Index constraint, double side, std::vector<double> v);
  /// The same; scope: of the constraint.
  RowOverY(Problem& model, Index constraint, double side, std::vector<double> v,
           const RobustScope& scope);

  [[nodiscard]] bool starting_point(StartingPoint& start) override;
  [[nodiscard]] bool user_scaling(UserScaling& scaling) override;
  [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override;
  [[nodiscard]] bool gradient(std::span<const double> v, bool new_v,
                              std::span<double> grad) override;
  [[nodiscard]] bool constraints(std::span<const double> v, bool new_v,
                                 std::span<double> g) override {
    std::ranges::fill(g, 0.0);
    return model().constraint_rows(rows_, v, new_v, g);
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool new_v,
                              std::span<double> values) override;
  [[nodiscard]] bool hessian(std::span<const double> v, bool new_v, double sigma,
                             std::span<const double> lambda, bool new_lambda,
                             std::span<double> values) override;
  [[nodiscard]] bool hessian_errors(std::span<const double> v, double sigma,
                                    std::span<const double> lambda,
                                    std::span<double> row_errors) override;
  [[nodiscard]] const BoxFunctions* over_boxes() const override {
    return boxes_ ? &*boxes_ : nullptr;
  }

 private:
  /// side * g as an objective over boxes.
  class Boxes final : public BoxFunctions {
   public:
    Boxes(const BoxFunctions& functions, const RowOverY& row) : functions_(functions), row_(row) {}
    [[nodiscard]] IntervalJet objective_over(std::span<const IntervalJet> v) const override;
    void constraints_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const override {
      functions_.constraints_over(v, g);
    }
    [[nodiscard]] IntervalJet all_over(std::span<const IntervalJet> v,
                                       std::span<IntervalJet> g) const override;
    [[nodiscard]] bool is_concurrent() const override { return functions_.is_concurrent(); }
    [[nodiscard]] Determined determined() const override { return functions_.determined(); }
    void determine(std::span<double> v) const override { functions_.determine(v); }

   private:
    const BoxFunctions& functions_;
    const RowOverY& row_;
  };

  [[nodiscard]] std::span<const double> weights(double sigma, std::span<const double> lambda);
  [[nodiscard]] std::span<const Index> row() const { return {&constraint_, 1}; }

  Index constraint_;
  double side_;
  std::vector<double> start_;
  std::vector<Index> rows_;                          ///< Max's constraints that it involves
  std::vector<std::size_t> entries_, rows_entries_;  ///< of the row and of these
  std::vector<double> g_, lambda_, jacobian_;        ///< in the model's shapes
  std::optional<Boxes> boxes_;
};

}  // namespace ipminmax
