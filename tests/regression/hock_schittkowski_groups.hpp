#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include <regression/hock_schittkowski.hpp>

namespace ipminmax::testing {

/// A MinimizationProblem being written down.
class Draft {
 public:
  Draft(std::string name, double objective, std::vector<double> start) {
    problem_.name = std::move(name);
    problem_.objective = objective;
    problem_.start = std::move(start);
  }

  template <std::size_t N>
  std::array<Expression, N> variables(double lower = -kNoBound, double upper = kNoBound) {
    std::array<double, N> lowers;
    std::array<double, N> uppers;
    lowers.fill(lower);
    uppers.fill(upper);
    return variables<N>(lowers, uppers);
  }
  template <std::size_t N>
  std::array<Expression, N> variables(const std::array<double, N>& lower,
                                      const std::array<double, N>& upper) {
    std::array<Expression, N> x;
    for (std::size_t i = 0; i < N; ++i) {
      x[i] = problem_.model.variable(Player::Min, "x" + std::to_string(i + 1), lower[i], upper[i]);
    }
    return x;
  }

  void minimize(const Expression& f) { problem_.model.objective(f); }
  void equal(const Expression& g, double value) { range(value, g, value); }
  void at_least(const Expression& g, double lower) { range(lower, g, kNoBound); }
  void at_most(const Expression& g, double upper) { range(-kNoBound, g, upper); }
  void range(double lower, const Expression& g, double upper) {
    problem_.model.constraint(g, lower, upper);
  }

  Draft& degenerate() {
    problem_.degenerate = true;
    return *this;
  }
  Draft& nonunique() {
    problem_.nonunique = true;
    return *this;
  }
  Draft& several_minima() {
    problem_.several_minima = true;
    return *this;
  }

  operator MinimizationProblem() const { return problem_; }  // NOLINT: conversion is the point

 private:
  MinimizationProblem problem_;
};

[[nodiscard]] inline Expression cube(const Expression& a) { return pow(a, 3.0); }

/// 100 (x2 - x1^2)^2 + (1 - x1)^2
[[nodiscard]] inline Expression rosenbrock(const Expression& x1, const Expression& x2) {
  return 100.0 * square(x2 - square(x1)) + square(1.0 - x1);
}

/// Data of Colville's first problem, 86, and of its dual, 117.
namespace colville {
inline constexpr double kA[10][5] = {{-16.0, 2.0, 0.0, 1.0, 0.0},    {0.0, -2.0, 0.0, 4.0, 2.0},
                                     {-3.5, 0.0, 2.0, 0.0, 0.0},     {0.0, -2.0, 0.0, -4.0, -1.0},
                                     {0.0, -9.0, -2.0, 1.0, -2.8},   {2.0, 0.0, -4.0, 0.0, 0.0},
                                     {-1.0, -1.0, -1.0, -1.0, -1.0}, {-1.0, -2.0, -3.0, -2.0, -1.0},
                                     {1.0, 2.0, 3.0, 4.0, 5.0},      {1.0, 1.0, 1.0, 1.0, 1.0}};
inline constexpr double kB[10] = {-40.0, -2.0, -0.25, -4.0, -4.0, -1.0, -40.0, -60.0, 5.0, 1.0};
inline constexpr double kC[5][5] = {{30.0, -20.0, -10.0, 32.0, -10.0},
                                    {-20.0, 39.0, -6.0, -31.0, 32.0},
                                    {-10.0, -6.0, 10.0, -6.0, -10.0},
                                    {32.0, -31.0, -6.0, 39.0, -20.0},
                                    {-10.0, 32.0, -10.0, -20.0, 30.0}};
inline constexpr double kD[5] = {4.0, 8.0, 10.0, 6.0, 2.0};
inline constexpr double kE[5] = {-15.0, -27.0, -36.0, -18.0, -12.0};
}  // namespace colville

[[nodiscard]] std::vector<MinimizationProblem> hock_schittkowski_001_to_050();
[[nodiscard]] std::vector<MinimizationProblem> hock_schittkowski_051_to_100();
[[nodiscard]] std::vector<MinimizationProblem> hock_schittkowski_101_to_119();
[[nodiscard]] std::vector<MinimizationProblem> schittkowski_from_201();
[[nodiscard]] std::vector<MinimizationProblem> hock_schittkowski_variants();

}  // namespace ipminmax::testing
