// Solves with the Schur complement give the certified answers of those without, and it is chosen
// where it saves operations.

#include <algorithm>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include <problems/scalable_problems.hpp>
#include <problems/small_problems.hpp>
#include <support/judge_result.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

Result solve_with(Problem& problem, SchurComplementUse use,
                  LinearSolver solver = LinearSolver::Auto) {
  SolverOptions options;
  options.minmax_schur_complement = use;
  options.linear_solver = solver;
  return solve(problem, options);
}

class SchurSmall : public ::testing::TestWithParam<std::size_t> {};

TEST_P(SchurSmall, CertifiesAsOften) {
  const SmallProblem& known = small_problems()[GetParam()];
  AutodiffProblem problem(known.model);
  std::mt19937 random(11);
  int certified[2] = {0, 0};
  auto starts = known.starts;
  for (int trial = 0; trial < 6; ++trial) {
    std::vector<double> start;
    for (const Interval& side : known.random_start_box) {
      start.push_back(std::uniform_real_distribution(side.lower, side.upper)(random));
    }
    starts.push_back(start);
  }
  for (const auto& start : starts) {
    problem.set_start(start);
    for (const bool schur : {false, true}) {
      const Result result =
          solve_with(problem, schur ? SchurComplementUse::Yes : SchurComplementUse::No);
      if (schur) {
        // The scaling at the start loosens tol as in solve_small_test.
        const DenseEvaluation here(
            problem, Eigen::Map<const Eigen::VectorXd>(start.data(), std::ssize(start)));
        const double scale = std::clamp(here.gradient.lpNorm<Eigen::Infinity>() / 100.0, 1.0, 1e8);
        const DenseOptimality found =
            judge(problem, result, {.first_order = 1e-6 * scale, .curvature = 1e-5});
        EXPECT_TRUE(is_sound(result, found)) << known.name << ": " << found;
      }
      certified[schur ? 1 : 0] += result.certificate.kind == PointKind::LocalMinmax ? 1 : 0;
    }
  }
  // Rounding may send single searches elsewhere.
  EXPECT_GE(certified[1] + 1, certified[0]);
}

INSTANTIATE_TEST_SUITE_P(Small, SchurSmall,
                         ::testing::Range<std::size_t>(0, small_problems().size()),
                         [](const auto& instance) {
                           std::string name = small_problems()[instance.param].name;
                           std::ranges::replace(name, '.', '_');
                           return name;
                         });

TEST(SchurComplement, IsChosenWhereMinHasFewVariables) {
  const auto known = f30_few_min(5, 60);
  const Result with = solve_with(*known.problem, SchurComplementUse::Auto);
  const Result without = solve_with(*known.problem, SchurComplementUse::No);
  for (const Result* result : {&with, &without}) {
    EXPECT_EQ(name_of(result->status), name_of(Status::Solved)) << result->message;
    EXPECT_EQ(result->certificate.kind, PointKind::LocalMinmax);
    for (std::size_t i = 0; i < known.v.size(); ++i) {
      ASSERT_NEAR(result->v[i], known.v[i], 1e-4) << i;
    }
  }
  EXPECT_GT(with.counts.factorizations_complement, 0);
  EXPECT_LE(with.counts.factorizations_full, 2);  // of the certificate
  EXPECT_LT(with.factorizations, without.factorizations);
  EXPECT_EQ(without.counts.factorizations_complement, 0);
}

TEST(SchurComplement, ServesEveryLinearSolver) {
  const auto known = f30_few_min(4, 9);
  for (const LinearSolver solver :
       {LinearSolver::Auto, LinearSolver::Mumps, LinearSolver::Ldlt, LinearSolver::Lapack}) {
    const Result result = solve_with(*known.problem, SchurComplementUse::Yes, solver);
    EXPECT_EQ(name_of(result.status), name_of(Status::Solved)) << result.message;
    EXPECT_GT(result.counts.factorizations_complement, 0);
    for (std::size_t i = 0; i < known.v.size(); ++i) EXPECT_NEAR(result.v[i], known.v[i], 1e-4);
  }
}

TEST(SchurComplement, IsNotChosenWhereMinHasManyVariables) {
  for (const auto& known : {f01_quad(200), f19_pde(100), f16_lq_game(100)}) {
    const Result result = solve_with(*known.problem, SchurComplementUse::Auto);
    EXPECT_EQ(result.counts.factorizations_complement, 0) << known.name;
    EXPECT_GT(result.counts.factorizations_full, 0) << known.name;
  }
}

TEST(SchurComplement, AlgorithmOneSharesFactorsToo) {
  const auto known = f30_few_min(3, 20);
  SolverOptions options;
  options.minmax_globalization = Globalization::None;
  options.minmax_schur_complement = SchurComplementUse::Yes;
  const Result result = solve(*known.problem, options);
  EXPECT_EQ(name_of(result.status), name_of(Status::Solved)) << result.message;
  EXPECT_GT(result.counts.factorizations_complement, 0);
}

TEST(SchurComplement, IsKeptBySolvesOfTheSameShape) {
  const auto known = f30_few_min(3, 20);
  SolverOptions options;
  options.minmax_schur_complement = SchurComplementUse::Yes;
  RepeatedSolver solver;
  const Result first = solver.solve(*known.problem, options);
  const Result second = solver.solve(*known.problem, options);
  EXPECT_EQ(first.counts.analyses, 3);
  EXPECT_EQ(second.counts.analyses, 0);
  EXPECT_EQ(second.v, first.v);
  EXPECT_GT(second.counts.factorizations_complement, 0);
}

}  // namespace
}  // namespace ipminmax::testing
