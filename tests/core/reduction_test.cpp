// Worst cases that are maximized exactly: their derivatives, and what inactive rows need them for.
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>

#include "core/model/row_over_y.hpp"
#include "core/reduction/solve_reduced.hpp"
#include "core/robust.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;

/// (x - 1)^2 with x mean(y) <= c for every y in [-1, 1]^N: the only worst case is y = 1, the
/// answer x = c.
class Mean final : public Problem {
 public:
  Mean(Index size, double c) : size_(size) {
    s_.variable_players.assign(static_cast<std::size_t>(size) + 1, Player::Max);
    s_.variable_players[0] = Player::Min;
    s_.variable_lower.assign(s_.variable_players.size(), -1.0);
    s_.variable_upper.assign(s_.variable_players.size(), 1.0);
    s_.variable_lower[0] = -kNoBound;
    s_.variable_upper[0] = kNoBound;
    s_.constraint_players = {Player::Min};
    s_.constraint_lower = {-kNoBound};
    s_.constraint_upper = {c};
    for (Index i = 0; i <= size; ++i) {
      s_.jacobian.push_back({0, i});
      s_.hessian.push_back({i, 0});
    }
  }
  [[nodiscard]] const ProblemStructure& structure() const override { return s_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    std::ranges::fill(start.v, 0.1);
    start.v[0] = 0.2;
    return true;
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    f = (v[0] - 1.0) * (v[0] - 1.0);
    return true;
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    std::ranges::fill(grad, 0.0);
    grad[0] = 2.0 * (v[0] - 1.0);
    return true;
  }
  [[nodiscard]] bool constraints(std::span<const double> v, bool, std::span<double> g) override {
    g[0] = v[0] * mean(v);
    return true;
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool, std::span<double> out) override {
    std::ranges::fill(out, v[0] / size_);
    out[0] = mean(v);
    return true;
  }
  [[nodiscard]] bool hessian(std::span<const double>, bool, double sigma,
                             std::span<const double> lambda, bool, std::span<double> out) override {
    std::ranges::fill(out, lambda[0] / size_);
    out[0] = 2.0 * sigma;
    return true;
  }

 private:
  [[nodiscard]] double mean(std::span<const double> v) const {
    double sum = 0.0;
    for (std::size_t i = 1; i < v.size(); ++i) sum += v[i];
    return sum / size_;
  }
  Index size_;
  ProblemStructure s_;
};

class InactiveRow : public ::testing::TestWithParam<Index> {};

