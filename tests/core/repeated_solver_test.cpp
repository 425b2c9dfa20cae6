// Solving again: what is kept, and that nothing is kept that no longer fits.
#include <cmath>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <problems/small_problems.hpp>
#include <support/autodiff_problem.hpp>

#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;
using testing::small_problem;
using testing::SmallProblem;

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

/// What may change between two solves of nonconvex(): numbers first, then structure.
struct Variant {
  double target = 1.0;
  double weight = 1.0;
  double lower_a = -3.0;
  double upper_a = 3.0;
  double disc = 4.0;
  double upper_sum = 2.0;
  double lower_sum = -kNoBound;
  Player owner_of_c = kMin;
  bool coupled = false;
};

/// Nonconvex in a and nonconcave in d away from the solution; inequalities of both players.
Model nonconvex(const Variant& p) {
  Model model;
  const Expression a = model.variable(kMin, "a", p.lower_a, p.upper_a);
  const Expression b = model.variable(kMin, "b");
  const Expression c = model.variable(p.owner_of_c, "c", -2.0, 2.0);
  const Expression d = model.variable(kMax, "d", -3.0, 3.0);
  const Expression e = model.variable(kMax, "e");
  const double sign = p.owner_of_c == kMin ? 1.0 : -1.0;
  Expression f = p.weight * (0.25 * pow(a - p.target, 4.0) - 0.5 * square(a) + square(b) +
                             sign * square(c - 0.3) + b * d + a * e - 2.0 * square(e)) +
                 cos(2.0 * d) - square(d);
  if (p.coupled) f += 0.1 * b * e;
  model.objective(f);
  model.constraint(a + b, p.lower_sum, p.upper_sum);
  model.constraint(square(d) + square(e) + 0.1 * a, -kNoBound, p.disc);
  return model;
}

const std::vector<double> kStart = {-0.4, 0.5, 0.1, 0.9, 0.2};

Result solve_fresh(const Variant& variant, const SolverOptions& options) {
  AutodiffProblem problem(nonconvex(variant), kStart);
  return solve(problem, options);
}

Result solve_again(RepeatedSolver& solver, const Variant& variant, const SolverOptions& options) {
  AutodiffProblem problem(nonconvex(variant), kStart);
  return solver.solve(problem, options);
}

void expect_same_answer(const Result& again, const Result& fresh) {
  ASSERT_EQ(again.status, fresh.status) << again.message;
  EXPECT_EQ(again.certificate.kind, fresh.certificate.kind);
  EXPECT_NEAR(again.objective, fresh.objective, 1e-6);
  ASSERT_EQ(again.v.size(), fresh.v.size());
  for (std::size_t i = 0; i < fresh.v.size(); ++i) {
    EXPECT_NEAR(again.v[i], fresh.v[i], 1e-5) << i;
    EXPECT_NEAR(again.z_lower[i], fresh.z_lower[i], 1e-5) << i;
    EXPECT_NEAR(again.z_upper[i], fresh.z_upper[i], 1e-5) << i;
  }
  for (std::size_t j = 0; j < fresh.lambda.size(); ++j) {
    EXPECT_NEAR(again.lambda[j], fresh.lambda[j], 1e-5) << j;
  }
}

TEST(RepeatedSolver, AnalyzesOnce) {
  for (const LinearSolver kind :
       {LinearSolver::Auto, LinearSolver::Ldlt, LinearSolver::Mumps, LinearSolver::Lapack}) {
    SolverOptions options;
    options.linear_solver = kind;
    const Result fresh = solve_fresh({}, options);
    ASSERT_EQ(fresh.status, Status::Solved) << fresh.message;
    EXPECT_EQ(fresh.counts.analyses, 2);
    RepeatedSolver solver;
    const Result first = solve_again(solver, {}, options);
    EXPECT_EQ(first.v, fresh.v) << "the first solve is that of solve()";
    EXPECT_EQ(first.counts.analyses, 2);
    for (int again = 0; again < 3; ++again) {
      const Result result = solve_again(solver, {}, options);
      EXPECT_EQ(result.counts.analyses, 0);
      EXPECT_EQ(result.timing.analysis, 0.0);
      expect_same_answer(result, fresh);
    }
    solver.reset();
    EXPECT_EQ(solve_again(solver, {}, options).counts.analyses, 2);
  }
}

