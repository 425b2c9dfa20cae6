#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <iterator>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>
#include <support/forwarding_problem.hpp>

#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::CountingProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;
using testing::StartedProblem;

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

SolverOptions with(Globalization globalization) {
  SolverOptions options;
  options.minmax_globalization = globalization;
  return options;
}

AutodiffProblem hs071() {
  Model model;
  std::vector<Expression> x;
  for (const char* name : {"x1", "x2", "x3", "x4"}) {
    x.push_back(model.variable(kMin, name, 1.0, 5.0));
  }
  model.objective(x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2]);
  model.constraint(x[0] * x[1] * x[2] * x[3], 25.0, kNoBound);
  model.constraint(square(x[0]) + square(x[1]) + square(x[2]) + square(x[3]), 40.0, 40.0);
  return AutodiffProblem(model, {1.0, 5.0, 5.0, 1.0});
}

/// min over x in [0, 3], max over y of (x - 2)^2 + 2y - y^2 / 2 s.t. x >= 0.5 and y <= x / 2.
/// The inner maximum is y = x / 2, so phi = (x - 2)^2 + x - x^2 / 8: x = 12/7, y = 6/7,
/// lambda of y - x/2 <= 0 is -f_y = -(2 - y) = -8/7.
AutodiffProblem constrained_minmax() {
  Model model;
  const Expression y = model.variable(kMax, "y");
  const Expression x = model.variable(kMin, "x", 0.0, 3.0);
  model.objective(square(x - 2.0) + 2.0 * y - 0.5 * square(y));
  model.constraint(y - 0.5 * x, -kNoBound, 0.0);
  model.constraint(1.0 * x, 0.5, kNoBound);
  return AutodiffProblem(model, {-1.0, 1.0});
}

/// Largest entry of grad f + J' lambda - z_lower + z_upper.
double stationarity(Problem& problem, const Result& result) {
  const ProblemStructure& shape = problem.structure();
  std::vector<double> gradient(result.v.size());
  std::vector<double> jacobian(shape.jacobian.size());
  EXPECT_TRUE(problem.gradient(result.v, true, gradient));
  EXPECT_TRUE(problem.jacobian(result.v, false, jacobian));
  for (std::size_t k = 0; k < jacobian.size(); ++k) {
    gradient[static_cast<std::size_t>(shape.jacobian[k].col)] +=
        jacobian[k] * result.lambda[static_cast<std::size_t>(shape.jacobian[k].row)];
  }
  double largest = 0.0;
  for (std::size_t i = 0; i < gradient.size(); ++i) {
    largest = std::max(largest, std::abs(gradient[i] - result.z_lower[i] + result.z_upper[i]));
  }
  return largest;
}

void expect_feasible(const Problem& problem, const Result& result, double tolerance = 1e-6) {
  const ProblemStructure& shape = problem.structure();
  for (std::size_t i = 0; i < result.v.size(); ++i) {
    EXPECT_GE(result.v[i], shape.variable_lower[i] - tolerance);
    EXPECT_LE(result.v[i], shape.variable_upper[i] + tolerance);
  }
  ASSERT_EQ(result.constraints.size(), shape.constraint_lower.size());
  for (std::size_t j = 0; j < result.constraints.size(); ++j) {
    EXPECT_GE(result.constraints[j], shape.constraint_lower[j] - tolerance);
    EXPECT_LE(result.constraints[j], shape.constraint_upper[j] + tolerance);
  }
}

class BothMethods : public ::testing::TestWithParam<Globalization> {};

TEST_P(BothMethods, SolveHs071) {
  AutodiffProblem problem = hs071();
  const Result result = solve(problem, with(GetParam()));
  ASSERT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_NEAR(result.objective, 17.0140173, 1e-6);
  const double expected[] = {1.0, 4.74299963, 3.82114998, 1.37940829};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(result.v[i], expected[i], 1e-6);
  EXPECT_NEAR(result.lambda[0], -0.55229366, 1e-6);
  EXPECT_NEAR(result.lambda[1], 0.16146857, 1e-6);
  EXPECT_NEAR(result.z_lower[0], 1.08787121, 1e-6);
  EXPECT_LT(stationarity(problem, result), 1e-7);
  EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax);
  expect_feasible(problem, result);
}

