// Constraints of Min that read Max variables: they hold for every y near the worst case found.
#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>

#include "core/answer.hpp"
#include "core/robust.hpp"
#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

void expect_certified(const Result& result) {
  EXPECT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax) << result.message;
}

TEST(RobustConstraint, HoldsAtTheWorstDisturbance) {
  // max_y 2 x y - y^2 = x^2 <= 4 at y = x: min -x, x = 2.
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(-x);
  model.constraint(2.0 * x * y - square(y), -kNoBound, 4.0, kMin);
  AutodiffProblem problem(model, {0.5, 0.1});
  const Result result = solve(problem, {});
  expect_certified(result);
  EXPECT_NEAR(result.v[0], 2.0, 1e-6);
  EXPECT_NEAR(result.v[1], 2.0, 1e-5);
  EXPECT_NEAR(result.lambda[0], 0.25, 1e-5);
}

/// Fewer or more scaling factors than it has variables and constraints.
class WrongFactors : public AutodiffProblem {
 public:
  using AutodiffProblem::AutodiffProblem;
  [[nodiscard]] bool user_scaling(UserScaling& scaling) override {
    scaling = factors;
    return true;
  }
  UserScaling factors;
};

TEST(RobustConstraint, WrongNumbersOfScalingFactorsAreRefused) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y", -1.0, 1.0);
  model.objective(square(x) + 0.1 * x * y - square(y));
  model.constraint(x + y, -kNoBound, 3.0, kMin);
  WrongFactors problem(model, {0.0, 0.0});
  SolverOptions options;
  options.nlp_scaling_method = Scaling::User;
  for (const std::size_t variables : {1U, 3U, 4U}) {
    problem.factors.variables.assign(variables, 2.0);
    const Result result = solve(problem, options);
    EXPECT_FALSE(is_success(result.status));
    EXPECT_NE(result.message.find("one entry per variable"), std::string::npos) << result.message;
  }
  problem.factors.variables.clear();
  for (const std::size_t constraints : {2U, 3U}) {
    problem.factors.constraints.assign(constraints, 2.0);
    EXPECT_FALSE(is_success(solve(problem, options).status));
  }
}

TEST(RobustConstraint, WorstDisturbanceAtABound) {
  // x + y <= 3 for y in [-1, 1]: x = 2.
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y", -1.0, 1.0);
  model.objective(-x + 0.1 * square(x));
  model.constraint(x + y, -kNoBound, 3.0, kMin);
  AutodiffProblem problem(model, {0.0, 0.0});
  const Result result = solve(problem, {});
  expect_certified(result);
  EXPECT_NEAR(result.v[0], 2.0, 1e-6);
  EXPECT_NEAR(result.v[1], 1.0, 1e-6);
}

TEST(RobustConstraint, OneThatCannotBeMetTellsItsOwnWorstValue) {
  // y + 0.3 y^2 + x <= 0.5 with x >= 0: 1.3 at y = 1, whatever x is.
  Model model;
  const Expression x = model.variable(kMin, "x", 0.0, 10.0);
  const Expression y = model.variable(kMax, "y", -1.0, 1.0);
  model.objective(x);
  model.constraint(y + 0.3 * square(y) + x, -kNoBound, 0.5, kMin);
  AutodiffProblem problem(model, {1.0, 0.0});
  const Result result = solve(problem, {});
  EXPECT_EQ(result.status, Status::LocallyInfeasible) << result.message;
  ASSERT_FALSE(result.worst_cases.empty());
  EXPECT_NEAR(result.worst_cases[0].value, 1.3, 1e-6);
  EXPECT_NEAR(result.error.primal, 0.8, 1e-6);
}

TEST(RobustConstraint, LowerBoundHoldsForTheLeastValue) {
  // x + y^2 + y >= 0 for every y: the least is x - 1/4.
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(x);
  model.constraint(x + square(y) + y, 0.0, kNoBound, kMin);
  AutodiffProblem problem(model, {3.0, 0.5});
  const Result result = solve(problem, {});
  expect_certified(result);
  EXPECT_NEAR(result.v[0], 0.25, 1e-6);
  EXPECT_NEAR(result.v[1], -0.5, 1e-5);
}

