// Derivatives of the scalable families against finite differences, and their solutions against
// Ipopt's.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>
#include <utility>

#include <gtest/gtest.h>
#include <Eigen/Core>

#include <regression/element_problem.hpp>
#include <regression/problem_tnlp.hpp>
#include <regression/scalable_nlp.hpp>
#include <support/dense_algebra.hpp>
#include <support/dense_judge.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

class Scalable : public ::testing::TestWithParam<std::size_t> {
 protected:
  const ScalableNlp& family_ = scalable_nlps()[GetParam()];
};

Eigen::VectorXd start_of(Problem& problem) {
  const std::size_t n = problem.structure().variable_lower.size();
  Eigen::VectorXd v = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(n));
  StartingPoint start;
  start.v = {v.data(), n};
  EXPECT_TRUE(problem.starting_point(start));
  return v;
}

/// The start, moved a little, inside the bounds.
Eigen::VectorXd moved_start(Problem& problem) {
  Eigen::VectorXd v = start_of(problem);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> factor(0.9, 1.1);
  for (double& value : v) value = value * factor(random) + 0.01 * (factor(random) - 0.9);
  return v;
}

TEST_P(Scalable, DerivativesAreThoseOfTheFunctions) {
  constexpr double kStep = 1e-6;
  const auto problem = family_.make(100);
  const Eigen::VectorXd v = moved_start(*problem);
  const DenseEvaluation here(*problem, v);
  ASSERT_TRUE(here.ok);
  Eigen::VectorXd lambda(here.constraints.size());
  for (Eigen::Index i = 0; i < lambda.size(); ++i) lambda[i] = std::sin(static_cast<double>(i));
  constexpr double kSigma = 0.7;
  const Eigen::MatrixXd hessian = dense_hessian(*problem, v, kSigma, lambda);

  for (Eigen::Index j = 0; j < v.size(); ++j) {
    const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(v.size(), j);
    const DenseEvaluation up(*problem, v + step);
    const DenseEvaluation down(*problem, v - step);
    ASSERT_TRUE(up.ok && down.ok);
    const auto near = [](double derivative, double difference) {
      return std::abs(derivative - difference) <= 1e-5 * (1.0 + std::abs(derivative));
    };
    // Differences of large values lose digits.
    const double slope = (up.objective - down.objective) / (2.0 * kStep);
    EXPECT_NEAR(here.gradient[j], slope,
                1e-5 * (1.0 + std::abs(slope)) + 1e-9 * std::abs(here.objective))
        << "gradient, variable " << j;
    const Eigen::VectorXd column = (up.constraints - down.constraints) / (2.0 * kStep);
    for (Eigen::Index i = 0; i < column.size(); ++i) {
      EXPECT_TRUE(near(here.jacobian(i, j), column[i])) << "Jacobian " << i << " " << j;
    }
    const Eigen::VectorXd curvature = (kSigma * (up.gradient - down.gradient) +
                                       (up.jacobian - down.jacobian).transpose() * lambda) /
                                      (2.0 * kStep);
    for (Eigen::Index i = 0; i < v.size(); ++i) {
      EXPECT_TRUE(near(hessian(i, j), curvature[i]))
          << "Hessian " << i << " " << j << ": " << hessian(i, j) << " " << curvature[i];
    }
  }
}

TEST_P(Scalable, SolutionIsThatOfIpopt) {
  const auto problem = family_.make(1000);
  const IpoptAnswer ipopt = solve_with_ipopt(*problem);
  SolverOptions options;
  options.minmax_globalization = Globalization::Filter;
  const Result ours = solve(*problem, options);
  std::printf("%-28s n %5zu m %5zu Ipopt %16.9g in %3d iterations, %16.9g in %3d iterations: %s\n",
              family_.name.c_str(), problem->structure().variable_lower.size(),
              problem->structure().constraint_lower.size(), ipopt.objective,
              static_cast<int>(ipopt.iterations), ours.objective, static_cast<int>(ours.iterations),
              std::string(name_of(ours.status)).c_str());
  EXPECT_TRUE(ipopt.solved()) << ipopt.status;
  EXPECT_TRUE(is_success(ours.status)) << ours.message;
  EXPECT_NEAR(ours.objective, ipopt.objective, 1e-6 * std::max(1.0, std::abs(ipopt.objective)));
  EXPECT_LE(ours.iterations, 2 * ipopt.iterations + 10);
}