TEST(RepeatedSolver, SeesChangedNumbers) {
  const std::vector<Variant> variants = {{},
                                         {.target = 1.2},
                                         {.weight = 2.0},
                                         {.upper_a = 1.0},
                                         {.lower_a = -5.0},
                                         {.disc = 0.5},
                                         {.upper_sum = 0.2},
                                         {}};
  const SolverOptions options;
  RepeatedSolver solver;
  for (std::size_t k = 0; k < variants.size(); ++k) {
    const Result fresh = solve_fresh(variants[k], options);
    ASSERT_EQ(fresh.status, Status::Solved) << k << ' ' << fresh.message;
    const Result result = solve_again(solver, variants[k], options);
    EXPECT_EQ(result.counts.analyses, k == 0 ? 2 : 0) << k;
    expect_same_answer(result, fresh);
  }
}

TEST(RepeatedSolver, GivesTheBitsOfASolveByItselfWithoutAWarmStart) {
  for (const char* name : {"paper_f3", "rh7", "attack_ball"}) {
    const SmallProblem& known = small_problem(name);
    std::mt19937_64 random(17);
    RepeatedSolver solver;
    for (int k = 0; k < 20; ++k) {
      std::vector<double> start = known.starts[0];
      for (double& x : start) x += std::uniform_real_distribution(-1.5, 1.5)(random);
      AutodiffProblem problem(known.model, start);
      const Result again = solver.solve(problem, {}), fresh = solve(problem, {});
      EXPECT_EQ(again.counts.analyses, k == 0 ? fresh.counts.analyses : 0);
      EXPECT_EQ(again.status, fresh.status) << name << ' ' << k;
      EXPECT_EQ(again.iterations, fresh.iterations) << name << ' ' << k;
      EXPECT_TRUE(again.v == fresh.v) << name << ' ' << k;
      EXPECT_TRUE(again.lambda == fresh.lambda) << name << ' ' << k;
    }
  }
}

TEST(RepeatedSolver, KeepsTheScalingForAWarmStart) {
  Variant steep;
  steep.weight = 400.0;
  SolverOptions options;
  options.warm_start_init_point = true;
  RepeatedSolver solver;
  const Result first = solve_again(solver, steep, options);
  ASSERT_EQ(first.status, Status::Solved) << first.message;
  Result again = solve_again(solver, steep, options);
  // The scaling asks for a gradient without a Hessian, as trial points may.
  const auto gradients_alone = [](const Result& r) { return r.counts.gradient - r.counts.hessian; };
  EXPECT_EQ(gradients_alone(again), gradients_alone(first) - 1);
  expect_same_answer(again, first);
  SolverOptions other = options;
  other.nlp_scaling_max_gradient = 10.0;
  again = solve_again(solver, steep, other);
  EXPECT_EQ(again.counts.analyses, 0) << "the analysis does not depend on the scaling";
  const Result fresh = solve_fresh(steep, other);
  EXPECT_EQ(gradients_alone(again), gradients_alone(fresh));
  expect_same_answer(again, fresh);
}

/// delta_y of every iteration that needed one.
std::vector<double> shifts_of(RepeatedSolver& solver, const SolverOptions& options) {
  std::vector<double> shifts;
  AutodiffProblem problem(nonconvex({}), {-0.4, 0.5, 0.1, 1.5, 0.2});
  SolveObserver observer;
  observer.on_iteration = [&](const IterationInfo& info) {
    if (info.delta_y > 0.0) shifts.push_back(info.delta_y);
    return true;
  };
  EXPECT_EQ(solver.solve(problem, options, observer).status, Status::Solved);
  return shifts;
}

TEST(RepeatedSolver, BeginsAWarmStartWithTheLastShifts) {
  SolverOptions options;
  options.warm_start_init_point = true;
  options.minmax_globalization = Globalization::None;
  RepeatedSolver solver;
  const std::vector<double> first = shifts_of(solver, options);
  ASSERT_FALSE(first.empty());
  const std::vector<double> again = shifts_of(solver, options);
  ASSERT_FALSE(again.empty());
  // A third of the last shift, or that grown by the factor for shifts known from before.
  const double guess = options.perturb_dec_fact * first.back();
  const double growths = std::log(again.front() / guess) / std::log(options.perturb_inc_fact);
  EXPECT_NEAR(growths, std::round(growths), 1e-9) << first.back() << ' ' << again.front();
  EXPECT_NE(again.front(), first.front());
  EXPECT_GE(growths, -1e-9);
  EXPECT_LE(growths, 2.0);

  options.minmax_warm_start_shifts = false;
  const std::vector<double> cold = shifts_of(solver, options);
  EXPECT_EQ(cold, shifts_of(solver, options));
  solver.reset();
  EXPECT_EQ(cold, shifts_of(solver, options));
}

