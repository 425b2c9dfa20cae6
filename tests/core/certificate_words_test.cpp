// Dependent rows, weakly active bounds, flat directions, what is known of y, reasons by name, and
// what it costs.
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>
#include <support/certified_point.hpp>
#include <support/units_problem.hpp>

#include "core/parallel/ranks.hpp"
#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

using Kind = CertificateReason::Kind;
constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

const CertificateReason* find(const Certificate& found, Kind kind) {
  for (const CertificateReason& reason : found.reasons) {
    if (reason.kind == kind) return &reason;
  }
  return nullptr;
}
bool names(const CertificateReason* reason, const char* name) {
  return reason != nullptr && reason->text.find(name) != std::string::npos;
}
Certificate solved(const Model& model, const std::vector<double>& start,
                   const SolverOptions& options = {}) {
  AutodiffProblem problem(model, start);
  return solve(problem, options).certificate;
}

// Rows that are combinations at every point are left out; those that touch at the point alone are
// not.

TEST(DependentRows, NonlinearOnesThatSayTheSameAreLeftOut) {
  Model model;
  const Expression a = model.variable(kMin, "a"), b = model.variable(kMin, "b");
  model.objective(b);
  model.constraint(square(a) + square(b), 1.0, 1.0);
  model.constraint(3.0 * square(a) + 3.0 * square(b), 3.0, 3.0);
  const Certificate below = certify(model, {0.0, -1.0}, {0.5, 0.0});
  EXPECT_EQ(below.second_order, SecondOrder::Satisfied);
  EXPECT_FALSE(below.licq_min);
  EXPECT_EQ(certify(model, {0.0, 1.0}, {-0.5, 0.0}).second_order, SecondOrder::Violated);
}

TEST(DependentRows, ABoundRepeatedAsARowIsNoObstacle) {
  for (const double times : {0.0, 1.0, -1.0, 2.0}) {
    for (const Player owner : {kMin, kMax}) {
      Model model;
      const bool inner = owner == kMax;
      const Expression x = model.variable(kMin, "x", inner ? -kNoBound : -1.0, kNoBound);
      const Expression y = model.variable(kMax, "y", -kNoBound, inner ? 1.0 : kNoBound);
      if (inner) {
        model.objective(square(x) + x * y + y);  // y = 1, x = -1/2
        if (times != 0.0)
          model.constraint(times * y, times > 0.0 ? -kNoBound : times,
                           times > 0.0 ? times : kNoBound);
      } else {
        model.objective(square(x) + 3.0 * x + x * y - square(y));  // x = -1, y = -1/2
        if (times != 0.0)
          model.constraint(times * x, times > 0.0 ? -times : -kNoBound,
                           times > 0.0 ? kNoBound : -times);
      }
      AutodiffProblem problem(model, {0.3, 0.2});
      const Result found = solve(problem, {});
      EXPECT_EQ(found.certificate.second_order, SecondOrder::Satisfied) << times << inner;
      EXPECT_EQ(found.certificate.answer, InnerAnswer::Smooth) << times << inner;
      EXPECT_LE(found.factorizations, 20) << times << inner;
    }
  }
}

TEST(DependentRows, BalancesOfNearlySeparateCirclesAreOneTooMany) {
  // Flows around two circles of nodes, and a thousandth of one from one to the other: balances of
  // each circle alone nearly follow from each other, those of both do.
  constexpr std::size_t kNodes = 6;
  Model model;
  const Expression between = model.variable(kMin, "t");
  Expression cost = square(between - 1.0);
  std::vector<Expression> flow;
  for (std::size_t k = 0; k < 2 * kNodes; ++k) {
    flow.push_back(model.variable(kMin, "q" + std::to_string(k)));
    cost = cost + square(flow[k] - std::cos(static_cast<double>(k)));
  }
  model.objective(cost);
  for (std::size_t circle = 0; circle < 2; ++circle) {
    for (std::size_t i = 0; i < kNodes; ++i) {
      const std::size_t first = circle * kNodes;
      const Expression sum = flow[first + i] - flow[first + (i + kNodes - 1) % kNodes];
      const double share = i > 0 ? 0.0 : circle == 0 ? 1e-3 : -1e-3;
      model.constraint(sum + share * between, 0.0, 0.0);
    }
  }
  const Certificate found = solved(model, std::vector<double>(2 * kNodes + 1, 10.0));
  EXPECT_EQ(found.second_order, SecondOrder::Satisfied);
  EXPECT_TRUE(names(find(found, Kind::Dependent), "redundant"));
}

