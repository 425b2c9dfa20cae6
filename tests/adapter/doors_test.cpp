// The same question through every door gives the same answer.
#include <gtest/gtest.h>
#include <ipminmax.h>

#include <string>
#include <vector>

#include <support/autodiff_problem.hpp>
#include <support/consistent_result.hpp>

#include "adapter/minmax_application.hpp"
#include "adapter/problem_tnlp.hpp"
#include "core/answer.hpp"
#include "core/robust.hpp"
#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;

/// Two maxima over y, and on request a robust constraint with two worst cases.
Model model_with(bool robust) {
  Model model;
  const Expression x = model.variable(Player::Min, "x", -5.0, 5.0);
  const Expression y = model.variable(Player::Max, "y", -2.0, 2.0);
  model.objective(square(x - 0.3) - 4.0 * square(square(y) - 1.0) + 0.4 * x * y);
  if (robust) {
    model.constraint(x + 2.0 + square(square(y) - 1.0) - 0.5 * y, 0.0, kNoBound, Player::Min);
  }
  return model;
}

/// starts of x, starts of y, epigraph, at kinks, robust
using Question = std::tuple<int, int, bool, bool, bool>;

class Doors : public ::testing::TestWithParam<Question> {};

TEST_P(Doors, GiveTheSameAnswer) {
  const auto [starts, starts_of_y, epigraph, at_kinks, robust] = GetParam();
  AutodiffProblem problem(model_with(robust), {1.0, -0.9});
  SolverOptions options;
  options.minmax_starts = starts;
  options.minmax_worst_case_starts = starts_of_y;
  options.minmax_epigraph = epigraph;
  options.minmax_epigraph_at_kinks = at_kinks;
  const Answer answer = run(problem, options);
  const Result& expected = answer.best;
  testing::expect_consistent(expected);

  const auto expect_same = [&](const Result& result, const char* door) {
    EXPECT_EQ(result.v, expected.v) << door;
    EXPECT_EQ(result.status, expected.status) << door;
    EXPECT_EQ(result.objective, expected.objective) << door;
    EXPECT_EQ(result.certificate.kind, expected.certificate.kind) << door;
    EXPECT_EQ(result.factorizations, expected.factorizations) << door;
    EXPECT_EQ(result.worst_cases.size(), expected.worst_cases.size()) << door;
    EXPECT_EQ(statements(result), statements(expected)) << door;
  };
  expect_same(solve(problem, options), "solve");
  expect_same(multistart(problem, options).best, "multistart");
  expect_same(solve_robust(problem, options).result, "solve_robust");
  RepeatedSolver repeated;
  expect_same(repeated.solve(problem, options), "RepeatedSolver");

  const Ipopt::SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  const auto list = app->Options();
  list->SetIntegerValue("minmax_starts", starts);
  list->SetIntegerValue("minmax_worst_case_starts", starts_of_y);
  list->SetStringValue("minmax_epigraph", epigraph ? "yes" : "no");
  list->SetStringValue("minmax_epigraph_at_kinks", at_kinks ? "yes" : "no");
  ASSERT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  const Ipopt::SmartPtr<Ipopt::TNLP> tnlp = new GameTNLP(problem);
  static_cast<void>(app->OptimizeTNLP(tnlp));
  expect_same(app->LastResult(), "MinMaxApplication");
  EXPECT_EQ(app->LastWorstCases().size(), expected.worst_cases.size());
  if (starts > 1) {
    ASSERT_EQ(app->LastPoints().size(), answer.points.size());
    for (std::size_t k = 0; k < answer.points.size(); ++k) {
      EXPECT_EQ(app->LastPoints()[k].result.v, answer.points[k].result.v);
      EXPECT_EQ(app->LastPoints()[k].found, answer.points[k].found);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Questions, Doors,
                         ::testing::Combine(::testing::Values(1, 4), ::testing::Values(-1, 0, 5),
                                            ::testing::Bool(), ::testing::Bool(),
                                            ::testing::Bool()));

}  // namespace
}  // namespace ipminmax