/// 1 <= x^2 + height^2 for every height that gusts in a box reach, stage by stage: all gusts that
/// leave the height at zero are worst, and along them nothing changes, the equations of the
/// stages included.
TEST(RobustConstraint, WorstDisturbancesAreAFaceOfTheirBox) {
  constexpr int kStages = 10;
  Model model;
  const Expression x = model.variable(kMin, "x");
  Expression height = model.variable(kMax, "height0", 0.0, 0.0), speed = height;
  std::vector<double> start = {2.0, 0.0};
  model.objective(square(x - 0.5));
  for (int k = 0; k < kStages; ++k) {
    const Expression gust = model.variable(kMax, "gust" + std::to_string(k), -1.0, 1.0);
    const Expression next_speed = model.variable(kMax, "speed" + std::to_string(k));
    const Expression next = model.variable(kMax, "height" + std::to_string(k + 1));
    model.constraint(next_speed - 0.9 * speed - 0.1 * gust, 0.0, 0.0);
    model.constraint(next - height - 0.1 * speed - 0.005 * gust, 0.0, 0.0);
    height = next;
    speed = next_speed;
    start.insert(start.end(), {0.3 - 0.05 * k, 0.0, 0.0});
  }
  model.constraint(1.0 - square(x) - square(height), -kNoBound, 0.0, kMin);
  AutodiffProblem problem(model, start);
  const Result result = solve_robust(problem, {}).result;
  expect_certified(result);
  EXPECT_EQ(result.certificate.answer, InnerAnswer::BestNotUnique);
  EXPECT_NEAR(result.v[0], 1.0, 1e-7);
}

/// x + sum 3 y_i^2 + slope_i y_i <= 2 over a box: a maximum at each corner, the highest at the
/// signs of the slopes; y starts at the lowest one.
Result below_a_convex_row(std::size_t variables) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  model.objective(-x);
  Expression row = x;
  std::vector<double> start{0.0};
  for (std::size_t i = 0; i < variables; ++i) {
    const Expression y = model.variable(kMax, "y" + std::to_string(i), -1.0, 1.0);
    const double slope = (i % 2 == 0 ? 0.01 : -0.01) * static_cast<double>(1 + i);
    row += 3.0 * square(y) + slope * y;
    start.push_back(slope > 0.0 ? -0.9 : 0.9);
  }
  model.constraint(row, -kNoBound, 2.0, kMin);
  AutodiffProblem problem(model, start);
  return solve(problem, {});
}

TEST(RobustConstraint, AFaceOfWorstCasesIsNotSearchedFromEachOfThem) {
  // x - (sum of y)^2 <= 1 for y in [-1, 1]^10: x = 1, whatever y sums to zero.
  Model model;
  const Expression x = model.variable(kMin, "x");
  Expression sum = model.variable(kMax, "y", -1.0, 1.0);
  for (int k = 1; k < 10; ++k) sum = sum + model.variable(kMax, "y", -1.0, 1.0);
  model.objective(square(x - 2.0));
  model.constraint(x - square(sum), -kNoBound, 1.0, kMin);
  std::vector<double> start(11, 0.3);
  AutodiffProblem problem(model, start);
  const RobustResult answer = solve_robust(problem, {});
  expect_certified(answer.result);
  EXPECT_NEAR(answer.result.v[0], 1.0, 1e-6);
  EXPECT_LT(answer.maximizations, 40);
}

TEST(RobustConstraint, OneVariableAtATimeFindsTheHighestCorner) {
  const Result result = below_a_convex_row(14);
  EXPECT_TRUE(is_success(result.status)) << result.message;
  EXPECT_NEAR(result.v[0], 2.0 - 14 * 3.0 - 0.01 * 14 * 15 / 2, 1e-6);
}

TEST(RobustConstraint, BoundsOfYMayBeConstraints) {
  // As in below_a_convex_row; one unit of y is a thousandth of its interval.
  for (const double unit : {1.0, 1e-3}) {
    Model model;
    const Expression x = model.variable(kMin, "x");
    const Expression y = unit * model.variable(kMax, "y");
    model.objective(-x);
    model.constraint(x + 3.0 * square(y) + 0.05 * y, -kNoBound, 2.0, kMin);
    model.constraint(-2.0 * y, -2.0, 2.0, kMax);
    AutodiffProblem problem(model, {0.0, -0.9 / unit});
    SolverOptions options;
    options.minmax_worst_case_starts = 8;
    EXPECT_NEAR(solve_robust(problem, options).result.v[0], -1.05, 1e-6) << unit;
  }
}

