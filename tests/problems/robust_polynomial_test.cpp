// The robust polynomial of Bertsimas, Nohadani and Teo (2010): min over x, max over |y| <= 0.5 of a
// sixth-order polynomial at x + y. Its best points are kinks of the outer function, and local
// minmax points over weak branches of y abound: the answer has to stand up to a grid and to many
// starts of y.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/formulas/autodiff_problem.hpp"
#include "core/multistart.hpp"
#include "core/robust.hpp"
#include "core/worst_case.hpp"

namespace ipminmax {
namespace {

struct Polynomial {
  template <class T>
  static T value(const T& a, const T& b) {
    const T a2 = a * a, b2 = b * b;
    return 2.0 * a2 * a2 * a2 - 12.2 * a2 * a2 * a + 21.2 * a2 * a2 + 6.2 * a - 6.4 * a2 * a -
           4.7 * a2 + b2 * b2 * b2 - 11.0 * b2 * b2 * b + 43.3 * b2 * b2 - 10.0 * b -
           74.8 * b2 * b + 56.9 * b2 - 4.1 * a * b - 0.1 * a2 * b2 + 0.4 * b2 * a + 0.4 * a2 * b;
  }
  template <class T>
  T objective(std::span<const T> v) const {
    return value<T>(v[0] + v[2], v[1] + v[3]);
  }
  template <class T>
  void constraints(std::span<const T> v, std::span<T> g) const {
    g[0] = v[2] * v[2] + v[3] * v[3];
  }
};

constexpr double kLowX = -1.0, kHighX = 3.2, kLowZ = -0.5, kHighZ = 4.4, kRadius = 0.5;

AutodiffProblem<Polynomial> robust_polynomial() {
  constexpr Player kMin = Player::Min, kMax = Player::Max;
  return {Polynomial{},
          {.players = {kMin, kMin, kMax, kMax},
           .start = {0.5, 1.0, 0.1, 0.1},
           .lower = {kLowX, kLowZ, -kRadius, -kRadius},
           .upper = {kHighX, kHighZ, kRadius, kRadius},
           .constraint_lower = {-1e20},
           .constraint_upper = {kRadius * kRadius}}};
}

/// max over y of the polynomial, on a grid of the disk with so many points on its circles.
double phi(double x, double z, int angles, int circles) {
  double worst = Polynomial::value<double>(x, z);
  for (int c = 1; c <= circles; ++c) {
    const double r = kRadius * c / circles;
    for (int k = 0; k < angles; ++k) {
      const double t = 2.0 * std::numbers::pi * k / angles;
      worst = std::max(worst, Polynomial::value<double>(x + r * std::cos(t), z + r * std::sin(t)));
    }
  }
  return worst;
}

/// Best phi of a grid, then of ever finer ones around the best point.
double best_of_grids() {
  double best = phi(0.0, 0.0, 90, 1), best_x = 0.0, best_z = 0.0;
  for (double x = kLowX; x <= kHighX; x += 0.05) {
    for (double z = kLowZ; z <= kHighZ; z += 0.05) {
      const double value = phi(x, z, 90, 1);
      if (value < best) best = value, best_x = x, best_z = z;
    }
  }
  best = phi(best_x, best_z, 2000, 10);
  for (double h = 0.05; h > 1e-6; h *= 0.7) {
    const double x = best_x, z = best_z;
    for (int i = -2; i <= 2; ++i) {
      for (int j = -2; j <= 2; ++j) {
        const double value = phi(x + h * i, z + h * j, 2000, 10);
        if (value < best) best = value, best_x = x + h * i, best_z = z + h * j;
      }
    }
  }
  return best;
}

SolverOptions with_starts(int starts, int worst_case_starts) {
  SolverOptions options;
  options.minmax_starts = starts;
  options.minmax_worst_case_starts = worst_case_starts;
  return options;
}

TEST(RobustPolynomial, TheAnswerIsTheBestOfAGridAndNoStartOfYIsWorse) {
  AutodiffProblem problem = robust_polynomial();
  SolverOptions options = with_starts(8, 20);
  options.minmax_epigraph = true;
  const RobustResult answer = solve_robust(problem, options);
  const double grid = best_of_grids();
  EXPECT_EQ(answer.result.certificate.kind, PointKind::LocalMinmax) << answer.result.message;
  const double x = answer.result.v[0], z = answer.result.v[1];
  EXPECT_NEAR(phi(x, z, 20000, 20), grid, 1e-4) << x << ' ' << z;
  EXPECT_GE(answer.worst_cases.size(), 2U) << "no kink";

  const WorstCaseCheck check = check_worst_case(problem, answer.result.v, {}, 1000);
  EXPECT_EQ(check.found.starts, 1000);
  EXPECT_LE(check.found.value, grid + 1e-4);
}

// The same by multistart.
TEST(RobustPolynomial, AMultistartOverBranchesFindsTheBestOfAGrid) {
  AutodiffProblem problem = robust_polynomial();
  SolverOptions options = with_starts(8, 20);
  options.minmax_epigraph_at_kinks = true;
  const MultistartResult answer = multistart(problem, options);
  EXPECT_EQ(answer.best.certificate.kind, PointKind::LocalMinmax) << answer.best.message;
  EXPECT_NEAR(phi(answer.best.v[0], answer.best.v[1], 20000, 20), best_of_grids(), 1e-4);
  EXPECT_FALSE(answer.best.worst_case.higher);
  const WorstCaseCheck check = check_worst_case(problem, answer.best.v, {}, 1000);
  EXPECT_LE(check.found.value, answer.best.objective + 1e-6);
}

// Without the options, a multistart ends over weak branches of y, certified or not, and says so.
TEST(RobustPolynomial, APlainMultistartSaysThatAnotherYIsWorse) {
  AutodiffProblem problem = robust_polynomial();
  for (const int seed : {SolverOptions{}.minmax_start_seed, 7}) {
    for (const int worst_case_starts : {0, 20}) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", " + std::to_string(worst_case_starts));
      SolverOptions options = with_starts(seed == 7 ? 24 : 8, worst_case_starts);
      options.minmax_start_seed = seed;
      const Result best = multistart(problem, options).best;
      const double worst = phi(best.v[0], best.v[1], 2000, 20);
      ASSERT_GT(worst, best.objective + 1.0) << "no weak branch";
      EXPECT_TRUE(best.worst_case.higher);
      EXPECT_GT(best.worst_case.value, best.objective);
      EXPECT_LE(best.worst_case.value, worst + 1e-2);
      EXPECT_EQ(best.worst_case.starts, worst_case_starts);
      for (const char* part : {"is a local worst case only", "minmax_epigraph"}) {
        EXPECT_NE(best.message.find(part), std::string::npos) << best.message;
      }
    }
  }
}