TEST_P(BothMethods, SolveAConstrainedMinmax) {
  AutodiffProblem problem = constrained_minmax();
  const Result result = solve(problem, with(GetParam()));
  ASSERT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_NEAR(result.v[0], 6.0 / 7.0, 1e-6);
  EXPECT_NEAR(result.v[1], 12.0 / 7.0, 1e-6);
  EXPECT_NEAR(result.lambda[0], -8.0 / 7.0, 1e-6);
  EXPECT_NEAR(result.lambda[1], 0.0, 1e-6);
  EXPECT_LT(stationarity(problem, result), 1e-7);
  EXPECT_EQ(result.certificate.second_order, SecondOrder::Satisfied);
  EXPECT_TRUE(result.certificate.licq_min && result.certificate.licq_max);
  EXPECT_EQ(result.certificate.inner_expected, (Inertia{1, 2, 0}));
  EXPECT_EQ(result.certificate.full_expected, (Inertia{2 + 1, 2 + 1, 0}));
  expect_feasible(problem, result);
}

TEST_P(BothMethods, SolveUnderGradientScalingToTheSameMultipliers) {
  // The same problem with an objective 1e5 times as large: scaled back inside.
  Model model;
  const Expression y = model.variable(kMax, "y");
  const Expression x = model.variable(kMin, "x", 0.0, 3.0);
  model.objective(1e5 * (square(x - 2.0) + 2.0 * y - 0.5 * square(y)));
  model.constraint(y - 0.5 * x, -kNoBound, 0.0);
  AutodiffProblem problem(model, {-1.0, 1.0});
  const Result result = solve(problem, with(GetParam()));
  ASSERT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_NEAR(result.v[1], 12.0 / 7.0, 1e-5);
  EXPECT_NEAR(result.lambda[0], -8e5 / 7.0, 1.0);
}

TEST_P(BothMethods, GiveBoundMultipliersTheSignOfTheirOwner) {
  // min over x >= 1 of x, max over y <= 2 of y.
  Model model;
  const Expression x = model.variable(kMin, "x", 1.0);
  const Expression y = model.variable(kMax, "y", -kNoBound, 2.0);
  model.objective(x + 3.0 * y);
  AutodiffProblem problem(model, {5.0, 0.0});
  const Result result = solve(problem, with(GetParam()));
  ASSERT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_NEAR(result.z_lower[0], 1.0, 1e-6);
  EXPECT_NEAR(result.z_upper[1], -3.0, 1e-6);
  EXPECT_EQ(result.z_upper[0], 0.0);
  EXPECT_EQ(result.z_lower[1], 0.0);
}

TEST_P(BothMethods, GiveTheSameBitsTwice) {
  for (int which = 0; which < 2; ++which) {
    std::vector<Result> results;
    std::vector<std::vector<double>> paths(2);
    for (std::vector<double>& path : paths) {
      AutodiffProblem problem = which == 0 ? hs071() : constrained_minmax();
      results.push_back(solve(problem, with(GetParam()), [&](const IterationInfo& info) {
        path.insert(path.end(), info.v.begin(), info.v.end());
        return true;
      }));
    }
    const auto same_bits = [](const std::vector<double>& a, const std::vector<double>& b) {
      return a.size() == b.size() &&
             std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
    };
    EXPECT_TRUE(same_bits(paths[0], paths[1]));
    EXPECT_TRUE(same_bits(results[0].v, results[1].v));
    EXPECT_TRUE(same_bits(results[0].lambda, results[1].lambda));
    EXPECT_TRUE(same_bits(results[0].z_lower, results[1].z_lower));
    EXPECT_EQ(results[0].iterations, results[1].iterations);
    EXPECT_EQ(results[0].factorizations, results[1].factorizations);
  }
}

