// Algorithm 1 of the paper (minmax_globalization none) against an independent dense reference, its
// examples, and what the iteration tells.

#include <cmath>
#include <cstdio>
#include <functional>
#include <ostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>
#include <support/dense_algorithm_one.hpp>
#include <support/paper_form.hpp>

#include "core/iteration_map.hpp"
#include "core/kkt/inertia_correction.hpp"
#include "core/kkt/system.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/paper/algorithm_one.hpp"
#include "core/point/point.hpp"
#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::DenseAlgorithmOne;
using testing::Expression;
using testing::kNoBound;
using testing::Model;
using testing::PaperChoices;
using testing::PaperForm;
using testing::PaperPoint;

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

/// As printed, with LAPACK for the factorizations, to compare to the last digits.
SolverOptions printed() {
  SolverOptions options = as_printed();
  options.linear_solver = LinearSolver::Lapack;
  return options;
}

struct Unconstrained {
  Model model;
  Expression x = model.variable(kMin, "x");
  Expression y = model.variable(kMax, "y");
};

Model f1() {
  Unconstrained p;
  p.model.objective(2.0 * square(p.x) - square(p.y) + 4.0 * p.x * p.y + 4.0 / 3.0 * pow(p.y, 3.0) -
                    0.25 * pow(p.y, 4.0));
  return p.model;
}
Model f3() {
  Unconstrained p;
  p.model.objective((p.x - 0.5) * (p.y - 0.5) + exp(-square(p.x - 0.25) - square(p.y - 0.75)));
  return p.model;
}
Model f4() {
  Unconstrained p;
  p.model.objective(p.x * p.y);
  return p.model;
}
/// 0 is no local minmax: K has the right inertia, K_yy has not.
Model example2() {
  Unconstrained p;
  p.model.objective(1.5 * square(p.x) - 4.0 * p.x * p.y + square(p.y));
  return p.model;
}
/// 0 is a local minmax.
Model example3() {
  Unconstrained p;
  p.model.objective(-0.25 * square(p.x) + p.x * p.y - 0.5 * square(p.y));
  return p.model;
}

/// Nonconvex in x, nonconcave in y, bounds of both players in all shapes.
Model with_bounds() {
  Model model;
  const Expression x1 = model.variable(kMin, "x1", -2.0, 2.0);
  const Expression x2 = model.variable(kMin, "x2", -1.0);
  const Expression y1 = model.variable(kMax, "y1", -kNoBound, 3.0);
  const Expression y2 = model.variable(kMax, "y2", -2.0, 2.0);
  model.objective(cos(2.0 * x1) + x1 * y1 - square(y1) + sin(x2) * y2 + 0.5 * square(y2) +
                  0.3 * x2 * square(y2) - 0.1 * pow(y2, 4.0));
  return model;
}
/// Equalities and inequalities of both players, those of Max coupled with x.
Model with_constraints() {
  Model model;
  const Expression x1 = model.variable(kMin, "x1", -3.0, 3.0);
  const Expression x2 = model.variable(kMin, "x2");
  const Expression x3 = model.variable(kMin, "x3");
  const Expression y1 = model.variable(kMax, "y1", -3.0, 3.0);
  const Expression y2 = model.variable(kMax, "y2");
  const Expression y3 = model.variable(kMax, "y3");
  model.objective(-0.5 * square(x1) + x1 * y1 + x2 * y2 + 0.5 * square(x2 - 1.0) + square(x3) +
                  2.0 * square(y1) - square(y2) - 0.5 * square(y3) + sin(x3 * y3));
  model.constraint(x1 + x2 + 0.1 * square(x3), 1.0, 1.0);          // G_x
  model.constraint(square(x1) + square(x3), -kNoBound, 4.0);       // F_x
  model.constraint(y1 + y2 * y3 - 0.5 * x3, 0.5, 0.5);             // G_y
  model.constraint(square(y1) + square(y2) + x2, -kNoBound, 3.0);  // F_y, coupled
  model.constraint(y3 + 0.2 * x1 * x2, -2.0, kNoBound);            // -F_y, coupled
  return model;
}

