// Hessians from differences of first derivatives: colouring, accuracy, detection of the sparsity,
// error estimates, and what solve makes of them.

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <random>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include <support/autodiff_problem.hpp>
#include <support/dense_judge.hpp>
#include <support/function_problem.hpp>
#include <support/without_hessian.hpp>

#include "core/differences/finite_difference_hessian.hpp"
#include "core/differences/hessian_detection.hpp"
#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

using Pairs = std::vector<std::pair<Index, Index>>;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

Pairs pairs_of(const ProblemStructure& structure) {
  Pairs pairs;
  for (const Triplet& entry : structure.hessian) pairs.emplace_back(entry.row, entry.col);
  return pairs;
}

SolverOptions with_differences() {
  SolverOptions options;
  options.hessian_approximation = HessianApproximation::FiniteDifferenceValues;
  return options;
}

// --- Colouring -----------------------------------------------------------------------------------

std::vector<Triplet> band(Index n, Index half_width) {
  std::vector<Triplet> pattern;
  for (Index i = 0; i < n; ++i) {
    for (Index j = std::max(0, i - half_width); j <= i; ++j) pattern.push_back({i, j});
  }
  return pattern;
}

/// Last row, last column and diagonal.
std::vector<Triplet> arrow(Index n) {
  std::vector<Triplet> pattern;
  for (Index i = 0; i < n; ++i) pattern.push_back({i, i});
  for (Index i = 0; i + 1 < n; ++i) pattern.push_back({n - 1, i});
  return pattern;
}

/// Fills a random symmetric matrix of the pattern, reads it back from its products with the groups.
void expect_recovers(const std::vector<Triplet>& pattern, Index n) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  MatrixXd h = MatrixXd::Zero(n, n);
  for (const auto& [row, col] : pattern) h(row, col) = h(col, row) = normal(random);
  const HessianColoring coloring = color_hessian(pattern, n);
  std::vector<int> read(pattern.size(), 0);
  for (const auto& group : coloring.groups) {
    VectorXd direction = VectorXd::Zero(n);
    for (const Index i : group.variables) direction[i] = 1.0;
    const VectorXd product = h * direction;
    for (const auto& entry : group.entries) {
      const Triplet& wanted = pattern[at(entry.position)];
      EXPECT_EQ(std::minmax(entry.row, entry.col), std::minmax(wanted.row, wanted.col));
      EXPECT_EQ(direction[entry.col], 1.0);
      EXPECT_DOUBLE_EQ(product[entry.row], h(wanted.row, wanted.col));
      ++read[at(entry.position)];
    }
  }
  EXPECT_EQ(std::count(read.begin(), read.end(), 1), static_cast<long>(pattern.size()));
}

TEST(Coloring, ReadsEveryEntryOnce) {
  expect_recovers({}, 3);
  expect_recovers(band(1, 0), 1);
  expect_recovers(band(40, 3), 40);
  expect_recovers(arrow(30), 30);
  std::mt19937 random(5);
  for (int trial = 0; trial < 50; ++trial) {
    const Index n = 25;
    const double density = 0.02 * (trial + 1);
    std::vector<Triplet> pattern;
    for (Index i = 0; i < n; ++i) {
      for (Index j = 0; j <= i; ++j) {
        if (std::uniform_real_distribution<double>()(random) > density) continue;
        pattern.push_back(trial % 2 == 0 ? Triplet{i, j} : Triplet{j, i});
      }
    }
    std::shuffle(pattern.begin(), pattern.end(), random);
    expect_recovers(pattern, n);
  }
}

TEST(Coloring, GroupsAreFew) {
  const auto groups = [](const std::vector<Triplet>& pattern, Index n) {
    return color_hessian(pattern, n).groups.size();
  };
  EXPECT_EQ(groups(band(1000, 0), 1000), 1U);
  for (const Index width : {1, 2, 5}) {
    EXPECT_LE(groups(band(1000, width), 1000), static_cast<std::size_t>(2 * width + 1));
  }
  EXPECT_EQ(groups(arrow(1000), 1000), 2U);
  EXPECT_EQ(groups(band(12, 11), 12), 12U);  // dense
}

TEST(Coloring, BilinearTermsNeedOneSideOnly) {
  std::vector<Triplet> pattern;
  for (Index i = 0; i < 50; ++i) pattern.push_back({i + 50, i});
  EXPECT_EQ(color_hessian(pattern, 100).groups.size(), 1U);
}

TEST(Coloring, GridTakesAConstantNumberOfGroups) {
  const auto grid = [](Index side) {
    std::vector<Triplet> pattern;
    for (Index i = 0; i < side * side; ++i) {
      pattern.push_back({i, i});
      if (i % side > 0) pattern.push_back({i, i - 1});
      if (i >= side) pattern.push_back({i, i - side});
    }
    return color_hessian(pattern, side * side).groups.size();
  };
  EXPECT_LE(grid(8), 8U);
  EXPECT_LE(grid(60), 8U);
}

// --- Values --------------------------------------------------------------------------------------

/// Both players, bounds, nonlinear and linear constraints, no dense Hessian.
Model mixed_model() {
  Model model;
  const Expression a = model.variable(kMin, "a", 0.0, 10.0);
  const Expression b = model.variable(kMin, "b");
  const Expression c = model.variable(kMax, "c", -3.0, 3.0);
  const Expression d = model.variable(kMax, "d", 1.0, 1.0);
  const Expression e = model.variable(kMax, "e", 1e-3, kNoBound);
  model.objective(log(e) * 3.0 - square(c) * exp(0.3 * a) + pow(b, 4.0) + d * b);
  model.constraint(sin(a) * b + 2.0 * b, -1.0, 1.0);
  model.constraint(square(c) + square(e) + 1e6 * a, -kNoBound, 9.0);
  return model;
}