TEST_P(BothMethods, CountWhatTheyDo) {
  AutodiffProblem problem = constrained_minmax();
  CountingProblem counted(problem);
  Index calls = 0;
  Index last = -1;
  const Result result = solve(counted, with(GetParam()), [&](const IterationInfo& info) {
    EXPECT_EQ(info.iteration, last + 1);
    last = info.iteration;
    ++calls;
    return true;
  });
  ASSERT_EQ(result.status, Status::Solved);
  EXPECT_EQ(calls, result.iterations + 1) << "iteration 0 is the starting point";
  EXPECT_EQ(result.factorizations,
            result.counts.factorizations_full + result.counts.factorizations_inner);
  EXPECT_GE(result.counts.factorizations_full, result.iterations);
  EXPECT_GE(result.counts.solves, result.iterations);
  EXPECT_EQ(result.counts.analyses, 2);
  EXPECT_EQ(result.counts.hessian, counted.counts().hessian);
  EXPECT_EQ(result.counts.objective, counted.counts().objective);
  EXPECT_EQ(result.counts.constraints, counted.counts().constraints);
  EXPECT_EQ(result.counts.gradient, counted.counts().gradient);
  EXPECT_EQ(result.counts.jacobian, counted.counts().jacobian);
}

TEST_P(BothMethods, MeasureTheirTime) {
  AutodiffProblem problem = constrained_minmax();
  const Result result = solve(problem, with(GetParam()));
  EXPECT_GT(result.seconds, 0.0);
  EXPECT_EQ(result.timing.total, result.seconds);
  const Timing& t = result.timing;
  for (const double part : {t.evaluations, t.assembly, t.analysis, t.factorization, t.solves}) {
    EXPECT_GE(part, 0.0);
    EXPECT_LE(part, result.seconds);
  }
}

TEST_P(BothMethods, ReportTheErrorsOfTheReturnedPoint) {
  AutodiffProblem problem = constrained_minmax();
  KktError last;
  const SolverOptions options = with(GetParam());
  const Result result = solve(problem, options, [&](const IterationInfo& info) {
    last = info.error;
    return true;
  });
  EXPECT_EQ(result.error.total, last.total);
  EXPECT_LE(result.error.total, options.tol);
  EXPECT_LE(result.mu, options.mu_init);
  EXPECT_NEAR(std::max(result.error.dual_min, result.error.dual_max), stationarity(problem, result),
              1e-10);
}

TEST_P(BothMethods, EndAtTheIterationLimitWithTheirPoint) {
  AutodiffProblem problem = hs071();
  SolverOptions options = with(GetParam());
  options.max_iter = 2;
  const Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::MaxIterations);
  EXPECT_EQ(result.iterations, 2);
  EXPECT_EQ(result.v.size(), 4U);
  EXPECT_EQ(result.certificate.second_order, SecondOrder::NotTested);
  EXPECT_FALSE(is_success(result.status));
}

TEST_P(BothMethods, SolveAGameWhoseBestAnswerIsNotUnique) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(x * y);
  AutodiffProblem problem(model, {1.0, 1.0});
  const Result result = solve(problem, with(GetParam()));
  ASSERT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax);
  EXPECT_EQ(result.certificate.answer, InnerAnswer::BestNotUnique);
}

TEST_P(BothMethods, StopAsDivergingWhenTheObjectiveHasNoMinimum) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  model.objective(-1.0 * square(x));
  AutodiffProblem problem(model, {1.0});
  SolverOptions options = with(GetParam());
  options.diverging_iterates_tol = 1e6;
  options.max_iter = 5000;
  const Result result = solve(problem, options);
  EXPECT_FALSE(is_success(result.status));
  EXPECT_TRUE(result.status == Status::DivergingIterates || result.status == Status::OuterUnbounded)
      << name_of(result.status);
}

