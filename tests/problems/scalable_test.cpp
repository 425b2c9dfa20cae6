// The scalable families at small size: derivatives against differences, the stated solutions
// against dense conditions, and a solve.

#include <functional>
#include <random>

#include <gtest/gtest.h>

#include <problems/scalable_problems.hpp>
#include <support/judge_result.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Family {
  const char* name;
  std::function<ScalableProblem()> make;
  double objective = std::nan("");  ///< published value of this instance, where reproducible
  bool must_certify = true;
};

const Family kFamilies[] = {
    {"f01_quad", [] { return f01_quad(20); }, 1.0},
    {"f03_quad_box", [] { return f03_quad_box(24); }},
    {"f05_trig", [] { return f05_trig(12); }, 0.0},
    {"f10_ball_halfspace", [] { return f10_ball_halfspace(6); }, 4.5},
    {"f12_robust_ls", [] { return f12_robust_ls(6, 3); }},
    {"f16_lq_game", [] { return f16_lq_game(8); }},
    {"f17_mpc_box", [] { return f17_mpc_box(8); }},
    {"f19_pde", [] { return f19_pde(10); }, 0.24548800707},
    {"f30_few_min", [] { return f30_few_min(3, 7); }, 0.0},
    {"f23_sphere", [] { return f23_sphere(8); }, 0.965874309047},
};

void PrintTo(const Family& family, std::ostream* out) { *out << family.name; }

VectorXd to_vector(const std::vector<double>& values) {
  return Eigen::Map<const VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

VectorXd or_zero(const std::vector<double>& values, std::size_t size) {
  if (values.empty()) return VectorXd::Zero(static_cast<Eigen::Index>(size));
  return to_vector(values);
}

class Scalable : public ::testing::TestWithParam<Family> {
 protected:
  ScalableProblem known_ = GetParam().make();
  Problem& problem_ = *known_.problem;
};

TEST_P(Scalable, DerivativesAgreeWithDifferences) {
  std::mt19937 random(5);
  std::uniform_real_distribution uniform(-1.0, 1.0);
  VectorXd v(static_cast<Eigen::Index>(known_.v.size()));
  for (double& value : v) value = uniform(random);
  const DenseEvaluation here(problem_, v);
  VectorXd lambda(here.constraints.size());
  for (double& value : lambda) value = uniform(random);
  const MatrixXd hessian = dense_hessian(problem_, v, 0.7, lambda);
  const double scale = 1.0 + hessian.lpNorm<Eigen::Infinity>() +
                       here.gradient.lpNorm<Eigen::Infinity>() + std::abs(here.objective);
  for (Eigen::Index i = 0; i < v.size(); ++i) {
    constexpr double kStep = 1e-6;
    VectorXd ahead = v, behind = v;
    ahead[i] += kStep;
    behind[i] -= kStep;
    const DenseEvaluation plus(problem_, ahead), minus(problem_, behind);
    EXPECT_NEAR((plus.objective - minus.objective) / (2 * kStep), here.gradient[i], 1e-7 * scale);
    if (lambda.size() > 0) {
      const VectorXd column = (plus.constraints - minus.constraints) / (2 * kStep);
      EXPECT_LE((column - here.jacobian.col(i)).lpNorm<Eigen::Infinity>(),
                1e-7 * (1.0 + column.norm()));
    }
    const auto gradient = [&](const DenseEvaluation& e) -> VectorXd {
      return 0.7 * e.gradient + e.jacobian.transpose() * lambda;
    };
    const VectorXd row = (gradient(plus) - gradient(minus)) / (2 * kStep);
    EXPECT_LE((row - hessian.col(i)).lpNorm<Eigen::Infinity>(), 1e-7 * scale);
  }
}

TEST_P(Scalable, TheSolutionIsALocalMinmax) {
  const std::size_t n = known_.v.size();
  const Multipliers stated{or_zero(known_.lambda, problem_.structure().constraint_lower.size()),
                           or_zero(known_.z_lower, n), or_zero(known_.z_upper, n)};
  const DenseTolerances tight{.first_order = 1e-10, .active = 1e-9, .curvature = 1e-8};
  const DenseOptimality found = dense_optimality(problem_, known_.v, &stated, tight);
  EXPECT_EQ(found.verdict, Verdict::LocalMinmax) << found;
  const DenseEvaluation here(problem_, to_vector(known_.v));
  EXPECT_NEAR(here.objective, known_.objective, 1e-10 * (1.0 + std::abs(here.objective)));
  if (!std::isnan(GetParam().objective)) {
    EXPECT_NEAR(here.objective, GetParam().objective, 1e-10);
  }
}

TEST_P(Scalable, IsSolved) {
  const Result result = solve(problem_, SolverOptions{});
  const DenseOptimality found = judge(problem_, result);
  EXPECT_TRUE(is_sound(result, found)) << name_of(result.status) << ": " << found;
  if (GetParam().must_certify) {
    EXPECT_EQ(name_of(result.status), name_of(Status::Solved)) << result.message;
    if (known_.unique_value) {
      EXPECT_NEAR(result.objective, known_.objective, 1e-6 * (1.0 + std::abs(known_.objective)));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Small, Scalable, ::testing::ValuesIn(kFamilies),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace ipminmax::testing