/// Largest error of a Hessian from differences, and whether the estimate covers it row by row.
void expect_accurate(Problem& problem, const std::vector<double>& v, double sigma,
                     const std::vector<double>& lambda, double tolerance) {
  WithoutHessian blind(problem, true);
  FiniteDifferenceHessian differences(blind, with_differences());
  const VectorXd point = Eigen::Map<const VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
  const VectorXd multipliers =
      Eigen::Map<const VectorXd>(lambda.data(), static_cast<Eigen::Index>(lambda.size()));
  MatrixXd exact = dense_hessian(problem, point, sigma, multipliers);
  std::vector<double> values(differences.structure().hessian.size());
  ASSERT_TRUE(differences.hessian(v, true, sigma, lambda, true, values));
  std::vector<double> row_errors(v.size());
  ASSERT_TRUE(differences.hessian_errors(v, sigma, lambda, row_errors));
  MatrixXd error = MatrixXd::Zero(exact.rows(), exact.cols());
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto [row, col] = differences.structure().hessian[k];
    const double wrong = std::abs(values[k] - exact(row, col));
    EXPECT_LE(wrong, tolerance * (1.0 + std::abs(exact(row, col)))) << row << ", " << col;
    error(row, col) = error(col, row) = wrong;
  }
  for (std::size_t i = 0; i < v.size(); ++i) {
    EXPECT_LE(error.row(static_cast<Eigen::Index>(i)).sum(), row_errors[i] + 1e-13) << i;
    EXPECT_LE(row_errors[i], 100.0 * tolerance * (1.0 + exact.cwiseAbs().maxCoeff())) << i;
  }
}

TEST(Differences, AreAccurateInTheInterior) {
  AutodiffProblem problem(mixed_model());
  expect_accurate(problem, {2.0, 0.7, -1.0, 1.0, 2.0}, 1.0, {0.5, -2.0}, 1e-8);
  expect_accurate(problem, {2.0, 0.7, -1.0, 1.0, 2.0}, 0.0, {0.5, -2.0}, 1e-8);
  expect_accurate(problem, {2.0, 0.7, -1.0, 1.0, 2.0}, 1.0, {0.0, 0.0}, 1e-8);
  expect_accurate(problem, {9.0, 1e4, -1.0, 1.0, 200.0}, 1.0, {1e3, 1.0}, 1e-6);
}

TEST(Differences, AreAccurateAtBounds) {
  AutodiffProblem problem(mixed_model());
  expect_accurate(problem, {0.0, 0.7, 3.0, 1.0, 2.0}, 1.0, {0.5, -2.0}, 1e-8);
  expect_accurate(problem, {10.0, 0.7, -3.0, 1.0, 2.0}, 1.0, {0.5, -2.0}, 1e-7);
  expect_accurate(problem, {1e-9, 0.7, 3.0 - 1e-9, 1.0, 2.0}, 1.0, {0.5, -2.0}, 1e-8);
}

/// Large constant first derivatives leave no rounding errors behind.
TEST(Differences, LinearTermsDoNotDisturb) {
  Model model;
  const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y");
  model.objective(0.5 * square(x) - 0.5 * square(y));
  model.constraint(1e8 * x + 3.0 * y, 0.0, 0.0);
  AutodiffProblem problem(model);
  expect_accurate(problem, {0.3, 0.4}, 1.0, {1e6}, 1e-9);
}

/// Functions that are undefined outside their bounds must not be asked there.
class Strict final : public Problem {
 public:
  explicit Strict(Problem& problem) : problem_(problem) {}
  bool outside = false;
  [[nodiscard]] const ProblemStructure& structure() const override { return problem_.structure(); }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    return problem_.starting_point(start);
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool n, double& f) override {
    return problem_.objective(v, n, f);
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool n, std::span<double> grad) override {
    look(v);
    return problem_.gradient(v, n, grad);
  }
  [[nodiscard]] bool constraints(std::span<const double> v, bool n, std::span<double> g) override {
    return problem_.constraints(v, n, g);
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool n,
                              std::span<double> values) override {
    look(v);
    return problem_.jacobian(v, n, values);
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool n, double sigma,
                             std::span<const double> lambda, bool new_lambda,
                             std::span<double> values) override {
    return problem_.hessian(v, n, sigma, lambda, new_lambda, values);
  }

 private:
  void look(std::span<const double> v) {
    for (std::size_t i = 0; i < v.size(); ++i) {
      outside =
          outside || v[i] < structure().variable_lower[i] || v[i] > structure().variable_upper[i];
    }
  }
  Problem& problem_;
};

TEST(Differences, StayWithinTheBounds) {
  AutodiffProblem inner(mixed_model());
  Strict problem(inner);
  for (const std::vector<double>& v :
       {std::vector{0.0, 0.7, 3.0, 1.0, 1e-3}, std::vector{10.0, 0.7, -3.0, 1.0, 1e-3 + 1e-9},
        std::vector{1e-7, 0.7, 3.0 - 1e-6, 1.0, 1.0}}) {
    FiniteDifferenceHessian differences(problem, with_differences());
    std::vector<double> values(differences.structure().hessian.size()), row_errors(5);
    const std::vector<double> lambda{1.0, 1.0};
    EXPECT_TRUE(differences.hessian(v, true, 1.0, lambda, true, values));
    EXPECT_TRUE(differences.hessian_errors(v, 1.0, lambda, row_errors));
    EXPECT_FALSE(problem.outside);
  }
}

