// Derivatives and predictions of solutions against differences of problems that are solved again.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <problems/small_problems.hpp>
#include <random>
#include <stdexcept>
#include <support/autodiff_problem.hpp>
#include <support/forwarding_problem.hpp>
#include <support/function_problem.hpp>
#include <support/units_problem.hpp>
#include <support/without_hessian.hpp>

#include "core/sensitivity.hpp"
#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Expectation;
using testing::kInf;
using testing::Model;

/// Another problem with other bounds, which starts at a given point.
class MovedProblem : public testing::ForwardingProblem {
 public:
  MovedProblem(Problem& problem, std::vector<double> start)
      : ForwardingProblem(problem), structure_(problem.structure()), start_(std::move(start)) {}

  void move(const BoundChange& change, double times) {
    add(change.variable_lower, times, structure_.variable_lower);
    add(change.variable_upper, times, structure_.variable_upper);
    add(change.constraint_lower, times, structure_.constraint_lower);
    add(change.constraint_upper, times, structure_.constraint_upper);
  }
  /// Leaves only Max's choice: Min's variables are fixed, Min's constraints dropped.
  void fix_min(const std::vector<double>& v) {
    for (std::size_t i = 0; i < v.size(); ++i) {
      if (structure_.variable_players[i] == Player::Max) continue;
      structure_.variable_lower[i] = structure_.variable_upper[i] = start_[i] = v[i];
    }
    for (std::size_t j = 0; j < structure_.constraint_players.size(); ++j) {
      if (structure_.constraint_players[j] == Player::Max) continue;
      structure_.constraint_lower[j] = -kInf;
      structure_.constraint_upper[j] = kInf;
    }
  }
  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    std::copy(start_.begin(), start_.end(), start.v.begin());
    return true;
  }

 private:
  static void add(const std::vector<double>& change, double times, std::vector<double>& values) {
    for (std::size_t i = 0; i < change.size(); ++i) values[i] += times * change[i];
  }
  ProblemStructure structure_;
  std::vector<double> start_;
};

SolverOptions accurate() {
  SolverOptions options;
  options.tol = 1e-12;
  options.bound_relax_factor = 0.0;
  options.acceptable_iter = 0;
  options.minmax_max_restarts = 0;
  options.mu_init = 1e-3;
  options.bound_push = options.bound_frac = 1e-6;
  return options;
}

bool is_certified(const Result& result) {
  return result.certificate.kind == PointKind::LocalMinmax;
}

/// Fourth-order central differences of solutions at -2h, -h, h, 2h; false when one is lost
/// on the way.
template <class Solve>
bool differentiate(const Result& base, double h, Solve solve, SolutionDerivative& derivative) {
  const auto accumulate = [&](double times, double weight) {
    const Result found = solve(times * h);
    if (!is_certified(found)) return false;
    for (std::size_t i = 0; i < found.v.size(); ++i) {  // another local minmax
      if (std::abs(found.v[i] - base.v[i]) > 0.1) return false;
    }
    const auto add = [&](const std::vector<double>& from, std::vector<double>& to) {
      to.resize(from.size(), 0.0);
      for (std::size_t i = 0; i < from.size(); ++i) to[i] += weight / (12.0 * h) * from[i];
    };
    add(found.v, derivative.v);
    add(found.lambda, derivative.lambda);
    add(found.z_lower, derivative.z_lower);
    add(found.z_upper, derivative.z_upper);
    derivative.objective += weight / (12.0 * h) * found.objective;
    return true;
  };
  derivative = {};
  return accumulate(-2.0, 1.0) && accumulate(-1.0, -8.0) && accumulate(1.0, 8.0) &&
         accumulate(2.0, -1.0);
}

void expect_close(const std::vector<double>& found, const std::vector<double>& expected,
                  const std::string& what) {
  ASSERT_EQ(found.size(), expected.size()) << what;
  for (std::size_t i = 0; i < found.size(); ++i) {
    EXPECT_NEAR(found[i], expected[i], 1e-6 * std::max(1.0, std::abs(expected[i])))
        << what << " [" << i << "]";
  }
}

