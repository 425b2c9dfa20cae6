// First-order points that are no strict local minmax although some matrix looks as if they were:
// none may be certified. And points that are, in units from tiny to huge: all must be.

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>
#include <support/dense_judge.hpp>
#include <support/function_problem.hpp>

#include "core/model/forwarding_problem.hpp"
#include "core/robust.hpp"
#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

/// A model with curvature of the right signs around a point: +-500 (v_i - p_i)^2.
class WithCurvature final : public ForwardingProblem {
 public:
  WithCurvature(Problem& model, std::vector<double> point)
      : ForwardingProblem(model), structure_(model.structure()), point_(std::move(point)) {
    for (std::size_t i = 0; i < point_.size(); ++i) {
      structure_.hessian.push_back({static_cast<Index>(i), static_cast<Index>(i)});
    }
  }
  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    std::ranges::copy(point_, start.v.begin());
    return true;
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override {
    if (!model().objective(v, new_v, f)) return false;
    for (std::size_t i = 0; i < v.size(); ++i) f += 0.5 * weight(i) * std::pow(v[i] - point_[i], 2);
    return true;
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool new_v,
                              std::span<double> grad) override {
    if (!model().gradient(v, new_v, grad)) return false;
    for (std::size_t i = 0; i < v.size(); ++i) grad[i] += weight(i) * (v[i] - point_[i]);
    return true;
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool new_v, double sigma,
                             std::span<const double> lambda, bool new_lambda,
                             std::span<double> values) override {
    const std::size_t own = values.size() - point_.size();
    if (!model().hessian(v, new_v, sigma, lambda, new_lambda, values.first(own))) return false;
    for (std::size_t i = 0; i < point_.size(); ++i) values[own + i] = sigma * weight(i);
    return true;
  }

 private:
  [[nodiscard]] double weight(std::size_t i) const {
    return structure_.variable_players[i] == kMin ? 1e3 : -1e3;
  }
  ProblemStructure structure_;
  std::vector<double> point_;
};

/// Solved from a start; a point of another kind may be certified, the named one may not.
void expect_not_certified(const Model& model, const std::vector<double>& start,
                          const SolverOptions& options = {}) {
  AutodiffProblem problem(model, start);
  const Result result = solve(problem, options);
  ASSERT_EQ(result.v.size(), start.size()) << result.message;
  WithCurvature strict(problem, result.v);  // a solver that certifies nothing does not pass
  EXPECT_EQ(solve(strict, options).certificate.kind, PointKind::LocalMinmax);
  if (result.certificate.kind != PointKind::LocalMinmax) return;
  const testing::DenseOptimality found = testing::dense_optimality(problem, result.v);
  EXPECT_EQ(found.verdict, testing::Verdict::LocalMinmax)
      << found << " at " << result.v[0] << ' ' << (result.v.size() > 1 ? result.v[1] : 0.0);
}

SolverOptions with_tol(double tol) {
  SolverOptions options;
  options.tol = tol;
  return options;
}

/// x^2 + x y / 2 + curvature y^2: the maximizer stands at a minimum inside of his ellipsoid.
Model inner_minimum_inside(double curvature, double weight, double radius) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(square(x) + 0.5 * x * y + curvature * square(y));
  model.constraint(weight * square(y), -kNoBound, radius);
  return model;
}

// Second derivatives that jump: W is the same at all iterates of one side.

using testing::FunctionProblem;
using Vector = Eigen::VectorXd;
using Matrix = Eigen::MatrixXd;

/// max(0, x - b)^2 for x, times s, and -(y - c)^2: all x up to b are equally good.
FunctionProblem squared_hinge(double s, double b, double c, const Vector& start) {
  return FunctionProblem(
      {kMin, kMax}, start,
      [=](const Vector& v) {
        const double over = std::max(0.0, v[0] - b);
        return s * over * over - (v[1] - c) * (v[1] - c);
      },
      [=](const Vector& v) {
        return Vector{{2.0 * s * std::max(0.0, v[0] - b), -2.0 * (v[1] - c)}};
      },
      [=](const Vector& v) {
        return Matrix{{v[0] > b ? 2.0 * s : 0.0, 0.0}, {0.0, -2.0}};
      });
}