TEST(Differences, ChangeSidesWhereTheModelIsUndefined) {
  // x^1.5 has no derivatives below 0, log(y - 2) none at 2; neither bound is stated.
  Model model;
  const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y");
  model.objective(pow(x, 2.5) - 3.0 * x + log(y - 2.0) - square(y) + x * y);
  AutodiffProblem problem(model);
  for (const double x0 : {1.0, 1e-6, 1e-7}) {
    for (const double y0 : {3.0, 2.0 + 5e-6}) {
      WithoutHessian blind(problem, true);
      FiniteDifferenceHessian differences(blind, with_differences());
      std::vector<double> values(3), row_errors(2);
      const std::vector<double> v{x0, y0};
      ASSERT_TRUE(differences.hessian(v, true, 1.0, {}, true, values)) << x0 << ", " << y0;
      ASSERT_TRUE(differences.hessian_errors(v, 1.0, {}, row_errors));
      const MatrixXd exact = dense_hessian(problem, Eigen::Vector2d(x0, y0), 1.0, VectorXd());
      for (std::size_t k = 0; k < 3; ++k) {
        const auto [row, col] = differences.structure().hessian[k];
        EXPECT_LE(std::abs(values[k] - exact(row, col)), row_errors[at(row)] + 1e-12);
      }
    }
  }
}

TEST(Differences, AreUndefinedWhereTheModelIs) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  model.objective(sqrt(x));
  AutodiffProblem problem(model);
  FiniteDifferenceHessian differences(problem, with_differences());
  std::vector<double> values(1), row_errors(1);
  EXPECT_FALSE(differences.hessian(std::vector{-1.0}, true, 1.0, {}, true, values));
  EXPECT_TRUE(differences.hessian_errors(std::vector{-1.0}, 1.0, {}, row_errors));
  EXPECT_EQ(row_errors[0], kInfinity);
}

