// Mistakes in first derivatives that second ones share: nothing is certified by the application, and
// the function is named. Games that are right keep their certificates: every other test.
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>
#include <support/changed_problem.hpp>

#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/ipopt/problem_tnlp.hpp"
#include "core/diagnostics/derivative_test.hpp"
#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

Result solve_as_tnlp(Problem& problem) {
  const Ipopt::SmartPtr<Ipopt::TNLP> model = new GameTNLP(problem);
  MinMaxApplication app;
  app.Options()->SetIntegerValue("print_level", 0);
  EXPECT_EQ(app.Initialize(), Ipopt::Solve_Succeeded);
  static_cast<void>(app.OptimizeTNLP(model));
  return app.LastResult();
}

/// y stands at a minimum; the sign of y's slopes, the second ones as well, says maximum. Its
/// derivatives at the answer agree with those of the function.
void turn_y(ChangedProblem& problem) {
  problem.of_gradient = [](std::span<double> gradient) { gradient[1] = -gradient[1]; };
  const std::vector<Triplet> entries = problem.structure().hessian;
  problem.of_hessian = [entries](std::span<double> values) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (entries[k].row == 1 && entries[k].col == 1) values[k] = -values[k];
    }
  };
}

Model minimum_over_y(double y_lower) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y", y_lower, 3.0);
  model.objective(square(x) + square(y - 0.5));
  return model;
}

TEST(WrongGradient, OfAMaxVariableIsNotCertified) {
  AutodiffProblem right(minimum_over_y(-3.0), {1.0, 0.0});
  ChangedProblem problem(right);
  turn_y(problem);
  const Result result = solve_as_tnlp(problem);
  EXPECT_EQ(result.certificate.kind, PointKind::FirstOrderPoint);
  EXPECT_NE(result.message.find("the gradient of the objective looks wrong beside the answer"),
            std::string::npos)
      << result.message;
}

TEST(WrongGradient, OfAConstraintIsNamed) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y");
  model.objective(square(x - 2.0) + x * y - square(y));
  model.constraint(1.0 * x, -kNoBound, 100.0);  // inactive: nothing else shows it
  AutodiffProblem right(model, {0.0, 0.0});
  ChangedProblem problem(right);
  problem.of_jacobian = [](std::span<double> values) { values[0] *= 1.5; };
  const Result result = solve_as_tnlp(problem);
  EXPECT_EQ(result.certificate.kind, PointKind::FirstOrderPoint);
  EXPECT_NE(result.message.find("constraint 0 (g1) looks wrong"), std::string::npos)
      << result.message;
}

/// At an active bound there is room on one side alone.
TEST(WrongGradient, AtABoundIsSeen) {
  Model model;
  const Expression x = model.variable(Player::Min, "x", 0.0, 2.0);
  const Expression y = model.variable(Player::Max, "y", -1.0, 1.0);
  model.objective(x + square(x) - y * y + 0.1 * x * y);
  AutodiffProblem right(model, {1.0, 0.5});
  EXPECT_EQ(solve_as_tnlp(right).certificate.kind, PointKind::LocalMinmax);
  ChangedProblem problem(right);
  problem.of_gradient = [](std::span<double> gradient) { gradient[0] *= 2.0; };
  EXPECT_EQ(solve_as_tnlp(problem).certificate.kind, PointKind::FirstOrderPoint);
}

TEST(WrongGradient, IsLookedForOnceInAModel) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y");
  model.objective(square(x) - square(y - 0.5));
  AutodiffProblem game(model, {1.0, 0.0});
  const Ipopt::SmartPtr<Ipopt::TNLP> tnlp = new GameTNLP(game);
  MinMaxApplication app;
  app.Options()->SetIntegerValue("print_level", 0);
  ASSERT_EQ(app.Initialize(), Ipopt::Solve_Succeeded);
  ASSERT_EQ(app.OptimizeTNLP(tnlp), Ipopt::Solve_Succeeded);
  const Result first = app.LastResult();
  ASSERT_EQ(app.ReOptimizeTNLP(tnlp), Ipopt::Solve_Succeeded);
  EXPECT_EQ(first.certificate.kind, PointKind::LocalMinmax);
  EXPECT_GT(first.counts.objective, app.LastResult().counts.objective);
}

}  // namespace
}  // namespace ipminmax::testing
