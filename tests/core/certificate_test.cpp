#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include <support/autodiff_problem.hpp>
#include <support/certified_point.hpp>
#include <support/dense_algebra.hpp>
#include <support/function_problem.hpp>

#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::certify;
using testing::Expression;
using testing::FunctionProblem;
using testing::kNoBound;
using testing::Model;

using Point = testing::CertifiedPoint;
constexpr double kMu = Point::kMu;
constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

void expect_consistent(const Certificate& c) {
  EXPECT_EQ(c.kind == PointKind::LocalMinmax, c.second_order == SecondOrder::Satisfied);
  EXPECT_EQ(c.margin > 0.0, c.second_order == SecondOrder::Satisfied);
  if (c.second_order == SecondOrder::Satisfied) {
    EXPECT_EQ(c.inner, c.inner_expected);
    EXPECT_EQ(c.full, c.full_expected);
  }
}

Certificate certify_quadratic(std::vector<Player> players, const Eigen::MatrixXd& h,
                              LinearSolver solver = LinearSolver::Auto) {
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(h.rows());
  auto problem = FunctionProblem::quadratic(std::move(players), h, zero, zero);
  SolverOptions options;
  options.linear_solver = solver;
  return Point(problem, std::vector<double>(static_cast<std::size_t>(h.rows()), 0.0), {}, options)
      .certify();
}

class CertificateBySolver : public ::testing::TestWithParam<LinearSolver> {};

TEST_P(CertificateBySolver, ScalarSaddlesOfAllSigns) {
  // a x^2 / 2 + c x y + b y^2 / 2: local minmax iff b < 0 and a - c^2 / b > 0.
  for (const double a : {-2.0, 0.5, 3.0}) {
    for (const double b : {-2.0, -0.5, 1.0}) {
      for (const double c : {0.0, 1.0, -4.0}) {
        const Certificate found =
            certify_quadratic({kMin, kMax}, Eigen::MatrixXd{{a, c}, {c, b}}, GetParam());
        const double outer = a - c * c / b;
        const SecondOrder expected = b > 0.0 || outer < 0.0 ? SecondOrder::Violated
                                     : outer == 0.0         ? SecondOrder::Flat
                                                            : SecondOrder::Satisfied;
        EXPECT_EQ(found.second_order, expected) << a << ' ' << b << ' ' << c;
        EXPECT_EQ(found.inner_expected, (Inertia{0, 1, 0}));
        EXPECT_EQ(found.full_expected, (Inertia{1, 1, 0}));
        expect_consistent(found);
      }
    }
  }
}

TEST_P(CertificateBySolver, RandomSaddlesNeedBothInertias) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  int satisfied = 0;
  int full_right_inner_wrong = 0;
  int inner_right_full_wrong = 0;
  for (int k = 0; k < 600; ++k) {
    Eigen::MatrixXd h = Eigen::MatrixXd::NullaryExpr(4, 4, [&] { return uniform(random); });
    h = (h + h.transpose()).eval();
    const Eigen::MatrixXd yy = h.bottomRightCorner(2, 2);
    const Eigen::MatrixXd schur =
        h.topLeftCorner(2, 2) - h.topRightCorner(2, 2) * yy.inverse() * h.bottomLeftCorner(2, 2);
    const bool inner = testing::symmetric_eigenvalues(yy).maxCoeff() < 0.0;
    const bool minmax = inner && testing::symmetric_eigenvalues(schur).minCoeff() > 0.0;
    const bool full = (testing::symmetric_eigenvalues(h).array() < 0.0).count() == 2;
    const Certificate found = certify_quadratic({kMin, kMin, kMax, kMax}, h, GetParam());
    EXPECT_EQ(found.second_order, minmax ? SecondOrder::Satisfied : SecondOrder::Violated) << h;
    EXPECT_EQ(found.inner == found.inner_expected, inner) << h;
    EXPECT_EQ(found.full == found.full_expected, full) << h;
    expect_consistent(found);
    satisfied += minmax;
    full_right_inner_wrong += full && !inner;
    inner_right_full_wrong += inner && !full;
  }
  EXPECT_GT(satisfied, 20);
  EXPECT_GT(full_right_inner_wrong, 20);
  EXPECT_GT(inner_right_full_wrong, 20);
}