TEST(RobustConstraint, DisturbancesThatPushOneWayAlongATrajectoryAreTried) {
  // z is the mean of 20 disturbances, and z + exp(-6 (z + 0.7)) is 1 at z = 1, but exp(1.8) - 1 at
  // z = -1, behind a valley at -0.4 that hardly a random trajectory crosses.
  for (const double sign : {1.0, -1.0}) {
    constexpr int kSteps = 20;
    Model model;
    const Expression x = model.variable(kMin, "x");
    std::vector<Expression> w, z;
    for (int k = 0; k < kSteps; ++k) {
      w.push_back(model.variable(kMax, "w" + std::to_string(k), -1.0, 1.0));
      z.push_back(model.variable(kMax, "z" + std::to_string(k)));
    }
    model.objective(x);
    for (std::size_t k = 0; k < kSteps; ++k) {
      const Expression step = z[k] - w[k] / kSteps;
      model.constraint(k == 0 ? step : step - z[k - 1], 0.0, 0.0, kMax);
    }
    const Expression end = sign * z.back();
    model.constraint(end + exp(-6.0 * (end + 0.7)) - x, -kNoBound, 0.0, kMin);
    AutodiffProblem problem(model, std::vector<double>(2 * kSteps + 1, 0.0));
    const Result result = solve_robust(problem, {}).result;
    expect_certified(result);
    EXPECT_NEAR(result.v[0], std::exp(1.8) - 1.0, 1e-6) << sign;
  }
}

TEST(RobustConstraint, IsNotCertifiedWhileStartsFindOtherMaxima) {
  // Few of the starts find the highest of 4^6 maxima: that there is none above is not known.
  constexpr int kVariables = 6;
  Model model;
  const Expression x = model.variable(kMin, "x");
  model.objective(-x);
  Expression row = x;
  for (int i = 0; i < kVariables; ++i) {
    const Expression y = model.variable(kMax, "y" + std::to_string(i), -1.0, 1.0);
    row += 0.3 * cos(11.0 * y + i) + 0.1 * y;
  }
  model.constraint(row, -kNoBound, 2.0, kMin);
  AutodiffProblem problem(model, std::vector<double>(1 + kVariables, 0.1));
  const Result result = solve(problem, {});
  EXPECT_TRUE(is_success(result.status)) << result.message;
  EXPECT_NE(result.certificate.kind, PointKind::LocalMinmax);
  ASSERT_FALSE(result.certificate.reasons.empty());
  EXPECT_EQ(result.certificate.reasons.front().kind, CertificateReason::Kind::RobustRow);
  EXPECT_EQ(result.certificate.reasons.front().constraints, std::vector<Index>{0});
  EXPECT_EQ(result.certificate.margin, 0.0);
  EXPECT_EQ(result.certificate.least_curvature, 0.0);
}

TEST(RobustConstraint, CornersOfTheBoxOutsideOfASimplexAreNoCornersWithoutAValue) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  Expression row = 0.0 * x, sum = 0.0 * x;
  model.objective(square(x - 3.0));
  for (int i = 0; i < 3; ++i) {
    const Expression y = model.variable(kMax, "y" + std::to_string(i), 0.0, 1.0);
    row += (1.0 + i) * x * y;
    sum += y;
  }
  model.constraint(row, -kNoBound, 2.0, kMin);
  model.constraint(sum, 1.0, 1.0, kMax);
  AutodiffProblem problem(model, {0.5, 0.3, 0.3, 0.4});
  const Result result = solve(problem, {});
  EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax) << result.over_y.open;
  EXPECT_NEAR(result.v[0], 2.0 / 3.0, 1e-6);
}

TEST(RobustConstraint, ALimitThatIsOverAtOnceIsNamed) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y", -1.0, 1.0);
  model.objective(square(x - 3.0));
  model.constraint(x + y, -kNoBound, 1.0, kMin);
  AutodiffProblem problem(model, {0.5, 0.3});
  SolverOptions options;
  options.max_wall_time = 1e-9;
  EXPECT_EQ(solve(problem, options).status, Status::MaxWallTime);
}

TEST(RobustConstraint, OverNoYAtAllSaysThatMaxsConstraintsCannotBeMet) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y", -2.0, 2.0);
  model.objective(square(x - 3.0));
  model.constraint(square(y), -kNoBound, -1.0, kMax);
  model.constraint(x * y, -kNoBound, 1.0, kMin);
  AutodiffProblem problem(model, {0.5, 0.3});
  const Result result = solve(problem, {});
  EXPECT_EQ(result.status, Status::InnerInfeasible) << result.message;
  EXPECT_EQ(result.message.find("kink"), std::string::npos) << result.message;
}