TEST(DependentRows, AVertexMayHaveMoreActiveRowsThanVariables) {
  // Bounds and two rows meet in (0, 0); the equation follows from the bounds.
  Model model;
  const Expression a = model.variable(kMin, "a", 0.0), b = model.variable(kMin, "b", 0.0);
  model.objective(2.0 * a + 3.0 * b);
  model.constraint(a + b, 0.0, kNoBound);
  model.constraint(a - b, 0.0, 0.0);
  const Certificate found = solved(model, {0.5, 0.7});
  EXPECT_EQ(found.second_order, SecondOrder::Satisfied);
  EXPECT_TRUE(names(find(found, Kind::Dependent), "g"));
}

TEST(DependentRows, OnesThatTouchAtThePointAloneAreNotTrusted) {
  // y = 0 and y = x^3 (hs220's kind): feasible at 0 alone, without curvature to speak of; and
  // y = 0, y = x^2.
  for (const double power : {2.0, 3.0}) {
    Model model;
    const Expression x = model.variable(kMin, "x"), y = model.variable(kMin, "y");
    model.objective(square(x) + square(y));
    model.constraint(1.0 * y, 0.0, 0.0);
    model.constraint(y - pow(x, power), 0.0, 0.0);
    const Certificate found = certify(model, {0.0, 0.0}, {0.0, 0.0});
    EXPECT_NE(found.second_order, SecondOrder::Satisfied);
    EXPECT_NE(found.second_order, SecondOrder::Violated);
    EXPECT_TRUE(names(find(found, Kind::Dependent), "at this point"));
  }
}

/// min height over the greater of 0 and a curve, and of b^2: at 0 both gradients are the same, and
/// so they are with a maximizer who answers to a.
Certificate above_curve(double slope, double square_part, double cubic_part, bool game) {
  Model model;
  const Expression a = model.variable(kMin, "a"), h = model.variable(kMin, "h", 0.0);
  Expression f = h + slope * square(a);
  if (game) {
    const Expression y = model.variable(kMax, "y");
    f = f + 0.2 * a * y - square(y);
  }
  model.objective(f);
  model.constraint(h - square_part * square(a) - cubic_part * pow(a, 3.0), 0.0, kNoBound);
  return solved(model, game ? std::vector{0.4, 1.0, 0.1} : std::vector{0.4, 1.0});
}

TEST(DependentRows, OfMinAtThePointAloneAreNotCertified) {
  for (const bool game : {false, true}) {
    const Certificate found = above_curve(0.0, 1.0, 0.0, game);
    EXPECT_EQ(found.second_order, SecondOrder::Undecided);
    EXPECT_FALSE(found.reasons.empty());
  }
}

TEST(DependentRows, OfMinWithoutCurvatureAreNotCertified) {
  const Certificate open = above_curve(0.0, -1.0, 0.0, false);  // far from the curve, below 0
  EXPECT_TRUE(open.kind != PointKind::LocalMinmax ||
              names(find(open, Kind::FlatDirection), "not unique"));
  EXPECT_NE(above_curve(0.0, 0.0, 1.0, false).second_order, SecondOrder::Satisfied);  // half flat
  // Falls to both sides.
  EXPECT_NE(above_curve(-2.0, 1.0, 0.0, false).kind, PointKind::LocalMinmax);
}

TEST(DependentRows, SquaredEquationsHaveNoGradient) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  model.objective(square(x));
  model.constraint(square(x), 0.0, 0.0);
  const Certificate found = certify(model, {0.0}, {0.0});
  EXPECT_EQ(found.second_order, SecondOrder::Undecided);
  EXPECT_TRUE(names(find(found, Kind::VanishingGradient), "g1"));
}

