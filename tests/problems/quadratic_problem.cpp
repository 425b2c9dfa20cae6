#include <problems/quadratic_problem.hpp>

#include <algorithm>

namespace ipminmax::testing {
namespace {

constexpr double kUnbounded = 2e19;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

double QuadraticFunction::operator()(std::span<const double> v) const {
  double sum = constant;
  for (const auto& [i, value] : linear) sum += value * v[at(i)];
  for (std::size_t k = 0; k < places.size(); ++k) {
    const auto [i, j] = places[k];
    sum += (i == j ? 0.5 : 1.0) * values[k] * v[at(i)] * v[at(j)];
  }
  return sum;
}

void QuadraticFunction::add_gradient(std::span<const double> v, double weight,
                                     std::span<double> gradient) const {
  for (const auto& [i, value] : linear) gradient[at(i)] += weight * value;
  for (std::size_t k = 0; k < places.size(); ++k) {
    const auto [i, j] = places[k];
    gradient[at(i)] += weight * values[k] * v[at(j)];
    if (i != j) gradient[at(j)] += weight * values[k] * v[at(i)];
  }
}

QuadraticProblem::QuadraticProblem(Index n_min, Index n_max) {
  const std::size_t n = at(n_min + n_max);
  structure_.variable_players.assign(n, Player::Min);
  std::fill_n(structure_.variable_players.begin() + n_min, n_max, Player::Max);
  structure_.variable_lower.assign(n, -kUnbounded);
  structure_.variable_upper.assign(n, kUnbounded);
  start_.assign(n, 0.0);
}

void QuadraticProblem::set_bounds(Index i, double lower, double upper) {
  structure_.variable_lower[at(i)] = lower;
  structure_.variable_upper[at(i)] = upper;
}

void QuadraticProblem::add_constraint(QuadraticFunction g, double lower, double upper) {
  constraints_.push_back(std::move(g));
  structure_.constraint_lower.push_back(lower);
  structure_.constraint_upper.push_back(upper);
}

void QuadraticProblem::finish() {
  structure_.hessian = objective_.places;
  for (std::size_t row = 0; row < constraints_.size(); ++row) {
    const auto entry = [&](Index col) {
      structure_.jacobian.push_back({static_cast<Index>(row), col});
    };
    for (const auto& [i, value] : constraints_[row].linear) entry(i);
    for (const auto& [i, j] : constraints_[row].places) {
      entry(i);
      if (i != j) entry(j);
    }
    structure_.hessian.insert(structure_.hessian.end(), constraints_[row].places.begin(),
                              constraints_[row].places.end());
  }
  structure_.constraint_players = implied_constraint_players(structure_);
}

bool QuadraticProblem::starting_point(StartingPoint& start) {
  std::ranges::copy(start_, start.v.begin());
  return true;
}

bool QuadraticProblem::objective(std::span<const double> v, bool, double& f) {
  f = objective_(v);
  return true;
}

bool QuadraticProblem::gradient(std::span<const double> v, bool, std::span<double> grad) {
  std::ranges::fill(grad, 0.0);
  objective_.add_gradient(v, 1.0, grad);
  return true;
}

bool QuadraticProblem::constraints(std::span<const double> v, bool, std::span<double> g) {
  for (std::size_t row = 0; row < constraints_.size(); ++row) g[row] = constraints_[row](v);
  return true;
}

bool QuadraticProblem::jacobian(std::span<const double> v, bool, std::span<double> values) {
  std::size_t entry = 0;
  for (const QuadraticFunction& g : constraints_) {
    for (const auto& [i, value] : g.linear) values[entry++] = value;
    for (std::size_t k = 0; k < g.places.size(); ++k) {
      const auto [i, j] = g.places[k];
      values[entry++] = g.values[k] * v[at(j)];
      if (i != j) values[entry++] = g.values[k] * v[at(i)];
    }
  }
  return true;
}

bool QuadraticProblem::hessian(std::span<const double>, bool, double sigma,
                               std::span<const double> lambda, bool, std::span<double> values) {
  std::size_t entry = 0;
  for (const double value : objective_.values) values[entry++] = sigma * value;
  for (std::size_t row = 0; row < constraints_.size(); ++row) {
    for (const double value : constraints_[row].values) values[entry++] = lambda[row] * value;
  }
  return true;
}

}  // namespace ipminmax::testing
