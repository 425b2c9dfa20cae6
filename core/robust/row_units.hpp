#pragma once

#include <cmath>
#include <memory>
#include <span>
#include <vector>

#include "core/model/forwarding_problem.hpp"
#include "core/model/indices.hpp"
#include "core/model/structure_check.hpp"
#include "core/robust/extended_structure.hpp"
#include "core/robust/robust_scope.hpp"
#include "linalg/numbers.hpp"

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

/// Units of the robust rows of a model, from the values that they take over samples of y at the x
/// of v (n values; empty: of the model's start), and from their distance to the bound there.
/// epigraph_row: index of a row f - t, whose unit becomes that of the objective t, or -1.
[[nodiscard]] RowUnits units_of_rows(Problem& model, const std::vector<double>& v,
                                     Index epigraph_row);

/// A model with its robust rows and its objective in such units. Variables are the model's.
class InRowUnits final : public ByRows<Restructured>, private BoxesOf {
 public:
  InRowUnits(Problem& model, const std::vector<double>& v, Index epigraph_row = -1)
      : ByRows(model),
        BoxesOf(model.over_boxes()),
        units_(units_of_rows(model, v, epigraph_row)),
        entries_(entries_of_rows(changed)),
        lambda_(units_.factor.size()) {
    for (const auto j : indices(units_.factor)) {
      for (auto* bounds : {&changed.constraint_lower, &changed.constraint_upper}) {
        double& bound = (*bounds)[j];
        if (std::abs(bound) < kUnbounded) bound = units_.factor[j] * (bound - units_.offset[j]);
      }
    }
    changed.variable_units = units_.variables;
    changed.objective_factor = units_.objective;
  }
  [[nodiscard]] const RowUnits& units() const { return units_; }
  [[nodiscard]] bool user_scaling(UserScaling& scaling) override {
    if (!model().user_scaling(scaling)) return false;
    scaling.objective /= units_.objective;
    if (scaling.constraints.size() != units_.factor.size()) return true;  // the solve refuses it
    for (const auto j : indices(scaling.constraints)) scaling.constraints[j] /= units_.factor[j];
    return true;
  }

  [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override {
    if (!model().objective(v, new_v, f)) return false;
    f *= units_.objective;
    return true;
  }

  [[nodiscard]] bool gradient(std::span<const double> v, bool new_v,
                              std::span<double> grad) override {
    if (!model().gradient(v, new_v, grad)) return false;
    for (double& value : grad) value *= units_.objective;
    return true;
  }

  [[nodiscard]] bool constraint_rows(std::span<const Index> rows, std::span<const double> v,
                                     bool new_v, std::span<double> g) override {
    if (!model().constraint_rows(rows, v, new_v, g)) return false;
    for (const Index j : rows) g[at(j)] = units_.factor[at(j)] * (g[at(j)] - units_.offset[at(j)]);
    return true;
  }

  [[nodiscard]] bool jacobian_rows(std::span<const Index> rows, std::span<const double> v,
                                   bool new_v, std::span<double> values) override {
    if (!model().jacobian_rows(rows, v, new_v, values)) return false;
    for (const Index j : rows) {
      for (const std::size_t k : entries_[at(j)]) values[k] *= units_.factor[at(j)];
    }
    return true;
  }

  [[nodiscard]] bool hessian(std::span<const double> v, bool new_v, double sigma,
                             std::span<const double> lambda, bool new_lambda,
                             std::span<double> values) override {
    return model().hessian(v, new_v, sigma * units_.objective, in_model_units(lambda), new_lambda,
                           values);
  }

  [[nodiscard]] bool hessian_errors(std::span<const double> v, double sigma,
                                    std::span<const double> lambda,
                                    std::span<double> row_errors) override {
    return model().hessian_errors(v, sigma * units_.objective, in_model_units(lambda), row_errors);
  }

  [[nodiscard]] const BoxFunctions* over_boxes() const override { return if_known(); }
  [[nodiscard]] std::unique_ptr<Problem> clone() const override {
    auto copy = cloned(*this);
    if (copy) copy->model_boxes = copy->model().over_boxes();
    return copy;
  }

 private:
  IntervalJet objective_over(std::span<const IntervalJet> v) const override {
    return IntervalJet(units_.objective) * model_boxes->objective_over(v);
  }
  void constraints_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const override {
    model_boxes->constraints_over(v, g);
    for (const auto j : indices(g)) {
      if (units_.factor[j] != 1.0 || units_.offset[j] != 0.0)
        g[j] = IntervalJet(units_.factor[j]) * (g[j] - IntervalJet(units_.offset[j]));
    }
  }
  std::span<const double> in_model_units(std::span<const double> lambda) {
    for (const auto j : indices(lambda_)) lambda_[j] = lambda[j] * units_.factor[j];
    return lambda_;
  }
  RowUnits units_;
  std::vector<std::vector<std::size_t>> entries_;  ///< of each row, in the Jacobian
  std::vector<double> lambda_;
};

}  // namespace ipminmax