TEST(RobustConstraint, KinkOfTwoBranchesIsSolvedWithACopyOfYEach) {
  // phi(x) = max_y -(y^2 - 1)^2 + x y + .1 x^2 + .3 x^3 = |x| + ..., least at the kink x = 0.
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression t = model.variable(kMin, "t");
  const Expression y1 = model.variable(kMax, "y1");
  const Expression y2 = model.variable(kMax, "y2");
  const auto f = [&](const Expression& y) {
    return -square(square(y) - 1.0) + x * y + 0.1 * square(x) + 0.3 * x * square(x);
  };
  model.objective(t);
  model.constraint(f(y1) - t, -kNoBound, 0.0, kMin);
  model.constraint(f(y2) - t, -kNoBound, 0.0, kMin);
  AutodiffProblem problem(model, {0.3, 1.0, 0.8, -0.8});
  SolverOptions options;
  options.minmax_worst_case_starts = 0;  // whose iterations count, too
  const Result result = solve(problem, options);
  expect_certified(result);
  EXPECT_NEAR(result.v[0], 0.0, 1e-6);
  EXPECT_NEAR(result.v[1], 0.0, 1e-6);
  EXPECT_NEAR(result.v[2], 1.0, 1e-5);
  EXPECT_NEAR(result.v[3], -1.0, 1e-5);
  EXPECT_LE(result.iterations, 20);
}

TEST(RobustConstraint, ActiveRowThatFAlsoReadsIsNotCertified) {
  // f pulls y to 0 where the row is active with a slope in y: y > 0 violates it.
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(-x - square(y));
  model.constraint(x + 0.1 * y, -kNoBound, 1.0, kMin);
  AutodiffProblem problem(model, {0.0, 0.0});
  const Result result = solve(problem, {});
  EXPECT_NE(result.certificate.kind, PointKind::LocalMinmax) << result.v[0] << " " << result.v[1];
  EXPECT_NE(result.status, Status::Solved);
}

TEST(RobustConstraint, InactiveRowLeavesThePointCertified) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  const Expression w = model.variable(kMax, "w", -1.0, 1.0);
  model.objective(square(x - 1.0) + x * y - square(y));
  model.constraint(x + w - 0.5 * square(w), -kNoBound, 10.0, kMin);
  AutodiffProblem problem(model, {0.0, 0.0, 0.0});
  const Result result = solve(problem, {});
  expect_certified(result);
  EXPECT_NEAR(result.v[0], 0.8, 1e-6);
}

TEST(RobustConstraint, EqualityIsRefused) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(square(x) - square(y));
  model.constraint(x + y, 1.0, 1.0, kMin);
  AutodiffProblem problem(model, {0.0, 0.0});
  const Result result = solve(problem, {});
  EXPECT_EQ(result.status, Status::InvalidProblem);
  EXPECT_NE(result.message.find("an equality cannot hold for every value"), std::string::npos)
      << result.message;
}

TEST(RobustConstraint, MayBeForbidden) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(square(x) - square(y));
  model.constraint(x + y, -kNoBound, 1.0, kMin);
  AutodiffProblem problem(model, {0.0, 0.0});
  SolverOptions options;
  options.minmax_robust_constraints = false;
  const Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::InvalidProblem);
  EXPECT_NE(result.message.find("belongs to the Min player but depends on"), std::string::npos);
}

/// f reads y, so the row has a copy of it, whose upper bound is weakly active: -(y - 1)^2 is
/// largest there, with slope zero.
RobustResult with_weakly_active_copy(bool named) {
  Model model;
  const Expression x = model.variable(kMin, named ? "x" : "");
  const Expression y = model.variable(kMax, named ? "y" : "", -1.0, 1.0);
  model.objective(0.1 * square(x) - x - square(y));
  model.constraint(x - square(y - 1.0), -kNoBound, 1.0, kMin);
  AutodiffProblem problem(model, {0.0, 0.5});
  SolverOptions options;
  options.minmax_worst_case_starts = 2;
  options.bound_relax_factor = 0.0;  // a bound moved out would be inactive
  return solve_robust(problem, options);
}