TEST_P(CertificateBySolver, SingularCurvatureOfMaxIsNoObstacleOfMinItIs) {
  const auto expect = [&](const Eigen::MatrixXd& h, SecondOrder outcome) {
    const Certificate found = certify_quadratic({kMin, kMax}, h, GetParam());
    EXPECT_EQ(found.second_order, outcome) << h;
    const bool certified = outcome == SecondOrder::Satisfied;
    EXPECT_EQ(found.kind, certified ? PointKind::LocalMinmax : PointKind::FirstOrderPoint);
    if (!certified) expect_consistent(found);
    EXPECT_EQ(found.answer == InnerAnswer::BestNotUnique, certified && h(1, 1) == 0.0);
  };
  // x y and flat in y: y is not strictly best.
  expect(Eigen::MatrixXd{{0.0, 1.0}, {1.0, 0.0}}, SecondOrder::Satisfied);
  expect(Eigen::MatrixXd{{1.0, 0.0}, {0.0, 0.0}}, SecondOrder::Satisfied);
  // Nothing reads x, and a flat direction of phi alone.
  expect(Eigen::MatrixXd{{0.0, 0.0}, {0.0, -1.0}}, SecondOrder::Satisfied);
  expect(Eigen::MatrixXd{{-1.0, 1.0}, {1.0, -1.0}}, SecondOrder::Flat);
}

TEST_P(CertificateBySolver, ManyZeroEigenvaluesAreNoWrongSign) {
  constexpr Eigen::Index kSize = 60;
  for (const Player player : {kMin, kMax}) {
    const Eigen::MatrixXd h = (player == kMin ? 1.0 : -1.0) * Eigen::MatrixXd::Ones(kSize, kSize);
    const Certificate found = certify_quadratic(std::vector<Player>(kSize, player), h, GetParam());
    EXPECT_NE(found.second_order, SecondOrder::Violated);
    const bool certified = found.kind == PointKind::LocalMinmax;
    EXPECT_TRUE(!certified || found.reasons.front().text.find("not unique") != std::string::npos);
  }
}

INSTANTIATE_TEST_SUITE_P(Solvers, CertificateBySolver,
                         ::testing::Values(LinearSolver::Auto, LinearSolver::Lapack,
                                           LinearSolver::Mumps, LinearSolver::Ldlt));

TEST(CertificateOfOnePlayer, MinimaAndMaxima) {
  const Eigen::MatrixXd positive{{2.0, 1.0}, {1.0, 3.0}};
  const Eigen::MatrixXd saddle{{1.0, 2.0}, {2.0, 1.0}};
  EXPECT_EQ(certify_quadratic({kMin, kMin}, positive).second_order, SecondOrder::Satisfied);
  EXPECT_EQ(certify_quadratic({kMin, kMin}, -positive).second_order, SecondOrder::Violated);
  EXPECT_EQ(certify_quadratic({kMin, kMin}, saddle).second_order, SecondOrder::Violated);
  EXPECT_EQ(certify_quadratic({kMax, kMax}, -positive).second_order, SecondOrder::Satisfied);
  EXPECT_EQ(certify_quadratic({kMax, kMax}, positive).second_order, SecondOrder::Violated);
  EXPECT_EQ(certify_quadratic({kMax, kMax}, saddle).second_order, SecondOrder::Violated);
}

TEST(CertificateOfOnePlayer, TheCurvatureToleranceSeparatesZeroFromSmall) {
  // Relative to the curvature of the variables, whatever its size: (1000, small) are the eigenvalues
  // of a matrix whose diagonal is about (500, 500) unit^2.
  const auto second_order = [](double small, double unit) {
    const double mean = 0.5 * (1000.0 + small) * unit * unit;
    const double half = 0.5 * (1000.0 - small) * unit * unit;
    return certify_quadratic({kMin, kMin}, Eigen::MatrixXd{{mean, half}, {half, mean}})
        .second_order;
  };
  for (const double unit : {1e-4, 1.0, 1e4}) {
    EXPECT_EQ(second_order(1e-4, unit), SecondOrder::Satisfied) << unit;
    EXPECT_EQ(second_order(1e-6, unit), SecondOrder::Undecided) << unit;
    EXPECT_EQ(second_order(-1e-6, unit), SecondOrder::Undecided) << unit;
    EXPECT_EQ(second_order(-1e-4, unit), SecondOrder::Violated) << unit;
  }
}

