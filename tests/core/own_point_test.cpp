// Results that once described another point than their own, or nothing that exists.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include <support/autodiff_problem.hpp>
#include <support/forwarding_problem.hpp>
#include <support/judge_truth.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

void expect_true(Problem& model, const SolverOptions& options, const Result& result,
                 bool fails = false) {
  EXPECT_EQ(TruthJudge(model, options, result, fails).untruths(), "") << name_of(result.status);
}

TEST(OwnPoint, OfASearchThatGivesUp) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y");
  model.objective(1.0 / (1.0 + square(x)) - square(y));
  AutodiffProblem problem(model, {1.0, 0.5});
  SolverOptions options;
  options.tol = 1e-16;
  options.acceptable_iter = 0;
  const Result result = solve(problem, options);
  expect_true(problem, options, result);
  EXPECT_NE(result.v, (std::vector<double>{1.0, 0.5}));
}

TEST(OwnPoint, OfAFailedEscape) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y");
  model.objective(square(x) + square(y));
  AutodiffProblem problem(model, {0.0, 0.0});
  const Result result = solve(problem, SolverOptions{});
  expect_true(problem, SolverOptions{}, result);
  EXPECT_FALSE(is_success(result.status));
}

/// Fails from a call of the constraints on.
class FailsLate final : public ForwardingProblem {
 public:
  FailsLate(Problem& model, int from) : ForwardingProblem(model), from_(from) {}
  [[nodiscard]] bool constraints(std::span<const double> v, bool new_v,
                                 std::span<double> g) override {
    if (!ForwardingProblem::constraints(v, new_v, g)) return false;
    if (++calls_ >= from_) std::ranges::fill(g, std::numeric_limits<double>::quiet_NaN());
    return true;
  }

 private:
  int from_, calls_ = 0;
};

TEST(OwnPoint, OfAModelThatFailsAtAnyCall) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y");
  model.objective(square(x) + x * y - square(y));
  model.constraint(x + y, 0.5, 3.0);
  model.constraint(exp(x), -kNoBound, kNoBound);
  for (int from = 1; from < 30; ++from) {
    AutodiffProblem problem(model, {1.0, 0.3});
    FailsLate failing(problem, from);
    expect_true(problem, SolverOptions{}, solve(failing, SolverOptions{}), true);
  }
}

/// Counts calls with numbers that are not finite.
class Watchful final : public ForwardingProblem {
 public:
  using ForwardingProblem::ForwardingProblem;
  int bad = 0;
  [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override {
    look(v);
    return ForwardingProblem::objective(v, new_v, f);
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool new_v,
                              std::span<double> grad) override {
    look(v);
    return ForwardingProblem::gradient(v, new_v, grad);
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool new_v, double sigma,
                             std::span<const double> lambda, bool new_lambda,
                             std::span<double> values) override {
    look(v);
    look(lambda);
    return ForwardingProblem::hessian(v, new_v, sigma, lambda, new_lambda, values);
  }

 private:
  void look(std::span<const double> numbers) {
    for (const double number : numbers) bad += std::isfinite(number) ? 0 : 1;
  }
};

TEST(OwnPoint, IsFiniteFromAHugeStart) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  static_cast<void>(model.variable(Player::Max, "unused"));
  model.objective(square(x));
  for (const Globalization method : {Globalization::Filter, Globalization::None}) {
    AutodiffProblem problem(model, {1.0, 1.7e308});
    Watchful watched(problem);
    SolverOptions options;
    options.minmax_globalization = method;
    const Result result = solve(watched, options);
    EXPECT_EQ(watched.bad, 0);
    expect_true(problem, options, result);
  }
}

TEST(OwnPoint, IsUnknownWithoutAnEvaluation) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  model.objective(log(x));
  AutodiffProblem problem(model, {-1.0});
  const Result result = solve(problem, SolverOptions{});
  expect_true(problem, SolverOptions{}, result);
  EXPECT_EQ(result.certificate.kind, PointKind::Unknown);
  EXPECT_TRUE(std::isnan(result.objective));
}

// Nothing can be done about a constraint on fixed variables.
TEST(OwnPoint, ViolatesAConstraintWithoutFreeVariables) {
  struct Case {
    Player player;
    bool unbounded;  // which is not what has to be said first
  };
  for (const auto& [player, unbounded] :
       {Case{Player::Min, false}, {Player::Max, false}, {Player::Min, true}, {Player::Max, true}}) {
    SCOPED_TRACE(unbounded);
    Model model;
    const Expression x = model.variable(player, "x", -1e18, 1e18);
    const Expression fixed = model.variable(player, "fixed", 1.0, 1.0);
    model.objective(unbounded ? 1.0 * x : player == Player::Min ? square(x) : -square(x));
    model.constraint(2.0 * fixed, 3.0, kNoBound);
    AutodiffProblem problem(model, {1.0, 1.0});
    const Result result = solve(problem, SolverOptions{});
    EXPECT_EQ(result.status,
              player == Player::Min ? Status::LocallyInfeasible : Status::InnerInfeasible);
    EXPECT_EQ(result.certificate.kind, PointKind::InfeasiblePoint);
    EXPECT_GE(result.error.primal, 1.0);
    EXPECT_NE(result.message.find("no free variable"), std::string::npos) << result.message;
    expect_true(problem, SolverOptions{}, result);
  }
}