// f falls by far more than its start promises, long before x is far away.
TEST(Solver, CallsAnObjectiveThatOutgrowsItsStartUnbounded) {
  const auto status_of = [](auto&& objective, double start, bool game) {
    Model model;
    const Expression x = model.variable(kMin, "x");
    Expression f = objective(x);
    if (game) f = f - square(model.variable(kMax, "y"));
    model.objective(f);
    AutodiffProblem problem(model, game ? std::vector{start, 0.5} : std::vector{start});
    return solve(problem, {}).status;
  };
  for (const bool game : {false, true}) {
    for (const double unit : {1.0, 1e6}) {
      const auto falls = [&](auto&& objective, double start) {
        EXPECT_EQ(status_of([&](const Expression& x) { return unit * objective(x); }, start, game),
                  Status::OuterUnbounded)
            << unit << ' ' << game << ' ' << start;
      };
      falls([](const Expression& x) { return -1.0 * exp(x); }, 0.0);
      falls([](const Expression& x) { return -1.0 * (exp(x) + exp(-1.0 * x)); }, 1.0);
      falls([](const Expression& x) { return -1.0 * square(square(x)); }, 1.5);
      if (!game) falls([](const Expression& x) { return x * square(x); }, -1.25);
    }
  }
}

TEST_P(BothMethods, KeepTheFreeVariableThatNothingDependsOn) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  model.variable(kMin, "unused");
  model.objective(square(x - 1.0));
  AutodiffProblem problem(model, {0.0, 3.0});
  const Result result = solve(problem, with(GetParam()));
  EXPECT_EQ(result.status, Status::Solved);
  EXPECT_NE(result.certificate.reasons.at(0).text.find("not unique"), std::string::npos);
  EXPECT_NEAR(result.v[0], 1.0, 1e-6);
  EXPECT_NEAR(result.v[1], 3.0, 1e-6) << "nothing moves it";
}

INSTANTIATE_TEST_SUITE_P(Globalizations, BothMethods,
                         ::testing::Values(Globalization::None, Globalization::Filter),
                         [](const auto& instance) {
                           return instance.param == Globalization::None ? "None" : "Filter";
                         });

// max over |y| = 1 is 1 + |x|: far out the multiplier is 1e10 and divides the gradient in x, 1.
TEST(SolveStatus, LargeMultipliersDoNotHideAGradient) {
  for (const double start : {1.0, 0.7}) {
    Model model;
    const Expression x1 = model.variable(kMin, "x1"), x2 = model.variable(kMin, "x2");
    const Expression y1 = model.variable(kMax, "y1"), y2 = model.variable(kMax, "y2");
    model.objective((1.0 + x1) * square(y1) + 2.0 * x2 * y1 * y2 + (1.0 - x1) * square(y2));
    model.constraint(square(y1) + square(y2), 1.0, 1.0);
    AutodiffProblem problem(model, {-3.0, 1.0, start, start == 1.0 ? 0.0 : 0.7});
    const Result result = solve(problem, {});
    EXPECT_FALSE(is_success(result.status)) << result.objective;
  }
}

// The gradient at the start, 1e12, scales f by 1e-8.
TEST(SolveStatus, TheScalingOfFDoesNotHideAGradient) {
  for (const BarrierStrategy strategy : {BarrierStrategy::Monotone, BarrierStrategy::Adaptive}) {
    Model model;
    const Expression x = model.variable(kMin, "x", 0.0, kNoBound), y = model.variable(kMin, "y");
    model.objective(x + 1.0 / x);
    model.constraint(x + square(y), 2.0, 2.0);
    AutodiffProblem problem(model, {1e-6, 1.0});
    SolverOptions options;
    options.mu_strategy = strategy;
    const Result result = solve(problem, options);
    EXPECT_TRUE(is_success(result.status)) << result.message;
    EXPECT_NEAR(result.objective, 2.0, 1e-6);
  }
}

