// What is composed of solves: starts of x, other y, robust constraints, branches. One budget, one
// stop, one answer.
#include <algorithm>
#include <cmath>
#include <new>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>
#include <support/consistent_result.hpp>

#include "core/answer.hpp"
#include "core/robust.hpp"
#include "core/solver.hpp"
#include "core/worst_case.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::expect_consistent;
using testing::Expression;
using testing::kNoBound;
using testing::Model;

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

SolverOptions with_starts_of_y(int starts, int starts_of_x = 1) {
  SolverOptions options;
  options.minmax_worst_case_starts = starts;
  options.minmax_starts = starts_of_x;
  return options;
}

/// x^2 and, apart from it, two maxima over y: about 0.7 at -1 and 1.3 at 1.
Model two_answers() {
  Model model;
  const Expression x = model.variable(kMin, "x", -2.0, 2.0);
  const Expression y = model.variable(kMax, "y", -2.0, 2.0);
  model.objective(square(x) + 1.0 - square(square(y) - 1.0) + 0.3 * y);
  return model;
}

double highest_of_two_answers() {
  double highest = 0.0;
  for (int k = 0; k <= 40000; ++k) {
    const double y = -2.0 + 1e-4 * k;
    highest = std::max(highest, 1.0 - std::pow(y * y - 1.0, 2) + 0.3 * y);
  }
  return highest;
}

/// A minimum of x below a robust row that a y far from the start violates: x + bump(y) >= 0 whose
/// deep minimum is narrow.
Model hidden_worst_case() {
  Model model;
  const Expression x = model.variable(kMin, "x", -5.0, 5.0);
  const Expression y = model.variable(kMax, "y", -2.0, 2.0);
  model.objective(x);
  model.constraint(x + 2.0 + square(square(y) - 1.0) - 0.5 * y, 0.0, kNoBound, kMin);
  return model;
}

/// The value of x that holds for every y.
double right_x_of_hidden() {
  double least = 10.0;
  for (int k = 0; k <= 40000; ++k) {
    const double y = -2.0 + 1e-4 * k;
    least = std::min(least, 2.0 + std::pow(y * y - 1.0, 2) - 0.5 * y);
  }
  return -least;
}

TEST(Composition, OfTwoAnswersToTheSameXTheWorstIsTheAnswer) {
  AutodiffProblem problem(two_answers(), {0.5, -1.1});
  const Result result = solve(problem, with_starts_of_y(10));
  expect_consistent(result);
  EXPECT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_NEAR(result.objective, highest_of_two_answers(), 1e-6);
  EXPECT_FALSE(result.worst_case.higher);
}

TEST(Composition, PointsOfTheSameXKeepTheirHigherValue) {
  AutodiffProblem problem(two_answers(), {0.5, -1.1});
  SolverOptions options;
  options.minmax_epigraph_at_kinks = true;
  const Answer answer = run(problem, options, {}, {{0.3, 1.2}, {0.4, -0.9}});
  expect_consistent(answer.best);
  ASSERT_EQ(answer.points.size(), 1U);
  EXPECT_EQ(answer.points[0].found, 3);
  EXPECT_NEAR(answer.best.objective, highest_of_two_answers(), 1e-6);
}

TEST(Composition, EpigraphBesideARobustRowReportsTheWorstF) {
  // f = 3 x + 4 y is worst at y = 1, x + y >= 0 at y = -1: x = 1, f = 7.
  Model model;
  const Expression x = model.variable(kMin, "x", -5.0, 5.0);
  const Expression y = model.variable(kMax, "y", -1.0, 1.0);
  model.objective(3.0 * x + 4.0 * y);
  model.constraint(x + y, 0.0, kNoBound, kMin);
  AutodiffProblem problem(model, {2.0, 0.0});
  SolverOptions options = with_starts_of_y(4);
  options.minmax_epigraph = true;
  const Result result = solve(problem, options);
  expect_consistent(result);
  EXPECT_TRUE(is_success(result.status)) << result.message;
  ASSERT_EQ(result.v.size(), 2U);
  EXPECT_NEAR(result.v[0], 1.0, 1e-6);
  EXPECT_NEAR(result.v[1], 1.0, 1e-5);
  EXPECT_NEAR(result.objective, 7.0, 1e-5);
}

TEST(Composition, ARobustRowIsMaximizedOverAllOfYByDefault) {
  AutodiffProblem problem(hidden_worst_case(), {0.0, -0.8});
  const Result result = solve(problem, {});
  expect_consistent(result);
  EXPECT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_NEAR(result.v[0], right_x_of_hidden(), 1e-6);
  EXPECT_EQ(result.over_y.asked, 8);
  EXPECT_EQ(result.over_y.functions, 1);
  EXPECT_GE(result.over_y.maximizations, 16);
  EXPECT_LE(result.over_y.largest_violation, 1e-6);
  // Switched off it is not, and the answer says so.
  const Result local = solve(problem, with_starts_of_y(0));
  EXPECT_LT(local.v[0], right_x_of_hidden() - 0.1);
  EXPECT_EQ(local.over_y.asked, 0);
  EXPECT_NE(statements(local)[2].find("not searched"), std::string::npos);
}

TEST(Composition, AViolationWithinTheRelaxedBoundsIsNone) {
  Model model;
  const Expression x = model.variable(kMin, "x", -5.0, 5.0);
  const Expression y = model.variable(kMax, "y", -1.0, 1.0);
  model.objective(-x);
  model.constraint(1e-3 * (x + y - 0.5 * square(y)), -kNoBound, 0.0, kMin);
  AutodiffProblem problem(model, {-2.0, 0.0});
  for (const int starts : {0, 4}) {
    const Result result = solve(problem, with_starts_of_y(starts));
    expect_consistent(result);
    EXPECT_TRUE(is_success(result.status)) << result.message;
    EXPECT_NEAR(result.v[0], -0.5, 1e-4);
  }
}