TEST(Differences, TellTheModelOfNewPoints) {
  // A model that computes at new points only.
  class Caching final : public Problem {
   public:
    Caching() {
      structure_.variable_players = {kMin};
      structure_.variable_lower = {-kInfinity};
      structure_.variable_upper = {kInfinity};
      structure_.hessian = {{0, 0}};
    }
    [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
    [[nodiscard]] bool starting_point(StartingPoint& start) override {
      start.v[0] = 1.0;
      return true;
    }
    [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override {
      load(v, new_v);
      f = x_ * x_ * x_ * x_;
      return true;
    }
    [[nodiscard]] bool gradient(std::span<const double> v, bool new_v,
                                std::span<double> grad) override {
      load(v, new_v);
      grad[0] = 4.0 * x_ * x_ * x_;
      return true;
    }
    [[nodiscard]] bool constraints(std::span<const double>, bool, std::span<double>) override {
      return true;
    }
    [[nodiscard]] bool jacobian(std::span<const double>, bool, std::span<double>) override {
      return true;
    }
    [[nodiscard]] bool hessian(std::span<const double>, bool, double, std::span<const double>, bool,
                               std::span<double>) override {
      return false;
    }

   private:
    void load(std::span<const double> v, bool new_v) {
      if (new_v) x_ = v[0];
    }
    ProblemStructure structure_;
    double x_ = 0.0;
  } model;
  FiniteDifferenceHessian differences(model, with_differences());
  const std::vector<double> v{2.0};
  double f = 0.0;
  std::vector<double> one(1);
  EXPECT_TRUE(differences.objective(v, true, f));
  EXPECT_TRUE(differences.hessian(v, false, 1.0, {}, true, one));
  EXPECT_NEAR(one[0], 48.0, 1e-6);
  EXPECT_TRUE(differences.objective(v, false, f));
  EXPECT_EQ(f, 16.0);
  EXPECT_TRUE(differences.gradient(v, false, one));
  EXPECT_EQ(one[0], 32.0);
}

TEST(Differences, CostTwoEvaluationsPerGroup) {
  Model model;
  std::vector<Expression> v;
  for (int i = 0; i < 40; ++i) v.push_back(model.variable(kMin, "v"));
  Expression f = 0.0;
  for (std::size_t i = 0; i < v.size(); ++i) {
    f += exp(v[i]);
    if (i > 0) f += sin(v[i] * v[i - 1]);
  }
  model.objective(f);
  AutodiffProblem problem(model);
  WithoutHessian blind(problem, true);
  FiniteDifferenceHessian differences(blind, with_differences());
  EXPECT_EQ(differences.groups(), 3);
  EXPECT_EQ(blind.counts().gradient, 0);
  const std::vector<double> point(40, 0.3);
  std::vector<double> gradient(40), values(differences.structure().hessian.size());
  EXPECT_TRUE(differences.gradient(point, true, gradient));
  EXPECT_TRUE(differences.hessian(point, false, 1.0, {}, true, values));
  EXPECT_EQ(blind.counts().gradient, 1 + 2 * 3);
  EXPECT_EQ(differences.gradients(), 2 * 3);
}

/// Gradients of Hessians, one after the other, of sums of all products of two variables, and of
/// fourth powers times bend; sigma changes with the point, the third is the second again.
std::vector<Index> gradients_of_hessians(double bend) {
  constexpr std::size_t kSize = 20;
  Model model;
  std::vector<Expression> v;
  Expression f = 0.0;
  for (std::size_t i = 0; i < kSize; ++i) {
    v.push_back(model.variable(kMin, "v"));
    f += bend * square(square(v[i]));
    for (std::size_t j = 0; j < i; ++j) f += 0.1 * static_cast<double>(i + 1) * v[i] * v[j];
  }
  model.objective(f);
  AutodiffProblem problem(model, std::vector(kSize, 0.1));
  WithoutHessian blind(problem);
  FiniteDifferenceHessian differences(blind, with_differences());
  std::vector<double> values(differences.structure().hessian.size()), errors(kSize);
  std::vector<Index> gradients;
  for (const auto& [place, sigma] : {std::pair{0.3, 1.0}, {0.4, 1.0}, {0.4, 1.0}, {0.4, 2.0}}) {
    const Index before = differences.gradients();
    const std::vector<double> point(kSize, place);
    EXPECT_TRUE(differences.hessian(point, true, sigma, {}, true, values));
    gradients.push_back(differences.gradients() - before);
    for (std::size_t k = 0; k < values.size(); ++k) {
      const auto [row, col] = differences.structure().hessian[k];
      const double exact =
          row == col ? 12.0 * bend * place * place : 0.1 * (std::max(row, col) + 1);
      EXPECT_NEAR(values[k], sigma * exact, 1e-6);
    }
    EXPECT_TRUE(differences.hessian_errors(point, sigma, {}, errors));
    for (const double error : errors) EXPECT_LT(error, 1e-5);
  }
  return gradients;
}

TEST(Differences, OfAQuadraticFunctionAreTakenOnce) {
  const std::vector<Index> quadratic = gradients_of_hessians(0.0);
  EXPECT_LE(quadratic[1], 4);
  EXPECT_LE(quadratic[2], 4);
  EXPECT_GT(quadratic[3], 30);  // twice the function
  const std::vector<Index> quartic = gradients_of_hessians(1.0);
  EXPECT_GT(quartic[1], 30);
  EXPECT_LE(quartic[2], 4);
}

// --- Detection -----------------------------------------------------------------------------------

Pairs detected(const Model& model, std::vector<double> start) {
  AutodiffProblem problem(model, std::move(start));
  WithoutHessian blind(problem);
  return pairs_of(FiniteDifferenceHessian(blind, SolverOptions{}).structure());
}

TEST(Detection, FindsPairsAcrossPlayersAndConstraints) {
  Model model;
  const Expression x0 = model.variable(kMin, "x0"), x1 = model.variable(kMin, "x1");
  const Expression y0 = model.variable(kMax, "y0"), y1 = model.variable(kMax, "y1");
  const Expression linear = model.variable(kMin, "linear");
  model.objective(x0 * y1 + linear);
  model.constraint(exp(y0) + 2.0 * linear, 0.0, kNoBound, kMax);
  model.constraint(x0 + x1, 0.0, 1.0);
  EXPECT_EQ(detected(model, {0.0, 0.0, 0.0, 0.0, 0.0}), (Pairs{{2, 2}, {3, 0}}));
}

TEST(Detection, SeesProductsThatVanishAtTheStart) {
  Model model;
  std::vector<Expression> v;
  for (int i = 0; i < 4; ++i) v.push_back(model.variable(i < 2 ? kMin : kMax, "v"));
  model.objective(v[0] * v[1] * v[2] * v[3]);
  EXPECT_EQ(detected(model, {0.0, 0.0, 0.0, 0.0}).size(), 6U);
}

TEST(Detection, LooksInsideTheDomain) {
  Model model;
  const Expression x = model.variable(kMin, "x", 0.0, 1.0), y = model.variable(kMax, "y");
  const Expression z = model.variable(kMax, "z");
  model.objective(log(x) - square(y) + log(3.0 + 1e-3 * (x - 1000.0 * z)));
  EXPECT_EQ(detected(model, {0.5, 1.0, -2.9}), (Pairs{{0, 0}, {1, 1}, {2, 0}, {2, 2}}));
}

TEST(Detection, FixedVariablesHaveNoEntries) {
  Model model;
  const Expression x = model.variable(kMin, "x"), p = model.variable(kMin, "p", 2.0, 2.0);
  model.objective(square(x) * p + square(p));
  EXPECT_EQ(detected(model, {1.0, 2.0}), (Pairs{{0, 0}}));
}

TEST(Detection, WideConstraintsAreNotDense) {
  Model model;
  Expression sum = 0.0;
  std::vector<Expression> v;
  for (int i = 0; i < 50; ++i) v.push_back(model.variable(kMin, "v"));
  for (const Expression& e : v) sum += square(e);
  model.objective(v[0]);
  model.constraint(sum, 0.0, 1.0);
  Pairs diagonal;
  for (Index i = 0; i < 50; ++i) diagonal.emplace_back(i, i);
  EXPECT_EQ(detected(model, std::vector(50, 0.1)), diagonal);
}

TEST(Detection, HandlesArrowsAndDenseHessians) {
  Model model;
  std::vector<Expression> v;
  Expression f = 0.0, sum = 0.0;
  for (int i = 0; i < 60; ++i) v.push_back(model.variable(kMin, "v"));
  for (const Expression& e : v) f += square(e) * square(v[30]) + pow(e, 4.0);
  model.objective(f);
  EXPECT_EQ(detected(model, std::vector(60, 0.1)).size(), 60U + 59U);
  for (const Expression& e : v) sum += e;
  model.objective(exp(0.1 * sum));
  EXPECT_EQ(detected(model, std::vector(60, 0.1)).size(), 60U * 61U / 2U);
}

TEST(Detection, AMatrixGameIsBilinear) {
  constexpr Index kRows = 24, kColumns = 36;
  Model model;
  std::vector<Expression> x, y;
  Expression f = 0.0, of_x = 0.0, of_y = 0.0;
  for (Index i = 0; i < kRows; ++i)
    of_x = of_x + x.emplace_back(model.variable(kMin, "x", 0.0, 1.0));
  for (Index j = 0; j < kColumns; ++j)
    of_y = of_y + y.emplace_back(model.variable(kMax, "y", 0.0, 1.0));
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> payoff(-1.0, 1.0);
  for (const Expression& of_min : x) {
    Expression sum = 0.0;
    for (const Expression& of_max : y) sum = sum + payoff(random) * of_max;
    f = f + of_min * sum;
  }
  model.objective(f);
  model.constraint(of_x, 1.0, 1.0);
  model.constraint(of_y, 1.0, 1.0);
  std::vector<double> start(kRows, 1.0 / kRows);
  start.resize(kRows + kColumns, 1.0 / kColumns);
  AutodiffProblem game(model, start);
  WithoutHessian problem(game);
  const FiniteDifferenceHessian differences(problem, {});
  EXPECT_EQ(differences.structure().hessian.size(), at(kRows * kColumns));
  EXPECT_EQ(solve(problem, {}).certificate.kind, PointKind::LocalMinmax)
      << "entries that are always zero stood in its way";
}

TEST(Detection, RandomPatternsAreFound) {
  std::mt19937 random(17);
  for (const int n : {1, 2, 7, 33, 64}) {
    Model model;
    std::vector<Expression> v;
    for (int i = 0; i < n; ++i) v.push_back(model.variable(i % 2 == 0 ? kMin : kMax, "v"));
    Expression f = 0.0;
    for (int k = 0; k < 2 * n; ++k) {
      std::uniform_int_distribution<std::size_t> any(0, v.size() - 1);
      f += sin(v[any(random)] * v[any(random)]);
    }
    model.objective(f);
    AutodiffProblem problem(model);
    Pairs known = pairs_of(problem.structure());
    std::sort(known.begin(), known.end());
    const Pairs found = detected(model, std::vector<double>(at(n), 0.0));
    EXPECT_TRUE(std::ranges::includes(found, known)) << n;
    // Scattered as these are, 64 variables take more evaluations than detection may.
    if (n < 64) {
      EXPECT_EQ(found, known) << n;
    }
  }
}

TEST(Detection, LooksOnlyAtTheVariablesThatTheModelCallsNonlinear) {
  Model model;
  const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y");
  const Expression z = model.variable(kMin, "z");
  model.objective(square(x) - square(y) + x * y + z);
  AutodiffProblem problem(model, {1.0, 1.0, 1.0});
  const auto cost = [&](std::optional<std::vector<Index>> list, Pairs expected) {
    WithoutHessian blind(problem);
    blind.mutable_structure().nonlinear_variables = std::move(list);
    const FiniteDifferenceHessian differences(blind, SolverOptions{});
    EXPECT_EQ(pairs_of(differences.structure()), expected);
    return blind.counts().gradient;
  };
  const Pairs all{{0, 0}, {1, 0}, {1, 1}};
  const Index without_list = cost(std::nullopt, all);
  EXPECT_LE(cost(std::vector<Index>{0, 1}, all), without_list);
  // A list that is wrong is found out.
  cost(std::vector<Index>{0}, all);
  cost(std::vector<Index>{}, all);
}

TEST(Detection, TheModelIsAskedForItsStartOnce) {
  AutodiffProblem problem(mixed_model(), {1.0, 0.5, 0.5, 1.0, 1.0});
  WithoutHessian blind(problem);
  static_cast<void>(solve(blind, SolverOptions{}));
  EXPECT_EQ(blind.starting_points, 1);
}

TEST(Detection, TakesFewEvaluationsForABand) {
  // n = 64 is the most that a Model has; sparse couplings in random order.
  Model model;
  std::vector<Expression> v;
  for (int i = 0; i < 64; ++i) v.push_back(model.variable(kMin, "v"));
  Expression f = 0.0;
  for (std::size_t i = 0; i < 64; ++i) f += square(sin(v[i] - (i > 0 ? v[i - 1] : v[i])));
  model.objective(f);
  AutodiffProblem problem(model, std::vector(64, 0.0));
  WithoutHessian blind(problem);
  const FiniteDifferenceHessian differences(blind, SolverOptions{});
  EXPECT_LE(blind.counts().gradient, 140);
}

// --- Missing entries -----------------------------------------------------------------------------

/// The structure hides 3xy.
TEST(MissingEntries, AreFoundByTheErrorEstimate) {
  Model model;
  const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y");
  const Expression z = model.variable(kMin, "z");
  model.objective(square(x) + 3.0 * x * y - square(y) + square(z));
  AutodiffProblem problem(model, {1.0, 1.0, 1.0});
  WithoutHessian blind(problem, true);
  blind.mutable_structure().hessian = {{0, 0}, {1, 1}, {2, 2}};
  FiniteDifferenceHessian differences(blind, with_differences());
  std::vector<double> row_errors(3);
  ASSERT_TRUE(differences.hessian_errors(std::vector{1.0, 1.0, 1.0}, 1.0, {}, row_errors));
  EXPECT_EQ(row_errors[0], kInfinity);
  EXPECT_EQ(row_errors[1], kInfinity);
  EXPECT_LT(row_errors[2], 1e-6);
  EXPECT_TRUE(differences.widen());
  EXPECT_EQ(pairs_of(differences.structure()), (Pairs{{0, 0}, {1, 0}, {1, 1}, {2, 2}}));
  ASSERT_TRUE(differences.hessian_errors(std::vector{1.0, 1.0, 1.0}, 1.0, {}, row_errors));
  EXPECT_LT(row_errors[0], 1e-6);
  EXPECT_FALSE(differences.widen());
}

/// Without the hidden entry both diagonal entries of y are right; with it the point is a saddle of
/// the maximization.
TEST(MissingEntries, DoNotMakeACertificate) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y0 = model.variable(kMax, "y0"), y1 = model.variable(kMax, "y1");
  model.objective(square(x) - square(y0) - square(y1) + 4.0 * y0 * y1);
  AutodiffProblem problem(model, {0.0, 0.0, 0.0});
  WithoutHessian blind(problem, true);
  blind.mutable_structure().hessian = {{0, 0}, {1, 1}, {2, 2}};
  std::vector<std::string> messages;
  SolveObserver observer;
  observer.message = [&](std::string_view text) { messages.emplace_back(text); };
  const Result result = solve(blind, with_differences(), observer);
  EXPECT_FALSE(is_success(result.status)) << name_of(result.status);
  EXPECT_NE(result.certificate.kind, PointKind::LocalMinmax);
  EXPECT_TRUE(std::ranges::any_of(messages, [](const std::string& text) {
    return text.find("entries that its structure misses") != std::string::npos;
  }));
}

/// f = (x-20)^2/2 - y^2/2 + max(0, x-10)^2 y / 100: the players meet far from where the sparsity
/// was looked for.
TEST(MissingEntries, AreAddedWhenTheyAppear) {
  const auto beyond = [](const VectorXd& v) { return std::max(0.0, v[0] - 10.0); };
  const auto square = [](double a) { return a * a; };
  FunctionProblem problem(
      {kMin, kMax}, Eigen::Vector2d(0.0, 0.0),
      [&](const VectorXd& v) {
        return 0.5 * square(v[0] - 20.0) - 0.5 * square(v[1]) + square(beyond(v)) * v[1] / 100.0;
      },
      [&](const VectorXd& v) -> VectorXd {
        return Eigen::Vector2d(v[0] - 20.0 + beyond(v) * v[1] / 50.0,
                               -v[1] + square(beyond(v)) / 100.0);
      },
      [&](const VectorXd& v) -> MatrixXd {
        const bool met = v[0] > 10.0;
        return MatrixXd{{1.0 + (met ? v[1] / 50.0 : 0.0), beyond(v) / 50.0},
                        {beyond(v) / 50.0, -1.0}};
      });
  WithoutHessian blind(problem);
  EXPECT_EQ(pairs_of(FiniteDifferenceHessian(blind, SolverOptions{}).structure()),
            (Pairs{{0, 0}, {1, 1}}));
  const Result exact = solve(problem, SolverOptions{});
  const Result found = solve(blind, SolverOptions{});
  ASSERT_EQ(exact.status, Status::Solved);
  EXPECT_EQ(found.status, Status::Solved) << found.message;
  EXPECT_EQ(found.certificate.kind, PointKind::LocalMinmax);
  EXPECT_NEAR(found.v[0], exact.v[0], 1e-6);
  EXPECT_NEAR(found.v[1], exact.v[1], 1e-6);
}

// --- Stated errors in the certificate ------------------------------------------------------------

/// A problem that states errors of its Hessian's rows.
class WithErrors final : public Problem {
 public:
  WithErrors(const Model& model, std::vector<double> start, std::vector<double> errors)
      : problem_(model, std::move(start)), errors_(std::move(errors)) {}
  [[nodiscard]] const ProblemStructure& structure() const override { return problem_.structure(); }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    return problem_.starting_point(start);
  }
  [[nodiscard]] bool user_scaling(UserScaling& scaling) override {
    scaling.variables.assign(errors_.size(), 10.0);
    return true;
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool n, double& f) override {
    return problem_.objective(v, n, f);
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool n, std::span<double> grad) override {
    return problem_.gradient(v, n, grad);
  }
  [[nodiscard]] bool constraints(std::span<const double> v, bool n, std::span<double> g) override {
    return problem_.constraints(v, n, g);
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool n,
                              std::span<double> values) override {
    return problem_.jacobian(v, n, values);
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool n, double sigma,
                             std::span<const double> lambda, bool new_lambda,
                             std::span<double> values) override {
    return problem_.hessian(v, n, sigma, lambda, new_lambda, values);
  }
  [[nodiscard]] bool hessian_errors(std::span<const double>, double, std::span<const double>,
                                    std::span<double> row_errors) override {
    std::ranges::copy(errors_, row_errors.begin());
    return true;
  }

 private:
  AutodiffProblem problem_;
  std::vector<double> errors_;
};

