#include <algorithm>
#include <cmath>

#include "core/model/initial_point.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/robust/epigraph.hpp"
#include "core/robust/extended_structure.hpp"
#include "core/robust/robust_scope.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

Epigraph::Epigraph(Problem& model, const std::vector<bool>& reads_y)
    : model_(model), structure_(model.structure()), of_objective_(true) {
  n_ = add_variable(structure_, Player::Min, -kInfinity, kInfinity, {-1, "t"});
  m_ = add_constraint(structure_, Player::Min, -kInfinity, 0.0, {-1, "f - t"});
  entries_ = structure_.jacobian.size();
  const bool known = std::ranges::find(reads_y, true) != reads_y.end();
  for (Index i = 0; i < n_; ++i) {
    const bool max = structure_.variable_players[size(i)] == Player::Max;
    (max && known && !reads_y[size(i)] ? unread_ : read_).push_back(i);
  }
  for (const Index i : read_) structure_.jacobian.push_back({m_, i});
  relax(m_, -1.0);
  gradient_.resize(size(n_));
  if (const BoxFunctions* functions = model.over_boxes()) boxes_.emplace(*functions);
}

Epigraph::Epigraph(Problem& model)
    : model_(model),
      structure_(model.structure()),
      of_objective_(false),
      m_(static_cast<Index>(structure_.constraint_players.size())),
      entries_(structure_.jacobian.size()) {
  n_ = add_variable(structure_, Player::Min, 0.0, kInfinity, {-1, "violation"});
  for (const Index row : robust_constraints(model.structure())) {
    const bool lower = structure_.constraint_lower[size(row)] > -kUnbounded;
    const bool upper = structure_.constraint_upper[size(row)] < kUnbounded;
    if (lower != upper) relax(row, upper ? -1.0 : 1.0);
  }
}

void Epigraph::relax(Index row, double sign) {
  relaxed_.push_back({row, sign});
  structure_.jacobian.push_back({row, n_});
  structure_.nonlinear_variables.reset();
}

bool Epigraph::starting_point(StartingPoint& start) {
  if (start.needs_multipliers) return false;
  const auto own = model_start(model_);
  if (!own) return false;
  std::ranges::copy(*own, start.v.begin());
  double f = 0.0;
  if (all_finite(*own) && model_.objective(*own, true, f) && std::isfinite(f)) start.v.back() = f;
  return true;
}

bool Epigraph::user_scaling(UserScaling& scaling) {
  if (!of_objective_ || !model_.user_scaling(scaling)) return false;
  if (!scaling.variables.empty()) scaling.variables.push_back(std::abs(scaling.objective));
  if (!scaling.constraints.empty()) scaling.constraints.push_back(std::abs(scaling.objective));
  return true;
}

bool Epigraph::objective(std::span<const double> v, bool, double& f) {
  f = v.back();
  return true;
}

bool Epigraph::gradient(std::span<const double>, bool, std::span<double> grad) {
  std::ranges::fill(grad, 0.0);
  grad.back() = 1.0;
  return true;
}

bool Epigraph::constraint_rows(std::span<const Index> rows, std::span<const double> v, bool,
                               std::span<double> g) {
  const auto own = v.first(size(n_));
  const auto asked = of_model(rows);
  if (!asked.empty() && !model_.constraint_rows(asked, own, true, g.first(size(m_)))) return false;
  if (asked.size() < rows.size() && !model_.objective(own, asked.empty(), g.back())) return false;
  for (const auto& [row, sign] : relaxed_) {
    if (std::ranges::binary_search(rows, row)) g[size(row)] += sign * v.back();
  }
  return true;
}

bool Epigraph::jacobian_rows(std::span<const Index> rows, std::span<const double> v, bool,
                             std::span<double> values) {
  const auto own = v.first(size(n_));
  const auto asked = of_model(rows);
  if (!asked.empty() && !model_.jacobian_rows(asked, own, true, values.first(entries_)))
    return false;
  for (std::size_t k = 0; k < relaxed_.size(); ++k)
    values[values.size() - relaxed_.size() + k] = relaxed_[k].sign;
  if (asked.size() == rows.size()) return true;
  if (!model_.gradient(own, asked.empty(), gradient_)) return false;
  for (std::size_t k = 0; k < read_.size(); ++k) values[entries_ + k] = gradient_[size(read_[k])];
  reads_more_ = reads_more_ ||
                std::ranges::any_of(unread_, [&](Index i) { return gradient_[size(i)] != 0.0; });
  return true;
}

bool Epigraph::hessian(std::span<const double> v, bool, double, std::span<const double> lambda,
                       bool, std::span<double> values) {
  return model_.hessian(v.first(size(n_)), true, of_objective_ ? lambda.back() : 0.0,
                        lambda.first(size(m_)), true, values);
}

bool Epigraph::hessian_errors(std::span<const double> v, double, std::span<const double> lambda,
                              std::span<double> row_errors) {
  row_errors.back() = 0.0;
  return model_.hessian_errors(v.first(size(n_)), of_objective_ ? lambda.back() : 0.0,
                               lambda.first(size(m_)), row_errors.first(size(n_)));
}

}  // namespace ipminmax