TEST(PiecewiseCurvature, OfASquaredHingeIsNotCertifiedAtItsEdge) {
  int certified = 0;
  for (int seed = 0; seed < 100; ++seed) {
    const double s = std::pow(10.0, -2.0 + 0.04 * seed), b = 2.0 * std::sin(1.0 + seed);
    const double c = 3.0 * std::cos(1.0 + 2.0 * seed);
    FunctionProblem model = squared_hinge(s, b, c, Vector{{b + 1.5, c + std::sin(3.0 * seed)}});
    certified += solve(model, {}).certificate.kind == PointKind::LocalMinmax ? 1 : 0;
  }
  EXPECT_EQ(certified, 0);
}

TEST(PiecewiseCurvature, OfXTimesItsAbsoluteValueIsNotCertifiedAtZero) {
  // x |x| falls for x < 0, -y |y| rises for y < 0.
  for (const bool inner : {false, true}) {
    const auto f = [=](const Vector& v) {
      return inner ? v[0] * v[0] - v[1] * std::abs(v[1]) : v[0] * std::abs(v[0]) - v[1] * v[1];
    };
    const auto gradient = [=](const Vector& v) {
      return inner ? Vector{{2.0 * v[0], -2.0 * std::abs(v[1])}}
                   : Vector{{2.0 * std::abs(v[0]), -2.0 * v[1]}};
    };
    const auto hessian = [=](const Vector& v) {
      const double sign = (inner ? v[1] : v[0]) < 0.0 ? -2.0 : 2.0;
      return inner ? Matrix{{2.0, 0.0}, {0.0, -sign}} : Matrix{{sign, 0.0}, {0.0, -2.0}};
    };
    FunctionProblem model({kMin, kMax}, Vector{{1.0, 1.0}}, f, gradient, hessian);
    const std::size_t bent = inner ? 1 : 0;
    model.mutable_structure().variable_lower[bent] = -1.0;
    model.mutable_structure().variable_upper[bent] = 3.0;
    const Result result = solve(model, {});
    EXPECT_FALSE(result.certificate.kind == PointKind::LocalMinmax &&
                 std::abs(result.v[bent]) < 0.1);
  }
}

TEST(Certified, PointsAreWhereTheirSolutionIs) {
  // p = 0 makes every xi as good, but the relaxed bound of p sends xi to an end of its interval.
  for (const double unit : {1.0, 1e-6, 1e6}) {
    Model model;
    const Expression x = model.variable(kMin, "x");
    const Expression p = model.variable(kMax, "p", 0.0, 1.0);
    const Expression xi = model.variable(kMax, "xi", -0.5 * unit, 0.5 * unit);
    const Expression scaled = (1.0 / unit) * xi;
    model.objective(square(x) + 0.1 * x - p * (1.0 + square(scaled)));
    AutodiffProblem problem(model, {1.0, 0.5, 0.2 * unit});
    const Result result = solve(problem, {});
    const bool strict = result.certificate.answer != InnerAnswer::BestNotUnique;
    const bool certified = result.certificate.kind == PointKind::LocalMinmax;
    const double off = std::abs(std::abs(result.v[2]) - 0.5 * unit);
    EXPECT_FALSE(certified && strict && off > 1e-3 * unit + 2e-8) << result.v[2];  // relaxed bounds
  }
}

TEST(Certified, PointsAreStationaryInTheModelsUnits) {
  // Jennrich and Sampson's sums of exponentials: the objective is scaled down by 1e-8 at these
  // starts.
  for (const std::vector<double>& start : {std::vector{2.0, 1.0}, std::vector{3.0, 0.5}}) {
    Model model;
    const Expression a = model.variable(kMin, "a"), b = model.variable(kMin, "b");
    Expression f = 0.0 * a;
    for (int i = 1; i <= 10; ++i) {
      f += square(2.0 + 2.0 * i - (exp(1.0 * i * a) + exp(1.0 * i * b)));
    }
    model.objective(f);
    AutodiffProblem problem(model, start);
    const Result result = solve(problem, {});
    EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax);
    EXPECT_LE(result.error.dual_min, 1e-4);
  }
}

