// Minimizations from the literature, written anew, that ask for more than the line search: a
// certain inertia in each iteration, full steps that do not improve at once, a filter that forgets.
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

constexpr double kInf = kNoBound;

struct Known {
  Model model{};
  std::vector<double> start;
  double objective = 0.0;
  Index iterations = 0;  ///< that suffice
};

Expression free_variable(Model& model) { return model.variable(Player::Min, ""); }

/// a + b exp(i c) = value_i, the equations alone (Optima manual, Hatfield Polytechnic, 1989).
Known exponential_equations() {
  Known known{.start = {0.1, 0.1, 0.1}, .iterations = 500};
  const Expression a = free_variable(known.model);
  const Expression b = free_variable(known.model);
  const Expression c = free_variable(known.model);
  known.model.objective(0.0 * a);
  double i = 0.0;
  for (const double value : {0.032, 0.056, 0.099}) {
    known.model.constraint(a + b * exp(++i * c), value, value);
  }
  return known;
}

/// Dimensions of a continuous caster with the largest throughput (Vasko and Stott, SIAM Review 37,
/// 1995).
Known continuous_caster() {
  Known known{.start = std::vector<double>(5, 0.5), .objective = -49.0752, .iterations = 100};
  Model& model = known.model;
  const Expression thick = model.variable(Player::Min, "thick", 7.0);
  const Expression wide = model.variable(Player::Min, "wide", 0.0);
  const Expression length = model.variable(Player::Min, "length", 0.0, 60.0);
  const Expression tons = model.variable(Player::Min, "tons", 0.0);
  const Expression speed = model.variable(Player::Min, "speed", 0.0);
  model.objective(-tons);
  model.constraint(117.370892 * tons / (wide * thick) - speed, 0.0, 0.0);
  model.constraint(square(thick) * speed / 48.0 - length, 0.0, 0.0);
  model.constraint(wide / thick, -kInf, 2.0);
  model.constraint(thick * wide, 200.0, 250.0);
  return known;
}

/// Rational approximation of exp on [0, 5] from above (Powell), least squares of relative errors.
Known one_sided_exponential_fit() {
  constexpr int kPoints = 51;
  Known known{.start = {1.0, 1.0, 6.0, 0.0, 0.0}, .objective = 0.00501951, .iterations = 100};
  Model& model = known.model;
  const Expression p0 = free_variable(model);
  const Expression p1 = free_variable(model);
  const Expression p2 = free_variable(model);
  const Expression q1 = free_variable(model);
  const Expression q2 = free_variable(model);
  Expression sum = 0.0;
  for (int i = 0; i < kPoints; ++i) {
    const double t = 5.0 * i / (kPoints - 1);
    const Expression above = p0 + t * p1 + t * t * p2;
    const Expression below = 1.0 + (t - 5.0) * q1 + (t - 5.0) * (t - 5.0) * q2;
    sum += square(above / (std::exp(t) * below) - 1.0);
    model.constraint(
        above - std::exp(t) * (t - 5.0) * q1 - std::exp(t) * (t - 5.0) * (t - 5.0) * q2,
        std::exp(t), kInf);
    model.constraint(below, 0.0, kInf);
  }
  model.objective(sum);
  return known;
}

/// The least eigenvalue d of diag(1, ..., n) as A q = d q, |q| = 1, all variables in [-1, 1].
Known least_eigenvalue() {
  constexpr int kSize = 50;
  Known known{.start = std::vector<double>(kSize + 1, 1.0 / std::sqrt(kSize)),
              .objective = 1.0,
              .iterations = 200};
  known.start[0] = 1.0;
  Model& model = known.model;
  const Expression d = model.variable(Player::Min, "d", -1.0, 1.0);
  model.objective(d);
  Expression norm = 0.0;
  for (int i = 1; i <= kSize; ++i) {
    const Expression q = model.variable(Player::Min, "", -1.0, 1.0);
    norm += square(q);
    model.constraint(q * d - static_cast<double>(i) * q, 0.0, 0.0);
  }
  model.constraint(norm, 1.0, 1.0);
  return known;
}

/// Space velocity of a stirred tank in which van de Vusse's reactions A -> B -> C, 2 A -> D give the
/// most B, from concentrations far above those of a feed as thin as this.
Known stirred_tank() {
  constexpr double kFeed = 1000.0, kToB = 5.0 / 6.0, kToC = 5.0 / 3.0, kToD = 1.0 / 6000.0;
  Known known{
      .start = {1.0, 5000.0, 2000.0, 2000.0, 1000.0}, .objective = -157.56368, .iterations = 80};
  Model& model = known.model;
  const Expression velocity = model.variable(Player::Min, "velocity", 0.0);
  const Expression a = model.variable(Player::Min, "a", 0.0);
  const Expression b = model.variable(Player::Min, "b", 0.0);
  const Expression c = model.variable(Player::Min, "c", 0.0);
  const Expression d = model.variable(Player::Min, "d", 0.0);
  model.objective(-b);
  model.constraint(velocity * kFeed - velocity * a - kToB * a - 2.0 * kToD * square(a), 0.0, 0.0);
  model.constraint(-velocity * b + kToB * a - kToC * b, 0.0, 0.0);
  model.constraint(-velocity * c + kToC * b, 0.0, 0.0);
  model.constraint(-velocity * d + kToD * square(a), 0.0, 0.0);
  return known;
}