struct Case {
  std::string name;
  std::function<Model()> model;
  std::vector<double> start;
  int iterations = 60;  ///< compared at most
  bool line7 = true;
  double delta_epsilon = 0.0;
  // What the case shows: at least so many iterations with shifts, by line 7, with frozen shifts.
  int shifted = 1, by_line7 = 0, frozen = 0;
};

std::vector<Case> cases() {
  const std::vector<double> inside = {0.5, 0.7, 0.2, 0.3, 0.4, 0.1};
  const std::vector<double> outside = {-1.5, 0.4, 1.6, 1.2, -0.8, 0.9};
  return {
      {.name = "f1", .model = f1, .start = {0.4, 0.7}, .by_line7 = 1},
      {.name = "f1_far", .model = f1, .start = {-0.9, 1.1}, .by_line7 = 1},
      {.name = "f1_without_line7", .model = f1, .start = {-0.9, 1.1}, .line7 = false},
      {.name = "f3", .model = f3, .start = {1.1, -0.4}, .by_line7 = 1},
      {.name = "f3_far", .model = f3, .start = {-1.7, 1.3}, .by_line7 = 1},
      {.name = "f4", .model = f4, .start = {0.7, -0.3}},
      {.name = "example2",
       .model = example2,
       .start = {1.0, 0.5},
       .iterations = 25,
       .by_line7 = 25},
      {.name = "example2_without_line7", .model = example2, .start = {1.0, 0.5}, .line7 = false},
      {.name = "bounds", .model = with_bounds, .start = {0.3, 0.2, 0.4, 0.6}},
      {.name = "bounds_elsewhere", .model = with_bounds, .start = {-1.2, 1.5, -1.0, -0.7}},
      {.name = "constraints", .model = with_constraints, .start = inside, .iterations = 14},
      {.name = "constraints_violated",
       .model = with_constraints,
       .start = outside,
       .iterations = 14,
       .by_line7 = 1},
      {.name = "freeze", .model = f3, .start = {0.35, 0.65}, .delta_epsilon = 0.2, .shifted = 0},
      {.name = "freeze_shifted",
       .model = example2,
       .start = {1.0, 0.5},
       .line7 = false,
       .delta_epsilon = 1.0,
       .frozen = 10},
      {.name = "freeze_bounds",
       .model = with_bounds,
       .start = {0.3, 0.2, 0.4, 0.6},
       .delta_epsilon = 0.5},
  };
}

class Reference : public ::testing::TestWithParam<Case> {};

/// With the rows that the paper has for bounds of variables.
testing::PaperInertia paper(const Inertia& inertia, Eigen::Index bounds) {
  return {inertia.positive + bounds, inertia.negative + bounds, inertia.zero};
}

