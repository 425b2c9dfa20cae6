#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <ipminmax/core/problem.hpp>
#include <span>

/// A defender spends x to shrink what an attacker can do; the attacker's set depends on x:
///
///   min over x   max over y in Y(x)   w x^2 / 2 + d'y,    Y(x) = { y : |y|^2 <= (c - x)^2 }
///   0 <= x <= 0.99 c,   y in R^2
///
/// phi(x) = w x^2 / 2 + |d| (c - x), so x = |d| / w while that is below the bound, y = (c - x) d /
/// |d|.
class Interdiction final : public ipminmax::Problem {
 public:
  double price = 1.0;                         ///< w > 0
  double capacity = 2.0;                      ///< c > 0
  std::array<double, 2> damage = {1.0, 1.0};  ///< d

  [[nodiscard]] double best_x() const {
    return std::min(std::hypot(damage[0], damage[1]) / price, 0.99 * capacity);
  }
  [[nodiscard]] double best_value() const {
    const double x = best_x();
    return 0.5 * price * x * x + std::hypot(damage[0], damage[1]) * (capacity - x);
  }

  Interdiction() { describe(); }
  Interdiction(double w, double c, std::array<double, 2> d) : price(w), capacity(c), damage(d) {
    describe();
  }

  [[nodiscard]] const ipminmax::ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(ipminmax::StartingPoint& start) override {
    start.v[0] = 0.5 * capacity;
    start.v[1] = 0.1 * capacity;
    return true;
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    f = 0.5 * price * v[0] * v[0] + damage[0] * v[1] + damage[1] * v[2];
    return true;
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    grad[0] = price * v[0];
    grad[1] = damage[0];
    grad[2] = damage[1];
    return true;
  }
  [[nodiscard]] bool constraints(std::span<const double> v, bool, std::span<double> g) override {
    g[0] = v[1] * v[1] + v[2] * v[2] - (capacity - v[0]) * (capacity - v[0]);
    return true;
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool, std::span<double> values) override {
    values[0] = 2.0 * (capacity - v[0]);
    values[1] = 2.0 * v[1];
    values[2] = 2.0 * v[2];
    return true;
  }
  [[nodiscard]] bool hessian(std::span<const double>, bool, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    values[0] = sigma * price - 2.0 * lambda[0];
    values[1] = values[2] = 2.0 * lambda[0];
    return true;
  }

 private:
  void describe() {
    using ipminmax::Player;
    structure_.variable_players = {Player::Min, Player::Max, Player::Max};
    structure_.variable_lower = {0.0, -2e19, -2e19};
    structure_.variable_upper = {0.99 * capacity, 2e19, 2e19};
    structure_.constraint_lower = {-2e19};
    structure_.constraint_upper = {0.0};
    structure_.jacobian = {{0, 0}, {0, 1}, {0, 2}};
    structure_.hessian = {{0, 0}, {1, 1}, {2, 2}};
    structure_.variable_names = {"x", "y0", "y1"};
    structure_.constraint_players = ipminmax::implied_constraint_players(structure_);
  }

  ipminmax::ProblemStructure structure_;
};