/// Rates of an epidemic from reported cases, which are rounded here:
/// I_{k+1} = beta S_k I_k^alpha / people, S_{k+1} = S_k - I_{k+1}, least squares of what I misses.
Known epidemic() {
  constexpr int kWeeks = 26;
  constexpr double kPeople = 300.0, kBeta = 2.3, kAlpha = 0.97;
  Known known{.start = {0.05, 0.5}, .objective = 0.52977975, .iterations = 120};
  Model& model = known.model;
  const Expression beta = model.variable(Player::Min, "beta", 0.05, 70.0);
  const Expression alpha = model.variable(Player::Min, "alpha", 0.5, 1.5);
  double cases = 1.0, healthy = kPeople - 1.0;
  Expression sum = 0.0, infected = 0.0, susceptible = 0.0;
  for (int k = 0; k < kWeeks; ++k) {
    const Expression i = model.variable(Player::Min, "", 0.0, kPeople);
    const Expression s = model.variable(Player::Min, "", 0.0, kPeople);
    known.start.insert(known.start.end(), {1.0, kPeople});
    if (k > 0) {
      model.constraint(i - beta * susceptible * exp(alpha * log(infected)) / kPeople, 0.0, 0.0);
      model.constraint(s - susceptible + i, 0.0, 0.0);
      cases = kBeta * healthy * std::pow(cases, kAlpha) / kPeople;
      healthy -= cases;
    }
    sum += square(i - std::round(cases));
    infected = i;
    susceptible = s;
  }
  model.objective(sum);
  return known;
}

void expect_solved(const Known& known) {
  AutodiffProblem problem(known.model, known.start);
  const Result result = solve(problem, SolverOptions{});
  EXPECT_TRUE(is_success(result.status)) << name_of(result.status);
  EXPECT_LE(result.error.primal, 2e-6);  // bounds are relaxed
  EXPECT_NEAR(result.objective, known.objective, 1e-5 * (1.0 + std::abs(known.objective)));
  EXPECT_LE(result.iterations, known.iterations);
}

TEST(RobustMinimization, EquationsWithExponentials) { expect_solved(exponential_equations()); }
TEST(RobustMinimization, ContinuousCaster) { expect_solved(continuous_caster()); }
TEST(RobustMinimization, OneSidedExponentialFit) { expect_solved(one_sided_exponential_fit()); }
TEST(RobustMinimization, LeastEigenvalue) { expect_solved(least_eigenvalue()); }
TEST(RobustMinimization, StirredTank) { expect_solved(stirred_tank()); }
TEST(RobustMinimization, Epidemic) { expect_solved(epidemic()); }

// x1^2 + x2^2 >= 1 is the least value. Where it is taken both gradients are parallel: their
// multipliers may be anything, and a Lagrangian that falls off the constraints refutes nothing.
TEST(RobustMinimization, DependentGradientsRefuteNoMinimum) {
  Model model;
  std::vector<Expression> x;
  for (int i = 0; i < 5; ++i) x.push_back(free_variable(model));
  model.objective(square(x[0]) + square(x[1]) + square(x[2]));
  model.constraint(x[0] - square(x[3]) + square(x[1]), 1.0, 1.0);
  model.constraint(square(x[0]) + square(x[1]) - square(x[4]), 1.0, 1.0);
  AutodiffProblem problem(model, {1.0, 1.0, 1.0, 0.0, 0.0});
  const Result result = solve(problem, SolverOptions{});
  EXPECT_TRUE(is_success(result.status)) << name_of(result.status);
  EXPECT_NE(result.certificate.second_order, SecondOrder::Violated);
  EXPECT_NEAR(result.objective, 1.0, 1e-6);
}

// Without a gradient of the objective multipliers are zero, however they came about on the way.
TEST(RobustMinimization, FeasiblePointsWithoutObjectiveAreOptimal) {
  Model model;
  const Expression x = model.variable(Player::Min, "x", 0.0);
  const Expression y = model.variable(Player::Min, "y", 0.0);
  model.objective(0.0 * x);
  model.constraint(x * y, 1.0, 1.0);
  model.constraint(square(x) + y, -kInf, 2.0);
  AutodiffProblem problem(model, {0.1, 4.0});
  const Result result = solve(problem, SolverOptions{});
  ASSERT_TRUE(is_success(result.status)) << name_of(result.status);
  EXPECT_LE(result.error.primal, 1e-8);
  for (const double lambda : result.lambda) EXPECT_LE(std::abs(lambda), 1e-8);
}

// What is returned shows the verdict: the violation's least value.
TEST(RobustMinimization, InfeasibleModelsEndAtTheLeastViolation) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Min, "y");
  model.objective(x + y);
  model.constraint(square(x) + square(y), -1.0, -1.0);
  AutodiffProblem problem(model, {3.0, 4.0});
  const Result result = solve(problem, SolverOptions{});
  EXPECT_EQ(result.status, Status::LocallyInfeasible);
  ASSERT_EQ(result.constraints.size(), 1U);
  EXPECT_NEAR(result.constraints[0], 0.0, 1e-4);

  Model line_and_disk;
  const Expression p = line_and_disk.variable(Player::Min, "p");
  const Expression q = line_and_disk.variable(Player::Min, "q");
  line_and_disk.objective(p + q);
  line_and_disk.constraint(p + q, 3.0, kInf);
  line_and_disk.constraint(square(p) + square(q), -kInf, 1.0);
  AutodiffProblem apart(line_and_disk, {1.0, 1.0});
  const Result between = solve(apart, SolverOptions{});
  EXPECT_EQ(between.status, Status::LocallyInfeasible);
  EXPECT_NEAR(between.v[0], std::sqrt(0.5), 1e-5);
  EXPECT_NEAR(between.v[1], std::sqrt(0.5), 1e-5);
}

}  // namespace
}  // namespace ipminmax::testing
