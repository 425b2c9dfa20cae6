// First-order points that are not local minmax, each handed to the solver as its starting point.
// It may say so or find a better point; it may never return the point as an answer.

#include <random>
#include <string>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include <problems/small_problems.hpp>
#include <support/dense_algebra.hpp>
#include <support/judge_result.hpp>
#include <support/without_hessian.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

/// Starting points inside the bounds stay where they are.
SolverOptions start_in_place() {
  SolverOptions options;
  options.bound_push = options.slack_bound_push = 1e-12;
  options.bound_frac = options.slack_bound_frac = 1e-12;
  return options;
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

void expect_refused(const std::string& what, const Model& model, const std::vector<double>& point) {
  SCOPED_TRACE(what);
  AutodiffProblem problem(model, point);
  for (const bool scaled : {true, false}) {
    SolverOptions options = start_in_place();
    if (!scaled) options.nlp_scaling_method = Scaling::None;
    for (const bool with_hessian : {true, false}) {
      SCOPED_TRACE(with_hessian ? "exact Hessian" : "differences");
      WithoutHessian blind(problem);
      const Result result = with_hessian ? solve(problem, options) : solve(blind, options);
      const DenseOptimality found = judge(problem, result);
      EXPECT_TRUE(is_sound(result, found)) << name_of(result.status) << ": " << found;
      if (is_success(result.status) || result.certificate.kind == PointKind::LocalMinmax) {
        EXPECT_GT(distance(result.v, point), 1e-3)
            << name_of(result.status) << ", " << name_of(result.certificate.kind) << ": " << found;
      }
    }
  }
}

void expect_first_order_but_refuted(const Model& model, const std::vector<double>& point) {
  AutodiffProblem problem(model);
  const DenseOptimality found = dense_optimality(problem, point);
  EXPECT_EQ(found.verdict, Verdict::NotLocalMinmax) << found;
}

/// v'Hv/2, the first nx variables Min's.
Model quadratic(const Eigen::MatrixXd& h, Eigen::Index nx) {
  Model model;
  std::vector<Expression> v;
  for (Eigen::Index i = 0; i < h.rows(); ++i) {
    v.push_back(model.variable(i < nx ? kMin : kMax, "v" + std::to_string(i)));
  }
  Expression f = 0.0;
  for (Eigen::Index i = 0; i < h.rows(); ++i) {
    for (Eigen::Index j = 0; j < h.cols(); ++j) {
      f += 0.5 * h(i, j) * v[static_cast<std::size_t>(i)] * v[static_cast<std::size_t>(j)];
    }
  }
  model.objective(f);
  return model;
}

void expect_quadratic_refused(const std::string& what, const Eigen::MatrixXd& h, Eigen::Index nx) {
  const Model model = quadratic(h, nx);
  const std::vector<double> origin(static_cast<std::size_t>(h.rows()), 0.0);
  expect_first_order_but_refuted(model, origin);
  expect_refused(what, model, origin);
}

TEST(Refusal, QuadraticsInOneAndOneVariable) {
  const auto refused = [](const char* what, double xx, double xy, double yy) {
    expect_quadratic_refused(what, Eigen::MatrixXd{{xx, xy}, {xy, yy}}, 1);
  };
  refused("minmin", 1.0, 0.0, 1.0);
  refused("minmin, coupled", 3.0, 1.0, 1.0);
  refused("maxmax", -1.0, 0.0, -1.0);
  refused("maxmax, coupled", -2.0, 1.0, -1.0);
  refused("maxmin", -1.0, 0.0, 1.0);
  refused("maxmin, coupled", -1.0, 0.5, 1.0);
  refused("K right, K_yy wrong: the paper's Example 2", 3.0, -4.0, 2.0);
  refused("K right, K_yy wrong: x'x + 4xy + y'y", 2.0, 4.0, 2.0);
  refused("flat in x alone, minmin by the coupling", 0.0, 1.0, 1.0);
}

TEST(Refusal, QuadraticsInTwoAndTwoVariables) {
  const auto diagonal = [](double x1, double x2, double y1, double y2) {
    return Eigen::MatrixXd(Eigen::Vector4d(x1, x2, y1, y2).asDiagonal());
  };
  expect_quadratic_refused("minmin", diagonal(1, 2, 1, 3), 2);
  expect_quadratic_refused("maxmax", diagonal(-1, -2, -1, -3), 2);
  expect_quadratic_refused("maxmin", diagonal(-1, -2, 1, 3), 2);
  expect_quadratic_refused("one wrong y", diagonal(1, 2, -1, 3), 2);
  expect_quadratic_refused("one wrong x", diagonal(1, -2, -1, -3), 2);
  expect_quadratic_refused("one wrong x and one wrong y", diagonal(1, -2, -1, 3), 2);
}

Eigen::Matrix4d random_symmetric(std::mt19937& random) {
  std::normal_distribution<double> normal;
  Eigen::Matrix4d a;
  for (Eigen::Index i = 0; i < 16; ++i) a.data()[i] = normal(random);
  return a + a.transpose();
}

struct Signs {
  int positive = 0;
  int negative = 0;
  double smallest = std::numeric_limits<double>::infinity();  ///< absolute eigenvalue
};

Signs signs_of(const Eigen::MatrixXd& a) {
  Signs signs;
  const Eigen::VectorXd values = symmetric_eigenvalues(a);
  for (const double value : values) {
    ++(value > 0.0 ? signs.positive : signs.negative);
    signs.smallest = std::min(signs.smallest, std::abs(value));
  }
  return signs;
}

/// Random 2+2 quadratics that pass exactly one of the two inertia counts, by rejection.
TEST(Refusal, RandomQuadraticsWithOneWrongInertia) {
  std::mt19937 random(11);
  int right_full = 0, right_inner = 0;
  while (right_full < 30 || right_inner < 30) {
    const Eigen::Matrix4d h = random_symmetric(random);
    const Signs full = signs_of(h);
    const Signs inner = signs_of(h.bottomRightCorner<2, 2>());
    if (std::min(full.smallest, inner.smallest) < 0.05) continue;
    const bool full_is_right = full.positive == 2;
    const bool inner_is_right = inner.negative == 2;
    if (full_is_right == inner_is_right) continue;
    int& count = full_is_right ? right_full : right_inner;
    if (++count > 30) continue;
    expect_quadratic_refused(full_is_right ? "K right, K_yy wrong" : "K_yy right, K wrong", h, 2);
  }
}

TEST(Refusal, StationaryPointsOfOnePlayer) {
  for (const Player player : {kMin, kMax}) {
    const double sign = player == kMin ? 1.0 : -1.0;  // Max gets the mirrored problem
    const auto refused = [&](const char* what, auto objective) {
      Model model;
      const Expression a = model.variable(player, "a");
      const Expression b = model.variable(player, "b");
      model.objective(sign * objective(a, b));
      expect_first_order_but_refuted(model, {0.0, 0.0});
      expect_refused(player == kMin ? what : std::string("mirrored: ") + what, model, {0.0, 0.0});
    };
    using E = Expression;
    refused("saddle", [](const E& a, const E& b) { return square(a) - square(b); });
    refused("maximum", [](const E& a, const E& b) { return -square(a) - square(b); });
    refused("saddle between two minima",
            [](const E& a, const E& b) { return square(a) - square(b) + pow(b, 4.0); });
    refused("local maximum of a bounded function",
            [](const E& a, const E& b) { return cos(a) + cos(b); });
    refused("saddle along the diagonal", [](const E& a, const E& b) { return a * b; });
  }
}

TEST(Refusal, LineWithNegativeCurvature) {
  Model minimize;
  minimize.objective(-square(minimize.variable(kMin, "x")));
  expect_refused("min -x^2", minimize, {0.0});
  Model maximize;
  maximize.objective(square(maximize.variable(kMax, "y")));
  expect_refused("max y^2", maximize, {0.0});
}

/// A linear function on a circle: each player's worst point is a first-order point too.
TEST(Refusal, WorstPointOnACircle) {
  for (const Player player : {kMin, kMax}) {
    Model model;
    const Expression a = model.variable(player, "a");
    const Expression b = model.variable(player, "b");
    model.objective(a + 2.0 * b);
    model.constraint(square(a) + square(b), 5.0, 5.0);
    const double worst = player == kMin ? 1.0 : -1.0;
    expect_first_order_but_refuted(model, {worst, 2.0 * worst});
    expect_refused("circle", model, {worst, 2.0 * worst});
  }
}

TEST(Refusal, WrongPointsOnBothCircles) {
  Model model;
  const Expression x1 = model.variable(kMin, "x1"), x2 = model.variable(kMin, "x2");
  const Expression y1 = model.variable(kMax, "y1"), y2 = model.variable(kMax, "y2");
  model.objective(x1 + y1 + 0.1 * x2 * y2);
  model.constraint(square(x1) + square(x2), 1.0, 1.0);
  model.constraint(square(y1) + square(y2), 1.0, 1.0);
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      if (x == -1.0 && y == 1.0) continue;  // the local minmax
      expect_first_order_but_refuted(model, {x, 0.0, y, 0.0});
      expect_refused("circles", model, {x, 0.0, y, 0.0});
    }
  }
}

