#include "ipopt.hpp"

namespace bench {

InnerProblem::InnerProblem(Problem& game, const Players& players, std::vector<double> v)
    : game_(game), players_(players), v_(std::move(v)), trial_(v_) {
  const ipminmax::ProblemStructure& s = game.structure();
  structure_.variable_players.assign(players.y.size(), ipminmax::Player::Min);
  structure_.constraint_players.assign(players.max_constraints.size(), ipminmax::Player::Min);
  for (const Index i : players.y) {
    structure_.variable_lower.push_back(s.variable_lower[at(i)]);
    structure_.variable_upper.push_back(s.variable_upper[at(i)]);
  }
  for (const Index j : players.max_constraints) {
    structure_.constraint_lower.push_back(s.constraint_lower[at(j)]);
    structure_.constraint_upper.push_back(s.constraint_upper[at(j)]);
  }
  const auto is_y = [&](Index i) { return s.variable_players[at(i)] == ipminmax::Player::Max; };
  for (std::size_t k = 0; k < s.jacobian.size(); ++k) {
    const auto [row, col] = s.jacobian[k];
    if (!is_y(col)) continue;
    jacobian_entries_.push_back(k);
    structure_.jacobian.push_back({players.constraint_place[at(row)], players.place[at(col)]});
  }
  for (std::size_t k = 0; k < s.hessian.size(); ++k) {
    const auto [row, col] = s.hessian[k];
    if (!is_y(row) || !is_y(col)) continue;
    hessian_entries_.push_back(k);
    structure_.hessian.push_back({players.place[at(row)], players.place[at(col)]});
  }
  gradient_.resize(v_.size());
  constraints_.resize(s.constraint_lower.size());
  lambda_.assign(s.constraint_lower.size(), 0.0);
  jacobian_.resize(s.jacobian.size());
  hessian_.resize(s.hessian.size());
}

std::vector<double> InnerProblem::point_with(std::span<const double> y) const {
  std::vector<double> v = v_;
  for (std::size_t i = 0; i < y.size(); ++i) v[at(players_.y[i])] = y[i];
  return v;
}

void InnerProblem::load(std::span<const double> y) {
  trial_ = v_;
  for (std::size_t i = 0; i < y.size(); ++i) trial_[at(players_.y[i])] = y[i];
}

bool InnerProblem::starting_point(ipminmax::StartingPoint& start) {
  for (std::size_t i = 0; i < players_.y.size(); ++i) start.v[i] = v_[at(players_.y[i])];
  return !start.needs_multipliers;
}

bool InnerProblem::objective(std::span<const double> y, bool, double& f) {
  load(y);
  const bool ok = game_.objective(trial_, true, f);
  f = -f;
  return ok;
}

bool InnerProblem::gradient(std::span<const double> y, bool, std::span<double> grad) {
  load(y);
  const bool ok = game_.gradient(trial_, true, gradient_);
  for (std::size_t i = 0; i < y.size(); ++i) grad[i] = -gradient_[at(players_.y[i])];
  return ok;
}

bool InnerProblem::constraints(std::span<const double> y, bool, std::span<double> g) {
  load(y);
  const bool ok = game_.constraints(trial_, true, constraints_);
  for (std::size_t j = 0; j < g.size(); ++j) g[j] = constraints_[at(players_.max_constraints[j])];
  return ok;
}

bool InnerProblem::jacobian(std::span<const double> y, bool, std::span<double> values) {
  load(y);
  const bool ok = game_.jacobian(trial_, true, jacobian_);
  for (std::size_t k = 0; k < values.size(); ++k) values[k] = jacobian_[jacobian_entries_[k]];
  return ok;
}

bool InnerProblem::hessian(std::span<const double> y, bool, double sigma,
                           std::span<const double> lambda, bool, std::span<double> values) {
  load(y);
  for (std::size_t j = 0; j < lambda.size(); ++j) {
    lambda_[at(players_.max_constraints[j])] = lambda[j];
  }
  const bool ok = game_.hessian(trial_, true, -sigma, lambda_, true, hessian_);
  for (std::size_t k = 0; k < values.size(); ++k) values[k] = hessian_[hessian_entries_[k]];
  return ok;
}

}  // namespace bench