TEST(DependentRows, OfMaxAtOneXAloneAreNotCertified) {
  // y = x and y = 2 x: an answer at x = 0 alone, no function y(x).
  Model model;
  const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y");
  const Expression w = model.variable(kMax, "w");
  model.objective(square(x) - square(y) - square(w));
  model.constraint(y - x, 0.0, 0.0);
  model.constraint(y - 2.0 * x, 0.0, 0.0);
  const Certificate found = certify(model, {0.0, 0.0, 0.0}, {0.0, 0.0});
  EXPECT_EQ(found.second_order, SecondOrder::Undecided);
  EXPECT_EQ(found.answer, InnerAnswer::Unknown);
  EXPECT_FALSE(found.licq_max);
}

TEST(DependentRows, OfMaxThatPinchYAtABoundOfXAreNotCertified) {
  // y <= -x and y >= x on x >= 0: no answer but at x = 0, where Min's bound is active.
  Model model;
  const Expression x = model.variable(kMin, "x", 0.0), y = model.variable(kMax, "y");
  model.objective(10.0 * x + 2.0 * y);
  model.constraint(y + x, -kNoBound, 0.0);
  model.constraint(y - x, 0.0, kNoBound);
  const Certificate found = certify(model, {0.0, 0.0}, {-3.0, 1.0});
  EXPECT_NE(found.kind, PointKind::LocalMinmax);
  EXPECT_EQ(found.answer, InnerAnswer::Unknown);
}

/// max over (h, a) of -h - inner a^2 + 2 x a on h >= 0 and h >= a^2: at 0 both gradients are alike.
/// phi(x) = x^2 / (1 + inner) + outer x^2, without the row it would be x^2 / inner + outer x^2.
Model below_curve(double inner, double outer) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression a = model.variable(kMax, "a"), h = model.variable(kMax, "h", 0.0);
  model.objective(outer * square(x) + 2.0 * x * a - h - inner * square(a));
  model.constraint(h - square(a), 0.0, kNoBound);
  return model;
}

TEST(DependentRows, OfMaxAreNotDroppedForMin) {
  // Without the row phi would be 0.3 x^2 and more; it is -0.2 x^2.
  const Model game = below_curve(1.0, -0.7);
  for (const double share : {0.0, 0.3, 1.0}) {
    EXPECT_NE(certify(game, {0.0, 0.0, 0.0}, {share}).kind, PointKind::LocalMinmax) << share;
  }
  EXPECT_NE(solved(game, {1e-4, 1e-4, 1e-4}).kind, PointKind::LocalMinmax);
}

TEST(LengthsOfX, AYThatCannotMoveGivesNoCurvature) {
  // The equation holds w.
  Model model;
  const Expression u = model.variable(kMin, "u"), w = model.variable(kMax, "w");
  model.objective(u * (w - 2.0) + 1e-9 * w);
  model.constraint(square(w), 4.0, 4.0);
  EXPECT_NE(solved(model, {0.3, 2.1}).second_order, SecondOrder::Satisfied);
}

// y is best, others are as good.

TEST(ManyAnswers, AreNoObstacleWhereXIsStrictForOneOfThem) {
  Model saddle;  // phi = |x| however little y moves
  const Expression x = saddle.variable(kMin, "x"), y = saddle.variable(kMax, "y");
  saddle.objective(x * y);
  for (const Certificate& c : {certify(saddle, {0.0, 0.0}), solved(saddle, {0.3, 0.2})}) {
    EXPECT_EQ(c.second_order, SecondOrder::Satisfied);
    EXPECT_EQ(c.kind, PointKind::LocalMinmax);
    EXPECT_EQ(c.answer, InnerAnswer::BestNotUnique);
    EXPECT_TRUE(names(find(c, Kind::FlatDirection), "y"));
    EXPECT_EQ(c.inner.zero, 1);
  }
}

TEST(ManyAnswers, OfAVariableThatNothingReadsAndOfASum) {
  Model unused;
  Expression x = unused.variable(kMin, "x"), y = unused.variable(kMax, "y");
  static_cast<void>(unused.variable(kMax, "idle"));
  unused.objective(square(x) + x * y - square(y));
  const Certificate found = solved(unused, {0.3, 0.2, 0.7});
  EXPECT_EQ(found.answer, InnerAnswer::BestNotUnique);
  EXPECT_TRUE(names(find(found, Kind::FlatDirection), "idle"));
  Model sum;
  x = sum.variable(kMin, "x");
  const Expression p = sum.variable(kMax, "p"), q = sum.variable(kMax, "q");
  y = p + q;
  sum.objective(square(x) + x * y - square(y));
  const Certificate of_sum = solved(sum, {0.3, 0.2, 0.7});
  EXPECT_EQ(of_sum.kind, PointKind::LocalMinmax);
  EXPECT_TRUE(names(find(of_sum, Kind::FlatDirection), "p") &&
              names(find(of_sum, Kind::FlatDirection), "q"));
}

