#include "core/robust/row_over_y.hpp"

#include <algorithm>
#include <utility>

#include "linalg/numbers.hpp"

namespace ipminmax {

RowOverY::RowOverY(Problem& model, Index constraint, double side, std::vector<double> v)
    : RowOverY(model, constraint, side, std::move(v), robust_scope(model.structure(), constraint)) {
}

RowOverY::RowOverY(Problem& model, Index constraint, double side, std::vector<double> v,
                   const RobustScope& scope)
    : Restructured(model),
      constraint_(constraint),
      side_(side),
      start_(std::move(v)),
      rows_(scope.constraints),
      g_(changed.constraint_players.size()),
      lambda_(g_.size()),
      jacobian_(model.structure().jacobian.size()) {
  const ProblemStructure& s = model.structure();
  changed.variable_lower = changed.variable_upper = start_;
  std::ranges::fill(changed.constraint_lower, -kInfinity);
  std::ranges::fill(changed.constraint_upper, kInfinity);
  for (const Index i : scope.variables) {
    changed.variable_lower[at(i)] = s.variable_lower[at(i)];
    changed.variable_upper[at(i)] = s.variable_upper[at(i)];
  }
  for (const Index i : scope.idle) {
    changed.variable_lower[at(i)] = changed.variable_upper[at(i)] = start_[at(i)];
  }
  for (const Index j : rows_) {
    changed.constraint_lower[at(j)] = s.constraint_lower[at(j)];
    changed.constraint_upper[at(j)] = s.constraint_upper[at(j)];
  }
  changed.jacobian.clear();
  for (std::size_t k = 0; k < s.jacobian.size(); ++k) {
    const Index row = s.jacobian[k].row;
    if (row == constraint_) entries_.push_back(k);
    if (!std::ranges::binary_search(rows_, row)) continue;
    rows_entries_.push_back(k);
    changed.jacobian.push_back(s.jacobian[k]);
  }
  changed.nonlinear_variables.reset();
  if (const BoxFunctions* functions = model.over_boxes()) boxes_.emplace(*functions, *this);
}

bool RowOverY::starting_point(StartingPoint& start) {
  std::ranges::copy(start_, start.v.begin());
  return !start.needs_multipliers;
}

bool RowOverY::user_scaling(UserScaling& scaling) {
  if (!model().user_scaling(scaling)) return false;
  if (!scaling.constraints.empty()) scaling.objective = scaling.constraints[at(constraint_)];
  return true;
}

bool RowOverY::objective(std::span<const double> v, bool new_v, double& f) {
  if (!model().constraint_rows(row(), v, new_v, g_)) return false;
  f = side_ * g_[at(constraint_)];
  return true;
}

bool RowOverY::gradient(std::span<const double> v, bool new_v, std::span<double> grad) {
  if (!model().jacobian_rows(row(), v, new_v, jacobian_)) return false;
  std::ranges::fill(grad, 0.0);
  for (const std::size_t k : entries_)
    grad[at(model().structure().jacobian[k].col)] += side_ * jacobian_[k];
  return true;
}

bool RowOverY::jacobian(std::span<const double> v, bool new_v, std::span<double> values) {
  if (!model().jacobian_rows(rows_, v, new_v, jacobian_)) return false;
  for (std::size_t k = 0; k < rows_entries_.size(); ++k) values[k] = jacobian_[rows_entries_[k]];
  return true;
}

bool RowOverY::hessian(std::span<const double> v, bool new_v, double sigma,
                       std::span<const double> lambda, bool, std::span<double> values) {
  return model().hessian(v, new_v, 0.0, weights(sigma, lambda), true, values);
}

bool RowOverY::hessian_errors(std::span<const double> v, double sigma,
                              std::span<const double> lambda, std::span<double> row_errors) {
  return model().hessian_errors(v, 0.0, weights(sigma, lambda), row_errors);
}

IntervalJet RowOverY::Boxes::objective_over(std::span<const IntervalJet> v) const {
  std::vector<IntervalJet> g(row_.g_.size());
  return all_over(v, g);
}

IntervalJet RowOverY::Boxes::all_over(std::span<const IntervalJet> v,
                                      std::span<IntervalJet> g) const {
  functions_.constraints_over(v, g);
  return IntervalJet(row_.side_) * g[at(row_.constraint_)];
}

std::span<const double> RowOverY::weights(double sigma, std::span<const double> lambda) {
  std::ranges::copy(lambda, lambda_.begin());
  lambda_[at(constraint_)] = sigma * side_;
  return lambda_;
}

}  // namespace ipminmax
