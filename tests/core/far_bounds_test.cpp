// Bounds far from zero, where distances to them vanish in rounding, and how far bounds are moved.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include <support/autodiff_problem.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

Result minimize_above(double bound, double start, const SolverOptions& options = {}) {
  Model model;
  const Expression x = model.variable(Player::Min, "x", bound);
  model.objective(x);
  AutodiffProblem problem(model, {start});
  return solve(problem, options);
}

// Ipopt takes 7 to 9 iterations.
TEST(FarBounds, ALinearObjectiveGoesToItsBound) {
  for (const double bound : {1e4, 1e6, 2.5e8, 1e10, 1e12, 1e15, -1e6, -1e10, -1e12}) {
    for (const double start : {0.0, bound, 2.0 * std::abs(bound)}) {
      const Result result = minimize_above(bound, start);
      EXPECT_EQ(result.status, Status::Solved) << bound << " from " << start << result.message;
      EXPECT_LE(result.iterations, 16) << bound << " from " << start;
      EXPECT_NEAR(result.v[0], bound, 1e-4 + 1e-15 * std::abs(bound));
      EXPECT_NEAR(result.z_lower[0], 1.0, 1e-6);
    }
  }
}

TEST(FarBounds, BothPlayersGoToTheirBounds) {
  Model model;
  const Expression x = model.variable(Player::Min, "x", 1e10);
  const Expression y = model.variable(Player::Max, "y", -kNoBound, 1e10);
  model.objective(x + 2.0 * y);
  AutodiffProblem problem(model, {0.0, 0.0});
  const Result result = solve(problem, SolverOptions{});
  EXPECT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_NEAR(result.v[0], 1e10, 1e-4);
  EXPECT_NEAR(result.v[1], 1e10, 1e-4);
}

TEST(FarBounds, AreMovedByNoMoreThanConstrViolTol) {
  for (const double bound : {2.5e8, -2.5e8, 1e12, 3.7e4}) {
    for (const double tolerance : {1e-4, 1e-8}) {
      SolverOptions options;
      options.constr_viol_tol = tolerance;
      const Result result = minimize_above(bound, 0.0, options);
      ASSERT_EQ(result.v.size(), 1U);
      EXPECT_LE(bound - result.v[0], tolerance) << bound;
      EXPECT_EQ(result.error.primal, std::max(bound - result.v[0], 0.0));
    }
  }
}

TEST(FarBounds, WithoutRelaxationAndWithALargeMultiplier) {
  SolverOptions options;
  options.bound_relax_factor = 0.0;
  Model model;
  const Expression x = model.variable(Player::Min, "x", 1.0);
  model.objective(1e8 * x);
  AutodiffProblem problem(model, {2.0});
  options.nlp_scaling_method = Scaling::None;
  const Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_NEAR(result.v[0], 1.0, 1e-11);
}

// What is far is far compared with the bounds and the start.
TEST(FarBounds, AnUnboundedObjectiveIsStillCalledSo) {
  Model model;
  const Expression x = model.variable(Player::Min, "x", -kNoBound, 1e6);
  model.objective(x);
  AutodiffProblem problem(model, {0.0});
  const Result result = solve(problem, SolverOptions{});
  EXPECT_TRUE(result.status == Status::OuterUnbounded || result.status == Status::DivergingIterates)
      << name_of(result.status);
}

}  // namespace
}  // namespace ipminmax::testing