/// One change for each constant of the model.
struct Constant {
  std::string name;
  BoundChange change;
};
std::vector<Constant> constants_of(const ProblemStructure& s) {
  std::vector<Constant> constants;
  for (std::size_t i = 0; i < s.variable_players.size(); ++i) {
    const BoundChange both = move_variable(s, static_cast<Index>(i));
    const std::string name = "variable " + std::to_string(i);
    if (s.variable_lower[i] == s.variable_upper[i]) {
      constants.push_back({name, both});
      continue;
    }
    if (std::isfinite(s.variable_lower[i])) {
      constants.push_back({name + " lower", {.variable_lower = both.variable_lower}});
    }
    if (std::isfinite(s.variable_upper[i])) {
      constants.push_back({name + " upper", {.variable_upper = both.variable_upper}});
    }
  }
  for (std::size_t j = 0; j < s.constraint_players.size(); ++j) {
    const BoundChange both = move_constraint(s, static_cast<Index>(j));
    const std::string name = "constraint " + std::to_string(j);
    if (s.constraint_lower[j] == s.constraint_upper[j]) {
      constants.push_back({name, both});
      continue;
    }
    if (std::isfinite(s.constraint_lower[j])) {
      constants.push_back({name + " lower", {.constraint_lower = both.constraint_lower}});
    }
    if (std::isfinite(s.constraint_upper[j])) {
      constants.push_back({name + " upper", {.constraint_upper = both.constraint_upper}});
    }
  }
  return constants;
}

constexpr double kStep = 2e-4;

bool changes_active_set(Sensitivity& sensitivity, BoundChange change) {
  for (const double times : {-2.0 * kStep, 2.0 * kStep}) {
    BoundChange scaled = change;
    for (auto* values : {&scaled.variable_lower, &scaled.variable_upper, &scaled.constraint_lower,
                         &scaled.constraint_upper}) {
      for (double& value : *values) value *= times;
    }
    if (!sensitivity.predict(scaled).changes.empty()) return true;
  }
  return false;
}

bool is_zero(const std::vector<double>& values) {
  return std::ranges::all_of(values, [](double value) { return value == 0.0; });
}

TEST(Sensitivity, DerivativesOfTheSmallProblemsAreThoseOfDifferences) {
  int compared = 0, moving = 0;
  for (const auto& small : testing::small_problems()) {
    if (small.expectation == Expectation::None || small.expectation == Expectation::Degenerate) {
      continue;
    }
    for (const auto& solution : small.solutions) {
      AutodiffProblem problem(small.model, solution.v);
      const Result base = solve(problem, accurate());
      if (!is_certified(base)) continue;
      Sensitivity sensitivity;
      ASSERT_EQ(sensitivity.update(problem, base, accurate()), "") << small.name;
      if (!sensitivity.weakly_active().empty()) continue;
      for (const auto& constant : constants_of(problem.structure())) {
        const auto& change = constant.change;
        if (changes_active_set(sensitivity, change)) continue;
        SolutionDerivative differences;
        const bool solved = differentiate(
            base, kStep,
            [&](double by) {
              MovedProblem moved(problem, base.v);
              moved.move(change, by);
              return solve(moved, accurate());
            },
            differences);
        if (!solved) continue;
        const std::string where = small.name + ", " + constant.name;
        const SolutionDerivative found = sensitivity.derivative(change);
        expect_close(found.v, differences.v, where + " v");
        expect_close(found.lambda, differences.lambda, where + " lambda");
        expect_close(found.z_lower, differences.z_lower, where + " z_lower");
        expect_close(found.z_upper, differences.z_upper, where + " z_upper");
        expect_close({found.objective}, {differences.objective}, where + " objective");
        ++compared;
        moving += is_zero(found.v) ? 0 : 1;
      }
    }
  }
  RecordProperty("compared", compared);
  RecordProperty("moving", moving);
  EXPECT_GE(compared, 250);
  EXPECT_GE(moving, 25);
}

