#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Core>

#include <support/autodiff_problem.hpp>

#include "core/model/canonical_problem.hpp"
#include "core/point/point.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::kNoBound;
using testing::Model;

/// Free x0, x1 in [0, 4], y0 in [-2, inf), y1 <= 1: bounds of every kind.
class StepLengthTest : public ::testing::Test {
 protected:
  static AutodiffProblem make() {
    Model model;
    const auto x0 = model.variable(Player::Min, "x0");
    const auto x1 = model.variable(Player::Min, "x1", 0.0, 4.0);
    const auto y0 = model.variable(Player::Max, "y0", -2.0, kNoBound);
    const auto y1 = model.variable(Player::Max, "y1", -kNoBound, 1.0);
    model.objective(square(x0) + square(x1) - square(y0) - square(y1));
    model.constraint(x0 + x1, 1.0, 1.0);
    return AutodiffProblem(model, {0.0, 2.0, 0.0, 0.0});
  }
  static SolverOptions unrelaxed() {
    SolverOptions options;
    options.bound_relax_factor = 0.0;
    return options;
  }

  StepLengthTest() : problem_(make()), canonical_(problem_, options_, counts_, timing_) {
    EXPECT_EQ(canonical_.build(), "");
    iterate_ = {.v = Eigen::VectorXd{{0.0, 1.0, -1.0, -3.0}},  // distances 1, 3 | 1 | 4
                .lambda = Eigen::VectorXd{{5.0}},
                .z_lower = Eigen::VectorXd{{0.0, 2.0, 0.5, 0.0}},
                .z_upper = Eigen::VectorXd{{0.0, 1.0, 0.0, 8.0}}};
    step_ = {.v = Eigen::VectorXd::Zero(4),
             .lambda = Eigen::VectorXd::Zero(1),
             .z_lower = Eigen::VectorXd::Zero(4),
             .z_upper = Eigen::VectorXd::Zero(4)};
  }

  StepLength largest(double tau) { return largest_step(canonical_, iterate_, step_, tau); }

  SolverOptions options_ = unrelaxed();
  Counts counts_;
  Timing timing_;
  AutodiffProblem problem_;
  CanonicalProblem canonical_;
  Iterate iterate_;
  Step step_;
};

TEST_F(StepLengthTest, IsOneWhereNoBoundIsInTheWay) {
  EXPECT_EQ(largest(0.9).primal, 1.0);
  step_.v << 1e9, 2.0, 1e9, -1e9;
  step_.z_lower << -1e9, 1e9, 1e9, -1e9;  // entries of absent bounds do not count
  step_.z_upper << -1e9, 1e9, -1e9, 1e9;
  EXPECT_EQ(largest(0.9).primal, 1.0);
  EXPECT_EQ(largest(0.9).dual, 1.0);
}

TEST_F(StepLengthTest, KeepsAFractionOfEveryDistance) {
  step_.v << 0.0, -2.0, 0.0, 0.0;
  EXPECT_DOUBLE_EQ(largest(0.9).primal, 0.45);
  step_.v << 0.0, 10.0, 0.0, 0.0;
  EXPECT_DOUBLE_EQ(largest(0.9).primal, 0.27);
  step_.v << 0.0, 0.0, -4.0, 0.0;
  EXPECT_DOUBLE_EQ(largest(0.5).primal, 0.125);
  step_.v << 0.0, 0.0, 0.0, 16.0;
  EXPECT_DOUBLE_EQ(largest(0.5).primal, 0.125);
  EXPECT_EQ(largest(0.5).dual, 1.0);
}

TEST_F(StepLengthTest, TakesTheTightestBound) {
  step_.v << 0.0, -2.0, -8.0, 5.0;
  EXPECT_DOUBLE_EQ(largest(0.8).primal, 0.1);
}

TEST_F(StepLengthTest, KeepsAFractionOfEveryMultiplierOfBothPlayers) {
  step_.z_lower << 0.0, -4.0, 0.0, 0.0;
  EXPECT_DOUBLE_EQ(largest(0.9).dual, 0.45);
  step_.z_lower << 0.0, 0.0, -2.0, 0.0;
  EXPECT_DOUBLE_EQ(largest(0.9).dual, 0.225);
  step_.z_upper << 0.0, 0.0, 0.0, -80.0;
  EXPECT_DOUBLE_EQ(largest(0.9).dual, 0.09);
  EXPECT_EQ(largest(0.9).primal, 1.0);
}

