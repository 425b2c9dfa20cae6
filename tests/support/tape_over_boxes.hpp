#pragma once

#include <span>
#include <utility>
#include <vector>

#include <support/autodiff_problem.hpp>

#include "core/formulas/interval.hpp"

namespace ipminmax::testing {

/// The problem of a Model, with its formulas over boxes.
class ProvableModel final : public AutodiffProblem, public BoxFunctions {
 public:
  explicit ProvableModel(const Model& model, std::vector<double> start = {})
      : AutodiffProblem(model, std::move(start)), model_(model) {}

  [[nodiscard]] const BoxFunctions* over_boxes() const override { return this; }
  [[nodiscard]] IntervalJet objective_over(std::span<const IntervalJet> v) const override {
    return value(model_.objective(), sweep(v));
  }
  void constraints_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const override {
    const std::vector<IntervalJet> values = sweep(v);
    for (std::size_t j = 0; j < g.size(); ++j) g[j] = value(model_.constraints()[j], values);
  }
  [[nodiscard]] bool is_concurrent() const override { return true; }

 private:
  static IntervalJet value(const Expression& e, const std::vector<IntervalJet>& values) {
    return e.is_constant() ? IntervalJet(e.constant()) : values[e.position()];
  }

  [[nodiscard]] std::vector<IntervalJet> sweep(std::span<const IntervalJet> v) const {
    using Kind = Operation::Kind;
    std::vector<IntervalJet> values;
    for (const Operation& operation : model_.tape()) {
      const IntervalJet a = operation.kind == Kind::Variable ? v[operation.a] : values[operation.a];
      const IntervalJet c(operation.c);
      switch (operation.kind) {
        case Kind::Variable:
          values.push_back(a);
          break;
        case Kind::Shift:
          values.push_back(a + c);
          break;
        case Kind::Scale:
          values.push_back(c * a);
          break;
        case Kind::Reciprocal:
          values.push_back(c / a);
          break;
        case Kind::Power:
          values.push_back(pow(a, operation.c));
          break;
        case Kind::Exp:
          values.push_back(exp(a));
          break;
        case Kind::Log:
          values.push_back(log(a));
          break;
        case Kind::Sin:
          values.push_back(sin(a));
          break;
        case Kind::Cos:
          values.push_back(cos(a));
          break;
        case Kind::Add:
          values.push_back(a + values[operation.b]);
          break;
        case Kind::Multiply:
          values.push_back(a * values[operation.b]);
          break;
      }
    }
    return values;
  }

  Model model_;
};

}  // namespace ipminmax::testing
