// The worst case over all of y: higher branches found, points ranked by them, kinks and runaways
// told.
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>

#include "core/gap.hpp"
#include "core/global/audit.hpp"
#include "core/multistart.hpp"
#include "core/solver.hpp"
#include "core/worst_case.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

/// 0.5 (x - 1)^2 + x y / 10 - (y^2 - 1)^2 + tilt y, in some unit: maxima over y near -1 and 1, the
/// higher one near 1 for x > -10 tilt; a local minmax on each branch.
Model two_branches(double tilt, double unit = 1.0) {
  Model model;
  const Expression x = model.variable(kMin, "x", -5.0, 5.0);
  const Expression y = model.variable(kMax, "y", -2.0, 2.0);
  model.objective(unit *
                  (0.5 * square(x - 1.0) + 0.1 * x * y - square(square(y) - 1.0) + tilt * y));
  return model;
}

SolverOptions with_starts(int worst_case, int starts = 1) {
  SolverOptions options;
  options.minmax_worst_case_starts = worst_case;
  options.minmax_starts = starts;
  return options;
}

TEST(WorstCase, HigherBranchOfYIsFound) {
  AutodiffProblem problem(two_branches(0.3), {1.0, -1.0});
  Result result = solve(problem, {});
  ASSERT_EQ(result.certificate.kind, PointKind::LocalMinmax);
  ASSERT_LT(result.v[1], 0.0) << "not the weak branch";
  EXPECT_EQ(result.worst_case.starts, 0);
  EXPECT_EQ(describe_worst_case(result), "");

  const WorstCaseCheck check = check_worst_case(problem, result.v, {}, 10);
  EXPECT_EQ(check.found.starts, 10);
  EXPECT_EQ(check.found.maxima, 2);
  ASSERT_EQ(check.maxima.size(), 2U);
  EXPECT_TRUE(check.found.higher);
  EXPECT_FALSE(check.found.unbounded);
  EXPECT_FALSE(check.found.single_branch);
  EXPECT_EQ(check.found.competing, 1);
  EXPECT_FALSE(check.interrupted);
  for (const WorstCaseMaximum& maximum : check.maxima) {
    EXPECT_EQ(maximum.v[0], result.v[0]) << "x moved";
    EXPECT_TRUE(maximum.certified);
    double f = 0.0;
    ASSERT_TRUE(problem.objective(maximum.v, true, f));
    EXPECT_DOUBLE_EQ(maximum.value, f);
  }
  EXPECT_GT(check.maxima[0].v[1], 0.9);
  EXPECT_NEAR(check.maxima[1].value, result.objective, 1e-7);

  add_worst_case(problem, with_starts(10), result);
  EXPECT_EQ(result.worst_case.value, check.found.value);
  EXPECT_NE(describe_worst_case(result).find("is a local worst case only"), std::string::npos);
}

TEST(WorstCase, TheYOfOtherStartsCountsInAnyUnits) {
  for (const double unit : {1.0, 1e-3, 1e-7, 1e7}) {  // the branches differ by 0.8 of it
    AutodiffProblem problem(two_branches(0.3, unit), {1.0, -1.0});
    Result result;
    result.status = Status::Solved;
    result.v = {1.0, -1.0};
    ASSERT_TRUE(problem.objective(result.v, true, result.objective));
    Witnesses witnesses(problem.structure());
    witnesses.add(std::vector{1.0, 1.0});
    Counts counts;
    const SolverOptions options;
    Budget budget(options, {});
    audit(problem, options, witnesses, budget, result, counts);
    EXPECT_TRUE(result.worst_case.higher) << unit;
    EXPECT_EQ(result.worst_case.y, std::vector{1.0});
  }
}

TEST(WorstCase, MultistartPrefersThePointWhoseWorstCaseIsBest) {
  AutodiffProblem problem(two_branches(0.3), {1.0, -1.0});
  const MultistartResult plain = multistart(problem, with_starts(0, 20));
  ASSERT_EQ(plain.points.size(), 2U);
  EXPECT_LT(plain.best.v[1], 0.0) << "the smallest local value is the weak branch's";

  const MultistartResult checked = multistart(problem, with_starts(10, 20));
  ASSERT_EQ(checked.points.size(), 2U);
  EXPECT_GT(checked.best.v[1], 0.9);
  EXPECT_FALSE(checked.best.worst_case.higher);
  EXPECT_TRUE(checked.points[1].result.worst_case.higher);
  EXPECT_NEAR(checked.best.worst_case.value, checked.best.objective, 1e-9);
}