TEST(CertificateOfOnePlayer, AVariableOfItsOwnMayHaveAnyCurvature) {
  const auto second_order = [](double small) {
    return certify_quadratic({kMin, kMin}, Eigen::MatrixXd{{1000.0, 0.0}, {0.0, small}})
        .second_order;
  };
  EXPECT_EQ(second_order(1e-6), SecondOrder::Satisfied);
  EXPECT_EQ(second_order(-1e-6), SecondOrder::Violated);
  EXPECT_EQ(second_order(0.0), SecondOrder::Satisfied);  // read by nothing
}

TEST(DegeneratePowers, AreNeverSatisfiedOnTheWayToZero) {
  // Points that meet the tolerances: |derivative| <= 1e-8.
  for (const int power : {3, 4}) {
    for (const double distance : {0.0, 1e-6, 1e-5, 5e-5, 1e-3}) {
      for (const double at : {distance, -distance}) {
        if (power * std::pow(distance, power - 1) > 1e-8) continue;
        for (const Player player : {kMin, kMax}) {
          Model model;
          const Expression t = model.variable(player, "t");
          model.objective((player == kMin ? 1.0 : -1.0) * pow(t, power));
          const Certificate found = certify(model, {at});
          EXPECT_NE(found.second_order, SecondOrder::Satisfied) << power << ' ' << at;
          if (power == 4 || distance == 0.0) {
            EXPECT_EQ(found.second_order, SecondOrder::Undecided) << power << ' ' << at;
          }
          expect_consistent(found);
        }
      }
    }
  }
}

// min over x of x, x >= 0: the multiplier 1 has the right sign.
TEST(DegeneratePowers, AreSeenThroughANonsingularMatrix) {
  // x^2 + y^3 + x y: K is nonsingular at 0 although K_yy is not, so Newton's method converges fast, and
  // on its way there K_yy has little curvature of either sign.
  for (const int power : {3, 5}) {
    for (const double y : {-1e-6, -8.6e-9, -1e-10, 0.0, 1e-10, 8.6e-9, 1e-6}) {
      Model model;
      const Expression x = model.variable(kMin, "x");
      const Expression z = model.variable(kMax, "y");
      model.objective(square(x) + x * z + z * square(z) * (power == 5 ? square(z) : 1.0));
      const Certificate found = certify(model, {-0.5 * y, y}, {});
      EXPECT_NE(found.kind, PointKind::LocalMinmax) << power << ' ' << y;
    }
  }
}

TEST(ActiveBounds, WithTheRightMultiplierReplaceCurvature) {
  for (const Player player : {kMin, kMax}) {
    const double sign = player == kMin ? 1.0 : -1.0;
    for (const double curvature : {-5.0, 0.0, 5.0}) {
      for (const bool lower : {true, false}) {
        Model model;
        const Expression t =
            lower ? model.variable(player, "t", 0.0) : model.variable(player, "t", -kNoBound, 0.0);
        model.objective(sign * ((lower ? 1.0 : -1.0) * t + curvature * square(t)));
        const Certificate found = certify(model, {0.0});
        EXPECT_EQ(found.second_order, SecondOrder::Satisfied) << curvature << ' ' << lower;
        EXPECT_TRUE(found.licq_min && found.licq_max);
        EXPECT_EQ(found.weakly_active_min + found.weakly_active_max, 0);
      }
    }
  }
}

