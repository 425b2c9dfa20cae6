#include <cmath>
#include <limits>
#include <string>
#include <utility>
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

/// min over x in [0, 4], max over y <= 3 of 2x^2 + 3xy - y^2
/// s.t. Min: x^2 >= 1,  Max: x + 2y = 4,  xy <= 5.
/// Canonical variables x, s | y, t; constraints x^2 - s | x + 2y - 4, xy - t.
class ResidualTest : public ::testing::Test {
 protected:
  static AutodiffProblem make() {
    Model model;
    const auto x = model.variable(Player::Min, "x", 0.0, 4.0);
    const auto y = model.variable(Player::Max, "y", -kNoBound, 3.0);
    model.objective(2.0 * square(x) + 3.0 * x * y - square(y));
    model.constraint(square(x), 1.0, kNoBound);
    model.constraint(x + 2.0 * y, 4.0, 4.0);
    model.constraint(x * y, -kNoBound, 5.0);
    return AutodiffProblem(model, {2.0, 1.5});
  }
  static SolverOptions make_options() {
    SolverOptions options;
    options.bound_relax_factor = 0.0;
    options.obj_scaling_factor = -0.5;  // canonical f = -x^2 - 1.5xy + 0.5y^2
    return options;
  }

  ResidualTest() : problem_(make()), canonical_(problem_, options_, counts_, timing_) {
    EXPECT_EQ(canonical_.build(), "");
    point_.iterate = {.v = Eigen::VectorXd{{2.0, 3.5, 1.0, 2.5}},
                      .lambda = Eigen::VectorXd{{0.25, -2.0, 0.5}},
                      .z_lower = Eigen::VectorXd{{0.5, 0.125, 0.0, 0.0}},
                      .z_upper = Eigen::VectorXd{{0.75, 0.0, 1.5, 2.0}}};
    point_.evaluation.c.setZero(3);
    point_.evaluation.gradient.setZero(4);
    point_.evaluation.jacobian.assign(canonical_.jacobian().size(), 0.0);
    EXPECT_TRUE(canonical_.objective(point_.iterate.v, point_.evaluation.f));
    EXPECT_TRUE(canonical_.constraints(point_.iterate.v, point_.evaluation.c));
    EXPECT_TRUE(canonical_.first_derivatives(point_.iterate.v, point_.evaluation));
    renew_dual(canonical_, point_);
  }

  BarrierError error(double mu, double s_max = 100.0) const {
    return barrier_error(canonical_, point_, mu, s_max);
  }

  SolverOptions options_ = make_options();
  Counts counts_;
  Timing timing_;
  AutodiffProblem problem_;
  CanonicalProblem canonical_;
  Point point_;
};

// f_x = -2x - 1.5y = -5.5, f_y = -1.5x + y = -2; J = (4 | 1 2 | y=1 x=2); lambda = 0.25 | -2, 0.5.
const Eigen::VectorXd kDual{{-5.5 + 4 * 0.25 - 2 + 0.5 - 0.5 + 0.75,  // x: - z_l + z_u
                             -0.25 - 0.125,                           // s: - lambda - z_l
                             -2.0 - 4.0 + 1.0 - 1.5,                  // y: Max, - z_u
                             -0.5 - 2.0}};                            // t: - lambda - z_u

TEST_F(ResidualTest, DualResidualHasTheSignsOfTheTwoPlayers) {
  EXPECT_TRUE(point_.dual.isApprox(kDual)) << point_.dual.transpose();
}

TEST_F(ResidualTest, PartsOfTheBarrierError) {
  // c = 4 - 3.5 | 2 + 2 - 4, 2 - 2.5;
  // S z: x 2 * 0.5 and 2 * 0.75, s 2.5 * 0.125, y 2 * 1.5, t 2.5 * 2.
  const BarrierError e = error(1.0);
  EXPECT_DOUBLE_EQ(e.primal, 0.5);
  EXPECT_DOUBLE_EQ(e.dual_min, 5.75);
  EXPECT_DOUBLE_EQ(e.dual_max, 6.5);
  EXPECT_DOUBLE_EQ(e.complementarity, 4.0);
  EXPECT_DOUBLE_EQ(e.norm(), 6.5);
  EXPECT_DOUBLE_EQ(error(10.0).complementarity, 10.0 - 0.3125);
}

TEST_F(ResidualTest, ScaledErrorDividesByTheMeanMultiplier) {
  EXPECT_DOUBLE_EQ(error(1.0).scaled, 6.5) << "small multipliers do not scale";
  // sum z = 4.875 over 5 bounds, sum |lambda| = 2.75 over 3 constraints.
  const double s_max = 0.1;
  const double s_d = (4.875 + 2.75) / 8.0 / s_max;
  EXPECT_DOUBLE_EQ(error(1.0, s_max).scaled, 6.5 / s_d);
  const double s_c = 4.875 / 5.0 / s_max;
  EXPECT_DOUBLE_EQ(error(1e4, s_max).scaled, (1e4 - 0.3125) / s_c);
}