TEST(RobustConstraint, ReasonsNameWhatTheModelHasNotTheCopy) {
  for (const bool named : {true, false}) {
    const Result result = with_weakly_active_copy(named).result;
    const auto& reasons = result.certificate.reasons;
    ASSERT_FALSE(reasons.empty()) << result.message;
    bool about_y = false;
    for (const CertificateReason& reason : reasons) {
      for (const Index i : reason.variables) {
        EXPECT_LT(i, 2) << reason.text;
        about_y = about_y || i == 1;
      }
      for (const Index j : reason.constraints) EXPECT_EQ(j, 0) << reason.text;
      EXPECT_EQ(reason.text.find("variable 2"), std::string::npos) << reason.text;
    }
    EXPECT_TRUE(about_y);
    EXPECT_LT(result.certificate.least_curvature_variable, 2);
    EXPECT_NE(reasons.front().text.find(named ? "variable 1 (y in worst case 1)"
                                              : "variable 1 (worst case 1)"),
              std::string::npos)
        << reasons.front().text;
  }
}

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

// The row changes by 1e-3 with y and by 1e5 with x, so that the barrier leaves y a share of the row
// below its maximum: the row is solved again with that y fixed.
TEST(RobustConstraint, WhatTheBarrierLeavesIsMeasuredInTheUnitsOfTheRow) {
  constexpr int kSize = 40;
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  Expression mean = 0.0;
  for (int i = 0; i < kSize; ++i) {
    mean = mean + model.variable(Player::Max, "y", -1.0, 1.0) * (1.0 / kSize);
  }
  model.objective(50.0 * square(x - 1.0));
  model.constraint(1e5 * x + 0.001 * mean, -kNoBound, 0.0, Player::Min);
  AutodiffProblem problem(model, std::vector<double>(kSize + 1, 0.0));
  for (const auto effort : {CertificateEffort::Full, CertificateEffort::Quick}) {
    SolverOptions options;
    options.minmax_certificate = effort;
    const RobustResult answer = solve_robust(problem, options);
    EXPECT_TRUE(is_success(answer.result.status)) << answer.result.message;
    // Bounds with small multipliers, from which y is far, are active all the same.
    EXPECT_EQ(answer.result.certificate.kind == PointKind::LocalMinmax,
              effort == CertificateEffort::Full);
    EXPECT_NEAR(answer.result.v[0], -1e-8, 1e-11);
    EXPECT_LE(answer.worst_cases.size(), 2U);
    EXPECT_LE(answer.solves, 5);
  }
}

TEST(RobustConstraint, BothBoundsAreKept) {
  // |x mean(y)| <= c for every y in [-1, 1]^N, the worst case of either bound is inactive first.
  Model model;
  const Expression x = model.variable(kMin, "x");
  Expression sum = 0.0;
  for (int i = 0; i < 20; ++i) sum += model.variable(kMax, "y", -1.0, 1.0);
  model.objective(square(x - 1.0));
  model.constraint(0.05 * x * sum + 0.2 * x, -0.6, 0.6, kMin);
  std::vector<double> start(21, 0.1);
  AutodiffProblem problem(model, start);
  for (const int starts : {-1, 0}) {
    SolverOptions options;
    options.minmax_worst_case_starts = starts;
    const Result result = solve_robust(problem, options).result;
    expect_certified(result);
    EXPECT_NEAR(result.v[0], 0.5, 1e-6);
  }
}

TEST(RobustConstraint, ThatCannotBeMetIsNamedWithItsViolationAndY) {
  // max_y (x - 1)^2 + y0 + 2 y1 <= 2 has least value 3 at x = 1; the other row has room.
  Model model;
  const Expression x = model.variable(kMin, "x", -5.0, 5.0);
  const Expression y0 = model.variable(kMax, "y", -1.0, 1.0);
  const Expression y1 = model.variable(kMax, "y", -1.0, 1.0);
  model.objective(square(x));
  model.constraint(x * y0, -kNoBound, 9.0, kMin);
  model.constraint(square(x - 1.0) + y0 + 2.0 * y1, -kNoBound, 2.0, kMin);
  AutodiffProblem problem(model, {0.3, 0.0, 0.0});
  for (const int starts : {-1, 0}) {
    SolverOptions options;
    options.minmax_worst_case_starts = starts;
    const RobustResult answer = solve_robust(problem, options);
    EXPECT_EQ(answer.result.status, Status::LocallyInfeasible);
    EXPECT_EQ(answer.result.certificate.kind, PointKind::InfeasiblePoint);
    for (const char* said : {"constraint 1", "violation is 1,", "variable 1 (y) = 1"}) {
      EXPECT_NE(answer.result.message.find(said), std::string::npos) << answer.result.message;
    }
    EXPECT_NEAR(answer.result.v[0], 1.0, 1e-3);
    EXPECT_NEAR(answer.largest_violation, 1.0, 1e-5);
  }
}