/// Verdict on (0, 0) of f = xx x^2/2 + xy x y + yy y^2/2 with these errors.
SecondOrder verdict(double xx, double xy, double yy, std::vector<double> errors,
                    const SolverOptions& options = {}) {
  Model model;
  const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y");
  model.objective(0.5 * xx * square(x) + xy * x * y + 0.5 * yy * square(y));
  WithErrors problem(model, {0.0, 0.0}, std::move(errors));
  const Result result = solve(problem, options);
  const Certificate& certificate = result.certificate;
  EXPECT_EQ(certificate.finite_differences, certificate.second_order != SecondOrder::NotTested);
  EXPECT_EQ(certificate.kind == PointKind::LocalMinmax,
            certificate.second_order == SecondOrder::Satisfied);
  return certificate.second_order;
}

TEST(StatedErrors, AreHeldAgainstTheCurvatureOfBothPlayers) {
  EXPECT_EQ(verdict(1.0, 0.0, -1.0, {0.0, 0.0}), SecondOrder::Satisfied);
  EXPECT_EQ(verdict(1.0, 0.0, -1.0, {0.9, 0.9}), SecondOrder::Satisfied);
  EXPECT_EQ(verdict(1.0, 0.0, -1.0, {1.1, 0.0}), SecondOrder::Undecided);
  EXPECT_EQ(verdict(1.0, 0.0, -1.0, {0.0, 1.1}), SecondOrder::Undecided);
  EXPECT_EQ(verdict(1.0, 0.0, -1.0, {kInfinity, 0.0}), SecondOrder::Undecided);
}

