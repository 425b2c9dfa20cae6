#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include <problems/small_problems.hpp>
#include <support/autodiff_problem.hpp>

#include "core/multistart.hpp"
#include "core/search/starts.hpp"
#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

/// Bounds of every kind.
Model box_model() {
  Model model;
  const Expression a = model.variable(kMin, "bounded", -3.0, 2.0);
  const Expression b = model.variable(kMin, "free");
  const Expression c = model.variable(kMax, "above", 5.0, kNoBound);
  const Expression d = model.variable(kMax, "wide", -1e6, 1e6);
  model.objective(square(a) + square(b) - square(c) - square(d));
  model.constraint(c + d, -kNoBound, 1e3);
  return model;
}

TEST(RestartPoint, LiesWithinTheBoundsAndTheReach) {
  AutodiffProblem problem(box_model(), {0.0, 20.0, 6.0, 1.0});
  const SolverOptions options;
  Counts counts;
  Timing timing;
  CanonicalProblem canonical(problem, options, counts, timing);
  ASSERT_EQ(canonical.build(), "");
  const Iterate start = canonical.starting_point();
  double least = 0.0, most = 0.0, farthest = 0.0;
  for (Index number = 1; number <= 200; ++number) {
    const Iterate point = restart_point(canonical, start, number);
    for (Index i = 0; i < canonical.variables(); ++i) {
      if (i >= canonical.y_slacks().begin) {
        EXPECT_EQ(point.v[i], 0.0) << "slacks are set from the constraints";
        continue;
      }
      EXPECT_GT(point.v[i], canonical.lower()[i]);
      EXPECT_LT(point.v[i], canonical.upper()[i]);
    }
    least = std::min(least, point.v[0]);
    most = std::max(most, point.v[0]);
    const double reach =
        std::array{3.0, 1.0, 10.0}.at(static_cast<std::size_t>(number - 1) / 2 % 3);
    const double from_center = std::abs(point.v[1] - (number % 2 != 0 ? 20.0 : 0.0));
    EXPECT_LE(from_center, 20.0 * reach) << number;
    farthest = std::max(farthest, from_center / (20.0 * reach));
    EXPECT_LE(point.v[2], 6.0 + 6.0 * reach);
    EXPECT_LE(std::abs(point.v[3]), 1.0 + reach);
    EXPECT_EQ(point.v, restart_point(canonical, start, number).v) << "the same in every run";
    EXPECT_NE(point.v, restart_point(canonical, start, number + 1).v);
  }
  EXPECT_LT(least, -2.5);
  EXPECT_GT(most, 1.5);
  EXPECT_GT(farthest, 0.9);
}

/// forsaken with a wider box: from (4, -3) the descent goes round a ring without a local minmax.
Model ring() {
  Model model;
  const Expression x = model.variable(kMin, "x", -2.0, 2.0);
  const Expression y = model.variable(kMax, "y", -2.0, 2.0);
  const auto phi = [](const Expression& z) {
    return 0.25 * square(z) - 0.5 * pow(z, 4.0) + 1.0 / 6.0 * pow(z, 6.0);
  };
  model.objective(x * (y - 0.45) + phi(x) - phi(y));
  return model;
}

TEST(Restarts, AreBoundedWhereNothingIsToBeFound) {
  AutodiffProblem problem(ring(), {1.2, 0.5});
  const Result result = solve(problem, SolverOptions{});
  EXPECT_EQ(result.status, Status::NoLocalMinmaxFound) << name_of(result.status);
  EXPECT_LE(result.iterations, 400);
  EXPECT_NE(result.message.find("other starting point"), std::string::npos) << result.message;

  EXPECT_NE(result.message.find("may have a kink: "), std::string::npos) << result.message;
  EXPECT_NE(result.message.find("time"), std::string::npos) << result.message;
  EXPECT_NE(result.message.find("last at variable 0"), std::string::npos) << result.message;

  SolverOptions twice;
  twice.minmax_max_restarts = 1;
  const std::string text = solve(problem, twice).message;
  EXPECT_NE(
      text.find("\nfailed from 1 other starting point, too (minmax_max_restarts allows no more)"),
      std::string::npos)
      << text;

  SolverOptions once;
  once.minmax_max_restarts = 0;
  const Result single = solve(problem, once);
  EXPECT_EQ(single.status, Status::NoLocalMinmaxFound);
  EXPECT_LT(single.iterations, result.iterations);
  EXPECT_EQ(single.message.find("other starting point"), std::string::npos) << single.message;
}

/// A local minmax that one search misses from many starts.
const Model& forsaken_variant() {
  const auto& problems = testing::small_problems();
  return std::ranges::find(problems, "forsaken_variant", &testing::SmallProblem::name)->model;
}