TEST_P(Reference, GivesTheSameIterates) {
  const Case& example = GetParam();
  AutodiffProblem problem(example.model(), example.start);
  SolverOptions options = printed();
  options.max_iter = example.iterations;
  options.minmax_instability = example.line7;
  options.minmax_freeze_tol = example.delta_epsilon;

  AutodiffProblem same(example.model(), example.start);
  const PaperForm form(same);
  DenseAlgorithmOne reference(
      form.functions(), form.start(example.start, options.mu_init, options.slack_bound_push),
      options.mu_init, {.delta_epsilon = example.delta_epsilon, .line7 = example.line7});

  // Rounding grows where the iterates are repelled: 1e-15 to 1e-9 within 26 iterations of the
  // longest.
  double largest = 0.0;
  int compared = 0, line7 = 0, shifted = 0, frozen = 0;
  const Eigen::Index max_bounds = form.bounds(kMax);
  const Eigen::Index all_bounds = form.bounds(kMin) + max_bounds;
  const auto near = [&](double a, double b, const std::string& what, Index k) {
    const double difference = std::abs(a - b) / std::max(1.0, std::abs(b));
    largest = std::max(largest, difference);
    EXPECT_LT(difference, 1e-8) << what << ", iteration " << k << ": " << a << ", not " << b;
  };
  const Result result = solve(problem, options, [&](const IterationInfo& info) {
    const Index k = info.iteration;
    if (k > 0) {
      reference.iterate();
      ++compared;
      near(info.mu, reference.b_of_step(), "b", k);
      near(info.delta_x, reference.epsilon_x(), "epsilon_x", k);
      near(info.delta_y, reference.epsilon_y(), "epsilon_y", k);
      near(info.alpha_primal, reference.alpha(), "alpha", k);
      near(info.alpha_dual, reference.alpha(), "alpha of multipliers", k);
      near(info.barrier_error, reference.norm_after_step(), "|g(z, b)|", k);
      if (info.shifts.inner_at_zero) {  // not frozen
        near(info.shifts.line7_mu, reference.line7_mu(), "mu of line 7", k);
        EXPECT_EQ(paper(*info.shifts.inner_at_zero, max_bounds), reference.inner_at_zero()) << k;
      }
      if (info.shifts.full_at_zero) {
        EXPECT_EQ(paper(*info.shifts.full_at_zero, all_bounds), reference.full_at_zero()) << k;
      }
      line7 += info.step_kind == 'i' ? 1 : 0;
      const bool is_shifted = info.delta_x + info.delta_y > 0.0;
      shifted += is_shifted ? 1 : 0;
      frozen += is_shifted && !info.shifts.inner_at_zero ? 1 : 0;
    }
    const std::vector<double> v = form.v(reference.point());
    for (std::size_t i = 0; i < v.size(); ++i) {
      near(info.v[i], v[i], "v[" + std::to_string(i) + "]", k);
    }
    const Result here = info.result();
    const std::vector<double> lambda = form.lambda(reference.point());
    for (std::size_t j = 0; j < lambda.size(); ++j) {
      near(here.lambda[j], lambda[j], "lambda[" + std::to_string(j) + "]", k);
    }
    std::vector<double> lower, upper;
    form.bound_multipliers(reference.point(), lower, upper);
    for (std::size_t i = 0; i < v.size(); ++i) {
      near(here.z_lower[i], lower[i], "z_lower[" + std::to_string(i) + "]", k);
      near(here.z_upper[i], upper[i], "z_upper[" + std::to_string(i) + "]", k);
    }
    return !::testing::Test::HasFailure();
  });
  EXPECT_GE(compared, 2);
  EXPECT_GE(shifted, example.shifted);
  EXPECT_GE(line7, example.by_line7);
  EXPECT_GE(frozen, example.frozen);
  std::printf(
      "%-24s %2d iterations, %2d with shifts, %2d by line 7, %2d frozen, largest difference %.1e, "
      "%s\n",
      example.name.c_str(), compared, shifted, line7, frozen, largest,
      std::string(name_of(result.status)).c_str());
}

void PrintTo(const Case& example, std::ostream* out) { *out << example.name; }

INSTANTIATE_TEST_SUITE_P(AsPrinted, Reference, ::testing::ValuesIn(cases()),
                         [](const auto& test) { return test.param.name; });

// --- What the preset says ------------------------------------------------------------------------

TEST(AsPrinted, KeepsWhatAlgorithm1LeavesOpen) {
  SolverOptions options;
  options.tol = 1e-5;
  options.minmax_freeze_tol = 0.25;
  options.minmax_instability = false;
  const SolverOptions result = as_printed(options);
  EXPECT_EQ(result.minmax_globalization, Globalization::None);
  EXPECT_EQ(result.minmax_barrier_rule, BarrierRule::Paper);
  EXPECT_FALSE(result.minmax_warm_start_shifts);
  EXPECT_EQ(result.tol, 1e-5);
  EXPECT_EQ(result.minmax_freeze_tol, 0.25);
  EXPECT_FALSE(result.minmax_instability);
  EXPECT_EQ(check(result), "");
}