TEST(WorstCase, MultistartGoesOnFromAHigherBranch) {
  // One start finds the weak branch only; the check's y leads to the other local minmax.
  AutodiffProblem problem(two_branches(0.3), {1.0, -1.0});
  const MultistartResult result = multistart(problem, with_starts(10));
  ASSERT_EQ(result.points.size(), 2U);
  EXPECT_EQ(result.starts, 2);
  EXPECT_EQ(result.best_start, 1);
  EXPECT_GT(result.best.v[1], 0.9);
}

TEST(WorstCase, KinkIsTold) {
  // At x = 0 both branches have the same value.
  AutodiffProblem problem(two_branches(0.0), {1.0, -1.0});
  const WorstCaseCheck check = check_worst_case(problem, std::vector<double>{0.0, 0.4}, {}, 10);
  EXPECT_EQ(check.found.competing, 2);
  EXPECT_TRUE(check.found.higher) << "y = 0.4 is no maximum";
}

TEST(WorstCase, ConcaveObjectiveHasOneMaximum) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y", -3.0, 3.0);
  model.objective(square(x) + x * y - square(y));
  AutodiffProblem problem(model, {1.0, 1.0});
  Result result = solve(problem, {});
  add_worst_case(problem, with_starts(8), result);
  EXPECT_TRUE(result.worst_case.single_branch);
  EXPECT_FALSE(result.worst_case.higher);
  EXPECT_NE(describe_worst_case(result).find("looks concave in y"), std::string::npos);
}

TEST(WorstCase, AnObjectiveWithoutYSaysSo) {
  Model model;
  const Expression x = model.variable(kMin, "x", 1.0, 10.0);
  model.variable(kMax, "y", -1.0, 1.0);
  model.objective(square(x));
  AutodiffProblem problem(model, {2.0, 0.1});
  const std::string text = describe_worst_case(solve(problem, with_starts(8)));
  EXPECT_TRUE(text.starts_with("f has the same value at every y seen")) << text;
}

TEST(WorstCase, BranchesAreListedWithTheirValues) {
  AutodiffProblem problem(two_branches(0.3), {1.0, -1.0});
  Result result = solve(problem, {});
  add_worst_case(problem, with_starts(10), result);
  const WorstCase& found = result.worst_case;
  ASSERT_EQ(found.branches.size(), 2U);
  EXPECT_EQ(found.branches[0], found.value);
  EXPECT_NEAR(found.branches[1], result.objective, 1e-7);
  ASSERT_EQ(found.y.size(), 1U);
  EXPECT_EQ(found.y[0], found.v[1]);
  const std::string text = describe_worst_case(result);
  EXPECT_NE(text.find("another y, y = ("), std::string::npos) << text;
  EXPECT_NE(text.find("values at the maxima: ("), std::string::npos) << text;
}

TEST(WorstCase, AModelThatStatesConcavityIsBelieved) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y", -1.0, 1.0);
  model.objective(square(x - 1.0) + x * y - square(y));
  AutodiffProblem problem(model, {0.0, 0.0});
  SolverOptions options = with_starts(50);
  options.minmax_concave_in_y = true;
  Result result = solve(problem, options);
  add_worst_case(problem, options, result);
  EXPECT_EQ(result.worst_case.starts, 1);
  EXPECT_TRUE(result.worst_case.stated_concave);
  EXPECT_NE(describe_worst_case(result).find("the model states that f is concave in y"),
            std::string::npos);
  options.minmax_concave_in_y = false;
  add_worst_case(problem, options, result);
  EXPECT_EQ(result.worst_case.starts, 50);
}

TEST(WorstCase, RunawayIsTold) {
  // -y^2 + y^4: a local maximum at 0, none far away.
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(square(x) - square(y) + 0.1 * square(square(y)));
  AutodiffProblem problem(model, {0.5, 0.1});
  Result result = solve(problem, {});
  ASSERT_EQ(result.certificate.kind, PointKind::LocalMinmax);
  add_worst_case(problem, with_starts(8), result);
  EXPECT_TRUE(result.worst_case.unbounded);
  EXPECT_FALSE(result.worst_case.single_branch);
  EXPECT_NE(describe_worst_case(result).find("unbounded"), std::string::npos);
}