// Every point that the starts led to is the worst case that it says.
TEST(RobustPolynomial, NoReportedPointHasAWorseY) {
  AutodiffProblem problem = robust_polynomial();
  SolverOptions options = with_starts(12, 20);
  options.minmax_epigraph = true;
  const RobustResult answer = solve_robust(problem, options);
  ASSERT_GE(answer.points.size(), 2U);
  for (const DistinctPoint& point : answer.points) {
    const double told = point.result.objective;
    const WorstCaseCheck check = check_worst_case(problem, point.result.v, {}, 1000);
    EXPECT_LE(check.found.value, told + 1e-6 * (1.0 + std::abs(told)))
        << point.result.v[0] << ' ' << point.result.v[1];
  }
}

/// As it is in the paper: the ball alone bounds y, so that most random starts of y lie far outside.
TEST(RobustPolynomial, AWorseYIsSeenWhereYHasNoBounds) {
  constexpr Player kMin = Player::Min, kMax = Player::Max;
  AutodiffProblem<Polynomial> problem{Polynomial{},
                                      {.players = {kMin, kMin, kMax, kMax},
                                       .start = {0.0, 0.0, 0.1, 0.05},
                                       .lower = {-1.0, -1.0, -1e20, -1e20},
                                       .upper = {4.0, 4.0, 1e20, 1e20},
                                       .constraint_lower = {-1e20},
                                       .constraint_upper = {kRadius * kRadius}}};
  for (int seed = 0; seed < 5; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    SolverOptions options = with_starts(1, 20);
    options.minmax_start_seed = seed;
    const Result checked = multistart(problem, options).best;
    const double value = phi(checked.v[0], checked.v[1], 2000, 10);
    EXPECT_EQ(checked.worst_case.higher, value > checked.objective + 0.01)
        << value << checked.objective;
    EXPECT_NE(is_success(checked.status), checked.worst_case.higher) << checked.message;

    options = with_starts(8, 20);
    options.minmax_start_seed = seed;
    const Result best = multistart(problem, options).best;
    EXPECT_NE(is_success(best.status), best.worst_case.higher) << best.message;
    const double worst = phi(best.v[0], best.v[1], 2000, 10);
    EXPECT_EQ(best.worst_case.higher, worst > best.objective + 0.01) << worst << best.objective;
  }
}

}  // namespace
}  // namespace ipminmax