TEST(AsPrinted, MultipliersOfInequalitiesStartAtThoseOfTheirSlacks) {
  AutodiffProblem problem(with_constraints(), {0.5, 0.7, 0.2, 0.3, 0.4, 0.1});
  const Result result = solve(problem, as_printed(), [](const IterationInfo&) { return false; });
  // b / s: Min's upper bound positive, Max's negative; 4 - 0.29, 3 - 0.95, 2 + 0.17
  EXPECT_EQ(result.lambda[0], 0.0);
  EXPECT_NEAR(result.lambda[1], 0.1 / 3.71, 1e-14);
  EXPECT_EQ(result.lambda[2], 0.0);
  EXPECT_NEAR(result.lambda[3], -0.1 / 2.05, 1e-14);
  EXPECT_NEAR(result.lambda[4], 0.1 / 2.17, 1e-14);
}

TEST(AsPrinted, DependentConstraintsEndTheSolve) {
  // Without a shift of multiplier rows there is no way on; it must not be looked for for ever.
  Model model;
  const Expression x1 = model.variable(kMin, "x1");
  const Expression x2 = model.variable(kMin, "x2");
  const Expression x3 = model.variable(kMin, "x3");
  const Expression y = model.variable(kMax, "y");
  model.objective(square(x1) + square(x2) + square(x3) - square(y));
  model.constraint(x1 + x2, 1.0, 1.0);
  model.constraint(2.0 * x1 + 2.0 * x2, 2.0, 2.0);
  AutodiffProblem problem(model, {0.0, 0.5, 0.3, 0.2});
  EXPECT_EQ(solve(problem, as_printed()).status, Status::InertiaCorrectionFailed);
  SolverOptions with_multiplier_shift = as_printed();
  with_multiplier_shift.jacobian_regularization_value = 1e-8;
  EXPECT_TRUE(is_success(solve(problem, with_multiplier_shift).status));
}

TEST(BarrierRule, OfThePaperWaitsForAStep) {
  // The start is the centre for b = 0.1, so |g(z, b)| <= b before any step; b falls after the
  // first.
  Model model;
  const Expression x = model.variable(kMin, "x", 0.0);
  model.objective(1.0 * x);
  AutodiffProblem problem(model, {0.1});
  std::vector<double> b;
  static_cast<void>(solve(problem, as_printed(), [&](const IterationInfo& info) {
    b.push_back(info.mu);
    return info.iteration < 2;
  }));
  ASSERT_EQ(b.size(), 3U);
  EXPECT_EQ(b[1], 0.1);
  EXPECT_NEAR(b[2], 0.02, 1e-15);
}

// --- Example 1: min x^3 - 3x, minimum at 1, maximum at -1 ----------------------------------------

AutodiffProblem cubic(double start) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  model.objective(pow(x, 3.0) - 3.0 * x);
  return AutodiffProblem(model, {start});
}

TEST(PaperExample1, FromAboveTheMaximumAlgorithm1GoesToTheMinimum) {
  for (const double start : {-0.999, -0.5, 0.0, 0.3, 2.0}) {
    AutodiffProblem problem = cubic(start);
    const Result result = solve(problem, printed());
    EXPECT_EQ(result.status, Status::Solved) << start;
    EXPECT_NEAR(result.v[0], 1.0, 1e-7);
  }
}

TEST(PaperExample1, FromBelowTheMaximumAlgorithm1GoesToMinusInfinity) {
  AutodiffProblem problem = cubic(-1.5);
  SolverOptions options = printed();
  options.max_iter = 100;
  double last = -1.5;
  bool monotone = true;
  const Result result = solve(problem, options, [&](const IterationInfo& info) {
    monotone = monotone && info.v[0] <= last;
    last = info.v[0];
    return true;
  });
  EXPECT_TRUE(monotone);
  EXPECT_LT(result.v[0], -1e10);
  EXPECT_FALSE(is_success(result.status));
}

