// The collection itself: derivatives against differences, and every stated point against dense
// first- and second-order conditions. No solver involved.

#include <algorithm>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include <problems/small_problems.hpp>
#include <support/dense_judge.hpp>

namespace ipminmax::testing {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd to_vector(const std::vector<double>& values) {
  return Eigen::Map<const VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

VectorXd or_zero(const std::vector<double>& values, std::size_t size) {
  if (values.empty()) return VectorXd::Zero(static_cast<Eigen::Index>(size));
  return to_vector(values);
}

class KnownPoints : public ::testing::TestWithParam<std::size_t> {
 protected:
  const SmallProblem& known_ = small_problems()[GetParam()];
  AutodiffProblem problem_{known_.model};

  void expect_derivatives();
  void expect_rows_of_min_without_y();
  void expect_starts_of_right_size();
  void expect_solutions();
  void expect_other_points_are_none();
};

VectorXd random_point(const std::vector<Interval>& box, std::mt19937& random) {
  VectorXd v(static_cast<Eigen::Index>(box.size()));
  for (Eigen::Index i = 0; i < v.size(); ++i) {
    const Interval& side = box[static_cast<std::size_t>(i)];
    v[i] = std::uniform_real_distribution(side.lower, side.upper)(random);
  }
  return v;
}

void KnownPoints::expect_derivatives() {
  std::mt19937 random(1);
  for (int trial = 0; trial < 5; ++trial) {
    const VectorXd v = random_point(known_.random_start_box, random);
    const DenseEvaluation here(problem_, v);
    ASSERT_TRUE(here.ok) << v.transpose();
    const VectorXd lambda = VectorXd::Random(here.constraints.size());
    const MatrixXd hessian = dense_hessian(problem_, v, 0.7, lambda);
    const double scale = 1.0 + std::abs(here.objective) + here.gradient.lpNorm<Eigen::Infinity>() +
                         hessian.lpNorm<Eigen::Infinity>();
    for (Eigen::Index i = 0; i < v.size(); ++i) {
      const double h = 1e-6 * (1.0 + std::abs(v[i]));
      VectorXd ahead = v, behind = v;
      ahead[i] += h;
      behind[i] -= h;
      const DenseEvaluation plus(problem_, ahead), minus(problem_, behind);
      ASSERT_TRUE(plus.ok && minus.ok);
      EXPECT_NEAR((plus.objective - minus.objective) / (2 * h), here.gradient[i], 1e-7 * scale);
      const VectorXd column = (plus.constraints - minus.constraints) / (2 * h);
      EXPECT_LE((column - here.jacobian.col(i)).norm(), 1e-7 * (1.0 + column.norm()));
      const auto lagrangian_gradient = [&](const DenseEvaluation& e) -> VectorXd {
        return 0.7 * e.gradient + e.jacobian.transpose() * lambda;
      };
      const VectorXd row = (lagrangian_gradient(plus) - lagrangian_gradient(minus)) / (2 * h);
      EXPECT_LE((row - hessian.col(i)).lpNorm<Eigen::Infinity>(), 1e-7 * scale);
    }
  }
}

void KnownPoints::expect_rows_of_min_without_y() {
  const ProblemStructure& structure = problem_.structure();
  for (const auto& [row, col] : structure.jacobian) {
    if (structure.variable_players[static_cast<std::size_t>(col)] == Player::Max) {
      EXPECT_EQ(structure.constraint_players[static_cast<std::size_t>(row)], Player::Max);
    }
  }
}

void KnownPoints::expect_starts_of_right_size() {
  EXPECT_EQ(known_.random_start_box.size(), known_.model.variables());
  EXPECT_FALSE(known_.starts.empty());
  for (const auto& start : known_.starts) EXPECT_EQ(start.size(), known_.model.variables());
}

void KnownPoints::expect_solutions() {
  EXPECT_EQ(known_.solutions.empty(), known_.expectation == Expectation::None);
  EXPECT_EQ(known_.expectation == Expectation::Global,
            known_.expectation != Expectation::Degenerate &&
                std::ranges::any_of(known_.solutions, &KnownSolution::global));
  const Verdict expected =
      known_.expectation == Expectation::Degenerate ? Verdict::Undecided : Verdict::LocalMinmax;
  for (const KnownSolution& solution : known_.solutions) {
    ASSERT_EQ(solution.v.size(), known_.model.variables());
    const DenseEvaluation here(problem_, to_vector(solution.v));
    ASSERT_TRUE(here.ok);
    EXPECT_NEAR(here.objective, solution.objective, 1e-10 * (1.0 + std::abs(here.objective)));

    const Multipliers stated{or_zero(solution.lambda, problem_.structure().constraint_lower.size()),
                             or_zero(solution.z_lower, solution.v.size()),
                             or_zero(solution.z_upper, solution.v.size())};
    const DenseTolerances tight{.first_order = 1e-10, .active = 1e-9, .curvature = 1e-8};
    const DenseOptimality with_stated = dense_optimality(problem_, solution.v, &stated, tight);
    EXPECT_EQ(with_stated.verdict, expected) << with_stated;
    if (with_stated.independent) {
      const DenseOptimality with_estimated = dense_optimality(problem_, solution.v, nullptr, tight);
      EXPECT_EQ(with_estimated.verdict, expected) << with_estimated;
    }
  }
}

void KnownPoints::expect_other_points_are_none() {
  for (const auto& v : known_.not_minmax) {
    const DenseTolerances tight{.first_order = 1e-8, .active = 1e-9, .curvature = 1e-8};
    const DenseOptimality found = dense_optimality(problem_, v, nullptr, tight);
    EXPECT_EQ(found.verdict, Verdict::NotLocalMinmax) << to_vector(v).transpose() << ": " << found;
  }
}

TEST_P(KnownPoints, AreWhatIsStated) {
  expect_derivatives();
  expect_rows_of_min_without_y();
  expect_starts_of_right_size();
  expect_solutions();
  expect_other_points_are_none();
}

INSTANTIATE_TEST_SUITE_P(Small, KnownPoints,
                         ::testing::Range<std::size_t>(0, small_problems().size()),
                         [](const auto& instance) {
                           std::string name = small_problems()[instance.param].name;
                           std::ranges::replace(name, '.', '_');
                           return name;
                         });

}  // namespace
}  // namespace ipminmax::testing
