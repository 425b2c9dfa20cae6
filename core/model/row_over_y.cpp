#include "core/model/row_over_y.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "core/model/sampling.hpp"

namespace ipminmax {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Entries of the Jacobian that are the same, and not zero, wherever it is looked at: at the start
/// and at points around it.
std::vector<bool> constant_entries(Problem& model, std::span<const double> start) {
  constexpr int kProbes = 3;
  constexpr double kRadius = 0.1;  // relative to max(1, |v|)
  std::vector<double> v(start.begin(), start.end());
  std::vector<double> first(model.structure().jacobian.size()), values(first.size());
  std::vector<bool> constant(first.size(), false);
  if (!model.jacobian(v, true, first)) return constant;
  for (std::size_t k = 0; k < first.size(); ++k) constant[k] = first[k] != 0.0;
  std::mt19937_64 random(20220411);
  for (int probe = 0; probe < kProbes; ++probe) {
    for (std::size_t i = 0; i < v.size(); ++i) {
      v[i] = start[i] + kRadius * (2.0 * uniform(random) - 1.0) * std::max(1.0, std::abs(start[i]));
    }
    if (!model.jacobian(v, true, values)) return std::vector<bool>(first.size(), false);
    for (std::size_t k = 0; k < first.size(); ++k) {
      if (values[k] != first[k]) constant[k] = false;
    }
  }
  return constant;
}

}  // namespace

RobustScope without_consequences(Problem& model, const RobustScope& scope, Index constraint,
                                 std::span<const double> start, const SolverOptions& options) {
  if (scope.constraints.empty()) return scope;
  const ProblemStructure& s = model.structure();
  const std::vector<bool> constant = constant_entries(model, start);
  std::vector<bool> in(s.variable_players.size(), false);
  std::vector<bool> row_in(s.constraint_players.size(), false);
  std::vector<Index> readers(in.size(), 0);  // rows that are in; the robust one counts for good
  std::vector<std::vector<std::size_t>> of_row(row_in.size()), of_variable(in.size());
  for (const Index i : scope.variables) in[at(i)] = true;
  for (const Index j : scope.constraints) row_in[at(j)] = true;
  for (std::size_t k = 0; k < s.jacobian.size(); ++k) {
    const auto [row, col] = s.jacobian[k];
    if (!in[at(col)] || (!row_in[at(row)] && row != constraint)) continue;
    of_row[at(row)].push_back(k);
    of_variable[at(col)].push_back(k);
    readers[at(col)] += row == constraint ? 2 : 1;
  }
  const auto follows = [&](Index i) {
    return in[at(i)] && readers[at(i)] == 1 &&
           !(s.variable_lower[at(i)] > options.nlp_lower_bound_inf) &&
           !(s.variable_upper[at(i)] < options.nlp_upper_bound_inf);
  };
  std::vector<Index> candidates = scope.variables;
  while (!candidates.empty()) {
    const Index i = candidates.back();
    candidates.pop_back();
    if (!follows(i)) continue;
    const auto entry = std::ranges::find_if(
        of_variable[at(i)], [&](std::size_t k) { return row_in[at(s.jacobian[k].row)]; });
    if (entry == of_variable[at(i)].end() || !constant[*entry]) continue;
    const Index j = s.jacobian[*entry].row;
    if (s.constraint_lower[at(j)] != s.constraint_upper[at(j)]) continue;
    in[at(i)] = false;
    row_in[at(j)] = false;
    for (const std::size_t k : of_row[at(j)]) {
      const Index other = s.jacobian[k].col;
      --readers[at(other)];
      if (in[at(other)]) candidates.push_back(other);
    }
  }
  // What nothing reads any more goes, too.
  RobustScope needed;
  for (const Index i : scope.variables) {
    if (in[at(i)] && readers[at(i)] > 0) needed.variables.push_back(i);
  }
  for (const Index j : scope.constraints) {
    if (row_in[at(j)]) needed.constraints.push_back(j);
  }
  return needed;
}

RowOverY::RowOverY(Problem& model, const RobustScope& scope, Index constraint, double side)
    : ForwardingProblem(model),
      structure_(model.structure()),
      constraint_(constraint),
      side_(side),
      free_(structure_.variable_players.size(), false),
      g_(structure_.constraint_players.size()),
      lambda_(g_.size()),
      jacobian_(structure_.jacobian.size()) {
  const ProblemStructure& s = model.structure();
  for (const Index i : scope.variables) free_[at(i)] = true;
  std::ranges::fill(structure_.constraint_lower, -kInfinity);
  std::ranges::fill(structure_.constraint_upper, kInfinity);
  for (const Index j : scope.constraints) {
    structure_.constraint_lower[at(j)] = s.constraint_lower[at(j)];
    structure_.constraint_upper[at(j)] = s.constraint_upper[at(j)];
  }
  structure_.nonlinear_variables.reset();
}

void RowOverY::start_at(const RowPoint& start) {
  start_ = start;
  for (std::size_t i = 0; i < free_.size(); ++i) {
    if (!free_[i]) structure_.variable_lower[i] = structure_.variable_upper[i] = start_.v[i];
  }
}

bool RowOverY::starting_point(StartingPoint& start) {
  std::ranges::copy(start_.v, start.v.begin());
  if (!start.needs_multipliers || start_.lambda.empty()) return !start.needs_multipliers;
  std::ranges::copy(start_.lambda, start.lambda.begin());
  std::ranges::copy(start_.z_lower, start.z_lower.begin());
  std::ranges::copy(start_.z_upper, start.z_upper.begin());
  return true;
}

bool RowOverY::user_scaling(UserScaling& scaling) {
  if (!model().user_scaling(scaling)) return false;
  if (!scaling.constraints.empty()) scaling.objective = scaling.constraints[at(constraint_)];
  return true;
}

bool RowOverY::objective(std::span<const double> v, bool new_v, double& f) {
  if (!model().constraints(v, new_v, g_)) return false;
  f = side_ * g_[at(constraint_)];
  return true;
}

bool RowOverY::gradient(std::span<const double> v, bool new_v, std::span<double> grad) {
  if (!model().jacobian(v, new_v, jacobian_)) return false;
  std::ranges::fill(grad, 0.0);
  for (std::size_t k = 0; k < jacobian_.size(); ++k) {
    const auto [row, col] = structure_.jacobian[k];
    if (row == constraint_) grad[at(col)] += side_ * jacobian_[k];
  }
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

std::span<const double> RowOverY::weights(double sigma, std::span<const double> lambda) {
  std::ranges::copy(lambda, lambda_.begin());
  lambda_[at(constraint_)] = sigma * side_;
  return lambda_;
}

}  // namespace ipminmax