// Where a search ends before it is balanced, the point that met the scaled tolerances is returned.
TEST(SolveStatus, APointThatMeetsTheScaledTolerancesIsKept) {
  Model model;
  const Expression x = model.variable(kMin, "x", 0.0, kNoBound), y = model.variable(kMin, "y");
  model.objective(x + 1e-3 / x);
  model.constraint(x + square(y), 2.0, 2.0);
  AutodiffProblem problem(model, {1e-4, 1.0});
  SolverOptions options;
  options.max_iter = solve(problem, options).iterations - 1;
  const Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::SolvedToAcceptableLevel) << result.message;
  EXPECT_NEAR(result.objective, 2.0 * std::sqrt(1e-3), 1e-6);
  EXPECT_NE(result.message.find("scaled tolerances"), std::string::npos) << result.message;
}

// The rounding of x, 1e4, leaves a gradient along p + q that nothing balances.
TEST(SolveStatus, WhatRoundingLeavesOfAGradientIsNone) {
  Model model;
  const Expression x = model.variable(kMin, "x", 1e4, 1e4 + 1.0);
  const Expression p = model.variable(kMin, "p"), q = model.variable(kMin, "q");
  static_cast<void>(model.variable(kMin, "unread", -kNoBound, 0.0));
  const Expression z = x - 1e4;
  model.objective(1e6 * (1.5 * square(z) - 0.4 * z + square(p + q - 2e4 - 0.1)));
  AutodiffProblem problem(model, {1e4 + 0.6, 1e4 + 0.3, 1e4 - 0.4, -1.0});
  const Result result = solve(problem, {});
  EXPECT_TRUE(is_success(result.status)) << result.message;
  EXPECT_LT(result.iterations, 50);
}

// At x = 0, the only feasible point, no multiplier exists; the iterates stay there.
TEST(SolveStatus, APointWithoutMultipliersIsASolution) {
  for (const double unit : {1.0, 1e3}) {
    Model model;
    const Expression x = model.variable(kMin, "x"), y = model.variable(kMin, "y");
    model.objective(x * (1.0 / unit) + square(y));
    model.constraint(square(x * (1.0 / unit)), 0.0, 0.0);
    AutodiffProblem problem(model, {unit, 1.0});
    EXPECT_EQ(solve(problem, {}).status, Status::SolvedDegenerate) << unit;
  }
}

TEST(SolveStatus, WithoutShiftsAWrongPointIsNotALocalMinmax) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(square(x) + square(y) + 0.5 * x * y);
  AutodiffProblem problem(model, {1.0, 1.0});
  SolverOptions options = with(Globalization::None);
  options.minmax_pure_newton = true;
  const Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::NotLocalMinmax);
  EXPECT_EQ(result.certificate.second_order, SecondOrder::Violated);
  EXPECT_EQ(result.certificate.kind, PointKind::FirstOrderPoint);
  EXPECT_NE(result.certificate.inner, result.certificate.inner_expected);
}

TEST(SolveStatus, AnInnerProblemWithoutMaximumIsNoSuccess) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(square(x) + square(y));
  AutodiffProblem problem(model, {1.0, 1.0});
  SolverOptions options;
  options.max_iter = 500;
  const Result result = solve(problem, options);
  EXPECT_FALSE(is_success(result.status)) << name_of(result.status);
  EXPECT_NE(result.certificate.kind, PointKind::LocalMinmax);
}

TEST(SolveStatus, IncompatibleConstraintsAreLocallyInfeasible) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression z = model.variable(kMin, "z");
  model.objective(square(x) + square(z));
  model.constraint(square(x) + square(z), -kNoBound, 1.0);
  model.constraint(x + z, 4.0, kNoBound);
  AutodiffProblem problem(model, {0.5, 0.25});
  const Result result = solve(problem, {});
  EXPECT_EQ(result.status, Status::LocallyInfeasible) << name_of(result.status);
  EXPECT_EQ(result.certificate.kind, PointKind::InfeasiblePoint);
  EXPECT_GT(result.error.primal, 0.1);
}