TEST(InactiveInequalities, LendNoCurvatureToTheMaximizer) {
  expect_not_certified(inner_minimum_inside(0.5e-5, 50.0, 0.01), {0.5, 0.0});
  expect_not_certified(inner_minimum_inside(0.5e-3, 5.0, 0.1), {0.5, 0.0}, with_tol(1e-3));
  expect_not_certified(inner_minimum_inside(0.5e-4, 5.0, 0.1), {0.5, 0.0}, with_tol(1e-5));
}

TEST(InactiveInequalities, LendNoCurvatureToTheMinimizer) {
  Model concave;
  const Expression x = concave.variable(kMin, "x");
  const Expression y = concave.variable(kMax, "y");
  concave.objective(-0.5e-6 * square(x) - square(y));
  concave.constraint(50.0 * square(x), -kNoBound, 0.01);
  expect_not_certified(concave, {0.0, 0.3});
}

TEST(InactiveInequalities, LendNoCurvatureToAMinimization) {
  Model flat;
  Expression u = flat.variable(kMin, "x0");
  Expression w = flat.variable(kMin, "x1");
  flat.objective(square(u));
  flat.constraint(5000.0 * square(w), -kNoBound, 1.0);
  AutodiffProblem problem(flat, {1.0, 0.01});
  const Result result = solve(problem, SolverOptions{});  // every w near is as good
  ASSERT_EQ(result.certificate.reasons.size(), 1U);
  EXPECT_EQ(result.certificate.reasons[0].text,
            "x is best but not unique: as good along +1 variable 1 (x1)");

  Model concave;
  u = concave.variable(kMin, "x0");
  w = concave.variable(kMin, "x1");
  concave.objective(1e4 * square(u) - 1e-3 * square(w));
  concave.constraint(1e6 * square(w), -kNoBound, 1.0);
  expect_not_certified(concave, {1.0, 5e-5});
}

TEST(FlatMaximizers, AreNotCertified) {
  // f_yy vanishes at (0, -0.2), where x has no say.
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(0.1 * square(x) + log(1.0 + exp(-x * (0.2 + y))));
  model.constraint(square(y), -kNoBound, 0.25);
  for (const double start : {0.0, 0.1, -0.3, 1.0}) {
    expect_not_certified(model, {start, 0.1});
    expect_not_certified(model, {start, -0.2});
  }
}

TEST(DegeneratePowers, AreNotCertifiedInOtherUnits) {
  // x^2 + y^3 + x y / 10 at 0, where K is nonsingular and K_yy is not.
  Model model;
  const Expression x = 0.662984 * model.variable(kMin, "x");
  const Expression y = 0.052424 * model.variable(kMax, "y");
  model.objective(square(x) + pow(y, 3.0) + 0.1 * x * y);
  SolverOptions options;
  options.minmax_globalization = Globalization::None;
  expect_not_certified(model, {-5.13372e-5, 3.41864e-4}, options);
}

TEST(WeaklyActiveBounds, OfTheMaximizerGiveTheMinimizerNothing) {
  // y <= 0 with a small multiplier holds only near 0, where phi = -x^2 / 4; away from the bound y
  // would answer and phi grow.
  Model model;
  const Expression x = model.variable(kMin, "x", -1.0, 1.0);
  const Expression y = model.variable(kMax, "y", -1.0, 0.0);
  model.objective(-0.25 * square(x) + 10.0 * x * y + 3.2e-4 * y - square(y));
  expect_not_certified(model, {0.0, 0.0});
  expect_not_certified(model, {1e-6, -1e-6});
}

// What is seen at a vertex, and what bound_relax_factor decides.