TEST(Restarts, FindWhatTheFirstSearchMisses) {
  AutodiffProblem problem(forsaken_variant());
  SolverOptions once;
  once.minmax_max_restarts = 0;
  int starts = 0, at_once = 0, in_all = 0;
  for (double x = -1.4; x < 1.5; x += 0.4) {
    for (double y = -1.4; y < 1.5; y += 0.4) {
      problem.set_start({x, y});
      ++starts;
      at_once += solve(problem, once).certificate.kind == PointKind::LocalMinmax;
      in_all += solve(problem, SolverOptions{}).certificate.kind == PointKind::LocalMinmax;
    }
  }
  EXPECT_LT(at_once, starts);
  EXPECT_EQ(in_all, starts);
}

TEST(Restarts, AMultistartFindsNoLess) {
  AutodiffProblem problem(forsaken_variant());
  SolverOptions two;
  two.minmax_starts = 2;
  two.minmax_start_radius = 0.1;
  for (double x = -1.4; x < 1.5; x += 0.4) {
    for (double y = -1.4; y < 1.5; y += 0.4) {
      problem.set_start({x, y});
      ASSERT_EQ(solve(problem, SolverOptions{}).status, Status::Solved) << x << ' ' << y;
      const MultistartResult answer = multistart(problem, two);
      EXPECT_EQ(answer.best.status, Status::Solved) << x << ' ' << y;
      EXPECT_LE(answer.starts, 3);
    }
  }
}

TEST(Restarts, ReplaceAStartThatIsUndefined) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(x - log(x) + 0.1 * x * y - square(y));
  AutodiffProblem problem(model, {-1.0, 0.0});
  std::vector<std::string> messages;
  SolveObserver observer;
  observer.message = [&](std::string_view text) { messages.emplace_back(text); };
  const Result result = solve(problem, SolverOptions{}, observer);
  EXPECT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_NEAR(result.v[0], 1.0, 0.1);
  ASSERT_FALSE(messages.empty());
  EXPECT_NE(messages.front().find("at the starting point; new start 1"), std::string::npos)
      << messages.front();

  SolverOptions once;
  once.minmax_max_restarts = 0;
  const Result single = solve(problem, once);
  EXPECT_EQ(single.status, Status::EvaluationFailed) << single.message;
  EXPECT_TRUE(single.v.empty());
}

TEST(Restarts, AModelThatIsDefinedNowhereSaysSo) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(log(-1.0 - square(x)) - square(y));
  AutodiffProblem problem(model, {1.0, 0.0});
  const Result result = solve(problem, SolverOptions{});
  EXPECT_EQ(result.status, Status::EvaluationFailed) << result.message;
  EXPECT_TRUE(result.v.empty());
  EXPECT_NE(result.message.find("and at 20 other points, too"), std::string::npos)
      << result.message;
}

TEST(Restarts, AreNotForMinimizers) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  model.objective(-1.0 * square(x) + x);  // unbounded below
  AutodiffProblem problem(model, {0.3});
  bool restarted = false;
  const Result result = solve(problem, SolverOptions{}, [&](const IterationInfo& info) {
    restarted |= info.step_kind == 'w';
    return true;
  });
  EXPECT_FALSE(restarted);
  EXPECT_FALSE(is_success(result.status)) << name_of(result.status);
}

TEST(RunsToInfinity, WhereTheGradientVanishesAreNamed) {
  // max over y of -exp(-y): its supremum 0 is at infinity; the gradient dies on the way.
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(square(x) - exp(-1.0 * y));
  AutodiffProblem problem(model, {0.3, 0.0});
  for (const Globalization globalization : {Globalization::None, Globalization::Filter}) {
    SolverOptions options;
    options.minmax_globalization = globalization;
    const Result result = solve(problem, options);
    EXPECT_EQ(result.status, Status::DivergingIterates) << name_of(result.status);
    EXPECT_NE(result.certificate.kind, PointKind::LocalMinmax);
  }
}

TEST(RunsToInfinity, AreNotDegenerateSolutions) {
  // y = 0 has no curvature, but Newton's method stays near it.
  for (const double start : {0.5, 30.0}) {
    Model model;
    const Expression x = model.variable(kMin, "x");
    const Expression y = model.variable(kMax, "y");
    model.objective(square(x) - pow(y, 4.0));
    AutodiffProblem problem(model, {0.3, start});
    EXPECT_EQ(solve(problem, SolverOptions{}).status, Status::SolvedDegenerate);
  }
}

// The barrier pulls t outward, and the value stays.
TEST(RunsToInfinity, AreNoFlatDirections) {
  for (const double power : {1.0, 2.0, 4.0}) {
    for (const bool two : {false, true}) {
      Model model;
      const Expression x = model.variable(kMin, "x", 0.0, 1.0);
      const Expression t = model.variable(kMin, "t", 0.0, kNoBound);
      const Expression s = two ? model.variable(kMin, "s", 0.0, kNoBound) : Expression(0.0);
      model.objective(power == 1.0 ? x : pow(x - 0.2, power));
      model.constraint(t - s - x, 0.0, kNoBound);
      AutodiffProblem problem(model, two ? std::vector{0.5, 0.5, 0.1} : std::vector{0.5, 0.5});
      const Status expected = power == 4.0 ? Status::SolvedDegenerate : Status::Solved;
      EXPECT_EQ(solve(problem, {}).status, expected) << power << two;
    }
  }
}