TEST(RobustConstraint, WorkBesideAFailedSearchIsCountedOnce) {
  // x + y <= 0 and y - x <= 0 for y in [-1, 1]: no x.
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y", -1.0, 1.0);
  model.objective(square(x));
  model.constraint(x + y, -kNoBound, 0.0, kMin);
  model.constraint(y - x, -kNoBound, 0.0, kMin);
  AutodiffProblem problem(model, {0.3, 0.0});
  Index over_y = 0, solves = 0;
  SolveObserver observer;
  observer.on_iteration = [&](const IterationInfo& info) {
    if (info.iteration == 0) ++(info.over_y ? over_y : solves);
    return true;
  };
  const RobustResult answer = solve_robust(problem, {}, observer);
  EXPECT_EQ(answer.result.status, Status::LocallyInfeasible) << answer.result.message;
  EXPECT_EQ(answer.maximizations, over_y);
  EXPECT_LE(answer.solves, solves);
}

/// min |x - (wish, 2)|^2 with x'y + |y|^2 / 4 <= 1.5 for every y in [-1, 1]^2: |x_0| + |x_1| <= 1.
Result solve_for_wish(double wish, const SolverOptions& options, RepeatedSolver& solver) {
  Model model;
  const Expression x0 = model.variable(kMin, "x", -3.0, 3.0);
  const Expression x1 = model.variable(kMin, "x", -3.0, 3.0);
  const Expression y0 = model.variable(kMax, "y", -1.0, 1.0);
  const Expression y1 = model.variable(kMax, "y", -1.0, 1.0);
  model.objective(square(x0 - wish) + square(x1 - 2.0));
  model.constraint(x0 * y0 + x1 * y1 + 0.25 * (square(y0) + square(y1)), -kNoBound, 1.5, kMin);
  AutodiffProblem problem(model, {0.3, 0.3, -0.5, 0.1});
  return solver.solve(problem, options);
}

TEST(RobustConstraint, WarmStartsFollowTheWorstCases) {
  SolverOptions options;
  RepeatedSolver solver;
  const Result first = solve_for_wish(1.2, options, solver);
  expect_certified(first);
  EXPECT_EQ(first.over_y.asked, 8);
  options.warm_start_init_point = true;
  const Result next = solve_for_wish(1.21, options, solver);
  expect_certified(next);
  EXPECT_NEAR(next.v[0], 0.105, 1e-6);
  EXPECT_NEAR(next.v[1], 0.895, 1e-6);
  EXPECT_EQ(next.over_y.asked, 8);
  EXPECT_LT(next.iterations, first.iterations);
  EXPECT_LE(next.over_y.largest_violation, 1e-6);
  // The option's number holds, and without a warm start nothing of the last answer counts.
  options.minmax_worst_case_starts = 5;
  EXPECT_EQ(solve_for_wish(1.22, options, solver).over_y.asked, 5);
  const Result cold = solve_for_wish(1.01, {}, solver);
  EXPECT_EQ(cold.over_y.asked, 8);
}

/// min (x - 2)^2 with x y <= 1 and x (y + 0.2 y^3) <= limit for every y in [-1, 1]: x = 1.
Result solve_beside_a_limit(double limit, const SolverOptions& options, RepeatedSolver& solver) {
  Model model;
  const Expression x = model.variable(kMin, "x", -3.0, 3.0);
  const Expression y = model.variable(kMax, "y", -1.0, 1.0);
  model.objective(square(x - 2.0));
  model.constraint(x * y, -kNoBound, 1.0, kMin);
  model.constraint(x * (y + 0.2 * y * square(y)), -kNoBound, limit, kMin);
  AutodiffProblem problem(model, {0.3, 0.1});
  return solver.solve(problem, options);
}