TEST(Corners, WithAKinkAreNotCertified) {
  // |x - y| - x / 2: y = 0 is the worst answer to x = 0. In other units, and with rows as bounds.
  for (const double unit : {1e-4, 1.0, 1e4}) {
    for (const bool rows : {false, true}) {
      Model model;
      const Expression x = model.variable(kMin, "x", rows ? -kNoBound : 0.0, unit);
      const Expression y = model.variable(kMax, "y", rows ? -kNoBound : 0.0, unit);
      model.objective(sqrt(square((x - y) / unit)) - 0.5 / unit * x);
      if (rows) {
        model.constraint(x / unit, 0.0, kNoBound, kMin);
        model.constraint(y / unit, 0.0, kNoBound, kMax);
      }
      AutodiffProblem problem(model, {0.5 * unit, 0.1 * unit});
      EXPECT_NE(solve(problem, {}).certificate.kind, PointKind::LocalMinmax) << unit << rows;
    }
  }
}

TEST(Corners, WithAKinkAreNotCertifiedBesideAVariableThatNothingReads) {
  Model model;
  const Expression x = model.variable(kMin, "x", 0.0, 1.0);
  const Expression y = model.variable(kMax, "y", 0.0, 1.0);
  model.variable(kMax, "unread", 0.0, 2e6);
  model.objective(sqrt(square(x - y)) - 0.5 * x);
  AutodiffProblem problem(model, {0.5, 0.1, 1e6});
  EXPECT_NE(solve(problem, {}).certificate.kind, PointKind::LocalMinmax);
}

TEST(Corners, WhereMultipliersChangeButKeepTheirSignAreCertified) {
  Model model;
  const Expression x = model.variable(kMin, "x", 0.0, 1.0);
  const Expression y = model.variable(kMax, "y", 0.0, 1.0);
  model.objective(0.3 * sqrt(square(x - y)) + x - y + 4.0 * x * y);
  AutodiffProblem problem(model, {0.5, 0.1});
  EXPECT_EQ(solve(problem, {}).certificate.kind, PointKind::LocalMinmax);
}

/// p'Aq on simplices, A a row after the other. unit: of the last q. rows: q_j >= 0 as constraints.
Result solve_game(const std::vector<std::vector<double>>& payoff, double unit = 1.0,
                  bool rows = false, const SolverOptions& options = {}) {
  Model model;
  std::vector<Expression> p, q;
  for (std::size_t i = 0; i < payoff.size(); ++i) {
    p.push_back(model.variable(kMin, "p" + std::to_string(i), 0.0));
  }
  for (std::size_t j = 0; j < payoff[0].size(); ++j) {
    q.push_back(model.variable(kMax, "q" + std::to_string(j), rows ? -kNoBound : 0.0));
    if (rows) model.constraint(q.back(), 0.0, kNoBound, kMax);
  }
  q.back() = unit * q.back();
  Expression value = 0.0 * p[0], sum_p = value, sum_q = value;
  for (std::size_t i = 0; i < p.size(); ++i) {
    sum_p = sum_p + p[i];
    for (std::size_t j = 0; j < q.size(); ++j) value = value + payoff[i][j] * p[i] * q[j];
  }
  for (const Expression& weight : q) sum_q = sum_q + weight;
  model.objective(value);
  model.constraint(sum_p, 1.0, 1.0, kMin);
  model.constraint(sum_q, 1.0, 1.0, kMax);
  std::vector<double> start(p.size(), 1.0 / static_cast<double>(p.size()));
  start.resize(p.size() + q.size(), 1.0 / static_cast<double>(q.size()));
  start.back() /= unit;
  AutodiffProblem problem(model, start);
  return solve_robust(problem, options).result;
}

TEST(RelaxedBounds, DoNotDecideBetweenAnswersThatAreAsGood) {
  // Every p is as good. A bound of q that is relaxed makes one of them better by its own size.
  EXPECT_NE(solve_game({{2, 0, 2}, {2, -1, 2}}).certificate.kind, PointKind::LocalMinmax);
  EXPECT_EQ(solve_game({{2, 0}, {2, -1}}).certificate.second_order, SecondOrder::Flat);
  EXPECT_NE(solve_game({{2, 2, -1}, {-2, 2, -2}}).certificate.kind, PointKind::LocalMinmax);
  EXPECT_NE(solve_game({{-1, -2, 0}, {1, 1, 0}}).certificate.kind, PointKind::LocalMinmax);
  EXPECT_NE(solve_game({{2, 0}, {2, -1}}, 1.0, true).certificate.kind, PointKind::LocalMinmax);
  SolverOptions epigraph;
  epigraph.minmax_epigraph = true;
  EXPECT_NE(solve_game({{2, 0}, {2, -1}}, 1e5, false, epigraph).certificate.kind,
            PointKind::LocalMinmax);
  // Max's answers tie, p is unique.
  EXPECT_EQ(solve_game({{0, 1}, {-2, -2}, {0, 0}}).certificate.kind, PointKind::LocalMinmax);
}

