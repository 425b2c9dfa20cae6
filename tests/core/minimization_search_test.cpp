// The line search of minimizations: where it goes on from, and what it says when it ends.
#include <cmath>
#include <cstddef>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>

#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;

constexpr Player kMin = Player::Min;

TEST(MinimizationSearch, ALimitOfFactorizationsIsNamedOnlyWhereThereIsOne) {
  // Restoration is what takes the last iterations.
  Model model;
  const Expression x0 = model.variable(kMin, "x0", -1e3, 1e3);
  const Expression x1 = model.variable(kMin, "x1", -1e3, 1e3);
  model.objective(x0 + x1);
  model.constraint(100.0 * square(x1 - square(x0)) + square(1.0 - x0), -kNoBound, -1.0);
  AutodiffProblem problem(model, {-1.2, 1.0});
  SolverOptions options;
  const Result free = solve(problem, options);
  ASSERT_EQ(free.status, Status::LocallyInfeasible) << name_of(free.status);
  const Index all = free.iterations + free.counts.restoration_iterations;
  ASSERT_GT(free.counts.restoration_iterations, 2);
  for (options.max_iter = all / 2; options.max_iter < all; ++options.max_iter) {
    const Result result = solve(problem, options);
    EXPECT_EQ(result.status, Status::MaxIterations) << options.max_iter;
    EXPECT_EQ(result.message.find("minmax_max_factorizations"), std::string::npos)
        << options.max_iter << ": " << result.message;
  }
}

/// A chain of springs whose ends are held twice: dependent rows in all of many steps.
AutodiffProblem chain_held_twice() {
  Model model;
  std::vector<Expression> x;
  for (int i = 0; i < 12; ++i) x.push_back(model.variable(kMin, "x", -10.0, 10.0));
  Expression energy = 0.0 * x[0];
  for (std::size_t i = 0; i + 1 < x.size(); ++i) energy = energy + square(square(x[i + 1] - x[i]));
  model.objective(energy);
  const auto equal = [&](const Expression& row, double value) {
    model.constraint(row, value, value);
  };
  equal(0.7 * x[0] + 0.1 * x[11], 0.8);
  equal(1.3 * x[0] - 0.3 * x[11], 1.0);
  equal((0.7 + 1.3) * x[0] - 0.2 * x[11], 1.8);
  for (std::size_t i = 1; i < 4; ++i) equal(x[i] * x[11] - x[i] * x[0], 0.0);
  std::vector<double> start(12, 0.0);
  for (std::size_t i = 0; i < start.size(); ++i) start[i] = std::sin(3.0 * static_cast<double>(i));
  return AutodiffProblem(model, start);
}

TEST(MinimizationSearch, DependentRowsOfAConvexModelNeedNoShiftOfTheHessian) {
  for (const LinearSolver solver : {LinearSolver::Mumps, LinearSolver::Auto}) {
    AutodiffProblem problem = chain_held_twice();
    SolverOptions options;
    options.linear_solver = solver;
    const Result result = solve(problem, options, [](const IterationInfo& info) {
      EXPECT_EQ(info.delta_x, 0.0) << info.iteration;
      return true;
    });
    EXPECT_TRUE(is_success(result.status)) << result.message;
    EXPECT_GT(result.iterations, 12);
  }
}

}  // namespace
}  // namespace ipminmax