TEST_P(InactiveRow, IsMaximizedWhateverItsMultiplier) {
  for (const double c : {0.1, 0.5, 0.9}) {
    for (const int starts : {-1, 0, 2}) {
      Mean problem(GetParam(), c);
      SolverOptions options;
      options.minmax_worst_case_starts = starts;
      const RobustResult answer = solve_robust(problem, options);
      const std::string what = "c = " + std::to_string(c) + ", " + std::to_string(starts) +
                               " starts: " + answer.result.message;
      ASSERT_TRUE(is_success(answer.result.status)) << what;
      EXPECT_EQ(answer.result.certificate.kind, PointKind::LocalMinmax) << what;
      EXPECT_NEAR(answer.result.v[0], c, 1e-6) << what;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Disturbances, InactiveRow,
                         ::testing::Values(1, 2, 5, 10, 20, 50, 200, 1000));

/// A row with a state s of Max that an equation makes of x and y, a ball, and a box.
Model with_everything() {
  Model model;
  std::vector<Expression> x, y;
  for (int i = 0; i < 3; ++i) x.push_back(model.variable(Player::Min, "x"));
  for (int i = 0; i < 2; ++i) y.push_back(model.variable(Player::Max, "y", -1.0, 1.0));
  const Expression s = model.variable(Player::Max, "s");
  model.objective(square(x[0]) + square(x[1]) + square(x[2]));
  model.constraint(sin(x[0] * y[0]) + x[1] * s - 0.3 * square(y[1] - x[2]) - 0.2 * square(y[0]),
                   -kNoBound, 5.0, Player::Min);
  model.constraint(s - y[0] * x[1] - 0.5 * y[1] * square(x[2]), 0.0, 0.0, Player::Max);
  model.constraint(square(y[0]) + 2.0 * square(y[1]), -kNoBound, 0.8, Player::Max);
  return model;
}

TEST(RowMaximum, HasTheDerivativesOfItsValue) {
  AutodiffProblem problem(with_everything(), {0.7, -0.4, 0.6, 0.1, 0.2, 0.0});
  std::vector<double> v = {0.7, -0.4, 0.6, 0.1, 0.2, 0.0};
  for (const double mu : {1e-1, 1e-3, 1e-8}) {
    SolverOptions options;
    options.mu_init = mu;
    Budget budget(options);
    RowMaximum row(problem, {.constraint = 0, .side = 1.0, .v = v}, options, budget);
    ASSERT_EQ(row.x(), (std::vector<Index>{0, 1, 2}));
    const auto at = [&](double a, double b, double c) {
      std::vector<double> moved = v;
      moved[0] += a, moved[1] += b, moved[2] += c;
      EXPECT_TRUE(row.move_to(moved)) << row.failure();
    };
    at(0, 0, 0);
    std::vector<double> gradient(3), plus(3), minus(3), hessian(6, 0.0);
    ASSERT_TRUE(row.gradient(gradient));
    ASSERT_TRUE(row.add_hessian(1.0, hessian));
    row.accept();
    constexpr double kStep = 1e-4;
    for (int i = 0; i < 3; ++i) {
      const auto along = [&](double t) {
        at(i == 0 ? t : 0.0, i == 1 ? t : 0.0, i == 2 ? t : 0.0);
      };
      along(kStep);
      const double above = row.value();
      ASSERT_TRUE(row.gradient(plus));
      along(-kStep);
      const double below = row.value();
      ASSERT_TRUE(row.gradient(minus));
      const auto place = static_cast<std::size_t>(i);
      EXPECT_NEAR((above - below) / (2.0 * kStep), gradient[place], 1e-6) << "mu " << mu;
      for (std::size_t j = 0; j <= place; ++j) {
        EXPECT_NEAR((plus[j] - minus[j]) / (2.0 * kStep), hessian[place * (place + 1) / 2 + j],
                    1e-4)
            << "mu " << mu << ", entry " << i << ", " << j;
      }
    }
  }
}

TEST(RowMaximum, LeavesOutWhatFollowsFromTheRest) {
  // s1 = s0 + w0 + u0, s2 = ..., the row reads s2 of 5 stages: stages 3 to 5 are consequences.
  Model model;
  std::vector<Expression> u, s, w;
  for (int k = 0; k < 5; ++k) u.push_back(model.variable(Player::Min, "u"));
  for (int k = 0; k < 5; ++k) w.push_back(model.variable(Player::Max, "w", -1.0, 1.0));
  for (int k = 0; k < 5; ++k) s.push_back(model.variable(Player::Max, "s"));
  model.objective(square(u[0]) + square(u[1]));
  model.constraint(square(s[2]), -kNoBound, 30.0, Player::Min);
  for (std::size_t k = 0; k < 5; ++k) {
    const Expression before = k > 0 ? sin(s[k - 1]) : Expression(0.0);
    model.constraint(s[k] - before - u[k] - w[k], 0.0, 0.0, Player::Max);
  }
  AutodiffProblem problem(model, std::vector<double>(15, 0.1));
  const RobustScope whole = robust_scope(problem.structure(), 0);
  EXPECT_EQ(whole.variables.size(), 10U);
  const RobustScope needed =
      without_consequences(problem, whole, 0, std::vector<double>(15, 0.1), SolverOptions{});
  EXPECT_EQ(needed.variables, (std::vector<Index>{5, 6, 7, 10, 11, 12}));
  EXPECT_EQ(needed.constraints, (std::vector<Index>{1, 2, 3}));
  Budget budget{SolverOptions{}};
  RowMaximum row(problem, {.constraint = 0, .side = 1.0, .v = std::vector<double>(15, 0.1)}, {},
                 budget);
  EXPECT_EQ(row.x(), (std::vector<Index>{0, 1, 2})) << "of u";
}

TEST(SolveReduced, MeetsTheOtherBranchOnItsWay) {
  // The largest disc in an ellipse: y leaps from one side of the ellipse to the other.
  Model model;
  std::vector<Expression> x;
  for (int i = 0; i < 3; ++i) x.push_back(model.variable(Player::Min, "x"));
  const Expression t = model.variable(Player::Max, "t", -3.14159265358979, 3.14159265358979);
  model.objective(-1.0 * x[2]);
  model.constraint(0.25 * square(x[0] + x[2] * cos(t)) + square(x[1] + x[2] * sin(t)) - 1.0,
                   -kNoBound, 0.0, Player::Min);
  AutodiffProblem problem(model, {0.3, 0.1, 0.2, 0.0});
  Budget budget{SolverOptions{}};
  Reduction reduction{problem, {{0, {0.3, 0.1, 0.2, 0.0}}}, std::vector<bool>(4, false), {}, budget,
                      nullptr};
  const ReducedSolve answer = solve_reduced(reduction, SolverOptions{}, SolveObserver{});
  EXPECT_TRUE(is_success(answer.result.status)) << answer.result.message;
  EXPECT_NEAR(answer.result.objective, -1.0, 1e-6);
  EXPECT_GE(reduction.worst_cases.size(), 2U);
}

TEST(SolveReduced, DoesNotCertifyAWorstCaseWithoutCurvature) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression z = model.variable(Player::Min, "z");
  const Expression t = model.variable(Player::Max, "t", 0.0, 1.0);
  model.objective(x + 0.5 * square(z - 0.4));
  model.constraint(1.0 + 0.1 * z - square(square(t - 0.3 - 0.2 * z)) - x, -kNoBound, 0.0,
                   Player::Min);
  AutodiffProblem problem(model, {2.0, 0.0, 0.6});
  Budget budget{SolverOptions{}};
  Reduction reduction{problem, {{0, {2.0, 0.0, 0.6}}}, std::vector<bool>(3, false), {}, budget,
                      nullptr};
  const ReducedSolve answer = solve_reduced(reduction, SolverOptions{}, SolveObserver{});
  EXPECT_NE(answer.result.certificate.kind, PointKind::LocalMinmax);
}

}  // namespace
}  // namespace ipminmax