// As of a vehicle's disturbances, of which the place at the end is one combination.
TEST(ManyAnswers, OfASumOfManyUnlessItRisesSomewhere) {
  for (const double power : {0.0, 3.0, 4.0}) {
    Model model;
    const Expression x = model.variable(kMin, "x");
    std::vector<Expression> p;
    for (int i = 0; i < 60; ++i) p.push_back(model.variable(kMax, "p", -1.0, 1.0));
    Expression y = 0.0;
    for (const Expression& term : p) y += term;
    Expression f = square(x) + x * y - square(y);
    if (power > 0.0) f += 1e-3 * pow(p[7] - p[40], power);
    model.objective(f);
    const Certificate found = certify(model, std::vector<double>(61, 0.0));
    EXPECT_EQ(found.kind == PointKind::LocalMinmax, power == 0.0) << power;
  }
}

TEST(ManyAnswers, OfGamesInMixedStrategies) {
  const double payoff[3][3] = {{0, 1, -1}, {-1, 0, 1}, {1, -1, 0}};
  for (const double unit : {1.0, 1e6, 1e-6}) {
    Model model;
    std::vector<Expression> p, q;
    for (int i = 0; i < 3; ++i) p.push_back(model.variable(kMin, "p", 0.0));
    for (int i = 0; i < 3; ++i) q.push_back(model.variable(kMax, "q", 0.0));
    Expression f = 0.0 * p[0];
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) f += unit * payoff[i][j] * p[i] * q[j];
    }
    model.objective(f);
    model.constraint(p[0] + p[1] + p[2], 1.0, 1.0);
    model.constraint(q[0] + q[1] + q[2], 1.0, 1.0);
    const Certificate found = solved(model, {0.2, 0.5, 0.3, 0.1, 0.6, 0.3});
    EXPECT_EQ(found.second_order, SecondOrder::Satisfied) << unit;
    EXPECT_EQ(found.answer, InnerAnswer::BestNotUnique) << unit;
  }
}

TEST(ManyAnswers, OfAFiniteMaximumAsAGame) {
  // max of (x - 1)^2 and (x + 2)^2
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression a = model.variable(kMax, "a", 0.0), b = model.variable(kMax, "b", 0.0);
  model.objective(a * square(x - 1.0) + b * square(x + 2.0));
  model.constraint(a + b, 1.0, 1.0);
  EXPECT_EQ(solved(model, {0.3, 0.5, 0.5}).answer, InnerAnswer::BestNotUnique);
}

TEST(ManyAnswers, AreNotCertifiedWhereYIsNotBestOrXNotStrict) {
  for (const double power : {3.0, 4.0}) {  // y = 0 is a minimum or a saddle of y^k
    Model model;
    const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y");
    model.objective(square(x) + x * y + pow(y, power));
    EXPECT_NE(certify(model, {0.0, 0.0}).kind, PointKind::LocalMinmax);
  }
  // Along y = 1000 z, which a row demands, f is convex.
  Model tied;
  Expression x = tied.variable(kMin, "x");
  const Expression y = tied.variable(kMax, "y"), z = tied.variable(kMax, "z");
  tied.objective(square(x) + x * y + 1e-5 * square(z));
  tied.constraint(y - 1000.0 * z, 0.0, 0.0);
  EXPECT_NE(certify(tied, {0.0, 0.0, 0.0}, {0.0}).kind, PointKind::LocalMinmax);
  // phi = |x0| alone, where x1 is told to be not unique, and - x1^2, and less with x1^4.
  const auto beside = [](double bend, double fourth) {
    Model flat;
    const Expression x0 = flat.variable(kMin, "x0"), x1 = flat.variable(kMin, "x1");
    const Expression w = flat.variable(kMax, "w");
    flat.objective(x0 * w + bend * square(x1) + fourth * pow(x1, 4.0));
    return certify(flat, {0.0, 0.0, 0.0});
  };
  EXPECT_TRUE(names(&beside(0.0, 0.0).reasons.back(), "x is best but not unique"));
  EXPECT_NE(beside(-1.0, 0.0).kind, PointKind::LocalMinmax);
  EXPECT_NE(beside(0.0, -1.0).kind, PointKind::LocalMinmax);
}