/// phi'' = xx - xy^2 / yy = -90 + 100 / (1 + e): an error of the maximizer's curvature counts a
/// hundredfold for the minimizer.
TEST(StatedErrors, OfTheMaximizerReachTheMinimizer) {
  EXPECT_EQ(verdict(-90.0, 10.0, -1.0, {0.0, 0.1}), SecondOrder::Satisfied);
  EXPECT_EQ(verdict(-90.0, 10.0, -1.0, {0.0, 0.12}), SecondOrder::Undecided);
}

TEST(StatedErrors, MakeAWrongSignUndecided) {
  EXPECT_EQ(verdict(-1.0, 0.0, -1.0, {1.1, 0.0}), SecondOrder::Undecided);
  EXPECT_EQ(verdict(1.0, 0.0, 1.0, {0.0, 1.1}), SecondOrder::Undecided);
  // Definitely wrong: left along the curvature, never returned as an answer.
  EXPECT_NE(verdict(-1.0, 0.0, -1.0, {0.9, 0.0}), SecondOrder::Undecided);
  EXPECT_NE(verdict(1.0, 0.0, 1.0, {0.0, 0.9}), SecondOrder::Undecided);
}

TEST(StatedErrors, AreScaledWithTheVariables) {
  SolverOptions options;
  options.nlp_scaling_method = Scaling::User;
  EXPECT_EQ(verdict(1.0, 0.0, -1.0, {0.9, 0.9}, options), SecondOrder::Satisfied);
  EXPECT_EQ(verdict(1.0, 0.0, -1.0, {1.1, 0.0}, options), SecondOrder::Undecided);
}

