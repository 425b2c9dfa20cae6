// The scalable families at sizes where a dense or quadratic-cost step would be felt.

#include <cmath>
#include <cstdio>
#include <functional>

#include <gtest/gtest.h>

#include <problems/scalable_problems.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

enum class Due {
  Certificate,
  FirstOrderPoint,  ///< weakly active bounds leave the second-order test undecided
  Honesty           ///< many points without a local minmax nearby: it may give up
};

struct Instance {
  const char* name;
  std::function<ScalableProblem()> make;
  double objective = std::nan("");  ///< published value, where the instance is reproducible
  Due due = Due::Certificate;
};

const Instance kInstances[] = {
    {"f01_quad_300", [] { return f01_quad(300); }, 1.0},
    {"f01_quad_5000", [] { return f01_quad(5000); }, 1.0},
    {"f03_quad_box_240", [] { return f03_quad_box(240); }},
    {"f03_quad_box_6000", [] { return f03_quad_box(6000); }, std::nan(""), Due::Honesty},
    {"f05_trig_300", [] { return f05_trig(300); }},
    {"f05_trig_5000", [] { return f05_trig(5000); }},
    {"f10_ball_halfspace_300", [] { return f10_ball_halfspace(300); }, 4.5},
    {"f10_ball_halfspace_5000", [] { return f10_ball_halfspace(5000); }, 4.5},
    {"f12_robust_ls_30_10", [] { return f12_robust_ls(30, 10); }},
    {"f12_robust_ls_60_20", [] { return f12_robust_ls(60, 20); }},
    {"f16_lq_game_100", [] { return f16_lq_game(100); }},
    {"f16_lq_game_1000", [] { return f16_lq_game(1000); }},
    {"f17_mpc_box_60", [] { return f17_mpc_box(60); }},
    {"f17_mpc_box_400", [] { return f17_mpc_box(400); }},
    {"f19_pde_150", [] { return f19_pde(150); }, 3.41463706048},
    {"f19_pde_2000", [] { return f19_pde(2000); }, 45.2528216458, Due::FirstOrderPoint},
    {"f23_sphere_200", [] { return f23_sphere(200); }, 0.777020482179},
    {"f23_sphere_1000", [] { return f23_sphere(1000); }, 0.730138594021},
};

void PrintTo(const Instance& instance, std::ostream* out) { *out << instance.name; }

/// Largest entry of grad f + J' lambda - z_lower + z_upper.
double stationarity(Problem& problem, const std::vector<double>& v,
                    const std::vector<double>& lambda, const std::vector<double>& z_lower,
                    const std::vector<double>& z_upper) {
  const ProblemStructure& structure = problem.structure();
  std::vector<double> residual(v.size()), values(structure.jacobian.size());
  if (!problem.gradient(v, true, residual) || !problem.jacobian(v, false, values)) return INFINITY;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto [row, col] = structure.jacobian[k];
    residual[static_cast<std::size_t>(col)] += lambda[static_cast<std::size_t>(row)] * values[k];
  }
  double largest = 0.0;
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (!z_lower.empty()) residual[i] += z_upper[i] - z_lower[i];
    largest = std::max(largest, std::abs(residual[i]));
  }
  return largest;
}

class ScalableSlow : public ::testing::TestWithParam<Instance> {};

TEST_P(ScalableSlow, EndsAsIsDue) {
  const ScalableProblem known = GetParam().make();
  Problem& problem = *known.problem;
  EXPECT_LE(stationarity(problem, known.v, known.lambda, known.z_lower, known.z_upper), 1e-8);
  if (!std::isnan(GetParam().objective)) {
    EXPECT_NEAR(known.objective, GetParam().objective, 1e-9 * (1.0 + std::abs(known.objective)));
  }

  const Result result = solve(problem, SolverOptions{});
  std::printf("%-26s %-40s iterations %4d factorizations %5d seconds %.2f f %.10g (%.10g)\n",
              GetParam().name, std::string(name_of(result.status)).c_str(), result.iterations,
              result.factorizations, result.seconds, result.objective, known.objective);
  if (GetParam().due == Due::Certificate) {
    EXPECT_EQ(name_of(result.status), name_of(Status::Solved)) << result.message;
  } else if (GetParam().due == Due::FirstOrderPoint) {
    EXPECT_TRUE(is_success(result.status)) << name_of(result.status) << ": " << result.message;
  } else {
    EXPECT_EQ(is_success(result.status), result.certificate.kind == PointKind::LocalMinmax);
    EXPECT_FALSE(result.message.empty());
  }
  if (is_success(result.status)) {
    EXPECT_LE(stationarity(problem, result.v, result.lambda, result.z_lower, result.z_upper), 1e-5);
    if (known.unique_value) {
      EXPECT_NEAR(result.objective, known.objective, 1e-6 * (1.0 + std::abs(known.objective)));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Large, ScalableSlow, ::testing::ValuesIn(kInstances),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace ipminmax::testing