TEST(ActiveBounds, WithoutMultiplierDoNotHideCurvature) {
  // Stationary at 0, -t^2 on t >= -1e-3.
  for (const Player player : {kMin, kMax}) {
    const double sign = player == kMin ? 1.0 : -1.0;
    Model model;
    const Expression t = model.variable(player, "t", -1e-3);
    model.objective(-sign * square(t));
    AutodiffProblem problem(model, {0.0});
    Point point(problem, {0.0});
    point.set_bound(0, true, 1e-3, 1e-6);  // z / s = 1e-3: inactive
    const Certificate found = point.certify();
    EXPECT_EQ(found.second_order, SecondOrder::Violated);
    EXPECT_EQ(found.weakly_active_min + found.weakly_active_max, 0);
  }
}

TEST(ActiveBounds, InactiveOnesLeaveTheInteriorVerdict) {
  Model good;
  const Expression x = good.variable(kMin, "x", -1.0, 2.0);
  const Expression y = good.variable(kMax, "y", -1.0, 2.0);
  good.objective(square(x) + x * y - square(y));
  EXPECT_EQ(certify(good, {0.0, 0.0}).second_order, SecondOrder::Satisfied);
  Model bad;
  const Expression u = bad.variable(kMin, "x", -1.0, 2.0);
  const Expression w = bad.variable(kMax, "y", -1.0, 2.0);
  bad.objective(square(u) + u * w + 0.1 * square(w));
  EXPECT_EQ(certify(bad, {0.0, 0.0}).second_order, SecondOrder::Violated);
}

TEST(WeaklyActiveBounds, AreCountedAndHideNoWrongCurvature) {
  // z and s alike: no strict complementarity, -t^2 is held only by the bound.
  for (const Player player : {kMin, kMax}) {
    const double sign = player == kMin ? 1.0 : -1.0;
    Model model;
    const Expression t = model.variable(player, "t", 0.0);
    model.objective(-sign * 0.125 * square(t));
    AutodiffProblem problem(model, {0.0});
    Point point(problem, {0.0});
    point.set_bound(0, true, 3e-5, 3e-5);
    const Certificate found = point.certify();
    EXPECT_NE(found.second_order, SecondOrder::Satisfied);
    EXPECT_EQ(found.weakly_active_min, player == kMin ? 1 : 0);
    EXPECT_EQ(found.weakly_active_max, player == kMin ? 0 : 1);
  }
}

// Little curvature leaves the barrier far from the bound: the solution is returned, with multipliers
// that vanish. Hock and Schittkowski 21, modified.
TEST(WeaklyActiveBounds, OfMinFarFromThePointAreGoneTo) {
  Model model;
  const Expression x1 = model.variable(kMin, "x1", 2.0, 50.0);
  const Expression x2 = model.variable(kMin, "x2", -50.0, 50.0);
  const Expression x3 = model.variable(kMin, "x3", -kNoBound, 50.0);
  const Expression x4 = model.variable(kMin, "x4", 2.0), x5 = model.variable(kMin, "x5");
  const Expression x6 = model.variable(kMin, "x6", -kNoBound, 0.0);
  const Expression x7 = model.variable(kMin, "x7", 0.0);
  model.objective(0.01 * (square(x1) + square(x3) + square(x6)) + square(x2) + square(x4) +
                  square(x5) + square(x7));
  model.constraint(10.0 * x1 - x2, 10.0, kNoBound);
  AutodiffProblem problem(model, {-1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  const Result result = solve(problem, {});
  EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax) << result.message;
  EXPECT_EQ(result.certificate.weakly_active_min, 2);
  EXPECT_NEAR(result.v[5], 0.0, 1e-6);
}

TEST(DependentRows, OfALinearProgramMayBeMany) {
  // min t, |x_i| <= t: 2 n active rows meet at zero.
  Model model;
  const Expression t = model.variable(kMin, "t");
  model.objective(t);
  constexpr int kVariables = 40;
  for (int i = 0; i < kVariables; ++i) {
    const Expression x = model.variable(kMin, "x" + std::to_string(i));
    model.constraint(x - t, -kNoBound, 0.0);
    model.constraint(-1.0 * x - t, -kNoBound, 0.0);
  }
  std::vector<double> start(kVariables + 1, 0.5);
  start[0] = 2.0;
  AutodiffProblem problem(model, start);
  const Result result = solve(problem, {});
  EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax) << result.message;
}