/// The circle of the maximizer is centred at x: its Jacobian couples the players.
TEST(Refusal, NearestPointOfAMovingCircle) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y1 = model.variable(kMax, "y1"), y2 = model.variable(kMax, "y2");
  model.objective(y1 + square(x) / 2.0);
  model.constraint(square(y1 - x) + square(y2), 1.0, 1.0);
  expect_first_order_but_refuted(model, {-1.0, -2.0, 0.0});
  expect_refused("moving circle", model, {-1.0, -2.0, 0.0});
}

TEST(Refusal, ActiveBoundsWithWrongMultipliers) {
  constexpr double kInside = 1e-9;
  Model minimize;
  const Expression x = minimize.variable(kMin, "x", 0.0, 1.0);
  minimize.objective(x + 0.1 * square(x));
  expect_refused("min x at its upper bound", minimize, {1.0 - kInside});
  Model maximize;
  const Expression y = maximize.variable(kMax, "y", 0.0, 1.0);
  maximize.objective(y - 0.1 * square(y));
  expect_refused("max y at its lower bound", maximize, {kInside});
  Model both;
  const Expression u = both.variable(kMin, "u", -1.0, 1.0);
  const Expression w = both.variable(kMax, "w", -1.0, 1.0);
  both.objective(u + w + 0.2 * u * w);
  expect_refused("both at their worst bounds", both, {1.0 - kInside, -1.0 + kInside});
}