// f falls for ever along t, beside a variable that is at its bound and a constant.
TEST(RunsToInfinity, AreNamedBesideOtherTerms) {
  for (const double constant : {0.0, 1.0, 100.0}) {
    Model model;
    const Expression x = model.variable(kMin, "x", 0.0, 1.0), t = model.variable(kMin, "t");
    model.objective(x + exp(-t) + constant);
    AutodiffProblem problem(model, {0.5, 0.0});
    EXPECT_EQ(solve(problem, {}).status, Status::DivergingIterates) << constant;
  }
}

TEST(RunsToInfinity, AreNoFeasiblePointsFarFromTheStart) {
  // Without objective W is zero at every solution: it has died out nowhere.
  Model model;
  const Expression a = model.variable(kMin, "a");
  const Expression b = model.variable(kMin, "b");
  model.objective(0.0 * a);
  model.constraint(a * b, 1e4, 1e4);
  AutodiffProblem problem(model, {1.0, 1.0});
  const Result result = solve(problem, SolverOptions{});
  EXPECT_TRUE(is_success(result.status)) << name_of(result.status);
  EXPECT_NEAR(result.v[0] * result.v[1], 1e4, 1e-3);
}

TEST(RunsToInfinity, AreNoFullStepsOfTheWatchdog) {
  // Newton's method for sqrt(1 + t^2) goes from t to -t^3. The line search shortens its steps,
  // until full ones are tried: 5 would become 1e2, 1e6 and 1e19.
  Model model;
  std::vector<double> start;
  std::vector<Expression> terms;
  for (int i = 1; i < 8; ++i) {
    terms.push_back(sqrt(1.0 + square(model.variable(kMin, ""))));
    start.push_back(std::pow(2.0, i));
  }
  Expression objective = terms[0];
  for (std::size_t i = 1; i < terms.size(); ++i) objective = objective + terms[i];
  model.objective(objective);
  AutodiffProblem problem(model, start);
  SolverOptions options;
  options.diverging_iterates_tol = 1e4;
  const Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::Solved) << name_of(result.status);
}

TEST(VanishingMaxSet, IsNamed) {
  // y^2 <= 1 - x with f = x-decreasing value: the minimizer gains by x -> 1, where Y(x) = {0} has
  // no interior and beyond which it is empty.
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(-1.0 * x + 0.1 * y);
  model.constraint(square(y) + x, -kNoBound, 1.0);
  AutodiffProblem problem(model, {0.0, 0.1});
  const Result result = solve(problem, SolverOptions{});
  EXPECT_EQ(result.status, Status::InnerInfeasible) << name_of(result.status);
  EXPECT_NE(result.certificate.kind, PointKind::LocalMinmax);
}

// Y(x) is empty for every x: not a kink, and no other start helps.
TEST(EmptyMaxSet, IsNamed) {
  for (int kind = 0; kind < 3; ++kind) {
    Model model;
    const Expression x = model.variable(kMin, "x", -2.0, 2.0);
    const Expression y = model.variable(kMax, "y");
    model.objective(square(x) + x * y - square(y));
    double least = 0.0;  // violation that is left
    if (kind == 0) {
      model.constraint(square(y) + square(x) + 1.0, -kNoBound, 0.0);
      least = 1.0;
    } else if (kind == 1) {
      model.constraint(y - square(x), 1.0, kNoBound);
      model.constraint(y, -kNoBound, -1.0);
      least = 1.0;  // 2 in all, shared somehow
    } else {
      model.constraint(square(y) + square(x), -1.0, -1.0);
      least = 1.0;
    }
    AutodiffProblem problem(model, {1.0, 0.5});
    const Result result = solve(problem, SolverOptions{});
    EXPECT_EQ(result.status, Status::InnerInfeasible) << kind << " " << name_of(result.status);
    EXPECT_NE(result.message.find("violated most"), std::string::npos) << result.message;
    EXPECT_EQ(result.certificate.kind, PointKind::InfeasiblePoint) << kind;
    EXPECT_GE(result.error.primal, 0.99 * least) << kind;
    EXPECT_NEAR(result.v[0], 0.0, 1e-2) << kind;  // where the violation is least
  }
}

// A kink with a feasible point is no infeasibility.
TEST(EmptyMaxSet, IsNotSeenWhereASearchIsLostNearFeasiblePoints) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(x * y +
                  0.1 * square(x));  // max over |y| <= 1: |x| + .1 x^2, y^2 in the constraint
  model.constraint(pow(y, 4.0) - square(y), -kNoBound, -0.2);
  AutodiffProblem problem(model, {0.7, 0.1});
  const Result result = solve(problem, SolverOptions{});
  EXPECT_NE(result.status, Status::InnerInfeasible) << result.message;
  EXPECT_NE(result.status, Status::LocallyInfeasible) << result.message;
}

}  // namespace
}  // namespace ipminmax