TEST(PaperExample1, PureNewtonGoesToTheSideOfZeroItStartsOn) {
  SolverOptions options = printed();
  options.minmax_pure_newton = true;
  for (const double start : {0.01, 0.5, 3.0, -0.01, -0.5, -3.0}) {
    AutodiffProblem problem = cubic(start);
    const Result result = solve(problem, options);
    EXPECT_NEAR(result.v[0], start > 0.0 ? 1.0 : -1.0, 1e-7) << start;
    EXPECT_EQ(result.status, start > 0.0 ? Status::Solved : Status::NotLocalMinmax) << start;
  }
}

TEST(PaperExample1, PureNewtonFailsAtZeroWhereTheHessianIsSingular) {
  AutodiffProblem problem = cubic(0.0);
  SolverOptions options = printed();
  options.minmax_pure_newton = true;
  const Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::InertiaCorrectionFailed);
  EXPECT_NE(result.message.find("singular"), std::string::npos) << result.message;
}

TEST(PaperExample1, AtTheMaximumAlgorithm1StaysForEver) {
  AutodiffProblem problem = cubic(-1.0);
  SolverOptions options = printed();
  options.minmax_prescribed_delta_x = 7.0;  // more than 6, so that K + E > 0
  options.minmax_prescribed_delta_y = 0.0;
  Counts counts;
  Timing timing;
  CanonicalProblem canonical(problem, options, counts, timing);
  ASSERT_EQ(canonical.build(), "");
  KktSystem kkt(canonical, options, counts, timing);
  ASSERT_TRUE(kkt.analyze());
  InertiaCorrection correction(kkt, options, counts);
  Budget shared(options);
  SolveLimit limit(shared, options.max_iter);
  AlgorithmOne algorithm({.canonical_ = canonical,
                          .kkt_ = kkt,
                          .correction_ = correction,
                          .options_ = options,
                          .limit_ = limit,
                          .counts_ = counts});
  Point point = unevaluated_point(canonical, canonical.starting_point());
  Point next = point;
  ASSERT_TRUE(evaluate_derivatives(canonical, point));
  for (int k = 0; k < 100; ++k) {
    const StepReport report = algorithm.step(point, 0.1, next);
    ASSERT_TRUE(report.moved && !report.failure);
    ASSERT_EQ(report.delta_x, 7.0);
    std::swap(point, next);
    ASSERT_EQ(point.iterate.v[0], -1.0) << k;
  }
  // An unstable equilibrium: the slightest push and it leaves, and the solver does not believe it.
  EXPECT_EQ(solve(problem, printed()).status, Status::NotLocalMinmax);
  AutodiffProblem pushed = cubic(-1.0 + 1e-12);
  SolverOptions strict = printed();
  strict.tol = 1e-13;
  EXPECT_NEAR(solve(pushed, strict).v[0], 1.0, 1e-7);
}

// --- Examples 2 and 3 with the paper's shifts ----------------------------------------------------

SolverOptions with_shifts(double x, double y) {
  SolverOptions options = printed();
  options.minmax_prescribed_delta_x = x;
  options.minmax_prescribed_delta_y = y;
  options.max_iter = 100;
  return options;
}

TEST(PrescribedShifts, Example2IsAttractedByAPointThatIsNoLocalMinmax) {
  AutodiffProblem problem(example2(), {1.0, 0.5});
  const Result result = solve(problem, with_shifts(0.0, 4.0), [](const IterationInfo& info) {
    EXPECT_TRUE(info.iteration == 0 || (info.delta_x == 0.0 && info.delta_y == 4.0));
    return true;
  });
  EXPECT_EQ(result.status, Status::NotLocalMinmax);
  EXPECT_NEAR(result.v[0], 0.0, 1e-6);
  const IterationMap map = iteration_map(problem, result, with_shifts(0.0, 4.0));
  ASSERT_EQ(map.error, "");
  ASSERT_EQ(map.eigenvalues.size(), 2U);
  EXPECT_NEAR(std::abs(map.eigenvalues[0] - 6.0 / 11.0), 0.0, 1e-12);  // the paper's 0.54
  EXPECT_NEAR(std::abs(map.eigenvalues[1]), 0.0, 1e-12);
  EXPECT_EQ(map.full, map.full_expected);
  EXPECT_NE(map.inner, map.inner_expected);
}

