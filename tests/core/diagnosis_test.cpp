// What a failure says about the model's derivatives.
#include <cmath>
#include <span>
#include <string>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>
#include <support/changed_problem.hpp>

#include "../../examples/shared_dynamics.hpp"
#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::ChangedProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

/// Too few iterations for its solution.
AutodiffProblem long_way() {
  Model model;
  const Expression x = model.variable(kMin, "thrust"), y = model.variable(kMax, "wind");
  model.objective(exp(0.3 * x) + square(square(x - 3.0)) + x * y - square(y) * (2.0 + x * x));
  model.constraint(square(x) + x * y, -kNoBound, 50.0);
  return AutodiffProblem(model, {-2.0, 1.5});
}

std::string message_of(Problem& problem) {
  SolverOptions options;
  options.max_iter = 2;
  options.minmax_max_restarts = 0;
  const Result result = solve(problem, options);
  EXPECT_FALSE(is_success(result.status)) << result.message;
  return result.message;
}

TEST(Diagnosis, RightDerivativesAreCleared) {
  AutodiffProblem problem = long_way();
  const std::string text = message_of(problem);
  EXPECT_NE(text.find("first and second derivatives agree"), std::string::npos) << text;
}

// Differences over a step that jumps a pole are not the slope beside it.
TEST(Diagnosis, APoleWithinTheStepIsNoError) {
  for (const double distance : {1e-6, 1e-7, -3e-7}) {
    Model model;
    const Expression x = model.variable(kMin, "x"), y = model.variable(kMin, "y");
    model.objective(1e-9 / (x - 1.0) + exp(y));
    AutodiffProblem problem(model, {1.0 + distance, 1.0});
    SolverOptions options;
    options.max_iter = 0;
    const std::string text = solve(problem, options).message;
    EXPECT_EQ(text.find("the gradient of the objective looks wrong"), std::string::npos) << text;
  }
}

TEST(Diagnosis, ADisturbanceThatWinsIsNamed) {
  shared_dynamics::System system = shared_dynamics::oscillator(20, false);
  system.gamma = 0.3;  // far below the least
  shared_dynamics::Game game(system);
  const Result result = solve(game, {});
  EXPECT_FALSE(is_success(result.status));
  EXPECT_NE(result.message.find("the disturbance wins"), std::string::npos) << result.message;
  EXPECT_NE(result.message.find("find_price"), std::string::npos) << result.message;
}

// A search that ends at the edge of the functions' domain says so, and nothing of kinks and prices.
TEST(Diagnosis, AnEdgeOfTheDomainIsNamed) {
  int ended_there = 0;
  for (const double unit : {1.0, 0.5}) {
    for (const bool bounded : {false, true}) {
      Model model;
      const Expression x = model.variable(kMin, "x", bounded ? 0.0 : -kNoBound, kNoBound);
      const Expression y = model.variable(kMax, "y");
      model.objective(log(x * (1.0 / unit)) - square(y));
      AutodiffProblem problem(model, {unit, 0.5});
      SolverOptions options;
      options.hessian_approximation = HessianApproximation::FiniteDifferenceValues;
      const Result result = solve(problem, options);
      if (result.status != Status::NoLocalMinmaxFound) continue;
      ++ended_there;
      const std::string& text = result.message;
      EXPECT_NE(text.find("the model is undefined if variable 0 (x) goes from"), std::string::npos)
          << text;
      for (const char* wrong : {"kink", "price"})
        EXPECT_EQ(text.find(wrong), std::string::npos) << text;
    }
  }
  EXPECT_GT(ended_there, 0);
}

/// 2 x^2 + 3 x y - y^2 as a program in single precision computes it, and the derivatives of that.
TEST(Diagnosis, AnObjectiveOfFewDigitsIsNamed) {
  Model model;
  const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y");
  model.objective(2.0 * square(x - 0.3) + 3.0 * x * y - square(y) + 1.0);
  AutodiffProblem right(model, {0.5, 0.1});
  ChangedProblem problem(right);
  problem.of_objective = [](std::span<double> f) { f[0] = static_cast<float>(f[0]); };
  problem.of_gradient = [](std::span<double> values) {
    for (double& value : values) value += 1e-3 * std::sin(1e8 * value);
  };
  const Result result = solve(problem, {});
  ASSERT_EQ(result.status, Status::NoLocalMinmaxFound) << result.message;
  EXPECT_NE(result.message.find("rounded to few digits"), std::string::npos) << result.message;
  EXPECT_EQ(result.message.find("kink"), std::string::npos) << result.message;
}

// Slacks do not move in the comparison, wherever their bounds are: g - s would change with them.
TEST(Diagnosis, InequalitiesFarFromZeroAreCleared) {
  Model model;
  const Expression x = model.variable(kMin, "x"), y = model.variable(kMin, "y");
  model.objective(x + y);
  model.constraint(x + y, 3.0, kNoBound);
  model.constraint(square(x) + square(y), -kNoBound, 1.0);
  AutodiffProblem problem(model, {1.0, 1.0});
  const std::string text = solve(problem, {}).message;
  EXPECT_NE(text.find("first and second derivatives agree"), std::string::npos) << text;
}

TEST(Diagnosis, AWrongGradientIsNamed) {
  AutodiffProblem right = long_way();
  ChangedProblem problem(right);
  problem.of_gradient = [](std::span<double> values) { values[0] *= 0.9; };
  const std::string text = message_of(problem);
  EXPECT_NE(text.find("the gradient of the objective looks wrong"), std::string::npos) << text;
  EXPECT_NE(text.find("derivative_test first-order"), std::string::npos) << text;
}

TEST(Diagnosis, AWrongJacobianIsNamed) {
  AutodiffProblem right = long_way();
  ChangedProblem problem(right);
  problem.of_jacobian = [](std::span<double> values) { values[0] += 1.0; };
  const std::string text = message_of(problem);
  EXPECT_NE(text.find("the gradient of constraint 0 (g1) looks wrong"), std::string::npos) << text;
}

TEST(Diagnosis, AWrongHessianIsNamed) {
  AutodiffProblem right = long_way();
  ChangedProblem problem(right);
  problem.of_hessian = [](std::span<double> values) { values[0] *= 1.5; };
  const std::string text = message_of(problem);
  EXPECT_NE(text.find("the second derivatives in variable 0 (thrust) look wrong"),
            std::string::npos)
      << text;
}

// Without a price on the disturbance and without bounds the maximum is infinite, however its
// multipliers grow on the way.
TEST(Diagnosis, AFreeDisturbanceIsUnboundedNotInfeasible) {
  for (const int horizon : {5, 20, 60}) {
    for (const double gamma : {0.0, 0.3}) {
      shared_dynamics::System system = shared_dynamics::oscillator(horizon, false);
      system.gamma = gamma;
      shared_dynamics::Game game(system);
      const Result result = solve(game, {});
      EXPECT_EQ(result.status, Status::InnerUnbounded)
          << horizon << ' ' << gamma << ' ' << result.message;
    }
  }
}

TEST(Diagnosis, DifferencesAreNotCompared) {
  AutodiffProblem problem = long_way();
  SolverOptions options;
  options.max_iter = 2;
  options.hessian_approximation = HessianApproximation::FiniteDifferenceValues;
  const Result result = solve(problem, options);
  EXPECT_EQ(result.message.find("look wrong"), std::string::npos) << result.message;
}

}  // namespace
}  // namespace ipminmax
