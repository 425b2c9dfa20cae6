// Semi-infinite programs, min f(x) with g(x, t) <= 0 for every t, by solve_robust: no t violates the
// answer, and the relaxation to a fine grid of t, whose optimum is a lower bound, is no better.
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>

#include "core/robust.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;

using Row = std::function<Expression(const std::vector<Expression>& x, const Expression& t)>;
using Objective = std::function<Expression(const std::vector<Expression>& x)>;

struct SemiInfinite {
  std::string name;
  std::vector<double> start;
  Objective objective;
  Row row;  ///< <= 0 for t in [lower, upper]
  double lower = 0.0, upper = 1.0;
  double optimum = std::nan("");  ///< as published, to 1e-4
  /// The worst t stands at a bound without a slope there: no strict complementarity.
  bool weakly_active = false;
};

void PrintTo(const SemiInfinite& problem, std::ostream* out) { *out << problem.name; }

Expression power(const Expression& t, int k) {
  Expression product = 1.0 * t;
  for (int i = 1; i < k; ++i) product = product * t;
  return product;
}

Expression polynomial(const std::vector<Expression>& x, const Expression& t) {
  Expression sum = 1.0 * x[0];
  for (std::size_t k = 1; k < x.size(); ++k) sum = sum + x[k] * power(t, static_cast<int>(k));
  return sum;
}

std::vector<SemiInfinite> problems() {
  using X = const std::vector<Expression>&;
  using T = const Expression&;
  return {
      {"coope_watson_1",
       {-0.5, -0.5},
       [](X x) { return (1.0 / 3.0) * square(x[0]) + square(x[1]) + 0.5 * x[0]; },
       [](X x, T t) {
         return square(1.0 - square(x[0]) * square(t)) - x[0] * square(t) - square(x[1]) + x[1];
       },
       0.0,
       1.0,
       0.194466,
       true},
      {"coope_watson_2",
       {1.0, 1.0, 1.0},
       [](X x) { return square(x[0]) + square(x[1]) + square(x[2]); },
       [](X x, T t) { return x[0] + x[1] * exp(x[2] * t) + exp(2.0 * t) - 2.0 * sin(4.0 * t); },
       0.0,
       1.0,
       5.334687},
      {"coope_watson_3",
       {1.0, 0.5, 0.0},
       [](X x) { return exp(x[0]) + exp(x[1]) + exp(x[2]); },
       [](X x, T t) { return 1.0 / (1.0 + square(t)) - x[0] - x[1] * t - x[2] * square(t); },
       0.0,
       1.0,
       4.301183},
      {"two_polynomials",
       {1.0, 1.0},
       [](X x) {
         return square(x[0] - 2.0 * x[1] + 5.0 * square(x[1]) - x[1] * square(x[1]) - 13.0) +
                square(x[0] - 14.0 * x[1] + square(x[1]) + x[1] * square(x[1]) - 29.0);
       },
       [](X x, T t) { return square(x[0]) + 2.0 * x[1] * square(t) + exp(x[0] + x[1]) - exp(t); },
       0.0,
       1.0,
       97.158852},
      {"tangent_from_above",
       {2.0, 0.0, 0.0},
       [](X x) { return x[0] + 0.5 * x[1] + x[2] * (1.0 / 3.0); },
       [](X x, T t) { return sin(t) / cos(t) - polynomial(x, t); },
       0.0,
       1.0,
       0.649042},
      {"exponential_from_above",
       {3.0, 0.0, 0.0},
       [](X x) { return x[0] + 0.5 * x[1] + x[2] * (1.0 / 3.0); },
       [](X x, T t) { return exp(t) - polynomial(x, t); },
       0.0,
       1.0},
      {"disc_around_a_curve",  // least circle radius^2 x2 around (cos 3t, t) t in [-1, 1]
       {0.0, 0.0, 4.0},
       [](X x) { return 1.0 * x[2]; },
       [](X x, T t) { return square(cos(3.0 * t) - x[0]) + square(t - x[1]) - x[2]; },
       -1.0,
       1.0},
  };
}

class SemiInfinitePrograms : public ::testing::TestWithParam<SemiInfinite> {};

double violation(const SemiInfinite& p, const std::vector<double>& v, double t) {
  Model model;
  std::vector<Expression> x;
  for (std::size_t i = 0; i < p.start.size(); ++i)
    x.push_back(model.variable(Player::Min, "x" + std::to_string(i)));
  const Expression parameter = model.variable(Player::Max, "t");
  model.objective(p.objective(x));
  model.constraint(p.row(x, parameter), -kNoBound, 0.0, Player::Min);
  AutodiffProblem problem(model);
  std::vector<double> point(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(x.size()));
  point.push_back(t);
  std::vector<double> g(1);
  EXPECT_TRUE(problem.constraints(point, true, g));
  return g[0];
}

/// Optimum with the constraint at 401 values of t only, from the answer.
double grid_optimum(const SemiInfinite& p, const std::vector<double>& v) {
  constexpr int kPoints = 401;
  Model model;
  std::vector<Expression> x;
  for (std::size_t i = 0; i < p.start.size(); ++i)
    x.push_back(model.variable(Player::Min, "x" + std::to_string(i)));
  model.objective(p.objective(x));
  for (int k = 0; k < kPoints; ++k) {
    const double t = p.lower + (p.upper - p.lower) * k / (kPoints - 1.0);
    model.constraint(p.row(x, 0.0 * x[0] + t), -kNoBound, 0.0, Player::Min);
  }
  AutodiffProblem problem(model, {v.begin(), v.begin() + static_cast<std::ptrdiff_t>(x.size())});
  const Result result = solve(problem, {});
  EXPECT_TRUE(is_success(result.status)) << result.message;
  return result.objective;
}