TEST(PrescribedShifts, Example3IsRepelledByALocalMinmax) {
  // epsilon_x = 0.3 as in the paper's matrix (its text says 0.2).
  AutodiffProblem problem(example3(), {1e-3, 1e-3});
  const SolverOptions options = with_shifts(0.3, 3.0);
  const Result result = solve(problem, options);
  EXPECT_FALSE(is_success(result.status));
  EXPECT_GT(std::hypot(result.v[0], result.v[1]), 1e6);
  Result at = result;
  at.v = {0.0, 0.0};
  const IterationMap map = iteration_map(problem, at, options);
  ASSERT_EQ(map.error, "");
  EXPECT_NEAR(map.eigenvalues[0].real(), 1.5, 1e-12);
  EXPECT_NEAR(std::abs(map.eigenvalues[0].imag()), 1.5, 1e-12);
  EXPECT_EQ(map.full, map.full_expected);
  EXPECT_EQ(map.inner, map.inner_expected);
  // What Algorithm 1 chooses there: no shift, and Newton's method.
  const IterationMap chosen = iteration_map(problem, at, printed());
  EXPECT_EQ(chosen.delta_x, 0.0);
  EXPECT_EQ(chosen.spectral_radius, 0.0);
}

TEST(PrescribedShifts, GoTogetherAndWithAlgorithm1) {
  SolverOptions options = printed();
  options.minmax_prescribed_delta_x = 1.0;
  EXPECT_NE(check(options), "");
  options.minmax_prescribed_delta_y = 0.0;
  EXPECT_EQ(check(options), "");
  options.minmax_globalization = Globalization::Filter;
  EXPECT_NE(check(options), "");
}

// --- The freeze neighbourhood --------------------------------------------------------------------

TEST(FreezeTolerance, LeadsToAPointThatIsNoLocalMinmaxAndIsWarnedOf) {
  SolverOptions options = printed();
  std::vector<std::string> messages;
  const SolveObserver observer{
      .on_iteration = {}, .message = [&](std::string_view text) { messages.emplace_back(text); }};

  AutodiffProblem problem(f3(), {0.35, 0.65});
  options.minmax_freeze_tol = 0.2;
  options.max_iter = 500;
  const Result frozen = solve(problem, options, observer);
  EXPECT_EQ(frozen.status, Status::NotLocalMinmax);
  ASSERT_FALSE(messages.empty());
  EXPECT_NE(messages.front().find("minmax_freeze_tol"), std::string::npos);

  messages.clear();
  options.minmax_freeze_tol = 0.0;
  const Result free = solve(problem, options, observer);
  EXPECT_NE(free.status, Status::NotLocalMinmax);
  EXPECT_TRUE(messages.empty());
}

// --- Line 7 --------------------------------------------------------------------------------------

TEST(Line7, MakesTheWrongPointRepel) {
  AutodiffProblem problem(example2(), {1.0, 0.5});
  Result at;
  at.v = {0.0, 0.0};
  at.z_lower = at.z_upper = at.v;
  at.mu = 0.1;
  SolverOptions options = printed();
  const IterationMap map = iteration_map(problem, at, options);
  ASSERT_EQ(map.error, "");
  EXPECT_GT(map.spectral_radius, 1.0);
  options.minmax_instability = false;
  EXPECT_LT(iteration_map(problem, at, options).spectral_radius, 1.0);
}

// --- mu_target -----------------------------------------------------------------------------------

/// min over x in [0, 4], max over y in [-1, 1] of x^2 + x y - 2 y^2 - y.
Model boxed() {
  Model model;
  const Expression x = model.variable(kMin, "x", 0.0, 4.0);
  const Expression y = model.variable(kMax, "y", -1.0, 1.0);
  model.objective(square(x) + x * y - 2.0 * square(y) - y);
  return model;
}