TEST(RepeatedSolver, AnalyzesAnewWhenTheStructureChanges) {
  const std::vector<std::pair<std::string, Variant>> variants = {
      {"a fixed variable", {.lower_a = 0.5, .upper_a = 0.5}},
      {"a bound less", {.upper_a = kNoBound}},
      {"an equality", {.upper_sum = 0.5, .lower_sum = 0.5}},
      {"a range", {.lower_sum = -2.0}},
      {"a constraint without bounds", {.upper_sum = kNoBound}},
      {"another player", {.owner_of_c = kMax}},
      {"an entry more", {.coupled = true}},
  };
  const SolverOptions options;
  RepeatedSolver solver;
  for (const auto& [name, variant] : variants) {
    SCOPED_TRACE(name);
    EXPECT_EQ(solve_again(solver, {}, options).counts.analyses, 2);
    const Result result = solve_again(solver, variant, options);
    EXPECT_EQ(result.counts.analyses, 2);
    const Result fresh = solve_fresh(variant, options);
    EXPECT_EQ(result.status, fresh.status);
    EXPECT_EQ(result.v, fresh.v) << "as if nothing had been solved before";
    EXPECT_EQ(result.iterations, fresh.iterations);
    EXPECT_EQ(solve_again(solver, variant, options).counts.analyses, 0);
  }
}

TEST(RepeatedSolver, SolvesOneProblemAfterTheOther) {
  const SolverOptions options;
  RepeatedSolver solver;
  int analyzed = 0;
  for (const testing::SmallProblem& small : testing::small_problems()) {
    AutodiffProblem problem(small.model, small.starts.front());
    const Result result = solver.solve(problem, options);
    if (result.counts.analyses == 0) continue;  // happens to have the structure of the one before
    ++analyzed;
    const Result fresh = solve(problem, options);
    EXPECT_EQ(result.status, fresh.status) << small.name;
    EXPECT_EQ(result.v, fresh.v) << small.name;
    EXPECT_EQ(result.factorizations, fresh.factorizations) << small.name;
  }
  EXPECT_GT(analyzed, 20);
}

TEST(RepeatedSolver, OptionsOfTheLinearSolverAndFixedVariables) {
  const Variant fixed{.lower_a = 0.5, .upper_a = 0.5};
  SolverOptions options;
  RepeatedSolver solver;
  static_cast<void>(solve_again(solver, fixed, options));
  EXPECT_EQ(solve_again(solver, fixed, options).counts.analyses, 0);
  options.linear_solver = LinearSolver::Mumps;
  EXPECT_EQ(solve_again(solver, fixed, options).counts.analyses, 2);
  options.mumps_pivtol = 1e-3;
  EXPECT_EQ(solve_again(solver, fixed, options).counts.analyses, 2);
  options.fixed_variable_treatment = FixedVariableTreatment::MakeConstraint;
  const Result result = solve_again(solver, fixed, options);
  EXPECT_EQ(result.counts.analyses, 2);
  expect_same_answer(result, solve_fresh(fixed, options));
  options.minmax_ordering = Ordering::Amd;
  EXPECT_EQ(solve_again(solver, fixed, options).counts.analyses, 2);
  options.tol = 1e-6;
  EXPECT_EQ(solve_again(solver, fixed, options).counts.analyses, 0);
}

TEST(RepeatedSolver, AfterABadModel) {
  const SolverOptions options;
  RepeatedSolver solver;
  ASSERT_EQ(solve_again(solver, {}, options).status, Status::Solved);
  EXPECT_EQ(solve_again(solver, {.lower_a = 2.0, .upper_a = 1.0}, options).status,
            Status::InvalidProblem);
  expect_same_answer(solve_again(solver, {}, options), solve_fresh({}, options));
}

TEST(RepeatedSolver, AfterAnException) {
  const SolverOptions options;
  RepeatedSolver solver;
  ASSERT_EQ(solve_again(solver, {}, options).status, Status::Solved);
  AutodiffProblem problem(nonconvex({}), kStart);
  SolveObserver observer;
  observer.on_iteration = [](const IterationInfo& info) -> bool {
    if (info.iteration == 2) throw std::runtime_error("no");
    return true;
  };
  EXPECT_THROW(static_cast<void>(solver.solve(problem, options, observer)), std::runtime_error);
  const Result result = solve_again(solver, {}, options);
  EXPECT_EQ(result.v, solve_fresh({}, options).v);
  EXPECT_EQ(result.counts.analyses, 2);
}

TEST(RepeatedSolver, WithDifferencesInsteadOfSecondDerivatives) {
  SolverOptions options;
  options.hessian_approximation = HessianApproximation::FiniteDifferenceValues;
  RepeatedSolver solver;
  const Result first = solve_again(solver, {}, options);
  ASSERT_EQ(first.status, Status::Solved) << first.message;
  const Result again = solve_again(solver, {}, options);
  EXPECT_EQ(again.counts.analyses, 0);
  expect_same_answer(again, first);
}

}  // namespace
}  // namespace ipminmax