/// A car that goes 100 m and stands still again in least time; derivatives are variables.
Model car(int intervals) {
  Model model;
  const Expression duration = model.variable(kMin, "duration");
  model.objective(duration);
  const auto equal = [&](const Expression& g) { model.constraint(g, 0.0, 0.0); };
  const auto state = [&](const std::string& name, double lower, double upper) {
    std::vector<Expression> values;
    for (int i = 0; i <= intervals; ++i)
      values.push_back(model.variable(kMin, name + std::to_string(i), lower, upper));
    return values;
  };
  const auto slopes = [&](const std::string& name, const std::vector<Expression>& values) {
    std::vector<Expression> found = state("d" + name, -kNoBound, kNoBound);
    for (std::size_t i = 1; i < values.size(); ++i)
      equal(found[i] - static_cast<double>(intervals) * (values[i] - values[i - 1]));
    return found;
  };
  const auto time = state("time", -kNoBound, kNoBound), x = state("x", 0.0, 150.0);
  const auto v = state("v", 0.0, kNoBound), a = state("a", -3.0, 1.0);
  const auto dtime = slopes("time", time), dx = slopes("x", x), dv = slopes("v", v);
  for (std::size_t i = 1; i < x.size(); ++i) {
    equal(dx[i] - duration * v[i]);
    equal(dv[i] - duration * (a[i] - 0.001 * square(v[i])));
    equal(dtime[i] - duration);
  }
  for (const Expression& value : {time.front(), x.front(), v.front(), v.back()}) equal(value);
  equal(x.back() - 100.0);
  return model;
}

/// From zero, where all products vanish: a proximal term of restoration that does not fall holds
/// the point near the start, which is no minimum of the violation.
TEST(SolveStatus, WhatTheProximalTermHoldsBackIsNotInfeasible) {
  const Model model = car(8);
  const auto size = AutodiffProblem(model).structure().variable_players.size();
  AutodiffProblem problem(model, std::vector<double>(size, 0.0));
  SolverOptions options;
  for (const LinearSolver solver : {LinearSolver::Ldlt, LinearSolver::Mumps}) {
    options.linear_solver = solver;
    const Result result = solve(problem, options);
    EXPECT_TRUE(is_success(result.status)) << result.message;
    EXPECT_LE(result.error.primal, 1e-6);
  }
}

TEST(SolveStatus, WithoutPivotingAProvenMinimumOfTheViolationIsInfeasible) {
  SolverOptions options;
  options.linear_solver = LinearSolver::Ldlt;
  Model impossible;
  const Expression u = impossible.variable(kMin, "u");
  impossible.objective(u);
  impossible.constraint(square(u - 1.0), -kNoBound, -1.0);
  AutodiffProblem infeasible(impossible, {0.5});
  EXPECT_EQ(solve(infeasible, options).status, Status::LocallyInfeasible);
}

TEST(SolveStatus, ALooseToleranceStopsAtTheAcceptableLevel) {
  AutodiffProblem problem = hs071();
  SolverOptions options;
  options.tol = 1e-13;
  options.acceptable_tol = 1e-1;
  options.acceptable_iter = 1;
  const Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::SolvedToAcceptableLevel);
  EXPECT_TRUE(is_success(result.status));
  EXPECT_GT(result.error.total, options.tol);
}

/// Bratu's equations just beyond their turning point have no solution. Newton's steps come within
/// the acceptable tolerances of one, and the restoration that fails in the end leads away from it.
TEST(SolveStatus, WhereARestorationFailsTheAcceptablePointBeforeItIsTheAnswer) {
  constexpr int kSide = 3;
  constexpr double kStep = 1.0 / (kSide + 1);
  Model model;
  std::vector<Expression> u;
  for (int k = 0; k < kSide * kSide; ++k) {
    u.push_back(model.variable(kMin, "u" + std::to_string(k)));
  }
  for (int k = 0; k < kSide * kSide; ++k) {
    const int i = k / kSide, j = k % kSide;
    Expression left = 4.0 * u[k] - kStep * kStep * 6.69050983 * exp(u[k]);
    if (i > 0) left = left - u[k - kSide];
    if (i + 1 < kSide) left = left - u[k + kSide];
    if (j > 0) left = left - u[k - 1];
    if (j + 1 < kSide) left = left - u[k + 1];
    model.constraint(left, 0.0, 0.0);
  }
  AutodiffProblem problem(model, std::vector<double>(kSide * kSide, 0.0));
  const Result result = solve(problem, {});
  EXPECT_EQ(result.status, Status::SolvedToAcceptableLevel);
  EXPECT_LE(result.error.total, 1e-6);
}