TEST(Sensitivity, ReactionsOfTheSmallProblemsAreThoseOfDifferences) {
  int compared = 0;
  for (const auto& small : testing::small_problems()) {
    if (small.expectation == Expectation::None || small.expectation == Expectation::Degenerate) {
      continue;
    }
    for (const auto& solution : small.solutions) {
      AutodiffProblem problem(small.model, solution.v);
      const Result base = solve(problem, accurate());
      Sensitivity sensitivity;
      if (!is_certified(base) || !sensitivity.update(problem, base, accurate()).empty() ||
          !sensitivity.weakly_active().empty()) {
        continue;
      }
      const auto& players = problem.structure().variable_players;
      if (std::ranges::count(players, Player::Max) == 0) continue;
      for (std::size_t x = 0; x < players.size(); ++x) {
        if (players[x] == Player::Max) continue;
        std::vector<double> dx(players.size(), 0.0);
        dx[x] = -2.0 * kStep;
        bool changes = !sensitivity.react(dx).changes.empty();
        dx[x] = 2.0 * kStep;
        changes = changes || !sensitivity.react(dx).changes.empty();
        if (changes) continue;
        SolutionDerivative differences;
        const bool solved = differentiate(
            base, kStep,
            [&](double by) {
              std::vector<double> v = base.v;
              v[x] += by;
              MovedProblem moved(problem, base.v);
              moved.fix_min(v);
              return solve(moved, accurate());
            },
            differences);
        if (!solved) continue;
        dx[x] = 1.0;
        const std::string where = small.name + ", variable " + std::to_string(x);
        const SolutionDerivative found = sensitivity.reaction(dx);
        expect_close(found.v, differences.v, where + " v");
        expect_close({found.objective}, {differences.objective}, where + " objective");
        for (std::size_t j = 0; j < found.lambda.size(); ++j) {
          if (problem.structure().constraint_players[j] == Player::Max) {
            expect_close({found.lambda[j]}, {differences.lambda[j]}, where + " lambda");
          }
        }
        ++compared;
      }
    }
  }
  RecordProperty("compared", compared);
  EXPECT_GE(compared, 50);
}

/// The same change in other units.
BoundChange in_units(const testing::UnitsProblem& units, BoundChange change) {
  for (auto* values : {&change.variable_lower, &change.variable_upper})
    for (std::size_t i = 0; i < values->size(); ++i) (*values)[i] /= units.unit(i);
  for (auto* values : {&change.constraint_lower, &change.constraint_upper})
    for (std::size_t j = 0; j < values->size(); ++j) (*values)[j] *= units.factor(j);
  return change;
}

/// A derivative as a result, so that units change it like one.
Result as_result(const SolutionDerivative& derivative) {
  Result result;
  result.v = derivative.v;
  result.lambda = derivative.lambda;
  result.z_lower = derivative.z_lower;
  result.z_upper = derivative.z_upper;
  result.objective = derivative.objective;
  return result;
}

TEST(Sensitivity, IsTheSameInOtherUnits) {
  testing::Dice dice(11);
  int compared = 0;
  for (const auto& small : testing::small_problems()) {
    if (small.expectation == Expectation::None || small.expectation == Expectation::Degenerate) {
      continue;
    }
    for (const auto& solution : small.solutions) {
      AutodiffProblem problem(small.model, solution.v);
      SolverOptions options;
      options.tol = 1e-10;
      const Result base = solve(problem, options);
      Sensitivity own, other;
      if (!is_certified(base) || !own.update(problem, base, options).empty() ||
          !own.weakly_active().empty()) {
        continue;
      }
      const auto powers = [&](std::size_t size) {
        std::vector<double> all(size);
        for (double& unit : all) unit = std::pow(10.0, dice.below(13) - 6);
        return all;
      };
      for (int trial = 0; trial < 3; ++trial) {
        testing::UnitsProblem units(problem, powers(base.v.size()), powers(base.lambda.size()),
                                    powers(1)[0]);
        const Result there = units.in_units(base);
        ASSERT_EQ(other.update(units, there, options), "") << small.name;
        for (const auto& constant : constants_of(problem.structure())) {
          const std::string where = small.name + ", " + constant.name;
          const Result expected = as_result(own.derivative(constant.change));
          const Result found =
              units.original(as_result(other.derivative(in_units(units, constant.change))));
          expect_close(found.v, expected.v, where + " v");
          expect_close(found.lambda, expected.lambda, where + " lambda");
          expect_close(found.z_lower, expected.z_lower, where + " z_lower");
          expect_close(found.z_upper, expected.z_upper, where + " z_upper");
          expect_close({found.objective}, {expected.objective}, where + " objective");
          ++compared;
        }
      }
    }
  }
  RecordProperty("compared", compared);
  EXPECT_GE(compared, 700);
}

