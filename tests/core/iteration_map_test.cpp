// The paper's examples on the stability of the modified Newton iteration z+ = z - (H + E)^-1 grad.

#include <complex>

#include <gtest/gtest.h>
#include <Eigen/Core>

#include <support/dense_algebra.hpp>
#include <support/function_problem.hpp>

#include "core/kkt/inertia_correction.hpp"
#include "core/kkt/system.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::FunctionProblem;
using testing::spectral_radius;

/// A quadratic at its stationary point 0 with the library's own KKT system.
class IterationMap {
 public:
  IterationMap(std::vector<Player> players, const Eigen::MatrixXd& hessian,
               const SolverOptions& options = {})
      : options_(options),
        problem_(FunctionProblem::quadratic(players, hessian, Eigen::VectorXd::Zero(hessian.rows()),
                                            Eigen::VectorXd::Zero(hessian.rows()))),
        canonical_(problem_, options_, counts_, timing_) {
    EXPECT_EQ(canonical_.build(), "");
    kkt_ = std::make_unique<KktSystem>(canonical_, options_, counts_, timing_);
    EXPECT_TRUE(kkt_->analyze());
    correction_ = std::make_unique<InertiaCorrection>(*kkt_, options_, counts_);
    iterate_ = canonical_.starting_point();
    evaluation_.gradient.setZero(canonical_.variables());
    evaluation_.hessian.assign(canonical_.hessian().size(), 0.0);
    EXPECT_TRUE(canonical_.second_derivatives(iterate_.v, iterate_.lambda, evaluation_));
    kkt_->assemble(iterate_, evaluation_);
  }

  std::optional<Regularization> correct() { return correction_->correct(0.1); }
  bool lqac_holds(const Regularization& shift) {
    return kkt_->has_expected_inner_inertia(kkt_->factorize_inner(shift)) &&
           kkt_->has_expected_inertia(kkt_->factorize(shift));
  }

  /// I - (H + E)^-1 H, column by column, with the shift of the last factorization.
  Eigen::MatrixXd jacobian(const Eigen::MatrixXd& hessian) {
    const auto n = hessian.rows();
    Eigen::MatrixXd map = Eigen::MatrixXd::Identity(n, n);
    for (Eigen::Index j = 0; j < n; ++j) {
      NewtonResidual rhs{-hessian.col(j), {}, Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)};
      Step step = rhs;
      EXPECT_TRUE(kkt_->solve(evaluation_, rhs, step));
      map.col(j) += step.v;
    }
    return map;
  }

  Index instability_raises() const { return counts_.instability_raises; }

 private:
  SolverOptions options_;
  Counts counts_;
  Timing timing_;
  FunctionProblem problem_;
  CanonicalProblem canonical_;
  std::unique_ptr<KktSystem> kkt_;
  std::unique_ptr<InertiaCorrection> correction_;
  Iterate iterate_;
  Evaluation evaluation_;
};

const std::vector<Player> kMinMax = {Player::Min, Player::Max};

// f = 1.5 x^2 - 4 x y + y^2: 0 is no local minmax, K has the right inertia, K_yy has not.
const Eigen::MatrixXd kNotMinmax{{3.0, -4.0}, {-4.0, 2.0}};

TEST(PaperCounterexample1, LqacAloneLeavesTheWrongPointStable) {
  IterationMap map(kMinMax, kNotMinmax);
  ASSERT_TRUE(map.lqac_holds({.x = 0.0, .y = 4.0}));
  const Eigen::MatrixXd jacobian = map.jacobian(kNotMinmax);
  EXPECT_NEAR(jacobian(0, 1), 0.72, 0.01);
  EXPECT_NEAR(jacobian(1, 1), 0.54, 0.01);
  EXPECT_LT(spectral_radius(jacobian), 1.0);
}

TEST(PaperCounterexample1, Line7MakesTheWrongPointUnstable) {
  for (const bool warm : {false, true}) {
    SolverOptions options;
    options.minmax_warm_start_shifts = warm;
    IterationMap map(kMinMax, kNotMinmax, options);
    const auto shift = map.correct();
    ASSERT_TRUE(shift);
    EXPECT_GT(shift->x, 0.0);
    EXPECT_EQ(map.instability_raises(), 1);
    ASSERT_TRUE(map.lqac_holds(*shift));
    EXPECT_GT(spectral_radius(map.jacobian(kNotMinmax)), 1.0);
  }
}

TEST(PaperCounterexample1, WithoutLine7TheShiftsAreTheLqacOnes) {
  SolverOptions options;
  options.minmax_instability = false;
  IterationMap map(kMinMax, kNotMinmax, options);
  const auto shift = map.correct();
  ASSERT_TRUE(shift);
  EXPECT_EQ(shift->x, 0.0);
  EXPECT_EQ(map.instability_raises(), 0);
  ASSERT_TRUE(map.lqac_holds(*shift));
  EXPECT_LT(spectral_radius(map.jacobian(kNotMinmax)), 1.0);
}

// f = -0.25 x^2 + x y - 0.5 y^2: 0 is a local minmax.
const Eigen::MatrixXd kMinmax{{-0.5, 1.0}, {1.0, -1.0}};

