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
#include <support/function_problem.hpp>

#include "core/certificate/certificate.hpp"
#include "core/kkt/system.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/point/residual.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Expression;
using testing::FunctionProblem;
using testing::kNoBound;
using testing::Model;

constexpr double kMu = 1e-9;
constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

/// A point in the model's units with multipliers of the constraints. Bound multipliers are those
/// that make it stationary; a point stays away from its active bounds as on the central path.
class Point {
 public:
  Point(Problem& problem, std::vector<double> v, std::vector<double> lambda = {},
        const SolverOptions& options = {})
      : options_(options), canonical_(problem, options_, counts_, timing_) {
    options_.nlp_scaling_method = Scaling::None;
    options_.bound_relax_factor = 0.0;
    EXPECT_EQ(canonical_.build(), "");
    kkt_ = std::make_unique<KktSystem>(canonical_, options_, counts_, timing_);
    EXPECT_TRUE(kkt_->analyze());
    place(problem.structure(), v, lambda);
  }

  Certificate certify() {
    ipminmax::Point point{iterate_, evaluation_, {}};
    dual_residual(canonical_, iterate_, evaluation_, point.dual);
    return ipminmax::certify(canonical_, *kkt_, point, kMu, options_).certificate;
  }

  /// A multiplier other than the stationary one, with the distance that belongs to it.
  void set_bound(Index i, bool lower, double distance, double z) {
    (lower ? iterate_.z_lower : iterate_.z_upper)[i] = z;
    iterate_.v[i] = lower ? canonical_.lower()[i] + distance : canonical_.upper()[i] - distance;
    evaluate();
  }

 private:
  void place(const ProblemStructure& shape, const std::vector<double>& v,
             const std::vector<double>& lambda) {
    const Index n = canonical_.variables();
    iterate_ = {Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(canonical_.constraints()),
                Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)};
    evaluation_.c.setZero(canonical_.constraints());
    evaluation_.gradient.setZero(n);
    evaluation_.jacobian.assign(canonical_.jacobian().size(), 0.0);
    evaluation_.hessian.assign(canonical_.hessian().size(), 0.0);
    Index x = canonical_.x().begin;
    Index y = canonical_.y().begin;
    for (std::size_t i = 0; i < v.size(); ++i) {
      iterate_.v[shape.variable_players[i] == kMin ? x++ : y++] = v[i];
    }
    Index min = canonical_.min_constraints().begin;
    Index max = canonical_.max_constraints().begin;
    for (std::size_t j = 0; j < lambda.size(); ++j) {
      iterate_.lambda[shape.constraint_players[j] == kMin ? min++ : max++] = lambda[j];
    }
    EXPECT_EQ(canonical_.constraints(iterate_.v, evaluation_.c), EvaluationStatus::Ok);
    for (Index j = 0; j < canonical_.constraints(); ++j) {
      const Index slack = canonical_.slack_of_constraint()[static_cast<std::size_t>(j)];
      if (slack >= 0) iterate_.v[slack] = evaluation_.c[j];
    }
    evaluate();
    // sign (z_lower - z_upper) = grad f + J' lambda; the slacks' rows are -lambda.
    Eigen::VectorXd gradient = evaluation_.gradient;
    for (std::size_t k = 0; k < evaluation_.jacobian.size(); ++k) {
      const auto [row, col] = canonical_.jacobian()[k];
      gradient[col] += evaluation_.jacobian[k] * iterate_.lambda[row];
    }
    for (Index j = 0; j < canonical_.constraints(); ++j) {
      const Index slack = canonical_.slack_of_constraint()[static_cast<std::size_t>(j)];
      if (slack >= 0) gradient[slack] = -iterate_.lambda[j];
    }
    const auto give = [&](Index i, double distance, double force, double& z, double direction) {
      z = distance > 1e-6 ? kMu / distance : std::max(force, 1e-12);
      if (distance <= 1e-6) iterate_.v[i] += direction * (kMu / z - distance);
    };
    const Eigen::VectorXd start = iterate_.v;
    for (const Index i : canonical_.lower_bounded()) {
      give(i, start[i] - canonical_.lower()[i], canonical_.sign(i) * gradient[i],
           iterate_.z_lower[i], 1.0);
    }
    for (const Index i : canonical_.upper_bounded()) {
      give(i, canonical_.upper()[i] - start[i], -canonical_.sign(i) * gradient[i],
           iterate_.z_upper[i], -1.0);
    }
    evaluate();
  }

  void evaluate() {
    EXPECT_EQ(canonical_.values(iterate_.v, evaluation_.f, evaluation_.c), EvaluationStatus::Ok);
    EXPECT_EQ(canonical_.first_derivatives(iterate_.v, evaluation_), EvaluationStatus::Ok);
    EXPECT_EQ(canonical_.second_derivatives(iterate_.v, iterate_.lambda, evaluation_),
              EvaluationStatus::Ok);
  }

  SolverOptions options_;
  Counts counts_;
  Timing timing_;
  CanonicalProblem canonical_;
  std::unique_ptr<KktSystem> kkt_;
  Iterate iterate_;
  Evaluation evaluation_;
};