TEST(RelaxedBounds, DoNotDecideInOtherUnits) {
  // Every p is as good: against the first q both rows pay 2.
  for (const auto& [unit, factor] :
       {std::pair{1.0, 1.0}, {0.01, 1e-3}, {1e-4, 1e-3}, {10.0, 0.01}}) {
    Model model;
    const Expression p0 = model.variable(kMin, "p0", 0.0, unit) / unit;
    const Expression p1 = model.variable(kMin, "p1", 0.0, unit) / unit;
    const Expression q0 = model.variable(kMax, "q0", 0.0, 1.0);
    const Expression q1 = model.variable(kMax, "q1", 0.0, 1.0);
    model.objective(factor * (p0 * (2.0 * q0 + 2.0 * q1) + p1 * (2.0 * q0 + q1)));
    model.constraint(p0 + p1, 1.0, 1.0, kMin);
    model.constraint(q0 + q1, 1.0, 1.0, kMax);
    AutodiffProblem problem(model, {0.5 * unit, 0.5 * unit, 0.5, 0.5});
    const Result result = solve(problem, {});
    EXPECT_TRUE(is_success(result.status)) << unit << ", " << factor << ": " << result.message;
    EXPECT_NE(result.certificate.kind, PointKind::LocalMinmax) << unit << ", " << factor;
  }
}

TEST(Shifts, OfSeveralVariablesChangeNothing) {
  for (const double shift : {0.0, 1e4}) {
    Model model;
    const Expression a = model.variable(kMin, "a", shift) - shift;
    const Expression b = model.variable(kMin, "b", shift) - shift;
    model.objective(-a);
    model.constraint(0.125 - pow(a - 1.5, 3.0) - b, 0.0, kNoBound);
    AutodiffProblem problem(model, {shift + 1.3, shift + 0.2});
    EXPECT_EQ(solve(problem, {}).certificate.kind, PointKind::LocalMinmax) << shift;
  }
}

TEST(RobustRows, ThatAreTheSameRowAgainChangeNothing) {
  for (const int times : {1, 3}) {
    Model model;
    const Expression a = model.variable(kMin, "a", 0.0, 10.0), b = model.variable(kMin, "b");
    const Expression y = model.variable(kMax, "y", -1.0, 1.0);
    model.objective(square(a - 3.0) + square(b - 1.0));
    for (int k = 0; k < times; ++k) model.constraint(a + b * y - square(y), -kNoBound, 1.0, kMin);
    AutodiffProblem problem(model, {0.5, 0.3, 0.1});
    const Result result = solve(problem, {});
    EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax) << times;
    EXPECT_NEAR(result.v[0], 0.939353, 1e-5) << times;
  }
}

/// A strict local minmax with active and inactive bounds and inequalities of both players, in other
/// units: v_i = unit_i times the variable, constraint j multiplied by weight_j, objective by
/// weight.
struct Measures {
  double objective = 1.0;
  std::vector<double> units = {1.0, 1.0, 1.0, 1.0};
  std::vector<double> weights = {1.0, 1.0, 1.0};
  std::vector<std::size_t> order = {0, 1, 2, 3};  ///< variable at each place
};

struct Measured {
  PointKind kind;
  std::vector<double> v;  ///< in the first units and order
};