TEST(WeaklyActiveBounds, AreHarmlessWhereTheCurvatureIsRightWithoutThem) {
  // t^2 on t >= 0: z = 2 s on the central path, s z = mu.
  Model model;
  const Expression t = model.variable(kMin, "t", 0.0);
  model.objective(square(t));
  AutodiffProblem problem(model, {0.0});
  Point point(problem, {0.0});
  const double s = std::sqrt(kMu / 2.0);
  point.set_bound(0, true, s, 2.0 * s);
  const Certificate found = point.certify();
  EXPECT_EQ(found.weakly_active_min, 1);
  EXPECT_EQ(found.second_order, SecondOrder::Satisfied);
}

/// x^2 + y^2 = 1 of one player with objective t: extreme points (0, +-1) of the vertical t.
Certificate certify_circle(Player player, double at) {
  Model model;
  const Expression s = model.variable(player, "s");
  const Expression t = model.variable(player, "t");
  model.objective(t);
  model.constraint(square(s) + square(t), 1.0, 1.0);
  return certify(model, {0.0, at}, {-1.0 / (2.0 * at)});
}

TEST(EqualityConstraints, TheCircleHasItsMinimumBelowAndItsMaximumAbove) {
  EXPECT_EQ(certify_circle(kMin, -1.0).second_order, SecondOrder::Satisfied);
  EXPECT_EQ(certify_circle(kMin, 1.0).second_order, SecondOrder::Violated);
  EXPECT_EQ(certify_circle(kMax, 1.0).second_order, SecondOrder::Satisfied);
  EXPECT_EQ(certify_circle(kMax, -1.0).second_order, SecondOrder::Violated);
  const Certificate found = certify_circle(kMax, 1.0);
  EXPECT_EQ(found.inner_expected, (Inertia{1, 2, 0}));
  EXPECT_EQ(found.full_expected, (Inertia{1, 2, 0}));
  EXPECT_TRUE(found.licq_max);
}

TEST(Inequalities, CountTheirSlacksInTheInertias) {
  // max over y of -(y - 2)^2, y <= 1 as a constraint: lambda = f_y = -2 (y - 2) ... = -2.
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(square(x) - square(y - 2.0));
  model.constraint(1.0 * y, -kNoBound, 1.0);
  const Certificate found = certify(model, {0.0, 1.0}, {-2.0});
  EXPECT_EQ(found.second_order, SecondOrder::Satisfied);
  EXPECT_EQ(found.inner_expected, (Inertia{1, 2, 0}));
  EXPECT_EQ(found.full_expected, (Inertia{2, 2, 0}));
  EXPECT_TRUE(found.licq_max);
}

TEST(MaxConstraintsThatDependOnX, CurveTheOuterProblem) {
  // max y s.t. y = a x^2 leaves phi(x) = b x^2 + a x^2.
  const auto verdict = [](double a, double b) {
    Model model;
    const Expression x = model.variable(kMin, "x");
    const Expression y = model.variable(kMax, "y");
    model.objective(y + b * square(x));
    model.constraint(y - a * square(x), 0.0, 0.0);
    return certify(model, {0.0, 0.0}, {-1.0}).second_order;
  };
  EXPECT_EQ(verdict(1.0, 0.0), SecondOrder::Satisfied);
  EXPECT_EQ(verdict(-1.0, 0.0), SecondOrder::Violated);
  EXPECT_EQ(verdict(-1.0, 2.0), SecondOrder::Satisfied);
  EXPECT_EQ(verdict(2.0, -3.0), SecondOrder::Violated);
  EXPECT_EQ(verdict(1.0, -1.0), SecondOrder::Flat);
}

