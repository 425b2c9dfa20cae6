#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Core>

#include <support/autodiff_problem.hpp>

#include "core/model/canonical_problem.hpp"
#include "core/point/step_length.hpp"

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