TEST(MuTarget, EndsOnTheCentralPathAndCallsItSuccess) {
  for (const Globalization globalization : {Globalization::None, Globalization::Filter}) {
    for (const double target : {0.5, 0.1, 1e-3}) {
      AutodiffProblem problem(boxed(), {1.0, 0.0});
      SolverOptions options;
      options.minmax_globalization = globalization;
      options.mu_target = target;
      options.kappa_d = 0.0;
      options.bound_relax_factor = 0.0;
      const Result result = solve(problem, options);
      ASSERT_EQ(result.status, Status::Solved) << target << ": " << result.message;
      EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax);
      EXPECT_EQ(result.mu, target);
      const double x = result.v[0], y = result.v[1];
      EXPECT_NEAR(2.0 * x + y - target / x + target / (4.0 - x), 0.0, 1e-7);
      EXPECT_NEAR(x - 4.0 * y - 1.0 + target / (y + 1.0) - target / (1.0 - y), 0.0, 1e-7);
      EXPECT_NEAR(result.z_lower[0] * x, target, 1e-7);
      EXPECT_LT(result.error.complementarity, 1e-7);
    }
  }
}

TEST(MuTarget, RefusesACentreThatIsNoLocalMinmax) {
  // f = -x^2 / 2 in [-1, 1] with b = 0.1: 0 is a centre, where the barrier's curvature 2 b is too
  // small; with b = 1 it is large enough and 0 is a minimum.
  Model model;
  const Expression x = model.variable(kMin, "x", -1.0, 1.0);
  model.objective(-0.5 * square(x));
  AutodiffProblem problem(model, {0.0});
  SolverOptions options;
  options.minmax_globalization = Globalization::None;
  options.mu_target = 0.1;
  for (const LinearSolver solver :
       {LinearSolver::Auto, LinearSolver::Mumps, LinearSolver::Lapack}) {
    options.linear_solver = solver;
    const Result at_centre = solve(problem, options);
    EXPECT_EQ(at_centre.status, Status::NotLocalMinmax);
    EXPECT_EQ(at_centre.certificate.second_order, SecondOrder::Violated);
  }
  // A wrong sign is not taken from factors without pivoting.
  options.linear_solver = LinearSolver::Ldlt;
  EXPECT_EQ(solve(problem, options).certificate.second_order, SecondOrder::Undecided);
  options.linear_solver = LinearSolver::Auto;
  options.mu_init = options.mu_target = 1.0;
  EXPECT_EQ(solve(problem, options).status, Status::Solved);
}

// --- What a callback sees ------------------------------------------------------------------------

TEST(ShiftFindings, TellBothInertiasAtZeroAndWithTheShifts) {
  AutodiffProblem problem(example2(), {1.0, 0.5});
  static_cast<void>(solve(problem, printed(), [](const IterationInfo& info) {
    if (info.iteration == 0) {
      EXPECT_FALSE(info.shifts.inner_at_zero || info.shifts.full || info.shifts.line7_mu != 0.0);
      EXPECT_NEAR(info.barrier_error, std::max(3.0 * 1.0 - 4.0 * 0.5, std::abs(2.0 * 0.5 - 4.0)),
                  1e-12);
      return true;
    }
    EXPECT_EQ(info.shifts.inner_at_zero, (Inertia{1, 0, 0}));
    EXPECT_EQ(info.shifts.full_at_zero, (Inertia{1, 1, 0}));
    EXPECT_EQ(info.shifts.inner, (Inertia{0, 1, 0}));
    EXPECT_EQ(info.shifts.full, (Inertia{1, 1, 0}));
    EXPECT_GT(info.shifts.line7_mu, 0.0);
    EXPECT_LT(info.shifts.line7_mu, 1.0);
    return info.iteration < 3;
  }));
}

}  // namespace
}  // namespace ipminmax