/// The certificate of a model at a point.
Certificate certify(const Model& model, const std::vector<double>& v,
                    const std::vector<double>& lambda = {}) {
  AutodiffProblem problem(model, v);
  return Point(problem, v, lambda).certify();
}

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
                                     : outer == 0.0         ? SecondOrder::Undecided
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
    const auto eigenvalues = [](const Eigen::MatrixXd& m) -> Eigen::VectorXd {
      return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(m).eigenvalues();
    };
    const Eigen::MatrixXd yy = h.bottomRightCorner(2, 2);
    const Eigen::MatrixXd schur =
        h.topLeftCorner(2, 2) - h.topRightCorner(2, 2) * yy.inverse() * h.bottomLeftCorner(2, 2);
    const bool inner = eigenvalues(yy).maxCoeff() < 0.0;
    const bool minmax = inner && eigenvalues(schur).minCoeff() > 0.0;
    const bool full = (eigenvalues(h).array() < 0.0).count() == 2;
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

TEST_P(CertificateBySolver, SingularCurvatureIsUndecided) {
  // x y, flat in y, flat in x, and a flat direction of phi.
  for (const Eigen::MatrixXd& h :
       {Eigen::MatrixXd{{0.0, 1.0}, {1.0, 0.0}}, Eigen::MatrixXd{{1.0, 0.0}, {0.0, 0.0}},
        Eigen::MatrixXd{{0.0, 0.0}, {0.0, -1.0}}, Eigen::MatrixXd{{-1.0, 1.0}, {1.0, -1.0}}}) {
    const Certificate found = certify_quadratic({kMin, kMax}, h, GetParam());
    EXPECT_EQ(found.second_order, SecondOrder::Undecided) << h;
    EXPECT_EQ(found.kind, PointKind::FirstOrderPoint);
    expect_consistent(found);
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
  EXPECT_EQ(second_order(0.0), SecondOrder::Undecided);
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
  EXPECT_EQ(verdict(1.0, -1.0), SecondOrder::Undecided);
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

TEST(DependentConstraints, OfTheMaxPlayerLeaveTheTestUndecided) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y0 = model.variable(kMax, "y0");
  const Expression y1 = model.variable(kMax, "y1");
  model.objective(square(x) - square(y0) - square(y1));
  model.constraint(y0 + y1, 0.0, 0.0);
  model.constraint(2.0 * y0 + 2.0 * y1, 0.0, 0.0);
  const Certificate found = certify(model, {0.0, 0.0, 0.0}, {0.0, 0.0});
  EXPECT_EQ(found.second_order, SecondOrder::Undecided);
  EXPECT_FALSE(found.licq_max);
}

TEST(DependentConstraints, OfTheMinPlayerAreNotRefuted) {
  Model model;
  const Expression x0 = model.variable(kMin, "x0");
  const Expression x1 = model.variable(kMin, "x1");
  const Expression y = model.variable(kMax, "y");
  model.objective(square(x0) + square(x1) - square(y));
  model.constraint(x0 + x1, 0.0, 0.0);
  model.constraint(2.0 * x0 + 2.0 * x1, 0.0, 0.0);
  const Certificate found = certify(model, {0.0, 0.0, 0.0}, {0.0, 0.0});
  EXPECT_EQ(found.second_order, SecondOrder::Undecided);
  EXPECT_FALSE(found.licq_min);
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

TEST(DependentConstraints, OfActiveInequalitiesFailLicq) {
  // y <= 0 twice, each with half of the multiplier.
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(square(x) + 2.0 * y);
  model.constraint(1.0 * y, -kNoBound, 0.0);
  model.constraint(3.0 * y, -kNoBound, 0.0);
  const Certificate found = certify(model, {0.0, 0.0}, {-1.0, -1.0 / 3.0});
  EXPECT_FALSE(found.licq_max);
  EXPECT_EQ(found.second_order, SecondOrder::Undecided);
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
  EXPECT_EQ(found.second_order, SecondOrder::Undecided);
  EXPECT_NE(found.kind, PointKind::LocalMinmax);
}

TEST(CertificateOfNothing, IsSatisfied) {
  const Certificate found = certify(Model{}, {});
  EXPECT_EQ(found.second_order, SecondOrder::Satisfied);
  EXPECT_EQ(found.full_expected, (Inertia{0, 0, 0}));
}

}  // namespace
}  // namespace ipminmax