TEST(WorstCase, MinConstraintsDoNotRestrainY) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y", -1.0, 2.0);
  model.objective(square(x) + y);
  model.constraint(x, 1.0, kNoBound);       // Min's, violated at x = 0
  model.constraint(x + y, -kNoBound, 1.5);  // Max's
  AutodiffProblem problem(model, {0.0, 0.0});
  const WorstCaseCheck check = check_worst_case(problem, std::vector<double>{0.0, 0.0}, {}, 3);
  EXPECT_NEAR(check.found.value, 1.5, 1e-6);
}

TEST(WorstCase, NothingToDoWithoutMaxVariables) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  model.objective(square(x));
  AutodiffProblem problem(model, {1.0});
  Result result = solve(problem, {});
  add_worst_case(problem, with_starts(5), result);
  EXPECT_EQ(result.worst_case.starts, 0);
}

TEST(WorstCase, WrongPointsAreRefused) {
  AutodiffProblem problem(two_branches(0.3), {1.0, -1.0});
  EXPECT_THROW(static_cast<void>(check_worst_case(problem, std::vector<double>{1.0}, {}, 3)),
               std::invalid_argument);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(static_cast<void>(check_worst_case(problem, std::vector<double>{nan, 0.0}, {}, 3)),
               std::invalid_argument);
}

TEST(WorstCase, ObserverStopsTheCheck) {
  AutodiffProblem problem(two_branches(0.3), {1.0, -1.0});
  MultistartObserver observer;
  int calls = 0;
  observer.on_iteration = [&](Index, const IterationInfo&) { return ++calls < 3; };
  const WorstCaseCheck check =
      check_worst_case(problem, std::vector<double>{1.0, -1.0}, {}, 10, {}, observer);
  EXPECT_EQ(check.interrupted, Status::UserStop);
}

TEST(WorstCase, VerdictDoesNotDependOnUnits) {
  for (const double factor : {1e-8, 1.0, 1e8}) {
    Model model;
    const Expression x = model.variable(kMin, "x", -5.0, 5.0);
    const Expression y = model.variable(kMax, "y", -2.0, 2.0);
    model.objective(factor *
                    (0.5 * square(x - 1.0) + 0.1 * x * y - square(square(y) - 1.0) + 0.3 * y));
    AutodiffProblem problem(model, {1.0, -1.0});
    const std::vector<double> weak{1.0943, -0.95};
    const WorstCaseCheck check = check_worst_case(problem, weak, {}, 10);
    EXPECT_TRUE(check.found.higher) << factor;
    EXPECT_EQ(check.found.competing, 1) << factor;
  }
}

/// x'Ay over two simplices, in some unit of f and of x and shifted by `rest`.
Model matrix_game(const std::vector<std::vector<double>>& payoff, double unit = 1.0,
                  double unit_of_x = 1.0, double rest = 0.0) {
  Model model;
  std::vector<Expression> x, y;
  Expression of_x = 0.0, of_y = 0.0, f = rest;
  for (std::size_t i = 0; i < payoff.size(); ++i) {
    x.push_back(unit_of_x * model.variable(kMin, "x", 0.0, 1.0 / unit_of_x));
    of_x = of_x + x.back();
  }
  for (std::size_t j = 0; j < payoff.front().size(); ++j) {
    y.push_back(model.variable(kMax, "y", 0.0, 1.0));
    of_y = of_y + y.back();
    for (std::size_t i = 0; i < payoff.size(); ++i) f = f + payoff[i][j] * x[i] * y[j];
  }
  model.objective(unit * f);
  model.constraint(of_x, 1.0, 1.0);
  model.constraint(of_y, 1.0, 1.0);
  return model;
}

/// Scissors twice: any split of their share is optimal.
const std::vector<std::vector<double>> kScissorsTwice{
    {0.0, 1.0, -1.0}, {-1.0, 0.0, 1.0}, {1.0, -1.0, 0.0}, {0.0, 1.0, -1.0}};

