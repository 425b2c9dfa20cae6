// The public header for models written as formulas: derivatives, sparsity, branches.
#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include "core/diagnostics/derivative_test.hpp"
#include "core/formulas/autodiff_problem.hpp"
#include "core/solver.hpp"

namespace ipminmax {
namespace {

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

/// Every operation, each in variables of its own.
struct Everything {
  template <class T>
  T objective(std::span<const T> v) const {
    using std::pow;
    return sin(v[0]) * cos(v[1]) + exp(v[2] / v[3]) - log(v[4]) + sqrt(v[5]) + tan(v[6]) +
           atan2(v[0], v[1]) + asin(v[7]) - acos(v[8]) + atan(v[8] * v[7]) + sinh(v[0]) -
           cosh(v[1]) + tanh(v[2]) + abs(-v[4]) + pow(v[3], 2) + pow(v[5], 1.5) + pow(v[4], v[5]) +
           square(v[6]) + 3.0 / v[3] - v[0] / 2.0 + (+v[1]) + hypot(v[2], v[5]) +
           2.0 * (v[7] - v[8]) * (v[7] - v[8]);
  }
  template <class T>
  void constraints(std::span<const T> v, std::span<T> g) const {
    g[0] = v[0];
    g[0] += v[3] * v[4];
    g[0] -= 1.0;
    g[1] = v[8] / v[4];
    g[1] *= v[8];
    g[1] /= 2.0;
    g[2] = 7.0;
  }
};

ModelData data_of_everything() {
  return {.players = std::vector<Player>(9, kMin),
          .start = {0.3, 0.7, -0.4, 1.3, 0.8, 1.9, 0.2, 0.35, -0.45},
          .constraint_lower = {-1e20, -1e20, -1e20},
          .constraint_upper = {1e3, 1e3, 1e3}};
}

TEST(Formulas, DerivativesAgreeWithDifferences) {
  AutodiffProblem problem(Everything{}, data_of_everything());
  SolverOptions options;
  options.derivative_test = DerivativeTest::SecondOrder;
  options.point_perturbation_radius = 0.0;
  const DerivativeReport report = test_derivatives(problem, options);
  EXPECT_EQ(report.failure, "");
  EXPECT_EQ(report.first_wrong, 0);
  EXPECT_EQ(report.second_wrong, 0);
  EXPECT_GT(report.first_tested, 9);
  for (const DerivativeEntry& entry : report.entries) {
    EXPECT_EQ(entry.finding, DerivativeFinding::Agrees) << describe(entry, problem.structure());
  }
}

/// The same with the standard library's names.
struct Standard {
  template <class T>
  T objective(std::span<const T> v) const {
    return std::sin(v[0]) * std::cos(2 * v[1]) + std::exp(v[2]) + std::atan2(v[0], v[1]) +
           std::pow(v[3], 2) + std::pow(v[4], v[5]) + std::pow(2, v[4]) + std::hypot(3.0, v[5]);
  }
};
struct Own {
  template <class T>
  T objective(std::span<const T> v) const {
    return sin(v[0]) * cos(2 * v[1]) + exp(v[2]) + atan2(v[0], v[1]) + pow(v[3], 2) +
           pow(v[4], v[5]) + pow(T(2.0), v[4]) + hypot(T(3.0), v[5]);
  }
};

TEST(Formulas, StandardNamesMeanTheSame) {
  ModelData data = data_of_everything();
  data.constraint_lower.clear();
  data.constraint_upper.clear();
  AutodiffProblem standard(Standard{}, data);
  AutodiffProblem own(Own{}, data);
  std::vector<double> first(9), second(9);
  ASSERT_TRUE(standard.gradient(data.start, true, first));
  ASSERT_TRUE(own.gradient(data.start, true, second));
  EXPECT_EQ(first, second);
  const std::vector<Plain> plain(data.start.begin(), data.start.end());
  EXPECT_EQ(Standard{}.objective(std::span<const double>(data.start)),
            Own{}.objective(std::span<const Plain>(plain)).value());
}

TEST(Formulas, SparsityIsThatOfTheFormulas) {
  AutodiffProblem problem(Everything{}, data_of_everything());
  const ProblemStructure& s = problem.structure();
  ASSERT_EQ(s.jacobian.size(), 5U);  // v0 v3 v4 | v4 v8
  EXPECT_EQ(s.jacobian[0].col, 0);
  EXPECT_EQ(s.jacobian[3].row, 1);
  const auto has = [&](Index i, Index j) {
    return std::ranges::any_of(s.hessian, [&](Triplet t) { return t.row == i && t.col == j; });
  };
  EXPECT_TRUE(has(1, 0) && has(3, 2) && has(4, 3) && has(5, 4) && has(8, 4) && has(8, 7));
  EXPECT_FALSE(has(2, 0) || has(6, 0) || has(7, 6) || has(8, 0));
}

struct Saddle {
  double tilt = 0.0;
  template <class T>
  T objective(std::span<const T> v) const {
    return v[0] * v[0] + tilt * v[0] + 4.0 * v[0] * v[1] - v[1] * v[1];
  }
};

TEST(Formulas, AGameIsSolvedAndSolvedAgainWithOtherNumbers) {
  AutodiffProblem problem(Saddle{.tilt = 10.0}, {.players = {kMin, kMax}, .start = {1.0, 1.0}});
  EXPECT_EQ(problem.structure().constraint_players.size(), 0U);
  const Result first = solve(problem, {});
  EXPECT_EQ(first.status, Status::Solved);
  EXPECT_NEAR(first.v[0], -1.0, 1e-8);  // f = 5 x^2 + tilt x after y = 2 x
  problem.functions().tilt = 20.0;
  EXPECT_NEAR(solve(problem, {}).v[0], -2.0, 1e-8);
}

struct Shared {
  template <class T>
  T objective(std::span<const T> v) const {
    return v[0] - v[1];
  }
  template <class T>
  void constraints(std::span<const T> v, std::span<T> g) const {
    g[0] = v[0] * v[0];
    g[1] = v[0] + v[1];
  }
};

TEST(Formulas, OwnersAreImpliedOrGiven) {
  ModelData data{.players = {kMin, kMax},
                 .start = {0.0, 0.0},
                 .constraint_lower = {-1.0, -1.0},
                 .constraint_upper = {1.0, 1.0}};
  EXPECT_EQ(AutodiffProblem(Shared{}, data).structure().constraint_players,
            (std::vector<Player>{kMin, kMax}));
  data.constraint_players = {kMax, kMax};
  EXPECT_EQ(AutodiffProblem(Shared{}, data).structure().constraint_players,
            (std::vector<Player>{kMax, kMax}));
}

struct Branching {
  bool grows = false;
  template <class T>
  T objective(std::span<const T> v) const {
    if (v[0] > 0.0) return v[0] * v[0] * v[0];
    return grows ? v[0] * v[1] : v[0] * v[0];
  }
};

TEST(Formulas, BranchesMayNotReadMore) {
  const ModelData data{.players = {kMin, kMax}, .start = {1.0, 1.0}};
  double f = 0.0;
  AutodiffProblem same(Branching{}, data);
  EXPECT_TRUE(same.objective(std::vector<double>{-2.0, 1.0}, true, f));
  EXPECT_EQ(f, 4.0);
  std::vector<double> grad(2);
  EXPECT_TRUE(same.gradient(std::vector<double>{-2.0, 1.0}, false, grad));
  EXPECT_EQ(grad, (std::vector<double>{-4.0, 0.0}));
  EXPECT_TRUE(same.gradient(std::vector<double>{2.0, 1.0}, false, grad));  // and back
  EXPECT_EQ(grad, (std::vector<double>{12.0, 0.0}));
  AutodiffProblem more(Branching{.grows = true}, data);
  EXPECT_THROW(static_cast<void>(more.gradient(std::vector<double>{-2.0, 1.0}, true, grad)),
               std::logic_error);
}

TEST(Formulas, LengthsHaveToFit) {
  EXPECT_THROW(AutodiffProblem(Saddle{}, {.players = {kMin, kMax}, .start = {1.0}}),
               std::invalid_argument);
  EXPECT_THROW(AutodiffProblem(Saddle{}, {.players = {kMin, kMax},
                                          .start = {1.0, 1.0},
                                          .constraint_lower = {0.0},
                                          .constraint_upper = {0.0}}),
               std::invalid_argument);
}

struct Root {
  template <class T>
  T objective(std::span<const T> v) const {
    return sqrt(v[0]) - v[1];
  }
};

TEST(Formulas, UndefinedIsNotFinite) {
  AutodiffProblem problem(Root{}, {.players = {kMin, kMax}, .start = {1.0, 1.0}});
  double f = 0.0;
  EXPECT_FALSE(problem.objective(std::vector<double>{-1.0, 0.0}, true, f));
}

}  // namespace
}  // namespace ipminmax