// --- Solve ---------------------------------------------------------------------------------------

Model game() {
  Model model;
  const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y");
  model.objective(-square(x) + 4.0 * x * y - square(y) - 12.0 * y);
  model.constraint(y - x, 0.0, kNoBound);
  return model;
}

TEST(SolveWithDifferences, IsChosenWhereTheModelHasNoHessian) {
  AutodiffProblem problem(game(), {0.0, 1.0});
  WithoutHessian blind(problem);
  std::vector<std::string> messages;
  SolveObserver observer;
  observer.message = [&](std::string_view text) { messages.emplace_back(text); };
  const Result result = solve(blind, SolverOptions{}, observer);
  EXPECT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax);
  EXPECT_TRUE(result.certificate.finite_differences);
  ASSERT_EQ(messages.size(), 1U);
  EXPECT_EQ(messages[0],
            "Second derivatives from finite differences: 3 entries by 2 groups of variables.");
  EXPECT_EQ(result.counts.gradient, blind.counts().gradient);
  EXPECT_EQ(result.counts.jacobian, blind.counts().jacobian);
}

TEST(SolveWithDifferences, IsAnErrorWhereExactDerivativesWereAskedFor) {
  AutodiffProblem problem(game(), {0.0, 1.0});
  WithoutHessian blind(problem);
  SolverOptions options;
  options.hessian_approximation = HessianApproximation::Exact;
  const Result result = solve(blind, options);
  EXPECT_EQ(result.status, Status::InvalidOption);
  EXPECT_NE(result.message.find("hessian_approximation = exact"), std::string::npos);
  EXPECT_NE(result.message.find("finite-difference-values"), std::string::npos);
  EXPECT_EQ(blind.counts().gradient, 0);
  EXPECT_EQ(solve(problem, options).status, Status::Solved);
}

/// Without second derivatives, and with first ones from differences whose rounding is tol.
class Rough final : public WithoutHessian {
 public:
  using WithoutHessian::WithoutHessian;
  bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    double f = 0.0;
    return difference(
        v, 1, [&](std::span<const double> w) { return objective(w, true, f) ? &f : nullptr; },
        [&](std::size_t, std::size_t i, double slope) { grad[i] = slope; });
  }
  bool jacobian(std::span<const double> v, bool, std::span<double> values) override {
    std::vector<double> g(structure().constraint_players.size());
    return difference(
        v, g.size(),
        [&](std::span<const double> w) { return constraints(w, true, g) ? g.data() : nullptr; },
        [&](std::size_t j, std::size_t i, double slope) {
          for (std::size_t k = 0; k < values.size(); ++k) {
            const auto [row, col] = structure().jacobian[k];
            if (at(row) == j && at(col) == i) values[k] = slope;
          }
        });
  }

 private:
  template <class Values, class Store>
  static bool difference(std::span<const double> v, std::size_t rows, const Values& values_at,
                         const Store& store) {
    constexpr double kStep = 1e-8;
    std::vector<double> w(v.begin(), v.end());
    const double* found = values_at(w);
    if (found == nullptr) return false;
    const std::vector<double> here(found, found + rows);
    for (std::size_t i = 0; i < w.size(); ++i) {
      w[i] = v[i] + kStep;
      if ((found = values_at(w)) == nullptr) return false;
      for (std::size_t j = 0; j < rows; ++j) store(j, i, (found[j] - here[j]) / kStep);
      w[i] = v[i];
    }
    return true;
  }
};

// Each step by a rounding renews the errors of rough gradients: multipliers have to answer at one
// point.
TEST(SolveWithDifferences, RoughGradientsReachTheTolerance) {
  for (int k = 0; k < 40; ++k) {
    const double slope = 2.0 + 0.05 * k, root = 1.0 / (1.0 + slope);  // of slope x = 1 - x
    Model model;
    const Expression x = model.variable(kMin, "x", -0.5, 1.0),
                     y = model.variable(kMin, "y", 0.0, 8.0);
    model.objective(sqrt(y));
    model.constraint(y - slope * slope * slope * x * square(x), 0.0, 0.0);
    model.constraint(y - (1.0 - x) * square(1.0 - x), 0.0, 0.0);
    AutodiffProblem smooth(model, {8.0, 0.25});
    Rough problem(smooth);
    SolverOptions options;
    options.mu_strategy = BarrierStrategy::Adaptive;
    const Result result = solve(problem, options);
    // Differences of such gradients may leave the curvature undecided.
    EXPECT_TRUE(result.status == Status::Solved || result.status == Status::SolvedDegenerate)
        << slope << ": " << name_of(result.status);
    EXPECT_NEAR(result.v[0], root, 1e-6);
  }
}

TEST(SolveWithDifferences, IsWhatLimitedMemoryMeans) {
  AutodiffProblem problem(game(), {0.0, 1.0});
  SolverOptions options;
  options.hessian_approximation = HessianApproximation::LimitedMemory;
  const Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::Solved);
  EXPECT_TRUE(result.certificate.finite_differences);
}