TEST_F(ResidualTest, PrimalErrorIsNeverScaledDown) {
  point_.evaluation.c[1] = -50.0;
  EXPECT_DOUBLE_EQ(error(1.0, 0.01).scaled, 50.0);
  EXPECT_DOUBLE_EQ(error(1.0).norm(), 50.0);
}

TEST_F(ResidualTest, KktErrorIsInTheModelsUnits) {
  measure(canonical_, options_, point_);
  const KktError e = point_.error;
  EXPECT_DOUBLE_EQ(e.primal, 0.5);
  EXPECT_DOUBLE_EQ(e.dual_min, 5.75 / 0.5);
  EXPECT_DOUBLE_EQ(e.dual_max, 6.5 / 0.5);
  EXPECT_DOUBLE_EQ(e.complementarity, 5.0 / 0.5) << "at mu = 0";
  EXPECT_DOUBLE_EQ(e.total, 6.5) << "in canonical units";
}

TEST_F(ResidualTest, NewtonResidualIsMinusTheResidual) {
  NewtonResidual rhs = zero_step(canonical_);
  newton_residual(canonical_, point_, 0.5, rhs);
  EXPECT_TRUE(rhs.v.isApprox(-kDual - 0.5 * canonical_.damping()));
  EXPECT_TRUE(rhs.lambda.isApprox(Eigen::VectorXd{{-0.5, 0.0, 0.5}}));
  EXPECT_TRUE(rhs.z_lower.isApprox(Eigen::VectorXd{{-0.5, 0.5 - 0.3125, 0.0, 0.0}}));
  EXPECT_TRUE(rhs.z_upper.isApprox(Eigen::VectorXd{{-1.0, 0.0, -2.5, -4.5}}));
}

// A norm that loses a NaN makes a success of it.
TEST_F(ResidualTest, NaNAnywhereIsNaNInEveryNorm) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const auto expect_nan = [&](double& place, const char* what, Eigen::Index i) {
    const double before = std::exchange(place, kNaN);
    const BarrierError found = error(0.1);
    measure(canonical_, options_, point_);
    const KktError total = point_.error;
    EXPECT_TRUE(std::isnan(found.scaled) && std::isnan(found.norm())) << what << ' ' << i;
    EXPECT_TRUE(std::isnan(total.total)) << what << ' ' << i;
    place = before;
  };
  for (Eigen::Index i = 0; i < 4; ++i) {
    expect_nan(point_.dual[i], "dual residual", i);
    expect_nan(point_.iterate.v[i], "variable", i);
  }
  for (Eigen::Index j = 0; j < 3; ++j) expect_nan(point_.evaluation.c[j], "constraint", j);
  for (const Eigen::Index i : {0, 1}) expect_nan(point_.iterate.z_lower[i], "lower multiplier", i);
  for (const Eigen::Index i : {0, 2, 3}) {
    expect_nan(point_.iterate.z_upper[i], "upper multiplier", i);
  }
}

TEST(ResidualScaling, KktErrorUndoesConstraintAndVariableScaling) {
  // Gradient 1000 in the constraint: scaled by 0.1.
  Model model;
  const auto x = model.variable(Player::Min, "x");
  model.objective(square(x));
  model.constraint(1000.0 * x, 1.0, 1.0);
  AutodiffProblem problem(model, {1.0});
  const SolverOptions options;
  Counts counts;
  Timing timing;
  CanonicalProblem canonical(problem, options, counts, timing);
  ASSERT_EQ(canonical.build(), "");
  ASSERT_DOUBLE_EQ(canonical.constraint_scale(0), 0.1);
  Point point;
  point.iterate = canonical.starting_point();
  point.evaluation.c.setZero(1);
  point.evaluation.gradient.setZero(1);
  point.evaluation.jacobian.assign(1, 0.0);
  ASSERT_TRUE(canonical.constraints(point.iterate.v, point.evaluation.c));
  ASSERT_TRUE(canonical.first_derivatives(point.iterate.v, point.evaluation));
  renew_dual(canonical, point);
  measure(canonical, options, point);
  const KktError e = point.error;
  EXPECT_DOUBLE_EQ(e.primal, 999.0);
  EXPECT_DOUBLE_EQ(e.total, 99.9);
  EXPECT_DOUBLE_EQ(e.dual_min, 2.0);
  EXPECT_EQ(e.dual_max, 0.0);
  EXPECT_EQ(e.complementarity, 0.0);
}

TEST(ResidualOfNothing, IsZero) {
  AutodiffProblem problem{Model{}};
  const SolverOptions options;
  Counts counts;
  Timing timing;
  CanonicalProblem canonical(problem, options, counts, timing);
  ASSERT_EQ(canonical.build(), "");
  Point point;
  point.iterate = canonical.starting_point();
  renew_dual(canonical, point);
  measure(canonical, options, point);
  const KktError e = point.error;
  EXPECT_EQ(e.total, 0.0);
}

}  // namespace
}  // namespace ipminmax