// Weakly active bounds: only directions into them refute.

/// (a^2 + b^2) / 2 + c a b on a, b >= 0, at the point of the central path.
Certificate certify_corner(double c) {
  Model model;
  const Expression a = model.variable(kMin, "a", 0.0), b = model.variable(kMin, "b", 0.0);
  model.objective(0.5 * square(a) + 0.5 * square(b) + c * a * b);
  AutodiffProblem problem(model, {1.0, 1.0});
  CertifiedPoint point(problem, {0.0, 0.0});
  // z = (1 + c) s; where that has the wrong sign, a point that meets the tolerances.
  const double s = c > -1.0 ? std::sqrt(CertifiedPoint::kMu / (1.0 + c)) : 1e-9;
  for (const Index i : {0, 1}) point.set_bound(i, true, s, c > -1.0 ? (1.0 + c) * s : 1e-9);
  return point.certify();
}

TEST(WeaklyActiveBounds, OfMinAreNeitherTrustedNorRefutedByCurvatureThatLeadsOut) {
  const Certificate found = certify_corner(2.0);  // negative along (1, -1), which leads out
  EXPECT_EQ(found.second_order, SecondOrder::Undecided);
  EXPECT_EQ(found.weakly_active_min, 2);
  EXPECT_TRUE(names(find(found, Kind::WeaklyActive), "a"));
}

TEST(WeaklyActiveBounds, OfMaxAreRefutedWhereYGainsByLeavingThem) {
  // y = -1 is a strict minimum over y of (x - y)^2, without slope; phi has its minimum at a kink.
  Model model;
  const Expression x = model.variable(kMin, "x", -1.0, 1.0),
                   y = model.variable(kMax, "y", -1.0, 1.0);
  model.objective(square(x - y));
  for (const std::vector<double>& start :
       {std::vector{0.3, 0.2}, std::vector{-0.3, 0.6}, std::vector{0.9, 0.8}}) {
    AutodiffProblem problem(model, start);
    const Result result = solve(problem, {});
    const double phi = std::pow(1.0 + std::abs(result.v[0]), 2.0);
    EXPECT_TRUE(!is_success(result.status) || result.objective > phi - 1e-6)
        << result.v[0] << ' ' << result.v[1];
  }
}

TEST(WeaklyActiveBounds, OfMaxAreLeftForTheAnswerBeyond) {
  // From y = 1, x = 1 the search has to leave along y; to x >= 0.2 the answer is y = -1.
  Model model;
  const Expression x = model.variable(kMin, "x", 0.2, 2.0),
                   y = model.variable(kMax, "y", -1.0, 1.0);
  model.objective(square(x - y));
  for (const std::vector<double>& start :
       {std::vector{0.7, 0.6}, std::vector{1.9, 1.0}, std::vector{0.5, 0.45}}) {
    AutodiffProblem problem(model, start);
    const Result result = solve(problem, {});
    EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax);
    EXPECT_NEAR(result.v[0], 0.2, 1e-6);
    EXPECT_NEAR(result.v[1], -1.0, 1e-6);
  }
}

TEST(Lengths, AreNotThoseOfCouplingsThatStationarityMakesVanish) {
  // An exponential is fitted to three points: linear in a, so that W_ab is zero at the solution.
  Model model;
  const Expression e = model.variable(kMin, "e"), a = model.variable(kMin, "a");
  const Expression b = model.variable(kMin, "b");
  model.objective(1.0 * e);
  const double times[] = {0.0, 1.0, 2.0}, values[] = {1.0, 0.3, 0.25};
  for (int k = 0; k < 3; ++k) {
    const Expression curve = a * exp(times[k] * b);
    model.constraint(curve - e, -kNoBound, values[k]);
    model.constraint(curve + e, values[k], kNoBound);
  }
  const Certificate found = solved(model, {1.0, 1.0, 0.0});
  EXPECT_EQ(found.second_order, SecondOrder::Satisfied);
  EXPECT_TRUE(found.licq_min);
  EXPECT_EQ(find(found, Kind::Dependent), nullptr);
}