TEST(DualityGap, AGameWithManyAnswersIsASaddlePoint) {
  for (const auto& [unit, unit_of_x, rest] :
       {std::array{1.0, 1.0, 0.0}, std::array{1e-2, 1.0, 0.0}, std::array{1e6, 1.0, 0.0},
        std::array{1.0, 1e4, 0.0}, std::array{1.0, 1e-4, 0.0}, std::array{1.0, 1.0, 3.0}}) {
    AutodiffProblem problem(
        matrix_game(kScissorsTwice, unit, unit_of_x, rest),
        {0.25 / unit_of_x, 0.25 / unit_of_x, 0.25 / unit_of_x, 0.25 / unit_of_x, 0.3, 0.3, 0.4});
    const Result result = solve(problem, {});
    ASSERT_TRUE(is_success(result.status)) << unit << " " << result.message;
    const DualityGap gap = duality_gap(problem, result.v, {});
    EXPECT_TRUE(gap.saddle_point) << gap.message;
    EXPECT_NEAR(gap.most, unit * rest, 1e-6 * unit);
    EXPECT_NEAR(gap.least, unit * rest, 1e-6 * unit);

    // To scissors alone rock is the best answer, and to paper scissors are.
    std::vector<double> pure(7, 0.0);
    pure[0] = 1.0 / unit_of_x;
    pure[4] = 1.0;
    const DualityGap wide = duality_gap(problem, pure, {});
    EXPECT_FALSE(wide.saddle_point);
    EXPECT_NEAR(wide.most, unit * (rest + 1.0), 1e-5 * unit);
    EXPECT_NEAR(wide.least, unit * (rest - 1.0), 1e-5 * unit);
  }
}

TEST(DualityGap, AnUndecidedGameSaysThatItsAnswerIsASaddlePoint) {
  Model model;
  const Expression x = model.variable(Player::Min, "x", -2.0, 2.0);
  const Expression y = model.variable(kMax, "y", -2.0, 2.0);
  model.objective(square(square(x)) - square(square(y)));
  AutodiffProblem problem(model, {0.5, 0.4});
  const Result result = solve(problem, {});
  EXPECT_EQ(result.status, Status::SolvedDegenerate) << result.message;
  EXPECT_NE(result.message.find("a saddle point"), std::string::npos) << result.message;
}

TEST(DualityGap, ThereIsNoneWhereItProvesNothing) {
  const auto why = [](auto write) {
    Model model;
    const Expression x = model.variable(kMin, "x", -2.0, 2.0);
    const Expression y = model.variable(kMax, "y", -2.0, 2.0);
    write(model, x, y);
    AutodiffProblem problem(model, {0.1, 0.1});
    const DualityGap gap = duality_gap(problem, std::vector{0.1, 0.1}, {});
    EXPECT_TRUE(std::isnan(gap.size()));
    EXPECT_FALSE(gap.saddle_point);
    return gap.message;
  };
  using std::string;
  EXPECT_NE(why([](Model& m, auto& x, auto& y) {
              m.objective(x * y);
              m.constraint(x + y, -1.0, 1.0);
            }).find("both players"),
            string::npos);
  EXPECT_NE(why([](Model& m, auto& x, auto& y) {
              m.objective(x * y);
              m.constraint(square(x), -1.0, 1.0);
            }).find("not linear"),
            string::npos);
  EXPECT_NE(why([](Model& m, auto& x, auto& y) {
              m.objective(x * y - square(square(x) - 1.0));
            }).find("not convex in x"),
            string::npos)
      << "as other points show";
  EXPECT_NE(why([](Model& m, auto& x, auto& y) {
              m.objective(square(x) + x * y + 0.1 * square(y));
            }).find("not concave in y"),
            string::npos);
  AutodiffProblem problem(two_branches(0.0), {1.0, -1.0});
  EXPECT_THROW((void)duality_gap(problem, std::vector{1.0}, {}), std::invalid_argument);
  EXPECT_THROW((void)duality_gap(problem, std::vector{1.0, std::nan("")}, {}),
               std::invalid_argument);
}

TEST(DualityGap, ALimitOfTimeLeavesTheAnswer) {
  AutodiffProblem problem(matrix_game(kScissorsTwice), {0.25, 0.25, 0.25, 0.25, 0.3, 0.3, 0.4});
  SolverOptions options;
  options.max_cpu_time = 1e-9;
  EXPECT_TRUE(std::isnan(duality_gap(problem, std::vector<double>(7, 0.25), options).size()));
}

TEST(Multistart, WithoutMinVariablesTheLargestMaximumIsBest) {
  Model model;
  const Expression y = model.variable(kMax, "y", -2.0, 2.0);
  model.objective(0.3 * y - square(square(y) - 1.0));
  AutodiffProblem problem(model, {-1.0});
  SolverOptions options;
  options.minmax_starts = 12;
  const MultistartResult result = multistart(problem, options);
  ASSERT_EQ(result.points.size(), 2U);
  EXPECT_GT(result.best.v[0], 0.9);
  EXPECT_GT(result.points[0].result.objective, result.points[1].result.objective);
}

}  // namespace
}  // namespace ipminmax