TEST_P(Scalable, EntriesGrowWithSizeOnly) {
  const auto entries_per_variable = [&](Index n) {
    const auto problem = family_.make(n);
    const ProblemStructure& structure = problem->structure();
    return static_cast<double>(structure.jacobian.size() + structure.hessian.size()) /
           static_cast<double>(structure.variable_lower.size());
  };
  EXPECT_LE(entries_per_variable(100000), 1.5 * entries_per_variable(1000));
}

TEST(ScalableMultipliers, FirstOnesAreTheLeastSquaresOnes) {
  for (const ScalableNlp& family : scalable_nlps()) {
    // Equality constraints only: neither bounds nor slacks take part.
    if (family.name != "luksan_vlcek_1" && family.name != "luksan_vlcek_2" &&
        family.name != "luksan_vlcek_3") {
      continue;
    }
    const auto problem = family.make(100);
    const DenseEvaluation here(*problem, start_of(*problem));
    const Eigen::VectorXd expected = least_squares(here.jacobian.transpose(), -here.gradient);
    for (const LinearSolver solver :
         {LinearSolver::Auto, LinearSolver::Ldlt, LinearSolver::Mumps, LinearSolver::Lapack}) {
      SolverOptions options;
      options.linear_solver = solver;
      options.nlp_scaling_method = Scaling::None;  // of the rows, it would change the projection
      options.constr_mult_init_max = 1e10;
      options.max_iter = 0;
      const Result result = solve(*problem, options);
      ASSERT_EQ(result.lambda.size(), static_cast<std::size_t>(expected.size()));
      const Eigen::Map<const Eigen::VectorXd> lambda(result.lambda.data(), expected.size());
      EXPECT_LE((lambda - expected).norm(), 1e-6 * expected.norm())
          << family.name << " " << static_cast<int>(solver);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Regression, Scalable,
                         ::testing::Range<std::size_t>(0, scalable_nlps().size()),
                         [](const auto& instance) { return scalable_nlps()[instance.param].name; });

Index factorizations_of_test(const Result& result) {
  return result.counts.factorizations_for(FactorizationCause::Certificate).full;
}

/// Newton's method creeps to a zero of high order: no later point on its way tells more.
TEST(TestsOfLargeSystems, EndWhereStepsChangeNothing) {
  constexpr Index kMany = 400;
  for (const LinearSolver solver : {LinearSolver::Auto, LinearSolver::Mumps}) {
    ElementProblem problem;
    for (Index i = 0; i < kMany; ++i) {
      const Index x = problem.add_variable(1.0 + 0.001 * i);
      problem.add_term<Ridge<FourthPower, 1>>(kObjective, 1.0, {x}, {{1.0}});
    }
    problem.finish();
    SolverOptions options;
    options.linear_solver = solver;
    const Result result = solve(problem, options);
    EXPECT_EQ(result.status, Status::SolvedDegenerate);
    EXPECT_LE(factorizations_of_test(result), 9);
  }
}

/// Each of many gradients twice: they are not looked for one after the other.
/// min sum of (x + y - 2)^2 with x = y^2 twice, once doubled.
Result solve_doubled_rows(Index pairs) {
  ElementProblem problem;
  for (Index k = 0; k < pairs; ++k) {
    const Index x = problem.add_variable(0.7), y = problem.add_variable(0.7);
    problem.add_term<Ridge<Square, 2>>(kObjective, 1.0, {x, y}, {{1.0, 1.0}, -2.0});
    for (const double factor : {1.0, 2.0}) {
      const Index row = problem.add_row(0.0, 0.0);
      problem.add_linear(row, x, factor);
      problem.add_term<Ridge<Square, 1>>(row, -factor, {y}, {{1.0}});
    }
  }
  problem.finish();
  return solve(problem, SolverOptions{});
}

TEST(TestsOfLargeSystems, DoNotCountManyDependentConstraints) {
  const Result moderate = solve_doubled_rows(200);
  EXPECT_EQ(moderate.certificate.kind, PointKind::LocalMinmax) << moderate.message;
  const Result large = solve_doubled_rows(2000);
  EXPECT_EQ(large.status, Status::SolvedDegenerate) << large.message;
  EXPECT_LE(large.counts.solves, large.iterations + 80);
}

}  // namespace
}  // namespace ipminmax::testing