/// Solved in the units in which the sensitivities are asked for.
TEST(Sensitivity, BoundsAreActiveInAnyUnits) {
  for (const double unit : {1e-4, 1.0, 1e4}) {  // y at its bound whatever x is
    Model model;
    const auto x = model.variable(Player::Min, "x", -kInf, kInf);
    const auto y = model.variable(Player::Max, "y", -unit, unit);
    const auto s = (1.0 / unit) * y;
    model.objective((x - 1.0) * (x - 1.0) + (x + 3.0) * s - s * s);
    AutodiffProblem problem(model, {0.0, 0.5 * unit});
    const Result base = solve(problem, SolverOptions{});
    ASSERT_TRUE(is_certified(base)) << unit;
    Sensitivity sensitivity;
    ASSERT_EQ(sensitivity.update(problem, base, SolverOptions{}), "");
    EXPECT_EQ(sensitivity.reaction(std::vector<double>{1.0, 0.0}).v[1], 0.0) << unit;
    EXPECT_TRUE(sensitivity.weakly_active().empty()) << unit;
  }
  for (const double factor : {1e-6, 1.0, 1e6}) {  // min x^2 - 2.2 x + y-part, row factor x <= p
    Model model;
    const auto x = model.variable(Player::Min, "x", -kInf, kInf);
    const auto y = model.variable(Player::Max, "y", -kInf, kInf);
    model.objective(0.1 * x * x - 2.4 * x + x * y - 0.5 * (x - y) * (x - y) - 0.5 * x * x);
    model.constraint(factor * x, -kInf, factor);
    AutodiffProblem problem(model, {0.0, 0.0});
    const Result base = solve(problem, SolverOptions{});
    ASSERT_EQ(base.status, Status::Solved) << factor;
    Sensitivity sensitivity;
    ASSERT_EQ(sensitivity.update(problem, base, SolverOptions{}), "");
    const auto found = sensitivity.derivative({.constraint_upper = {factor}});
    EXPECT_NEAR(found.v[0], 1.0, 1e-6) << factor;
    EXPECT_NEAR(found.objective, base.lambda[0] * -factor, 1e-6) << factor;
    EXPECT_LT(found.objective, -0.1) << factor;
  }
}

/// A game with quadratic objective and linear constraints: its solution is piecewise linear in the
/// constants, so predictions are exact through any number of active sets.
AutodiffProblem quadratic_game(std::mt19937& random, int size) {
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  Model model;
  std::vector<testing::Expression> x, y;
  for (int i = 0; i < size; ++i) {
    x.push_back(model.variable(Player::Min, "x" + std::to_string(i), -1.0, 1.0));
  }
  for (int i = 0; i < size; ++i) {
    y.push_back(model.variable(Player::Max, "y" + std::to_string(i), -1.0, 1.0));
  }
  testing::Expression f = 0.0 * x[0];
  const auto n = static_cast<std::size_t>(size);
  for (std::size_t i = 0; i < n; ++i) {
    f = f + 1.5 * x[i] * x[i] - 1.5 * y[i] * y[i] + 4.0 * number(random) * x[i] +
        4.0 * number(random) * y[i];
    for (std::size_t j = 0; j < n; ++j) f = f + 0.5 * number(random) * x[i] * y[j];
  }
  model.objective(f);
  for (int k = 0; k < 2; ++k) {
    testing::Expression gx = 0.0 * x[0], gy = 0.0 * y[0];
    for (std::size_t i = 0; i < n; ++i) {
      gx = gx + number(random) * x[i];
      gy = gy + number(random) * y[i] + 0.3 * number(random) * x[i];
    }
    model.constraint(gx, -kInf, 0.3);
    model.constraint(gy, -kInf, 0.3);
  }
  return AutodiffProblem(model, std::vector<double>(2 * n, 0.0));
}