/// min e, |curve_t(x) - y_t| <= e: the least largest error of a fit.
Result fitted(int variables, int times, const std::function<double(int)>& time,
              const std::function<Expression(const std::vector<Expression>& x, double t)>& curve,
              const std::function<double(double t)>& value, std::vector<double> start) {
  Model model;
  const Expression e = model.variable(kMin, "e");
  std::vector<Expression> x;
  for (int i = 0; i < variables; ++i) x.push_back(model.variable(kMin, "x"));
  model.objective(1.0 * e);
  for (int k = 0; k < times; ++k) {
    const double t = time(k);
    model.constraint(curve(x, t) - e, -kNoBound, value(t));
    model.constraint(curve(x, t) + e, value(t), kNoBound);
  }
  start.insert(start.begin(), 10.0);
  AutodiffProblem problem(model, start);
  Result result = solve(problem, {});
  EXPECT_EQ(result.certificate.second_order, SecondOrder::Satisfied);
  EXPECT_TRUE(result.certificate.licq_min);
  EXPECT_EQ(find(result.certificate, Kind::Dependent), nullptr);
  return result;
}

// PBC3, EVD61, OET6 and EXP of Luksan and Vlcek's collection (2000), with its optima; their
// parameters are linear in part.
TEST(Lengths, OfVariablesThatOnlyProductsCoupleAreTheSameInAnyUnits) {
  Model model;
  const Expression a = model.variable(kMin, "a"), b = model.variable(kMin, "b");
  const Expression c = model.variable(kMin, "c");
  model.objective(-(a * b * c));
  model.constraint(a + 2.0 * b + 2.0 * c, 2.0, 2.0);
  AutodiffProblem problem(model, {0.6, 0.3, 0.4});
  const double least = solve(problem, {}).certificate.least_curvature;
  EXPECT_GT(least, 0.1);
  for (const double unit : {1e-6, 1e-3, 1e3, 1e6}) {
    UnitsProblem other(problem, {unit, 1.0, 1.0 / unit}, {1.0});
    const Certificate found = solve(other, {}).certificate;
    EXPECT_EQ(found.second_order, SecondOrder::Satisfied) << unit;
    EXPECT_NEAR(found.least_curvature, least, 0.1 * least) << unit;
  }
}

TEST(Lengths, OfFitsOfTheLiterature) {
  using List = std::vector<Expression>;
  const Result pbc3 = fitted(
      3, 21, [](int k) { return 0.5 * k; },
      [](const List& x, double t) { return x[2] / x[1] * exp(-t * x[0]) * sin(t * x[1]); },
      [](double t) {
        return 0.15 * std::exp(-t) + std::exp(-5.0 * t) / 52.0 -
               std::exp(-2.0 * t) * (3.0 * std::sin(2.0 * t) + 11.0 * std::cos(2.0 * t)) / 65.0;
      },
      {1.0, 1.0, 1.0});
  EXPECT_NEAR(pbc3.objective, 0.42021427e-2, 1e-7);
  const Result evd61 = fitted(
      6, 51, [](int k) { return 0.1 * k; },
      [](const List& x, double t) {
        return x[0] * exp(-t * x[1]) * cos(t * x[2] + x[3]) + x[4] * exp(-t * x[5]);
      },
      [](double t) {
        return 0.5 * std::exp(-t) - std::exp(-2.0 * t) + 0.5 * std::exp(-3.0 * t) +
               1.5 * std::exp(-1.5 * t) * std::sin(7.0 * t) +
               std::exp(-2.5 * t) * std::sin(5.0 * t);
      },
      {2.0, 2.0, 7.0, 0.0, -2.0, 1.0});
  EXPECT_NEAR(evd61.objective, 0.34904926e-1, 1e-7);
  const Result oet6 = fitted(
      4, 21, [](int k) { return -0.5 + 0.05 * k; },
      [](const List& x, double t) { return x[0] * exp(t * x[2]) + x[1] * exp(t * x[3]); },
      [](double t) { return 1.0 / (1.0 + t); }, {1.0, 1.0, -3.0, -1.0});
  EXPECT_NEAR(oet6.objective, 0.20160753e-2, 1e-7);
  // Other starts than near its optimum lead to other local minima, or to poles.
  const Result exponential = fitted(
      5, 21, [](int k) { return -1.0 + 0.1 * k; },
      [](const List& x, double t) {
        return (x[0] + t * x[1]) / (1.0 + t * x[2] + t * t * x[3] + t * t * t * x[4]);
      },
      [](double t) { return std::exp(t); }, {1.0, 0.4, -0.6, 0.2, 0.0});
  EXPECT_NEAR(exponential.objective, 0.12237125e-3, 1e-7);
}