TEST(PaperCounterexample2, ShiftsThatAreTooSmallInXMakeALocalMinmaxUnstable) {
  IterationMap map(kMinMax, kMinmax);
  ASSERT_TRUE(map.lqac_holds({.x = 0.3, .y = 3.0}));
  const Eigen::MatrixXd jacobian = map.jacobian(kMinmax);
  EXPECT_TRUE(jacobian.isApprox(Eigen::MatrixXd{{6.0, -15.0}, {1.5, -3.0}}, 1e-9));
  const auto eigenvalues = testing::eigenvalues(jacobian);
  EXPECT_NEAR(eigenvalues[0].real(), 1.5, 1e-9);
  EXPECT_NEAR(std::abs(eigenvalues[0].imag()), 1.5, 1e-9);
  EXPECT_GT(spectral_radius(jacobian), 1.0);
}

TEST(PaperCounterexample2, TheChosenShiftsAreZeroAtALocalMinmax) {
  IterationMap map(kMinMax, kMinmax);
  const auto shift = map.correct();
  ASSERT_TRUE(shift);
  EXPECT_EQ(*shift, Regularization{});
  EXPECT_LT(spectral_radius(map.jacobian(kMinmax)), 1e-12);
}

TEST(PaperCounterexample2, ShiftsThatMeetTheStabilityConditionKeepALocalMinmaxStable) {
  // eps_x >= lambda(eps_y f_xy f_yy^-2 f_yx) = 3
  IterationMap map(kMinMax, kMinmax);
  ASSERT_TRUE(map.lqac_holds({.x = 3.0, .y = 3.0}));
  EXPECT_LT(spectral_radius(map.jacobian(kMinmax)), 1.0);
}

TEST(Line7, RandomPointsWithTheRightFullAndTheWrongInnerInertiaAreUnstable) {
  std::srand(3);
  int found = 0;
  while (found < 200) {
    Eigen::MatrixXd h = Eigen::MatrixXd::Random(4, 4);
    h = (h + h.transpose()).eval();
    const auto negative = [](const Eigen::MatrixXd& m) {
      return (testing::symmetric_eigenvalues(m).array() < 0).count();
    };
    if (negative(h) != 2 || negative(h.bottomRightCorner(2, 2)) == 2) continue;
    ++found;
    IterationMap map({Player::Min, Player::Min, Player::Max, Player::Max}, h);
    const auto shift = map.correct();
    ASSERT_TRUE(shift);
    ASSERT_TRUE(map.lqac_holds(*shift));
    EXPECT_GT(spectral_radius(map.jacobian(h)), 1.0) << h;
  }
}

TEST(Line7, IsSkippedWhereTheInnerMatrixIsOnlySingular) {
  const Eigen::MatrixXd bilinear{{0.0, 1.0}, {1.0, 0.0}};
  IterationMap map(kMinMax, bilinear);
  const auto shift = map.correct();
  ASSERT_TRUE(shift);
  EXPECT_EQ(map.instability_raises(), 0);
}

// Example 1: min x^3 - 3x, minimum at 1, maximum at -1.
FunctionProblem cubic(double start) {
  return FunctionProblem(
      {Player::Min}, Eigen::VectorXd::Constant(1, start),
      [](const Eigen::VectorXd& v) { return v[0] * v[0] * v[0] - 3 * v[0]; },
      [](const Eigen::VectorXd& v) { return Eigen::VectorXd::Constant(1, 3 * v[0] * v[0] - 3); },
      [](const Eigen::VectorXd& v) { return Eigen::MatrixXd::Constant(1, 1, 6 * v[0]); });
}

TEST(PaperExample1, TheModifiedNewtonMethodFindsTheMinimum) {
  for (const double start : {-0.99, -0.5, 0.0, 0.3, 2.0}) {
    FunctionProblem problem = cubic(start);
    const Result result = solve(problem, {});
    EXPECT_EQ(result.status, Status::Solved) << start;
    EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax);
    EXPECT_NEAR(result.v[0], 1.0, 1e-7);
  }
}

TEST(PaperExample1, PureNewtonEndsAtTheMaximumAndIsNotBelieved) {
  FunctionProblem problem = cubic(-0.5);
  SolverOptions options;
  options.minmax_pure_newton = true;
  const Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::NotLocalMinmax);
  EXPECT_EQ(result.certificate.second_order, SecondOrder::Violated);
  EXPECT_NEAR(result.v[0], -1.0, 1e-7);
}

TEST(PaperExample1, FromBelowTheMaximumTheIteratesDescendWithoutBound) {
  FunctionProblem problem = cubic(-1.5);
  SolverOptions options;
  options.max_iter = 200;
  const Result result = solve(problem, options);
  EXPECT_FALSE(is_success(result.status));
  EXPECT_LT(result.objective, -100.0);
}

TEST(PaperExample1, StartedExactlyAtTheMaximumItIsRefused) {
  FunctionProblem problem = cubic(-1.0);
  const Result result = solve(problem, {});
  EXPECT_FALSE(is_success(result.status) && std::abs(result.v[0] + 1.0) < 0.1);
}

}  // namespace
}  // namespace ipminmax
