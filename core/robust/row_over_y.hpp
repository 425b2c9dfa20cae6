#pragma once

#include <algorithm>
#include <span>
#include <utility>
#include <vector>

#include "core/model/forwarding_problem.hpp"
#include "core/model/indices.hpp"
#include "core/robust/extended_structure.hpp"
#include "core/robust/robust_scope.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

/// max over y of side * g(x, y) for one robust constraint g of the model, y in Y(x), x held; side
/// -1 is for its lower bound. Variables and constraints are the model's: those that the row does
/// not involve are fixed and absent; these constraints are not evaluated but 0.
class RowOverY final : public ForwardingProblem, private BoxesOf {
 public:
  /// v: n, x and where y starts. scope: of the constraint.
  RowOverY(Problem& model, Index constraint, double side, std::vector<double> v,
           const RobustScope& scope)
      : ForwardingProblem(model),
        BoxesOf(model.over_boxes()),
        changed_(model.structure()),
        constraint_(constraint),
        side_(side),
        start_(std::move(v)),
        rows_(scope.constraints),
        g_(changed_.constraint_players.size()),
        lambda_(g_.size()),
        jacobian_(model.structure().jacobian.size()) {
    const ProblemStructure& s = model.structure();
    changed_.variable_lower = changed_.variable_upper = start_;
    std::ranges::fill(changed_.constraint_lower, -kInfinity);
    std::ranges::fill(changed_.constraint_upper, kInfinity);
    for (const Index i : scope.variables) {
      changed_.variable_lower[at(i)] = s.variable_lower[at(i)];
      changed_.variable_upper[at(i)] = s.variable_upper[at(i)];
    }
    for (const Index i : scope.irrelevant) fix_variable(changed_, i, start_[at(i)]);
    for (const Index j : rows_) {
      changed_.constraint_lower[at(j)] = s.constraint_lower[at(j)];
      changed_.constraint_upper[at(j)] = s.constraint_upper[at(j)];
    }
    changed_.jacobian.clear();
    for (const auto k : indices(s.jacobian)) {
      const Index row = s.jacobian[k].row;
      if (row == constraint_) entries_.push_back(k);
      if (!std::ranges::binary_search(rows_, row)) continue;
      rows_entries_.push_back(k);
      changed_.jacobian.push_back(s.jacobian[k]);
    }
    changed_.nonlinear_variables.reset();
  }

  [[nodiscard]] const ProblemStructure& structure() const override { return changed_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    std::ranges::copy(start_, start.v.begin());
    return !start.needs_multipliers;
  }

  [[nodiscard]] bool user_scaling(UserScaling& scaling) override {
    if (!model().user_scaling(scaling)) return false;
    if (!scaling.constraints.empty()) scaling.objective = scaling.constraints[at(constraint_)];
    return true;
  }

  [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override {
    if (!model().constraint_rows(row(), v, new_v, g_)) return false;
    f = side_ * g_[at(constraint_)];
    return true;
  }

  [[nodiscard]] bool gradient(std::span<const double> v, bool new_v,
                              std::span<double> grad) override {
    if (!model().jacobian_rows(row(), v, new_v, jacobian_)) return false;
    std::ranges::fill(grad, 0.0);
    for (const std::size_t k : entries_)
      grad[at(model().structure().jacobian[k].col)] += side_ * jacobian_[k];
    return true;
  }

  [[nodiscard]] bool constraints(std::span<const double> v, bool new_v,
                                 std::span<double> g) override {
    std::ranges::fill(g, 0.0);
    return model().constraint_rows(rows_, v, new_v, g);
  }

  [[nodiscard]] bool jacobian(std::span<const double> v, bool new_v,
                              std::span<double> values) override {
    if (!model().jacobian_rows(rows_, v, new_v, jacobian_)) return false;
    for (const auto k : indices(rows_entries_)) values[k] = jacobian_[rows_entries_[k]];
    return true;
  }

  [[nodiscard]] bool hessian(std::span<const double> v, bool new_v, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    return model().hessian(v, new_v, 0.0, weights(sigma, lambda), true, values);
  }

  [[nodiscard]] bool hessian_errors(std::span<const double> v, double sigma,
                                    std::span<const double> lambda,
                                    std::span<double> row_errors) override {
    return model().hessian_errors(v, 0.0, weights(sigma, lambda), row_errors);
  }

  [[nodiscard]] const BoxFunctions* over_boxes() const override { return if_known(); }

 private:
  IntervalJet objective_over(std::span<const IntervalJet> v) const override {
    std::vector<IntervalJet> g(g_.size());
    return all_over(v, g);
  }
  IntervalJet all_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const override {
    constraints_over(v, g);
    return IntervalJet(side_) * g[at(constraint_)];
  }
  std::span<const double> weights(double sigma, std::span<const double> lambda) {
    std::ranges::copy(lambda, lambda_.begin());
    lambda_[at(constraint_)] = sigma * side_;
    return lambda_;
  }
  std::span<const Index> row() const { return {&constraint_, 1}; }

  ProblemStructure changed_;  ///< the model's, of the same size
  Index constraint_;
  double side_;
  std::vector<double> start_;
  std::vector<Index> rows_;                          ///< Max's constraints that it involves
  std::vector<std::size_t> entries_, rows_entries_;  ///< of the row and of these
  std::vector<double> g_, lambda_, jacobian_;        ///< in the model's shapes
};

}  // namespace ipminmax