// Flat directions: the value is constant, also where they bend, and not where a higher power rises.

TEST(Flat, StraightAndBentOnesAreSeen) {
  Model straight;
  const Expression a = straight.variable(kMin, "a"), b = straight.variable(kMin, "b");
  straight.objective(square(a - b));
  const Certificate found = certify(straight, {0.3, 0.3});
  EXPECT_EQ(found.kind, PointKind::LocalMinmax);  // the model does not change along it
  EXPECT_TRUE(names(find(found, Kind::FlatDirection), "a") &&
              names(find(found, Kind::FlatDirection), "b"));
  Model bent;
  const Expression u = bent.variable(kMin, "u"), w = bent.variable(kMin, "w");
  bent.objective(square(square(u) + square(w) - 1.0));
  EXPECT_EQ(certify(bent, {0.6, 0.8}).second_order, SecondOrder::Flat);
}

TEST(Flat, AValleyOfPhiNeedNotBeOneOfF) {
  // phi(x) = 0: y = x^2 answers.
  Model model;
  const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y");
  model.objective(2.0 * y * square(x) - square(y) - pow(x, 4.0));
  const Certificate found = certify(model, {0.0, 0.0});
  EXPECT_EQ(found.second_order, SecondOrder::Flat);
}

TEST(Flat, HigherPowersAreNot) {
  for (const double power : {3.0, 4.0, 6.0}) {
    for (const double sign : {1.0, -1.0}) {
      Model model;
      const Expression a = model.variable(kMin, "a"), b = model.variable(kMin, "b");
      model.objective(square(a) + sign * pow(b, power));
      const Certificate found = certify(model, {0.0, 0.0});
      EXPECT_EQ(found.second_order, SecondOrder::Undecided) << power;
      EXPECT_TRUE(names(find(found, Kind::LittleCurvature), "b")) << power;
    }
  }
}

TEST(Flat, MaximizersHaveRidges) {
  Model model;
  const Expression a = model.variable(kMax, "a"), b = model.variable(kMax, "b");
  model.objective(-square(a + b));
  EXPECT_EQ(certify(model, {1.0, -1.0}).second_order, SecondOrder::Flat);
}

// What it costs.

TEST(Effort, ARiseThatTheCurvatureExplainsIsSeenOnOneSideAlone) {
  Model model;
  const Expression a = model.variable(kMin, "a"), b = model.variable(kMin, "b");
  model.objective(square(a + b) + 1e-9 * square(b));
  AutodiffProblem problem(model, std::vector<double>{1.0, 2.0});
  const Result result = solve(problem, SolverOptions{});
  EXPECT_EQ(result.certificate.second_order, SecondOrder::Undecided);
  EXPECT_EQ(result.iterations, 1);
  EXPECT_LE(result.counts.objective, 4);
}

TEST(Effort, AClearPointCostsOneFactorizationOfEachMatrix) {
  Model model;
  const Expression x = model.variable(kMin, "x", -1.0, 2.0);
  const Expression y = model.variable(kMax, "y", -1.0, 2.0);
  model.objective(square(x) + x * y - 4.0 * square(y) + 4.0 * y);
  model.constraint(0.1 * x + y, -kNoBound, 0.1);
  AutodiffProblem problem(model, {-0.2, 0.3});
  SolverOptions options;
  options.minmax_certificate = CertificateEffort::Full;
  Index full = 0, inner = 0;
  SolveObserver observer;
  observer.on_iteration = [&](const IterationInfo& info) {
    full += info.factorizations_full;
    inner += info.factorizations_inner;
    return true;
  };
  const Result result = solve(problem, options, observer);
  ASSERT_EQ(result.status, Status::Solved);
  EXPECT_EQ(result.counts.factorizations_full - full, 1);
  EXPECT_EQ(result.counts.factorizations_inner - inner, 1);
}