TEST(Sensitivity, PredictionsOfQuadraticGamesAreExactThroughActiveSetChanges) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-0.8, 0.8);
  int changes = 0, complete = 0;
  for (int trial = 0; trial < 40; ++trial) {
    AutodiffProblem problem = quadratic_game(random, 6);
    const Result base = solve(problem, accurate());
    ASSERT_TRUE(is_certified(base)) << trial;
    Sensitivity sensitivity;
    ASSERT_EQ(sensitivity.update(problem, base, accurate()), "");
    const ProblemStructure& s = problem.structure();
    BoundChange change;
    for (std::size_t i = 0; i < s.variable_players.size(); ++i) {
      change.variable_lower.push_back(number(random));
      change.variable_upper.push_back(change.variable_lower[i] + std::abs(number(random)));
    }
    for (std::size_t j = 0; j < s.constraint_players.size(); ++j) {
      change.constraint_upper.push_back(0.5 * number(random));
    }
    const Prediction predicted = sensitivity.predict(change);
    MovedProblem moved(problem, base.v);
    moved.move(change, 1.0);
    const Result again = solve(moved, accurate());
    changes += static_cast<int>(predicted.changes.size());
    if (predicted.share < 1.0 || !is_certified(again)) continue;
    ++complete;
    expect_close(predicted.v, again.v, "v of trial " + std::to_string(trial));
    expect_close(predicted.lambda, again.lambda, "lambda of trial " + std::to_string(trial));
    expect_close(predicted.z_lower, again.z_lower, "z_lower of trial " + std::to_string(trial));
    expect_close(predicted.z_upper, again.z_upper, "z_upper of trial " + std::to_string(trial));
    EXPECT_NEAR(predicted.objective, again.objective, 1e-6) << trial;
  }
  RecordProperty("changes", changes);
  RecordProperty("complete", complete);
  EXPECT_GE(changes, 60);
  EXPECT_GE(complete, 36);
}

/// f = x^2 - (y - x)^2 with y <= 1: y follows x up to the bound.
AutodiffProblem follower(double from) {
  Model model;
  const auto x = model.variable(Player::Min, "x", from, kInf);
  const auto y = model.variable(Player::Max, "y", -kInf, 1.0);
  model.objective(x * x - (y - x) * (y - x));
  return AutodiffProblem(model, {from + 0.5, 0.0});
}

TEST(Sensitivity, ActiveSetChangesAreNamed) {
  AutodiffProblem problem = follower(0.5);
  const Result base = solve(problem, accurate());
  ASSERT_TRUE(is_certified(base));
  Sensitivity sensitivity;
  ASSERT_EQ(sensitivity.update(problem, base, accurate()), "");
  // What would the adversary do if x went from 0.5 to 1.5?
  const Prediction reaction = sensitivity.react(std::vector<double>{1.0, 0.0});
  ASSERT_EQ(reaction.changes.size(), 1U);
  EXPECT_EQ(reaction.changes[0].text, "variable y reaches its upper bound");
  EXPECT_NEAR(reaction.changes[0].share, 0.5, 1e-9);
  EXPECT_TRUE(reaction.changes[0].enters);
  EXPECT_NEAR(reaction.v[0], 1.5, 1e-9);
  EXPECT_NEAR(reaction.v[1], 1.0, 1e-9);
  EXPECT_NEAR(reaction.objective, 2.0, 1e-9);
  // Moving the bound x >= 0.5 past 0 leaves it; objective and multiplier are those of x^2.
  const Prediction freed = sensitivity.predict({.variable_lower = {-1.0, 0.0}});
  ASSERT_EQ(freed.changes.size(), 1U);
  EXPECT_EQ(freed.changes[0].text, "variable x leaves its lower bound");
  EXPECT_NEAR(freed.changes[0].share, 0.5, 1e-9);
  EXPECT_NEAR(freed.v[0], 0.0, 1e-9);
  EXPECT_NEAR(freed.objective, 0.0, 1e-9);
  EXPECT_EQ(freed.share, 1.0);
}

TEST(Sensitivity, ValueMovesToSecondOrder) {
  AutodiffProblem problem = follower(0.5);
  const Result base = solve(problem, accurate());
  Sensitivity sensitivity;
  ASSERT_EQ(sensitivity.update(problem, base, accurate()), "");
  const SolutionDerivative d = sensitivity.derivative({.variable_lower = {1.0, 0.0}});
  EXPECT_NEAR(d.objective, 1.0, 1e-8);  // of x^2 at 0.5
  EXPECT_NEAR(d.objective_curvature, 2.0, 1e-8);
  EXPECT_NEAR(d.objective, base.z_lower[0], 1e-8);
}