TEST(SolveStatus, EveryStatusHasItsOwnName) {
  std::vector<std::string_view> names;
  for (int s = 0; s <= static_cast<int>(Status::WorstCaseNotMet); ++s) {
    const std::string_view name = name_of(static_cast<Status>(s));
    EXPECT_FALSE(name.empty());
    for (const std::string_view other : names) EXPECT_NE(name, other);
    names.push_back(name);
  }
  for (const Status s :
       {Status::Solved, Status::SolvedDegenerate, Status::SolvedToAcceptableLevel}) {
    EXPECT_TRUE(is_success(s));
  }
  for (const Status s : {Status::InternalError, Status::NotLocalMinmax, Status::UserStop,
                         Status::MaxIterations, Status::LocallyInfeasible}) {
    EXPECT_FALSE(is_success(s));
  }
}

// A worst-case design over two scenarios: each pair of inequalities fixes an x2 to within the
// relaxation of the bounds, so that no interior is left and the pair's multipliers begin at mu over
// that.
TEST(Minimization, InequalitiesThatLeaveNoRoomAreSolved) {
  Model model;
  const Expression x1 = model.variable(kMin, "x1", 0.0), a = model.variable(kMin, "x2_a"),
                   b = model.variable(kMin, "x2_b"), worst = model.variable(kMin, "worst"),
                   rule = model.variable(kMin, "rule"), slope = model.variable(kMin, "slope");
  model.objective(worst);
  for (const auto& [x2, q, own] : {std::tuple{a, 1.125, 1.0606601717798212},
                                   std::tuple{b, 1.9999997791675885, 1.414213484297045}}) {
    const double square_of_q = q * q;
    model.constraint(square(x1 - 4.0) + square(x2 - 1.0) - worst, -kNoBound, 0.0);
    model.constraint(own * x1 - q * x2, -kNoBound, 2.0);
    model.constraint(-square_of_q * x2, -kNoBound, -square_of_q);
    model.constraint(square_of_q * x2, -kNoBound, square_of_q);
    model.constraint(-x2, -kNoBound, 0.0);
    model.constraint(rule + q * slope - x2, 0.0, 0.0);
  }
  AutodiffProblem problem(model, {0.9618589259604294, 0.9999999981512983, 0.9999999981402116,
                                  99971.06638478952, 0.9999999981461323, 0.0});
  const Result result = solve(problem, {});
  EXPECT_TRUE(is_success(result.status)) << result.message;
  EXPECT_NEAR(result.objective, 1.3725829356, 1e-7);
  EXPECT_LE(result.iterations, 60);  // thousands at the solution else
}