Measured solve_in(const Measures& m) {
  constexpr Player players[] = {kMin, kMin, kMax, kMax};
  constexpr double lower[] = {-2.0, 0.0, -1.0, -3.0};
  constexpr double upper[] = {2.0, 2.0, 1.0, 3.0};
  constexpr double start[] = {0.7, 0.4, 0.2, 0.5};
  Model model;
  std::vector<Expression> v(4);
  std::vector<double> from(4);
  for (std::size_t place = 0; place < 4; ++place) {
    const std::size_t k = m.order[place];
    const double unit = m.units[k];
    v[k] = model.variable(players[k], "v" + std::to_string(k), lower[k] / unit, upper[k] / unit) *
           unit;
    from[place] = start[k] / unit;
  }
  const Expression &a = v[0], &b = v[1], &p = v[2], &q = v[3];
  // b stands at 0, p at 1; q answers a; a + b + p <= 3 stays open, q^2 + p <= a + 1.5 does not.
  model.objective(m.objective * (square(a) + 0.3 * a * q + b + 0.5 * square(b) + 0.4 * a * p -
                                 0.5 * square(q) + p - 0.1 * p * q + 0.05 * pow(a, 3.0)));
  model.constraint(m.weights[0] * (a + b + 0.2 * square(a)), -kNoBound, m.weights[0] * 3.0);
  model.constraint(m.weights[1] * (a - 2.0 * b), m.weights[1] * -0.05, kNoBound);
  model.constraint(m.weights[2] * (square(q) + p - a), -kNoBound, m.weights[2] * 1.0);
  AutodiffProblem problem(model, from);
  SolverOptions options;
  options.bound_relax_factor = 0.0;  // absolute for bounds below 1
  const Result result = solve(problem, options);
  if (result.v.size() != 4) throw std::runtime_error(result.message);
  Measured answer{result.certificate.kind, std::vector<double>(4)};
  for (std::size_t place = 0; place < 4; ++place) {
    answer.v[m.order[place]] = result.v[place] * m.units[m.order[place]];
  }
  return answer;
}

void expect_same(const Measures& measures, const Measured& plain, const std::string& what) {
  const Measured other = solve_in(measures);
  EXPECT_EQ(other.kind, plain.kind) << what;
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(other.v[k], plain.v[k], 1e-5) << what << ' ' << k;
}

TEST(Units, OfTheObjectiveChangeNothing) {
  const Measured plain = solve_in({});
  EXPECT_EQ(plain.kind, PointKind::LocalMinmax);
  for (int k = -8; k <= 8; ++k) {
    expect_same({.objective = std::pow(10.0, k)}, plain, "objective 1e" + std::to_string(k));
  }
}

TEST(Units, OfVariablesAndConstraintsChangeNothing) {
  const Measured plain = solve_in({});
  for (const double unit : {1e-4, 1e-2, 1e2, 1e4}) {
    expect_same({.units = {unit, unit, unit, unit}}, plain, "all " + std::to_string(unit));
    for (std::size_t k = 0; k < 4; ++k) {
      Measures measures;
      measures.units[k] = unit;
      expect_same(measures, plain, "variable " + std::to_string(k) + ' ' + std::to_string(unit));
    }
    for (std::size_t k = 0; k < 3; ++k) {
      Measures measures;
      measures.weights[k] = unit;
      expect_same(measures, plain, "constraint " + std::to_string(k) + ' ' + std::to_string(unit));
    }
  }
  expect_same({.order = {3, 1, 0, 2}}, plain, "permuted");
  expect_same({.order = {2, 3, 1, 0}}, plain, "permuted");
}

TEST(Units, OfABoundedGameChangeNothing) {
  for (int k = -8; k <= 8; ++k) {
    const double m = std::pow(10.0, k);
    Model model;
    const Expression x = model.variable(kMin, "x", 0.0, 2.0);
    const Expression y = model.variable(kMax, "y", -1.0, 1.0);
    model.objective(m * (x - 0.2 * square(x) - 0.5 * square(y)));
    AutodiffProblem problem(model, {0.5, 0.3});
    const Result result = solve(problem, SolverOptions{});
    EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax) << m;
    EXPECT_NEAR(result.v[0], 0.0, 1e-6) << m;
    EXPECT_NEAR(result.v[1], 0.0, 1e-6) << m;
  }
}

}  // namespace
}  // namespace ipminmax