TEST(RobustConstraint, FarFromItsLimitIsFollowedWhenSolvingAgain) {
  SolverOptions options;
  RepeatedSolver solver;
  const Result first = solve_beside_a_limit(9.0, options, solver);
  EXPECT_EQ(first.over_y.age, 0);
  options.warm_start_init_point = true;
  Index oldest = 0;
  for (int k = 1; k < 12; ++k) {
    const Result next = solve_beside_a_limit(9.0 + 0.01 * k, options, solver);
    expect_certified(next);
    EXPECT_LT(next.over_y.maximizations, first.over_y.maximizations);
    EXPECT_EQ(next.over_y.age, k % 10) << k;
    oldest = std::max(oldest, next.over_y.age);
    EXPECT_EQ(next.worst_cases.front().age, next.over_y.age);
    EXPECT_EQ(next.worst_cases.back().age, next.over_y.age);
    EXPECT_EQ(statements(next)[2].find(" ago") != std::string::npos, next.over_y.age > 0)
        << statements(next)[2];
  }
  EXPECT_EQ(oldest, 9);
  // Near its limit it is searched at once, and so it is if a number of starts was asked for.
  EXPECT_EQ(solve_beside_a_limit(1.3, options, solver).worst_cases.back().age, 0);
  static_cast<void>(solve_beside_a_limit(9.0, options, solver));
  options.minmax_worst_case_starts = 4;
  EXPECT_EQ(solve_beside_a_limit(9.0, options, solver).over_y.age, 0);
}

TEST(RobustConstraint, AWorstCaseThatDoesNotFitIsNoStart) {
  RepeatedSolver solver;
  SolverOptions options;
  options.warm_start_init_point = true;
  solver.start_at({{.constraint = 7, .v = {1.0}}, {.constraint = 0, .v = {0.0, 0.0}}});
  const Result result = solve_for_wish(1.2, options, solver);
  expect_certified(result);
  EXPECT_EQ(result.over_y.asked, 8);
  EXPECT_NEAR(result.v[1], 0.9, 1e-6);
}

/// Leyffer's example with two uncertain parameters: f reads the second one, the row the first.
Model two_parameters() {
  Model model;
  const Expression x = model.variable(kMin, "x", 0.0, kNoBound);
  const Expression z = model.variable(kMin, "z", 0.0, kNoBound);
  const Expression u = model.variable(kMax, "u", 0.25, 2.0);
  const Expression w = model.variable(kMax, "w", 0.5, 1.5);
  // Second derivatives in z and u have places, for ReadsElsewhere.
  model.objective(square(x - 4.0) + square(z - w) + 0.0 * square(u) * square(z));
  model.constraint(x * sqrt(u) - z * u, -kNoBound, 2.0, kMin);
  return model;
}

// A copy of u for f, which does not read it, has nothing to be a maximum of.
TEST(RobustConstraint, TheWorstCaseOfFHoldsOnlyWhatFReads) {
  AutodiffProblem problem(two_parameters(), {0.0, 0.0, 1.125, 1.0});
  SolverOptions options;
  options.minmax_epigraph = true;
  options.minmax_worst_case_starts = 10;
  const RobustResult answer = solve_robust(problem, options);
  expect_certified(answer.result);
  EXPECT_NEAR(answer.result.objective, 1.2316931, 1e-6);
  EXPECT_NEAR(answer.result.v[0], std::sqrt(8.0 * answer.result.v[1]), 1e-6);  // x^2 = 8 z
  for (const CertificateReason& reason : answer.result.certificate.reasons)
    EXPECT_EQ(reason.text.find("flat"), std::string::npos) << reason.text;
}

/// With max(0, 2 - z)^3 u^2 in f, which therefore does not read u around the start.
class ReadsElsewhere final : public AutodiffProblem {
 public:
  ReadsElsewhere() : AutodiffProblem(two_parameters(), {0.0, 3.0, 1.125, 1.0}) {}
  bool objective(std::span<const double> v, bool new_v, double& f) override {
    if (!AutodiffProblem::objective(v, new_v, f)) return false;
    f += std::pow(h(v), 3) * v[2] * v[2];
    return true;
  }
  bool gradient(std::span<const double> v, bool new_v, std::span<double> grad) override {
    if (!AutodiffProblem::gradient(v, new_v, grad)) return false;
    grad[1] -= 3.0 * std::pow(h(v), 2) * v[2] * v[2];
    grad[2] += 2.0 * std::pow(h(v), 3) * v[2];
    return true;
  }
  bool hessian(std::span<const double> v, bool new_v, double sigma, std::span<const double> lambda,
               bool new_lambda, std::span<double> values) override {
    if (!AutodiffProblem::hessian(v, new_v, sigma, lambda, new_lambda, values)) return false;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const auto [i, j] = structure().hessian[k];
      if (i == 1 && j == 1) values[k] += sigma * 6.0 * h(v) * v[2] * v[2];
      if (i == 2 && j == 1) values[k] -= sigma * 6.0 * std::pow(h(v), 2) * v[2];
      if (i == 2 && j == 2) values[k] += sigma * 2.0 * std::pow(h(v), 3);
    }
    return true;
  }

 private:
  static double h(std::span<const double> v) { return std::max(0.0, 2.0 - v[1]); }
};