TEST_P(SemiInfinitePrograms, AreSolved) {
  const SemiInfinite& p = GetParam();
  Model model;
  std::vector<Expression> x;
  for (std::size_t i = 0; i < p.start.size(); ++i)
    x.push_back(model.variable(Player::Min, "x" + std::to_string(i)));
  const Expression t = model.variable(Player::Max, "t", p.lower, p.upper);
  model.objective(p.objective(x));
  model.constraint(p.row(x, t), -kNoBound, 0.0, Player::Min);
  std::vector<double> start = p.start;
  start.push_back(0.5 * (p.lower + p.upper));
  AutodiffProblem problem(model, start);
  SolverOptions options;
  options.minmax_worst_case_starts = 20;
  const RobustResult answer = solve_robust(problem, options);
  const Result& result = answer.result;
  EXPECT_TRUE(is_success(result.status)) << result.message;
  if (!p.weakly_active) {
    EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax) << result.message;
  }
  EXPECT_LE(answer.largest_violation, 1e-6);
  if (!std::isnan(p.optimum)) {
    EXPECT_NEAR(result.objective, p.optimum, 1e-4 * std::max(1.0, std::abs(p.optimum)));
  }
  EXPECT_EQ(result.v.size(), start.size());
  const double relaxed = grid_optimum(p, result.v);
  EXPECT_GE(result.objective, relaxed - 1e-6 * std::max(1.0, std::abs(relaxed)));
  EXPECT_LE(result.objective, relaxed + 1e-3 * std::max(1.0, std::abs(relaxed)));

  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(p.lower, p.upper);
  double worst = -1e300;
  for (int k = 0; k < 10000; ++k) worst = std::max(worst, violation(p, result.v, uniform(random)));
  EXPECT_LE(worst, 1e-6);
  std::printf("%-24s f = %.7f, %zu worst cases, %d solves, %d maximizations, violation %.1e\n",
              p.name.c_str(), result.objective, answer.worst_cases.size(), answer.solves,
              answer.maximizations, answer.largest_violation);
}

INSTANTIATE_TEST_SUITE_P(Problems, SemiInfinitePrograms, ::testing::ValuesIn(problems()),
                         [](const auto& problem) { return problem.param.name; });

TEST(RobustCopies, SharedYGetsACopyPerConstraint) {
  // f reads y as well: (x - 3)^2 - (y - x)^2 / 10, and x + y <= 2, x - y <= 2 for y in [-1, 1].
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y", -1.0, 1.0);
  model.objective(square(x - 3.0) - 0.1 * square(y - 0.1 * x));
  model.constraint(x + y, -kNoBound, 2.0, Player::Min);
  model.constraint(x - 0.5 * y, -kNoBound, 2.0, Player::Min);
  AutodiffProblem problem(model, {0.0, 0.2});
  const RobustResult answer = solve_robust(problem, {});
  EXPECT_TRUE(is_success(answer.result.status)) << answer.result.message;
  EXPECT_NEAR(answer.result.v[0], 1.0, 1e-6);
  EXPECT_NEAR(answer.result.v[1], 0.1, 1e-5) << "f's own y";
  ASSERT_EQ(answer.worst_cases.size(), 2U);
  EXPECT_NEAR(answer.worst_cases[0].v[1], 1.0, 1e-6);
  EXPECT_NEAR(answer.worst_cases[0].multiplier, answer.result.lambda[0], 1e-12);
  EXPECT_GT(answer.worst_cases[0].multiplier, 1.0);
  EXPECT_EQ(answer.solves, 1);
}

TEST(RobustCopies, EpigraphSolvesTheKink) {
  // phi(x) = max_y -(y^2 - 1)^2 + x y + .1 x^2 + .3 x^3 = |x| + ...: least at its kink 0.
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y", -2.0, 2.0);
  model.objective(-square(square(y) - 1.0) + x * y + 0.1 * square(x) + 0.3 * x * square(x));
  AutodiffProblem problem(model, {0.3, 0.8});
  SolverOptions options;
  options.minmax_epigraph = true;
  options.minmax_worst_case_starts = 10;
  const RobustResult answer = solve_robust(problem, options);
  EXPECT_EQ(answer.result.certificate.kind, PointKind::LocalMinmax) << answer.result.message;
  ASSERT_EQ(answer.result.v.size(), 2U);
  EXPECT_NEAR(answer.result.v[0], 0.0, 1e-6);
  EXPECT_NEAR(answer.result.objective, 0.0, 1e-6);
  ASSERT_EQ(answer.worst_cases.size(), 2U);
  EXPECT_NEAR(answer.worst_cases[0].value, 0.0, 1e-6);
  EXPECT_NEAR(answer.worst_cases[0].multiplier + answer.worst_cases[1].multiplier, 1.0, 1e-6);
  EXPECT_LT(answer.worst_cases[0].v[1] * answer.worst_cases[1].v[1], 0.0);
}

TEST(RobustCopies, BrokenModelsAreNamed) {
  class Broken final : public AutodiffProblem {
   public:
    using AutodiffProblem::AutodiffProblem;
    [[nodiscard]] const ProblemStructure& structure() const override { return broken; }
    ProblemStructure broken;
  };
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y");
  model.objective(square(x) - square(y));
  model.constraint(x + y, -kNoBound, 1.0, Player::Min);
  Broken problem(model, {0.0, 0.0});
  problem.broken = problem.AutodiffProblem::structure();
  problem.broken.jacobian.push_back({7, 0});
  EXPECT_FALSE(has_robust_constraints(problem.broken));
  const RobustResult answer = solve_robust(problem, {});
  EXPECT_EQ(answer.result.status, Status::InvalidProblem);
}

}  // namespace
}  // namespace ipminmax