TEST(Sensitivity, FixedVariablesAreParameters) {
  // sIPOPT's example of a parameter: f = (x - p)^2 - (y - p x)^2 with p a fixed variable.
  Model model;
  const auto x = model.variable(Player::Min, "x", -kInf, kInf);
  const auto y = model.variable(Player::Max, "y", -kInf, kInf);
  const auto p = model.variable(Player::Min, "p", 2.0, 2.0);
  model.objective((x - p) * (x - p) - (y - p * x) * (y - p * x));
  AutodiffProblem problem(model, {0.0, 0.0, 2.0});
  const Result base = solve(problem, accurate());
  ASSERT_TRUE(is_certified(base));
  Sensitivity sensitivity;
  ASSERT_EQ(sensitivity.update(problem, base, accurate()), "");
  const SolutionDerivative d = sensitivity.derivative(move_variable(problem.structure(), 2));
  expect_close(d.v, {1.0, 4.0, 1.0}, "dv/dp");  // x = p, y = p^2
  EXPECT_THROW(static_cast<void>(sensitivity.derivative({.variable_lower = {0.0, 0.0, 1.0}})),
               std::invalid_argument);
}

TEST(Sensitivity, SaysWhyThereAreNoDerivatives) {
  Sensitivity sensitivity;
  EXPECT_FALSE(sensitivity.available());
  {
    AutodiffProblem problem = follower(0.5);
    SolverOptions options = accurate();
    options.max_iter = 1;
    const Result stopped = solve(problem, options);
    EXPECT_NE(sensitivity.update(problem, stopped, options).find("no first-order point"),
              std::string::npos);
    EXPECT_FALSE(sensitivity.available());
  }
  {  // x + y is all that matters to the minimizer: a flat direction.
    Model model;
    const auto a = model.variable(Player::Min, "a", -kInf, kInf);
    const auto b = model.variable(Player::Min, "b", -kInf, kInf);
    const auto y = model.variable(Player::Max, "y", -kInf, kInf);
    model.objective((a + b) * (a + b) - y * y);
    AutodiffProblem problem(model, {1.0, 2.0, 1.0});
    const Result flat = solve(problem, accurate());
    ASSERT_EQ(flat.certificate.kind, PointKind::LocalMinmax);
    EXPECT_NE(sensitivity.update(problem, flat, accurate()).find("singular"), std::string::npos);
  }
  AutodiffProblem problem = follower(0.5);
  const Result base = solve(problem, accurate());
  ASSERT_EQ(sensitivity.update(problem, base, accurate()), "");
  EXPECT_TRUE(sensitivity.available());
  EXPECT_THROW(static_cast<void>(sensitivity.derivative({.variable_lower = {1.0}})),
               std::invalid_argument);
  EXPECT_THROW(static_cast<void>(sensitivity.derivative({.variable_lower = {kInf, 0.0}})),
               std::invalid_argument);
  EXPECT_THROW(static_cast<void>(sensitivity.reaction(std::vector<double>{1.0})),
               std::invalid_argument);
}

TEST(Sensitivity, WeaklyActiveBoundsAreNamed) {
  AutodiffProblem problem = follower(0.0);  // x >= 0 with multiplier 0
  SolverOptions options = accurate();
  options.tol = 1e-8;
  const Result base = solve(problem, options);
  Sensitivity sensitivity;
  ASSERT_EQ(sensitivity.update(problem, base, options), "");
  EXPECT_EQ(sensitivity.weakly_active(), std::vector<std::string>{"variable x at its lower bound"});
}

TEST(Sensitivity, ModelsWithoutSecondDerivativesHaveThemToo) {
  AutodiffProblem exact = follower(0.5);
  testing::WithoutHessian problem(exact);
  SolverOptions options = accurate();
  options.tol = 1e-8;
  const Result base = solve(problem, options);
  ASSERT_TRUE(is_certified(base));
  Sensitivity sensitivity;
  ASSERT_EQ(sensitivity.update(problem, base, options), "");
  expect_close(sensitivity.reaction(std::vector<double>{1.0, 0.0}).v, {1.0, 1.0}, "reaction");
}

TEST(Sensitivity, OneAnalysisServesManySolutionsAndOneFactorizationManyDirections) {
  AutodiffProblem problem = follower(0.5);
  const Result base = solve(problem, accurate());
  Sensitivity sensitivity;
  for (int round = 0; round < 3; ++round) {
    ASSERT_EQ(sensitivity.update(problem, base, accurate()), "");
    for (int k = 0; k < 5; ++k) {
      static_cast<void>(sensitivity.derivative({.variable_lower = {1.0 + k, 0.0}}));
    }
  }
  EXPECT_EQ(sensitivity.analyses(), 1);
  EXPECT_EQ(sensitivity.factorizations(), 3);
}

}  // namespace
}  // namespace ipminmax