// What the gradient shows later counts: the worst u is 2 where f reads it.
TEST(RobustConstraint, WhatFReadsElsewhereIsNotOverlooked) {
  ReadsElsewhere problem;
  SolverOptions options;
  options.minmax_epigraph = true;
  options.minmax_worst_case_starts = 10;
  const Result result = solve_robust(problem, options).result;
  EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax) << result.message;
  double worst = 0.0;
  for (const double w : {0.5, 1.5}) {
    double f = 0.0;
    ASSERT_TRUE(problem.objective(std::vector<double>{result.v[0], result.v[1], 2.0, w}, true, f));
    worst = std::max(worst, f);
  }
  EXPECT_NEAR(result.objective, worst, 1e-6) << result.message;
}

/// A reactor with a cooler (Halemane and Grossmann 1983): its volume and area are chosen at once,
/// recycle flow and temperature by an affine rule of the rate t and the heat transfer w. Five
/// implicit equations in units from 5 to 5e5. The value is that of a grid of 400 scenarios.
TEST(RobustConstraint, ADecisionRuleIsFoundWhereStatesFollowImplicitly) {
  constexpr double kFeed = 45.36, kHeat = 23260.0 * kFeed * 0.9, kCp = 167.4, kWater = 4.184;
  Model model;
  const Expression volume = model.variable(kMin, "volume", 0.0, 20.0);
  const Expression area = model.variable(kMin, "area", 0.0, 10.0);
  const Expression t = model.variable(kMax, "t", -1.0, 1.0);
  const Expression w = model.variable(kMax, "w", -1.0, 1.0);
  const auto rule = [&](const std::string& name) {
    const Expression constant = model.variable(kMin, name);
    const Expression of_t = model.variable(kMin, name + "_t");
    const Expression of_w = model.variable(kMin, name + "_w");
    return constant + of_t * t + of_w * w;
  };
  const Expression flow = rule("flow"), hot = rule("hot");
  const Expression used = model.variable(kMax, "used"), heat = model.variable(kMax, "heat");
  const Expression cooled = model.variable(kMax, "cooled"), out = model.variable(kMax, "out");
  const Expression water = model.variable(kMax, "water");
  model.objective(691.2 * pow(volume, 0.7) + 873.6 * pow(area, 0.6) + 1.76 * water + 7.056 * flow);
  const auto equation = [&](const Expression& e) { model.constraint(e, 0.0, 0.0, kMax); };
  equation(used * (10.0 + 0.5 * t) * exp(-555.6 / hot) * 3.204 - kFeed * 0.9);
  equation(kFeed * kCp * (hot - 333.0) + heat - kHeat);
  equation(flow * kCp * (hot - cooled) - heat);
  equation(water * kWater * (out - 300.0) - heat);
  const Expression warm = hot - out, cold = cooled - 300.0;
  equation(area * 1635.0 * (1.0 + 0.05 * w) * (warm - cold) / (log(warm) - log(cold)) - heat);
  const auto limit = [&](const Expression& e, double lower, double upper) {
    model.constraint(e, lower, upper, kMin);
  };
  limit(used - volume, -kNoBound, 0.0);
  limit(used, 0.0, kNoBound);
  limit(hot, 311.0, 389.0);
  limit(cooled, 311.0, 389.0);
  limit(out, 301.0, 355.0);
  limit(hot - cooled, 1.0, kNoBound);
  limit(out - 300.0, 1.0, kNoBound);
  limit(warm, 11.1, kNoBound);
  limit(cold, 11.1, kNoBound);
  AutodiffProblem problem(model, {6.0, 7.45, 0.0, 0.0, 88.32, 0.0, 0.0, 388.0, 0.0, 0.0, 5.315,
                                  531927.0, 352.0, 350.0, 2542.0});
  SolverOptions options;
  options.minmax_epigraph = true;
  const Result result = solve(problem, options);
  EXPECT_TRUE(is_success(result.status)) << result.message;
  EXPECT_NEAR(result.objective, 9955.0935, 0.1);
}

}  // namespace
}  // namespace ipminmax
