// Time limits act inside iterations too: between factorizations, inner steps and restoration steps.
#include <chrono>
#include <cmath>
#include <functional>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>
#include <support/forwarding_problem.hpp>
#include <support/function_problem.hpp>

#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Expression;
using testing::ForwardingProblem;
using testing::FunctionProblem;
using testing::kNoBound;
using testing::Model;

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;
constexpr double kLimit = 0.05;

/// Concave in x, convex in y: each player needs a shift. 60 + 60 variables, dense.
FunctionProblem wrong_curvature() {
  constexpr Eigen::Index kSize = 120;
  std::vector<Player> players(60, kMin);
  players.resize(kSize, kMax);
  Eigen::MatrixXd h = Eigen::MatrixXd::Constant(kSize, kSize, 0.01);
  for (Eigen::Index i = 0; i < kSize; ++i) h(i, i) = i < 60 ? -3.0 : 3.0;
  return FunctionProblem::quadratic(players, h, Eigen::VectorXd::Ones(kSize),
                                    Eigen::VectorXd::Zero(kSize));
}

class TimeLimitOf : public ::testing::TestWithParam<Globalization> {};

TEST_P(TimeLimitOf, AnIterationWithThousandsOfFactorizations) {
  FunctionProblem problem = wrong_curvature();
  SolverOptions options;
  options.minmax_globalization = GetParam();
  // From 1e-20 to 3 in steps of 1 permille: 47000 factorizations of each matrix.
  options.first_hessian_perturbation = 1e-20;
  options.perturb_inc_fact = options.perturb_inc_fact_first = 1.001;
  // Limits are looked at between evaluations and factorizations, of which some make this.
  options.max_iter = 0;
  const double start = solve(problem, options).seconds;
  options.max_iter = SolverOptions{}.max_iter;
  const double most = 9.0 * std::max(kLimit, start);
  for (const bool wall : {true, false}) {
    options.max_wall_time = wall ? kLimit : 1e20;
    options.max_cpu_time = wall ? 1e20 : kLimit;
    const Result result = solve(problem, options);
    EXPECT_EQ(result.status, wall ? Status::MaxWallTime : Status::MaxCpuTime)
        << name_of(result.status) << ": " << result.message;
    EXPECT_EQ(result.message, name_of(result.status));
    EXPECT_LT(wall ? result.seconds : result.cpu_seconds, kLimit + most);
    EXPECT_EQ(result.v.size(), 120U);
  }
}

INSTANTIATE_TEST_SUITE_P(Globalizations, TimeLimitOf,
                         ::testing::Values(Globalization::None, Globalization::Filter));

/// A model whose Jacobian takes a while.
class Slow final : public ForwardingProblem {
 public:
  Slow(Problem& model, std::chrono::milliseconds pause) : ForwardingProblem(model), pause_(pause) {}
  bool jacobian(std::span<const double> v, bool fresh, std::span<double> out) override {
    std::this_thread::sleep_for(pause_);
    return ForwardingProblem::jacobian(v, fresh, out);
  }

 private:
  std::chrono::milliseconds pause_;
};

TEST(TimeLimit, OfALongInnerMaximization) {
  // y climbs a curved ridge, -Rosenbrock's function, in one inner phase: no fast step leads away
  // from where x has the wrong curvature.
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y0 = model.variable(kMax, "y0");
  const Expression y1 = model.variable(kMax, "y1");
  model.objective(square(square(x) - 1.0) - 100.0 * square(y1 - square(y0)) - square(1.0 - y0) +
                  0.1 * x * y0);
  model.constraint(y0 + y1, -100.0, 100.0);
  AutodiffProblem ridge(model, {0.1, -1.2, 1.0});

  SolverOptions options;
  const Result free = solve(ridge, options);
  ASSERT_TRUE(is_success(free.status)) << free.message;
  ASSERT_GT(free.counts.jacobian, 3 * free.iterations) << "inner steps do the work";

  constexpr double kPause = 0.05;
  Slow problem(ridge, std::chrono::milliseconds(50));
  const double needed = kPause * free.counts.jacobian;
  options.max_wall_time = 4 * kPause;
  ASSERT_GT(needed, 5 * options.max_wall_time);
  const Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::MaxWallTime) << name_of(result.status);
  EXPECT_LT(result.seconds, 0.5 * needed + free.seconds);
}

TEST(TimeLimit, OfARestoration) {
  Model model;
  const Expression x0 = model.variable(kMin, "x0", -1e3, 1e3);
  const Expression x1 = model.variable(kMin, "x1", -1e3, 1e3);
  model.objective(x0 + x1);
  model.constraint(100.0 * square(x1 - square(x0)) + square(1.0 - x0), -kNoBound, -1.0);
  AutodiffProblem infeasible(model, {-1.2, 1.0});
  SolverOptions options;
  const Result free = solve(infeasible, options);
  ASSERT_EQ(free.status, Status::LocallyInfeasible) << name_of(free.status);

  Slow problem(infeasible, std::chrono::milliseconds(20));
  const double needed = 0.02 * free.counts.jacobian;
  options.max_wall_time = 0.5 * needed;
  const Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::MaxWallTime) << name_of(result.status);
  EXPECT_LT(result.seconds, 0.75 * needed + free.seconds);
}

/// The answer is the model's start then, with its errors: nothing is laid out.
TEST(TimeLimit, BeforeTheFirstIteration) {
  FunctionProblem problem = wrong_curvature();
  SolverOptions options;
  options.max_iter = 0;
  options.max_wall_time = 1e-9;
  const Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::MaxWallTime) << result.message;
  EXPECT_EQ(result.counts.hessian, 0);
  EXPECT_EQ(result.v, std::vector(120, 0.0));
  EXPECT_EQ(result.objective, 0.0);
  EXPECT_EQ(result.certificate.kind, PointKind::FeasiblePoint);
}

}  // namespace
}  // namespace ipminmax