/// A table of flows is moved as little as possible to given sums of its rows and columns, which
/// depend on each other.
class Table final : public Problem {
 public:
  Table() {
    double place = 0.0;
    const auto share = [&] { return std::fmod(place += std::sqrt(28.5), 1.0); };
    const auto flow = [&] { return std::exp(12.0 * share()); };
    std::generate_n(std::back_inserter(given_), kSize * kSize, flow);
    s_.variable_players.assign(given_.size(), Player::Min);
    s_.variable_lower.assign(given_.size(), 0.0);
    s_.variable_upper.assign(given_.size(), kNoBound);
    s_.constraint_players.assign(2 * kSize, Player::Min);
    s_.constraint_lower.assign(2 * kSize, 0.0);
    for (std::size_t k = 0; k < given_.size(); ++k) {
      const double part = share() < 0.4 ? 0.0 : flow();
      for (const std::size_t sum : sums_of(k)) {
        s_.constraint_lower[sum] += part;
        s_.jacobian.push_back({static_cast<Index>(sum), static_cast<Index>(k)});
      }
      s_.hessian.push_back({static_cast<Index>(k), static_cast<Index>(k)});
    }
    s_.constraint_upper = s_.constraint_lower;
  }
  const ProblemStructure& structure() const override { return s_; }
  bool starting_point(StartingPoint& start) override {
    std::ranges::copy(given_, start.v.begin());
    return true;
  }
  bool objective(std::span<const double> v, bool, double& f) override {
    f = 0.0;
    for (std::size_t k = 0; k < v.size(); ++k)
      f += (v[k] - given_[k]) * (v[k] - given_[k]) / given_[k];
    return true;
  }
  bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    for (std::size_t k = 0; k < v.size(); ++k) grad[k] = 2.0 * (v[k] - given_[k]) / given_[k];
    return true;
  }
  bool constraints(std::span<const double> v, bool, std::span<double> g) override {
    std::ranges::fill(g, 0.0);
    for (std::size_t k = 0; k < v.size(); ++k) {
      for (const std::size_t sum : sums_of(k)) g[sum] += v[k];
    }
    return true;
  }
  bool jacobian(std::span<const double>, bool, std::span<double> values) override {
    std::ranges::fill(values, 1.0);
    return true;
  }
  bool hessian(std::span<const double> v, bool, double sigma, std::span<const double>, bool,
               std::span<double> values) override {
    for (std::size_t k = 0; k < v.size(); ++k) values[k] = 2.0 * sigma / given_[k];
    return true;
  }

 private:
  static constexpr std::size_t kSize = 15;
  static std::array<std::size_t, 2> sums_of(std::size_t k) {
    return {k / kSize, kSize + k % kSize};
  }
  std::vector<double> given_;
  ProblemStructure s_;
};

// A share of the shift of the multipliers' rows would be below the accuracy of the gradients of
// sums of flows between 1 and e^12.
TEST(Minimization, DependentSumsKeepTheirShift) {
  Table problem;
  const Result result = solve(problem, {});
  EXPECT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_LE(result.iterations, 24);  // 31 with the share
}

// Where the gradient of a large objective vanishes multipliers are dropped: what is left of those
// of bounds is small in the model's units, too, and the solve ends.
TEST(Minimization, WithoutAGradientEndsWhateverTheObjectivesSize) {
  Model model;
  const Expression x = model.variable(kMin, "x"), a = model.variable(kMin, "a", 0.0),
                   b = model.variable(kMin, "b", 0.0);
  model.objective(1e10 * square(x - 1.0));
  model.constraint(x, 1.0, 1.0);
  model.constraint(a + b, 2.0, 2.0);
  AutodiffProblem problem(model, {3.0, 0.5, 4.0});
  const Result result = solve(problem, {});
  EXPECT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_LE(result.iterations, 20);
}

TEST(WarmStart, FromTheSolutionTakesFewIterations) {
  AutodiffProblem problem = hs071();
  const Result cold = solve(problem, {});
  ASSERT_EQ(cold.status, Status::Solved);
  StartedProblem again(problem, cold);
  SolverOptions options;
  options.warm_start_init_point = true;
  options.warm_start_bound_push = options.warm_start_bound_frac = 1e-9;
  options.warm_start_slack_bound_push = options.warm_start_slack_bound_frac = 1e-9;
  options.warm_start_mult_bound_push = 1e-9;
  options.mu_init = 1e-8;
  const Result warm = solve(again, options);
  ASSERT_EQ(warm.status, Status::Solved) << warm.message;
  EXPECT_LT(warm.iterations, cold.iterations / 2 + 1);
  EXPECT_NEAR(warm.objective, cold.objective, 1e-7);
}

}  // namespace
}  // namespace ipminmax