TEST_F(StepLengthTest, AFullStepMayUseTheWholeFraction) {
  step_.v << 0.0, -0.9, 0.0, 0.0;
  EXPECT_EQ(largest(0.9).primal, 1.0);
  step_.v << 0.0, -0.95, 0.0, 0.0;
  EXPECT_LT(largest(0.9).primal, 1.0);
}

TEST_F(StepLengthTest, AdvanceUsesThePrimalLengthForLambda) {
  step_.v << 1.0, 2.0, 3.0, 4.0;
  step_.lambda << 10.0;
  step_.z_lower << 0.0, 4.0, 8.0, 0.0;
  step_.z_upper << 0.0, -2.0, 0.0, 16.0;
  advance(canonical_, step_, {.primal = 0.5, .dual = 0.25}, iterate_);
  EXPECT_EQ(iterate_.v, (Eigen::VectorXd{{0.5, 2.0, 0.5, -1.0}}));
  EXPECT_EQ(iterate_.lambda[0], 10.0);
  EXPECT_EQ(iterate_.z_lower, (Eigen::VectorXd{{0.0, 3.0, 2.5, 0.0}}));
  EXPECT_EQ(iterate_.z_upper, (Eigen::VectorXd{{0.0, 0.5, 0.0, 12.0}}));
}

TEST(Advance, KeepsSlacksStationaryWithTheDualLengthForInequalities) {
  Model model;
  const auto x = model.variable(Player::Min, "x");
  const auto y = model.variable(Player::Max, "y");
  model.objective(square(x) - square(y));
  model.constraint(x + y, 1.0, 1.0);
  model.constraint(square(y), -kNoBound, 1.0);
  AutodiffProblem problem(model, {0.0, 0.0});
  const SolverOptions options;
  Counts counts;
  Timing timing;
  CanonicalProblem canonical(problem, options, counts, timing);
  ASSERT_EQ(canonical.build(), "");
  const auto slack_of = canonical.slack_of_constraint();
  const Index inequality = slack_of[0] >= 0 ? 0 : 1, equation = 1 - inequality;
  ASSERT_GE(slack_of[static_cast<std::size_t>(inequality)], 0);
  const Index slack = slack_of[static_cast<std::size_t>(inequality)];

  Iterate start{.v = Eigen::VectorXd::Zero(canonical.variables()),
                .lambda = Eigen::VectorXd::Zero(2),
                .z_lower = Eigen::VectorXd::Zero(canonical.variables()),
                .z_upper = Eigen::VectorXd::Zero(canonical.variables())};
  // Stationarity of the slack: -lambda + sign z_upper = 0.
  const double sign = canonical.sign(slack);
  start.z_upper[slack] = 2.0;
  start.lambda[inequality] = 2.0 * sign;
  Step step = zero_step(canonical);
  step.z_upper[slack] = -100.0;
  step.lambda << -100.0 * sign, -100.0 * sign;
  step.lambda[equation] = 3.0;
  const StepLength alpha{.primal = 1.0, .dual = 0.015};

  Iterate primal = start, dual = start;
  advance(canonical, step, alpha, primal);
  EXPECT_EQ(primal.lambda[inequality], -98.0 * sign);
  advance(canonical, step, alpha, dual, InequalityLength::Dual);
  EXPECT_EQ(dual.lambda[equation], 3.0);
  EXPECT_EQ(dual.z_upper[slack], 0.5);
  EXPECT_EQ(dual.lambda[inequality], 0.5 * sign);
}

TEST_F(StepLengthTest, ClipKeepsMultipliersNearTheCentralPath) {
  // mu / s is 0.1, 0.1/3 | 0.1 | 0.025.
  iterate_.z_lower << 0.0, 2.0, 1e-4, 0.0;
  iterate_.z_upper << 0.0, 0.1 / 3.0, 0.0, 0.3;
  clip_bound_multipliers(canonical_, 0.1, 10.0, iterate_);
  EXPECT_DOUBLE_EQ(iterate_.z_lower[1], 1.0);
  EXPECT_DOUBLE_EQ(iterate_.z_lower[2], 0.01);
  EXPECT_DOUBLE_EQ(iterate_.z_upper[1], 0.1 / 3.0) << "inside the interval";
  EXPECT_DOUBLE_EQ(iterate_.z_upper[3], 0.25);
  EXPECT_EQ(iterate_.z_lower[0], 0.0) << "no bound, no multiplier";
  EXPECT_EQ(iterate_.z_lower[3], 0.0);
}

}  // namespace
}  // namespace ipminmax