/// The true curvature of y is kappa; the model's gradient carries noise that the differences
/// enlarge.
Result solve_noisy(double kappa, double noise) {
  class Noisy final : public Problem {
   public:
    Noisy(double kappa, double noise) : kappa_(kappa), noise_(noise) {
      structure_.variable_players = {kMin, kMax};
      structure_.variable_lower.assign(2, -kInfinity);
      structure_.variable_upper.assign(2, kInfinity);
      structure_.hessian = {{0, 0}, {1, 1}};
    }
    [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
    [[nodiscard]] bool starting_point(StartingPoint&) override { return true; }
    [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
      f = 0.5 * v[0] * v[0] + 0.5 * kappa_ * v[1] * v[1];
      return true;
    }
    [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
      grad[0] = v[0];
      grad[1] = kappa_ * v[1] + noise_ * std::sin(1e7 * v[1]);
      return true;
    }
    [[nodiscard]] bool constraints(std::span<const double>, bool, std::span<double>) override {
      return true;
    }
    [[nodiscard]] bool jacobian(std::span<const double>, bool, std::span<double>) override {
      return true;
    }
    [[nodiscard]] bool hessian(std::span<const double>, bool, double, std::span<const double>, bool,
                               std::span<double>) override {
      return false;
    }

   private:
    ProblemStructure structure_;
    double kappa_, noise_;
  } problem(kappa, noise);
  return solve(problem, with_differences());
}

TEST(SolveWithDifferences, NoiseBeyondTheCurvatureIsUndecided) {
  EXPECT_EQ(solve_noisy(-1e-3, 0.0).certificate.second_order, SecondOrder::Satisfied);
  EXPECT_NE(solve_noisy(-1e-3, 1e-7).certificate.second_order, SecondOrder::Satisfied);
  EXPECT_NE(solve_noisy(1e-3, 1e-7).certificate.second_order, SecondOrder::Satisfied);
}

/// Curvatures around the tolerance: what differences certify is really there.
TEST(SolveWithDifferences, TinyCurvatureOfTheWrongSignIsNotCertified) {
  for (const double curvature : {1e-4, 1e-6, 1e-7, 1e-8, 1e-9, 1e-11, 0.0}) {
    for (const bool of_max : {false, true}) {
      Model model;
      const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y");
      const Expression flat = of_max ? y : x;
      // e^t + e^-t - 2 - t^2 is flat to fourth order at 0: its curvature comes out as noise.
      model.objective((of_max ? square(x) : -square(y)) + exp(flat) + exp(-flat) +
                      (-1.0 + (of_max ? curvature : -curvature)) * square(flat));
      AutodiffProblem problem(model, {0.0, 0.0});
      WithoutHessian blind(problem);
      const Result result = solve(blind, SolverOptions{});
      if (result.certificate.second_order != SecondOrder::Satisfied) continue;
      const double t = result.v[of_max ? 1 : 0];  // where escaping from 0 may have led
      const double found = 2.0 * std::cosh(t) - 2.0 + 2.0 * (of_max ? curvature : -curvature);
      EXPECT_GT(of_max ? -found : found, 0.0) << curvature << (of_max ? " Max" : " Min");
    }
  }
}

TEST(SolveWithDifferences, BadStructureGetsTheUsualMessage) {
  AutodiffProblem problem(game(), {0.0, 1.0});
  WithoutHessian blind(problem);
  blind.mutable_structure().jacobian[0].col = 7;
  const Result result = solve(blind, SolverOptions{});
  EXPECT_EQ(result.status, Status::InvalidProblem);
  EXPECT_NE(result.message.find("column 7"), std::string::npos);
  WithoutHessian bounds(problem);
  bounds.mutable_structure().variable_lower[0] = std::nan("");
  EXPECT_NE(solve(bounds, SolverOptions{}).message.find("NaN"), std::string::npos);
}

TEST(SolveWithDifferences, NeedsNoVariables) {
  Model model;
  const Expression x = model.variable(kMin, "x", 1.0, 1.0);
  model.objective(square(x));
  AutodiffProblem problem(model, {1.0});
  WithoutHessian blind(problem);
  EXPECT_TRUE(is_success(solve(blind, SolverOptions{}).status));
}

TEST(SolveWithDifferences, RestoresFeasibility) {
  Model model;
  const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y");
  model.objective(x - square(y));
  model.constraint(square(x) + square(x - 3.0), 0.0, 1.0);
  AutodiffProblem problem(model, {10.0, 1.0});
  WithoutHessian blind(problem);
  const Result exact = solve(problem, SolverOptions{});
  const Result found = solve(blind, SolverOptions{});
  EXPECT_EQ(name_of(found.status), name_of(exact.status));
}

// --- What detection may cost ---------------------------------------------------------------------

/// Every constraint couples 20 variables far apart: nothing short of the whole matrix to find.
class Scattered final : public AutodiffProblem {
 public:
  explicit Scattered(Index n)
      : AutodiffProblem(model(n), std::vector<double>(static_cast<std::size_t>(n), 0.5)) {}

 private:
  static Model model(Index n) {
    Model model;
    std::vector<Expression> v;
    for (Index i = 0; i < n; ++i) v.push_back(model.variable(kMin, "v"));
    std::mt19937 random(3);
    for (Index j = 0; j < n; ++j) {
      Expression sum = 0.0 * v[0];
      for (int k = 0; k < 20; ++k) sum = sum + v[random() % v.size()] * static_cast<double>(k + 1);
      model.constraint(square(sum), -kInfinity, 1e3);
    }
    model.objective(square(v[0]));
    return model;
  }
};

TEST(Detection, AsksForFewerDerivativesThanAnEighthOfTheVariablesAndTwoHundred) {
  for (const Index n : {40, 60}) {
    Scattered exact(n);
    WithoutHessian problem(exact);
    const FiniteDifferenceHessian model(problem, with_differences());
    EXPECT_LE(problem.counts().gradient, n / 8 + 200);
    EXPECT_LE(problem.counts().jacobian, n / 8 + 200);
    const Pairs found = pairs_of(model.structure());
    for (const auto& [row, col] : pairs_of(exact.structure())) {
      EXPECT_TRUE(
          std::ranges::binary_search(found, std::pair(std::max(row, col), std::min(row, col))))
          << row << ' ' << col;
    }
  }
}

}  // namespace
}  // namespace ipminmax::testing