TEST(Effort, AClearNoOfMaxHardlyNeedsK) {
  // y^2 for Max: K for the Newton step and to report its inertia.
  Model model;
  const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y");
  model.objective(square(x) + square(y));
  AutodiffProblem problem(model, {0.0, 0.0});
  CertifiedPoint point(problem, {0.0, 0.0});
  EXPECT_EQ(point.certify().second_order, SecondOrder::Violated);
  EXPECT_LE(point.counts().factorizations_full, 2);
  EXPECT_LE(point.counts().factorizations_inner, 10);
}

TEST(Effort, QuickCertifiesClearPointsAlone) {
  SolverOptions quick;
  quick.minmax_certificate = CertificateEffort::Quick;
  Model clear;
  const Expression x = clear.variable(kMin, "x"), y = clear.variable(kMax, "y");
  clear.objective(square(x) + x * y - square(y));
  EXPECT_EQ(solved(clear, {1.0, 1.0}, quick).kind, PointKind::LocalMinmax);
  Model twice;
  const Expression a = twice.variable(kMin, "a"), b = twice.variable(kMin, "b");
  twice.objective(square(a) + square(b));
  twice.constraint(a + b, 1.0, 1.0);
  twice.constraint(a + b, 1.0, 1.0);
  const Certificate found = solved(twice, {1.0, 1.0}, quick);
  EXPECT_EQ(found.second_order, SecondOrder::Undecided);
  EXPECT_TRUE(names(find(found, Kind::Effort), "quick"));
  EXPECT_EQ(solved(twice, {1.0, 1.0}).kind, PointKind::LocalMinmax);
}

TEST(Effort, NoneTestsNothingAndIsForMinimizations) {
  SolverOptions none;
  none.minmax_certificate = CertificateEffort::None;
  Model model;
  const Expression x = model.variable(kMin, "x");
  model.objective(square(x - 1.0));
  AutodiffProblem problem(model, {3.0});
  const Result full = solve(problem, SolverOptions{});
  const Result result = solve(problem, none);
  EXPECT_EQ(result.status, Status::Solved);
  EXPECT_EQ(result.certificate.second_order, SecondOrder::NotTested);
  EXPECT_EQ(result.certificate.kind, PointKind::FirstOrderPoint);
  EXPECT_LT(result.factorizations, full.factorizations);
  Model game;
  const Expression u = game.variable(kMin, "u"), w = game.variable(kMax, "w");
  game.objective(square(u) - square(w));
  AutodiffProblem both(game, {1.0, 1.0});
  const Result refused = solve(both, none);
  EXPECT_EQ(refused.status, Status::InvalidOption);
  EXPECT_NE(refused.message.find("minmax_certificate"), std::string::npos);
}

TEST(Reasons, SayWhereRelaxedBoundsMatter) {
  for (const double unit : {1.0, 1e-6}) {
    Model model;
    const Expression x = model.variable(kMin, "speed", unit, kNoBound);
    model.objective(square(x / unit));
    const Certificate found = solved(model, {2.0 * unit});
    EXPECT_EQ(found.second_order, SecondOrder::Satisfied);
    EXPECT_EQ(names(find(found, Kind::Relaxed), "speed"), unit < 1.0);
  }
}

TEST(Reasons, SurviveTheWayBetweenRanks) {
  Model model;
  const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y");
  model.objective(pow(x, 4.0) - square(y));
  AutodiffProblem problem(model, {0.0, 0.0});
  const Result sent = solve(problem, SolverOptions{});
  ASSERT_FALSE(sent.certificate.reasons.empty());
  const Result received = result_from(to_bytes(sent));
  ASSERT_EQ(received.certificate.reasons.size(), sent.certificate.reasons.size());
  EXPECT_EQ(received.certificate.answer, sent.certificate.answer);
  for (std::size_t k = 0; k < sent.certificate.reasons.size(); ++k) {
    EXPECT_EQ(received.certificate.reasons[k].text, sent.certificate.reasons[k].text);
    EXPECT_EQ(received.certificate.reasons[k].variables, sent.certificate.reasons[k].variables);
  }
}

}  // namespace
}  // namespace ipminmax::testing