TEST(Refusal, WrongCurvatureAlongActiveBounds) {
  for (const Player player : {kMin, kMax}) {
    const double sign = player == kMin ? 1.0 : -1.0;
    Model model;
    const Expression a = model.variable(player, "a", 0.0, 2.0);
    const Expression b = model.variable(player, "b", -1.0, 1.0);
    model.objective(sign * (a - square(b)));
    expect_first_order_but_refuted(model, {0.0, 0.0});
    expect_refused("bound", model, {1e-9, 0.0});
  }
}

/// The gradient condition holds with the right sign; the constraint's own curvature is wrong.
TEST(Refusal, WrongCurvatureAlongAnActiveInequality) {
  for (const Player player : {kMin, kMax}) {
    const double sign = player == kMin ? 1.0 : -1.0;
    Model model;
    const Expression a = model.variable(player, "a", -10.0, 10.0);
    const Expression b = model.variable(player, "b", -2.0, 2.0);
    model.objective(sign * a);
    model.constraint(a + square(b), 0.0, kNoBound);  // a >= -b^2: going along it lowers a
    expect_first_order_but_refuted(model, {0.0, 0.0});
    expect_refused("inequality", model, {0.0, 0.0});
  }
}

/// At (0,0) the bound y >= 0 is active with multiplier 0. Where it is left (x > 0) the outer value
/// is x^2/2, where it stays active (x < 0) it is -x^2/2: no local minmax, though a test that takes
/// the bound for inactive passes. The only local minmax is (-1,0).
TEST(Refusal, WeaklyActiveMaxBoundWithOneBadBranch) {
  Model model;
  const Expression x = model.variable(kMin, "x", -1.0, 1.0);
  const Expression y = model.variable(kMax, "y", 0.0, 3.0);
  model.objective(-0.5 * square(x) + 2.0 * x * y - square(y));
  AutodiffProblem problem(model);
  for (const double x0 : {1e-6, 1e-3, 0.1, 0.5, 0.9}) {
    for (const double y0 : {1e-6, 1e-3, 0.1, 0.5, 1.0}) {
      problem.set_start({x0, y0});
      const Result result = solve(problem, start_in_place());
      if (result.certificate.kind == PointKind::LocalMinmax || result.status == Status::Solved) {
        EXPECT_NEAR(result.v[0], -1.0, 1e-5) << "from " << x0 << ", " << y0;
        EXPECT_NEAR(result.v[1], 0.0, 1e-5);
      }
    }
  }
}

/// The same for Min: x >= 0 is active with multiplier 0 and only it stops the descent along -x^2.
TEST(Refusal, WeaklyActiveMinBoundWithNegativeCurvature) {
  Model model;
  const Expression x = model.variable(kMin, "x", 0.0, 1.0);
  const Expression y = model.variable(kMax, "y");
  model.objective(-square(x) - square(y - x));
  expect_refused("weak bound of Min", model, {1e-9, 0.0});
}

/// f is convex in y and the bound's multiplier is 0, so moving off the bound pays.
TEST(Refusal, WeaklyActiveMaxBoundWithPositiveCurvature) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y", 0.0, 1.0);
  model.objective(square(x) + square(y));
  expect_refused("weak bound of Max", model, {0.0, 1e-9});
}

TEST(Refusal, StationaryPointsOfTheCollection) {
  for (const SmallProblem& known : small_problems()) {
    for (const auto& point : known.not_minmax) expect_refused(known.name, known.model, point);
  }
}

}  // namespace
}  // namespace ipminmax::testing
