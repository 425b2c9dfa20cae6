// The collections without second derivatives: differences must lead to the same certified points as
// exact Hessians, or say that they cannot tell.

#include <algorithm>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <problems/scalable_problems.hpp>
#include <problems/small_problems.hpp>
#include <support/judge_result.hpp>
#include <support/without_hessian.hpp>

#include "core/differences/finite_difference_hessian.hpp"
#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    largest = std::max(largest, std::abs(a[i] - b[i]) / (1.0 + std::abs(a[i])));
  }
  return largest;
}

class WithoutSecondDerivatives : public ::testing::TestWithParam<std::size_t> {
 protected:
  void expect_ends_where_exact_hessians_do(bool structure_given);
  void expect_no_more_claims_from_random_starts(bool structure_given);
};

void WithoutSecondDerivatives::expect_ends_where_exact_hessians_do(bool structure_given) {
  const auto& known = small_problems()[GetParam()];
  AutodiffProblem problem(known.model);
  SolverOptions options;
  if (structure_given) {
    options.hessian_approximation = HessianApproximation::FiniteDifferenceValues;
  }
  for (const auto& start : known.starts) {
    problem.set_start(start);
    const Result exact = solve(problem, SolverOptions{});
    WithoutHessian blind(problem, structure_given);
    const Result found = solve(blind, options);
    const DenseOptimality judged = judge(problem, found);
    EXPECT_TRUE(is_sound(found, judged)) << name_of(found.status) << ": " << judged;
    EXPECT_FALSE(exact.certificate.finite_differences);
    if (exact.certificate.kind == PointKind::LocalMinmax) {
      EXPECT_TRUE(is_success(found.status)) << found.message;
      EXPECT_LE(distance(exact.v, found.v), 1e-5);
    }
    if (found.certificate.second_order != SecondOrder::NotTested) {
      EXPECT_TRUE(found.certificate.finite_differences);
    }
  }
}

void WithoutSecondDerivatives::expect_no_more_claims_from_random_starts(bool structure_given) {
  const auto& known = small_problems()[GetParam()];
  AutodiffProblem problem(known.model);
  SolverOptions options;
  if (structure_given) {
    options.hessian_approximation = HessianApproximation::FiniteDifferenceValues;
  }
  std::mt19937 random(3);
  int certified = 0, certified_exact = 0;
  for (int trial = 0; trial < 8; ++trial) {
    std::vector<double> start;
    for (const Interval& side : known.random_start_box) {
      start.push_back(std::uniform_real_distribution(side.lower, side.upper)(random));
    }
    problem.set_start(start);
    const Eigen::VectorXd v =
        Eigen::Map<const Eigen::VectorXd>(start.data(), static_cast<Eigen::Index>(start.size()));
    const double gradient = DenseEvaluation(problem, v).gradient.lpNorm<Eigen::Infinity>();
    const Result exact = solve(problem, SolverOptions{});
    WithoutHessian blind(problem, structure_given);
    const Result found = solve(blind, options);
    const DenseOptimality judged =
        judge(problem, found,
              {.first_order = 1e-6 * std::clamp(gradient / 100.0, 1.0, 1e8), .curvature = 1e-5});
    EXPECT_TRUE(is_sound(found, judged)) << name_of(found.status) << ": " << judged;
    certified += found.certificate.kind == PointKind::LocalMinmax;
    certified_exact += exact.certificate.kind == PointKind::LocalMinmax;
  }
  EXPECT_GE(certified, certified_exact - 2);
}

TEST_P(WithoutSecondDerivatives, ClaimsWhatHolds) {
  for (const bool structure_given : {false, true}) {
    SCOPED_TRACE(structure_given ? "structure given" : "detected");
    expect_ends_where_exact_hessians_do(structure_given);
    expect_no_more_claims_from_random_starts(structure_given);
  }
}

/// The scalable families: sparsity, and nothing lost by detecting it.
struct Family {
  const char* name;
  std::function<ScalableProblem()> make;
};

const Family kFamilies[] = {
    {"f01_quad", [] { return f01_quad(60); }},
    {"f03_quad_box", [] { return f03_quad_box(24); }},
    {"f05_trig", [] { return f05_trig(40); }},
    {"f10_ball_halfspace", [] { return f10_ball_halfspace(20); }},
    {"f12_robust_ls", [] { return f12_robust_ls(6, 3); }},
    {"f16_lq_game", [] { return f16_lq_game(20); }},
    {"f17_mpc_box", [] { return f17_mpc_box(20); }},
    {"f19_pde", [] { return f19_pde(30); }},
    {"f23_sphere", [] { return f23_sphere(20); }},
};

void PrintTo(const Family& family, std::ostream* out) { *out << family.name; }

class FamilyWithoutSecondDerivatives : public ::testing::TestWithParam<Family> {};

TEST_P(FamilyWithoutSecondDerivatives, IsSolvedAsWithThem) {
  const ScalableProblem known = GetParam().make();
  const Result exact = solve(*known.problem, SolverOptions{});
  WithoutHessian blind(*known.problem);
  const Result found = solve(blind, SolverOptions{});
  EXPECT_EQ(name_of(found.status), name_of(exact.status)) << found.message;
  EXPECT_NEAR(found.objective, exact.objective, 1e-7 * (1.0 + std::abs(exact.objective)));
  EXPECT_TRUE(found.certificate.finite_differences);
  EXPECT_LT(found.certificate.hessian_error, 1e-5);
}

TEST_P(FamilyWithoutSecondDerivatives, SparsityIsFound) {
  const ScalableProblem known = GetParam().make();
  WithoutHessian blind(*known.problem), given(*known.problem, true);
  const FiniteDifferenceHessian detected(blind, SolverOptions{}), told(given, SolverOptions{});
  const auto pairs = [](const FiniteDifferenceHessian& problem) {
    std::vector<std::pair<Index, Index>> result;
    for (const Triplet& entry : problem.structure().hessian) {
      result.emplace_back(entry.row, entry.col);
    }
    return result;
  };
  EXPECT_EQ(pairs(detected), pairs(told));
  EXPECT_LE(detected.groups(), 7);
}

INSTANTIATE_TEST_SUITE_P(Scalable, FamilyWithoutSecondDerivatives, ::testing::ValuesIn(kFamilies),
                         [](const auto& instance) { return std::string(instance.param.name); });

INSTANTIATE_TEST_SUITE_P(Small, WithoutSecondDerivatives,
                         ::testing::Range<std::size_t>(0, small_problems().size()),
                         [](const auto& instance) {
                           std::string name = small_problems()[instance.param].name;
                           std::ranges::replace(name, '.', '_');
                           return name;
                         });

}  // namespace
}  // namespace ipminmax::testing
