#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/formulas/interval.hpp"
#include "core/model/forwarding_problem.hpp"

namespace ipminmax {

/// The units in which robust constraints are solved: g' = factor (g - offset), factor a power of
/// two, so that tolerances and the relaxation of bounds, which are absolute near one, are small
/// beside what a row can change by. Rows whose size is ordinary keep theirs.
struct RowUnits {
  std::vector<double> factor, offset;  ///< m
  std::vector<double> size;            ///< m: of the rows in these units, where they were measured
  double objective = 1.0;              ///< factor of f
  std::vector<double> variables{};     ///< n or empty: ProblemStructure::variable_units

  /// A value of side times constraint j in the model's units.
  [[nodiscard]] double value(std::size_t j, double side, double scaled) const {
    return scaled / factor[j] + side * offset[j];
  }
  /// A multiplier of constraint j in the model's units.
  [[nodiscard]] double multiplier(std::size_t j, double scaled) const {
    return scaled * factor[j] / objective;
  }
};

/// The model's own units of so many constraints.
[[nodiscard]] inline RowUnits own_units(std::size_t constraints) {
  return {.factor = std::vector<double>(constraints, 1.0),
          .offset = std::vector<double>(constraints, 0.0),
          .size = std::vector<double>(constraints, 0.0)};
}

/// Units of the robust rows of a model, from the values that they take over samples of y at the x
/// of v (n values), and from their distance to the bound there.
/// epigraph_row: index of a row f - t, whose unit becomes that of the objective t, or -1.
[[nodiscard]] RowUnits units_of_rows(Problem& model, const std::vector<double>& v,
                                     Index epigraph_row = -1);

/// A model with its robust rows and its objective in other units. Variables are the model's.
class InRowUnits final : public ByRows<Restructured> {
 public:
  InRowUnits(Problem& model, RowUnits units);

  [[nodiscard]] const RowUnits& units() const { return units_; }

  [[nodiscard]] bool user_scaling(UserScaling& scaling) override;
  [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override;
  [[nodiscard]] bool gradient(std::span<const double> v, bool new_v,
                              std::span<double> grad) override;
  [[nodiscard]] bool constraint_rows(std::span<const Index> rows, std::span<const double> v,
                                     bool new_v, std::span<double> g) override;
  [[nodiscard]] bool jacobian_rows(std::span<const Index> rows, std::span<const double> v,
                                   bool new_v, std::span<double> values) override;
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
  class Boxes final : public BoxFunctions {
   public:
    Boxes(const BoxFunctions& model, const RowUnits& units) : model_(model), units_(units) {}
    [[nodiscard]] IntervalJet objective_over(std::span<const IntervalJet> v) const override;
    void constraints_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const override;
    [[nodiscard]] bool is_concurrent() const override { return model_.is_concurrent(); }
    [[nodiscard]] Determined determined() const override { return model_.determined(); }
    void determine(std::span<double> v) const override { model_.determine(v); }

   private:
    const BoxFunctions& model_;
    const RowUnits& units_;
  };

  [[nodiscard]] std::span<const double> in_model_units(std::span<const double> lambda);

  RowUnits units_;
  std::vector<std::vector<std::size_t>> entries_;  ///< of each row, in the Jacobian
  std::vector<double> lambda_;
  std::optional<Boxes> boxes_;
};

}  // namespace ipminmax
