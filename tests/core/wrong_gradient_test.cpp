// Mistakes in first derivatives that second ones share: nothing is certified, and who is wrong is
// named. Games that are right keep their certificates: every other test.
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>
#include <support/changed_problem.hpp>

#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::ChangedProblem;
using testing::Expression;
using testing::Model;

/// y stands at a minimum; the sign of y's slopes, the second ones as well, says maximum.
Model minimum_over_y() {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y");
  model.objective(square(x) + square(y - 0.5));
  return model;
}

void turn_y(ChangedProblem& problem) {
  problem.of_gradient = [](std::span<double> gradient) { gradient[1] = -gradient[1]; };
  const std::vector<Triplet> entries = problem.structure().hessian;
  problem.of_hessian = [entries](std::span<double> values) {
    for (std::size_t k = 0; k < values.size(); ++k) {
      if (entries[k].row == 1 && entries[k].col == 1) values[k] = -values[k];
    }
  };
}

TEST(WrongGradient, OfAMaxVariableIsNotCertified) {
  AutodiffProblem right(minimum_over_y(), {1.0, 0.0});
  ChangedProblem problem(right);
  turn_y(problem);
  for (const int starts : {1, 3}) {
    SolverOptions options;
    options.minmax_starts = starts;
    const Result result = solve(problem, options);
    EXPECT_EQ(result.certificate.kind, PointKind::FirstOrderPoint);
    EXPECT_NE(result.message.find("the value of the objective changes by"), std::string::npos)
        << result.message;
  }
}

TEST(WrongGradient, OfAConstraintIsNamed) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y");
  model.objective(square(x - 2.0) + x * y - square(y));
  model.constraint(1.0 * x, -testing::kNoBound, 100.0);  // inactive: nothing else shows it
  AutodiffProblem right(model, {0.0, 0.0});
  ChangedProblem problem(right);
  problem.of_jacobian = [](std::span<double> values) { values[0] *= 1.5; };
  const Result result = solve(problem, SolverOptions{});
  EXPECT_EQ(result.certificate.kind, PointKind::FirstOrderPoint);
  EXPECT_NE(result.message.find("the value of constraint 0 (g1) changes by"), std::string::npos)
      << result.message;
}

TEST(WrongGradient, IsLookedForOnceInAModelOfOneShape) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y");
  model.objective(square(x) - square(y - 0.5));
  AutodiffProblem game(model, {1.0, 0.0});
  RepeatedSolver repeated;
  const Result first = repeated.solve(game, SolverOptions{});
  const Result second = repeated.solve(game, SolverOptions{});
  EXPECT_EQ(first.certificate.kind, PointKind::LocalMinmax);
  EXPECT_EQ(first.counts.objective, second.counts.objective + 1);
}

}  // namespace
}  // namespace ipminmax