// Waechter and Biegler (2000): from this start no line search reaches feasibility.
TEST(OwnPoint, IsReachedWithinMaxIterRestorationsIncluded) {
  Model model;
  const Expression a = model.variable(Player::Min, "a");
  const Expression b = model.variable(Player::Min, "b", 0.0);
  const Expression c = model.variable(Player::Min, "c", 0.0);
  model.objective(a);
  model.constraint(square(a) - b - 1.0, 0.0, 0.0);
  model.constraint(a - c - 0.5, 0.0, 0.0);
  AutodiffProblem problem(model, {-2.0, 3.0, 1.0});
  const Result free = solve(problem, SolverOptions{});
  ASSERT_GT(free.counts.restoration_iterations, 0);
  const Index all = free.iterations + free.counts.restoration_iterations;
  for (Index limit = 0; limit <= all + 1; ++limit) {
    SolverOptions options;
    options.max_iter = static_cast<int>(limit);
    const Result result = solve(problem, options);
    EXPECT_LE(result.iterations + result.counts.restoration_iterations, limit);
    EXPECT_EQ(result.status, limit > all ? free.status : Status::MaxIterations) << limit;
    expect_true(problem, options, result);
  }
}

/// Throws in the objective.
class Throwing final : public ForwardingProblem {
 public:
  using ForwardingProblem::ForwardingProblem;
  [[nodiscard]] bool objective(std::span<const double>, bool, double&) override {
    throw std::length_error("the model's");
  }
};

TEST(OwnPoint, ExceptionsOfTheModelPassThrough) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  model.objective(square(x));
  AutodiffProblem problem(model, {1.0});
  Throwing throwing(problem);
  EXPECT_THROW(static_cast<void>(solve(throwing, SolverOptions{})), std::length_error);
  EXPECT_THROW(static_cast<void>(solve(
                   problem, SolverOptions{},
                   [](const IterationInfo&) -> bool { throw std::length_error("the caller's"); })),
               std::length_error);
}

// Multipliers of the least violation show that nothing near is feasible: J' l - z_l + z_u = 0.
TEST(OwnPoint, MultipliersOfAnInfeasiblePointAreThoseOfItsViolation) {
  Model model;
  const Expression a = model.variable(Player::Min, "a");
  const Expression b = model.variable(Player::Min, "b", 0.0);
  model.objective(square(a - 1.0) + b);
  model.constraint(square(a) + b, -kNoBound, -1.0);
  AutodiffProblem problem(model, {0.7, 2.0});
  const Result result = solve(problem, {});
  ASSERT_EQ(result.status, Status::LocallyInfeasible) << result.message;
  const double lambda = result.lambda[0];
  EXPECT_GT(lambda, 1.0);
  EXPECT_NEAR(2.0 * result.v[0] * lambda - result.z_lower[0] + result.z_upper[0], 0.0, 1e-3);
  EXPECT_NEAR(lambda - result.z_lower[1] + result.z_upper[1], 0.0, 1e-6 * lambda);
}

// g = 1 and a multiple of g above by 4e-8: nothing is feasible to tol, and only restorations
// lead on from points that are to the acceptable tolerances.
TEST(OwnPoint, NearlyContradictingRowsEndAtAnAcceptablePoint) {
  Model model;
  const Expression x = model.variable(Player::Min, "x"), y = model.variable(Player::Min, "y");
  const Expression z = model.variable(Player::Min, "z");
  constexpr double kTimes = 1.98690688, kAbove = 1.0 + 3.9069302126653145e-08;
  model.objective(square(x * y - 1.0) + 0.1 * square(z) - 0.61521853 * x);
  model.constraint(x + square(y), 1.0, 1.0);
  model.constraint(kTimes * (x + square(y)), kTimes * kAbove, kNoBound);
  model.constraint(square(x) + y * z, -kNoBound, 1.0);
  AutodiffProblem problem(model, {0.4805010166461464, 0.4547598185825813, 0.6669930438538807});
  const Result result = solve(problem, SolverOptions{});
  EXPECT_TRUE(is_success(result.status)) << result.message;
  EXPECT_LT(result.iterations, 200);
}

}  // namespace
}  // namespace ipminmax::testing