TEST(MaxConstraintsThatDependOnX, CountWhenTheyAreActiveInequalities) {
  // max y s.t. y <= a x^2, lambda = -1.
  const auto verdict = [](double a) {
    Model model;
    const Expression x = model.variable(kMin, "x");
    const Expression y = model.variable(kMax, "y");
    model.objective(1.0 * y);
    model.constraint(y - a * square(x), -kNoBound, 0.0);
    return certify(model, {0.0, 0.0}, {-1.0}).second_order;
  };
  EXPECT_EQ(verdict(1.0), SecondOrder::Satisfied);
  EXPECT_EQ(verdict(-1.0), SecondOrder::Violated);
}

TEST(DependentConstraints, ThatSayTheSameTwiceLeaveTheModelAsItIs) {
  for (const Player player : {kMin, kMax}) {
    Model model;
    const Expression x = model.variable(kMin, "x");
    const Expression x1 = model.variable(kMin, "x1");
    const Expression y = model.variable(kMax, "y");
    const Expression y1 = model.variable(kMax, "y1");
    model.objective(square(x) + square(x1) - square(y) - square(y1));
    const Expression sum = player == kMin ? x + x1 : y + y1;
    model.constraint(sum, 0.0, 0.0);
    model.constraint(2.0 * sum, 0.0, 0.0);
    const Certificate found = certify(model, {0.0, 0.0, 0.0, 0.0}, {0.0, 0.0});
    EXPECT_EQ(found.second_order, SecondOrder::Satisfied);
    EXPECT_EQ(found.licq_min, player == kMax);
    EXPECT_EQ(found.licq_max, player == kMin);
    ASSERT_EQ(found.reasons.size(), 1U);
    EXPECT_EQ(found.reasons[0].kind, CertificateReason::Kind::Dependent);
    EXPECT_EQ(found.reasons[0].player, player);
    EXPECT_EQ(found.reasons[0].constraints, (std::vector<Index>{0, 1}));
    EXPECT_NE(found.reasons[0].text.find("g1"), std::string::npos) << found.reasons[0].text;
    EXPECT_NE(found.reasons[0].text.find("g2"), std::string::npos) << found.reasons[0].text;
  }
}

TEST(DependentConstraints, DoNotHideAWrongSign) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y0 = model.variable(kMax, "y0");
  const Expression y1 = model.variable(kMax, "y1");
  model.objective(square(x) + square(y0) + square(y1));
  model.constraint(y0 + y1, 0.0, 0.0);
  model.constraint(2.0 * y0 + 2.0 * y1, 0.0, 0.0);
  EXPECT_EQ(certify(model, {0.0, 0.0, 0.0}, {0.0, 0.0}).second_order, SecondOrder::Violated);
}

TEST(DependentConstraints, OfActiveInequalitiesShareTheMultiplier) {
  // y <= 0 twice, each with half of the multiplier.
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(square(x) + 2.0 * y);
  model.constraint(1.0 * y, -kNoBound, 0.0);
  model.constraint(3.0 * y, -kNoBound, 0.0);
  const Certificate found = certify(model, {0.0, 0.0}, {-1.0, -1.0 / 3.0});
  EXPECT_FALSE(found.licq_max);
  EXPECT_EQ(found.second_order, SecondOrder::Satisfied);
}

TEST(DependentConstraints, OfBothPlayersAtOnceAreSeen) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(2.0 * y + 2.0 * x);
  model.constraint(1.0 * x, 0.0, kNoBound);
  model.constraint(3.0 * x, 0.0, kNoBound);
  model.constraint(1.0 * y, -kNoBound, 0.0);
  model.constraint(3.0 * y, -kNoBound, 0.0);
  const Certificate found = certify(model, {0.0, 0.0}, {-1.0, -1.0 / 3.0, -1.0, -1.0 / 3.0});
  EXPECT_FALSE(found.licq_min);
  EXPECT_FALSE(found.licq_max);
  EXPECT_EQ(found.second_order, SecondOrder::Satisfied);
  EXPECT_EQ(found.reasons.size(), 2U);
}

TEST(CertificateOfNothing, IsSatisfied) {
  const Certificate found = certify(Model{}, {});
  EXPECT_EQ(found.second_order, SecondOrder::Satisfied);
  EXPECT_EQ(found.full_expected, (Inertia{0, 0, 0}));
}

}  // namespace
}  // namespace ipminmax