TEST(Composition, DifferencesBelowTheAccuracyOfXAreNone) {
  Model model;
  const Expression x = model.variable(kMin, "x", 0.0, 1.0);
  const Expression y = model.variable(kMax, "y", 0.0, 1.0);
  model.objective((x - 0.5) * (y - 0.5));
  AutodiffProblem problem(model, {0.9, 0.2});
  const Result result = solve(problem, with_starts_of_y(10));
  expect_consistent(result);
  EXPECT_TRUE(is_success(result.status)) << result.message;
  EXPECT_FALSE(result.worst_case.higher);
}

TEST(Composition, ABetterYThatWasAskedForIsNoSuccess) {
  // phi = |x| with its kink at 0, where no answer of one y is: two maxima over y.
  Model model;
  const Expression x = model.variable(kMin, "x", -2.0, 2.0);
  const Expression y = model.variable(kMax, "y", -2.0, 2.0);
  model.objective(square(x - 0.3) - 4.0 * square(square(y) - 1.0) + 3.0 * x * y);
  AutodiffProblem problem(model, {-1.0, 1.0});
  for (const int starts : {1, 5}) {
    const Result result = solve(problem, with_starts_of_y(10, starts));
    expect_consistent(result);
    EXPECT_FALSE(is_success(result.status) && result.worst_case.higher);
    EXPECT_NE(result.certificate.kind, PointKind::LocalMinmax);
  }
}

TEST(Composition, AllDoorsHonourTheOptions) {
  AutodiffProblem problem(two_answers(), {0.5, -1.1});
  SolverOptions options = with_starts_of_y(6, 4);
  const Result by_solve = solve(problem, options);
  const Result by_multistart = multistart(problem, options).best;
  const Result by_robust = solve_robust(problem, options).result;
  RepeatedSolver repeated;
  const Result by_repeated = repeated.solve(problem, options);
  for (const Result* other : {&by_multistart, &by_robust, &by_repeated}) {
    EXPECT_EQ(by_solve.v, other->v);
    EXPECT_EQ(by_solve.status, other->status);
    EXPECT_EQ(by_solve.message, other->message);
    EXPECT_EQ(by_solve.factorizations, other->factorizations);
    EXPECT_EQ(by_solve.over_y.maximizations, other->over_y.maximizations);
    EXPECT_EQ(by_solve.over_x.made, other->over_x.made);
    EXPECT_EQ(statements(by_solve), statements(*other));
  }
  EXPECT_EQ(by_solve.over_x.asked, 4);
  EXPECT_EQ(by_solve.over_x.made, 4);
  EXPECT_GT(by_solve.worst_case.starts, 0);
}

TEST(Composition, RobustConstraintsDoNotHideTheWorstCaseOfF) {
  // The row reads another y than f, whose answer of the start is the lower one.
  Model model;
  const Expression x = model.variable(kMin, "x", -2.0, 2.0);
  const Expression y = model.variable(kMax, "y", -2.0, 2.0);
  const Expression z = model.variable(kMin, "z", -5.0, 5.0);
  const Expression w = model.variable(kMax, "w", -1.0, 1.0);
  model.objective(square(x) + square(z - 2.0) + 1.0 - square(square(y) - 1.0) + 0.3 * y);
  model.constraint(z + w, 1.0, kNoBound, kMin);
  AutodiffProblem problem(model, {0.5, -1.1, 3.0, 0.0});
  const Result result = solve_robust(problem, with_starts_of_y(10)).result;
  expect_consistent(result);
  EXPECT_NEAR(result.objective, highest_of_two_answers(), 1e-5) << result.message;
  EXPECT_GT(result.worst_case.starts, 0);
}

TEST(Composition, KinksAreLookedForAfterAFailureOnly) {
  // f = x y: solved, undecided or not, without curvature.
  Model model;
  const Expression x = model.variable(kMin, "x", -1.0, 1.0);
  const Expression y = model.variable(kMax, "y", -1.0, 1.0);
  model.objective(x * y);
  AutodiffProblem problem(model, {0.7, 0.2});
  SolverOptions options;
  const Result plain = solve(problem, options);
  ASSERT_TRUE(is_success(plain.status));
  options.minmax_epigraph_at_kinks = true;
  const Result at_kinks = solve(problem, options);
  EXPECT_EQ(at_kinks.status, plain.status);
  EXPECT_EQ(at_kinks.iterations, plain.iterations);
}

TEST(Composition, AStartThatIsCutShortIsNotMade) {
  AutodiffProblem problem(two_answers(), {0.5, -1.1});
  MultistartObserver observer;
  observer.on_iteration = [](Index start, const IterationInfo&) { return start < 7; };
  const Answer answer = run(problem, with_starts_of_y(0, 100), observer);
  expect_consistent(answer.best);
  EXPECT_EQ(answer.best.status, Status::UserStop);
  EXPECT_EQ(answer.best.over_x.asked, 100);
  EXPECT_EQ(answer.best.over_x.made, 7);
  EXPECT_EQ(answer.best.certificate.second_order, SecondOrder::Satisfied);
  EXPECT_NE(statements(answer.best)[3].find("7 of 100"), std::string::npos);
}

}  // namespace
}  // namespace ipminmax
