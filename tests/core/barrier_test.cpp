#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include <ipminmax/core/barrier.hpp>

namespace ipminmax {
namespace {

TEST(FinalBarrier, IsTheSmallerToleranceOverElevenAsInIpopt) {
  SolverOptions options;
  EXPECT_DOUBLE_EQ(final_barrier(options, 1.0), 1e-8 / 11.0);
  options.compl_inf_tol = 1e-9;
  EXPECT_DOUBLE_EQ(final_barrier(options, 1.0), 1e-9 / 11.0);
  options.barrier_tol_factor = 4.0;
  EXPECT_DOUBLE_EQ(final_barrier(options, 1.0), 1e-9 / 5.0);
}

TEST(FinalBarrier, MeasuresComplementarityInTheModelsUnits) {
  SolverOptions options;
  options.tol = 1e-3;
  options.compl_inf_tol = 1e-4;
  EXPECT_DOUBLE_EQ(final_barrier(options, 0.01), 1e-6 / 11.0);
  EXPECT_DOUBLE_EQ(final_barrier(options, -0.01), 1e-6 / 11.0) << "a negative factor of f";
  EXPECT_DOUBLE_EQ(final_barrier(options, 1e6), 1e-3 / 11.0);
}

TEST(FinalBarrier, StaysAboveTheTarget) {
  SolverOptions options;
  options.mu_target = 1e-3;
  EXPECT_EQ(final_barrier(options, 1.0), 1e-3);
}

/// next_barrier for errors that do not depend on mu.
double next(double mu, double scaled, double norm, const SolverOptions& options = {},
            double mu_final = 1e-9) {
  return next_barrier(
      mu, mu_final, [scaled](double) { return scaled; }, [norm](double) { return norm; }, options);
}

TEST(IpoptsRule, KeepsMuUntilTheErrorIsTenTimesMu) {
  EXPECT_EQ(next(0.1, 1.001, 0.0), 0.1);
  EXPECT_DOUBLE_EQ(next(0.1, 0.999, 0.0), 0.02);
}

TEST(IpoptsRule, DecreasesLinearlyFarOutAndSuperlinearlyNearTheEnd) {
  EXPECT_DOUBLE_EQ(next(0.5, 4.0, 0.0), 0.1);     // 0.2 * 0.5 < 0.5^1.5
  EXPECT_DOUBLE_EQ(next(1e-4, 1e-4, 0.0), 1e-6);  // 1e-4^1.5 < 0.2e-4
}

TEST(IpoptsRule, DecreasesSeveralTimesWhenTheErrorAllowsIt) {
  EXPECT_DOUBLE_EQ(next(0.1, 0.15, 0.0), 0.02 * std::sqrt(0.02));
  EXPECT_EQ(next(0.1, 0.0, 0.0), 1e-9);
}

TEST(IpoptsRule, AsksForTheErrorAtEveryMu) {
  std::vector<double> asked;
  const SolverOptions options;
  const double mu = next_barrier(
      0.1, 1e-9,
      [&](double at) {
        asked.push_back(at);
        return at > 0.05 ? 0.0 : 1.0;
      },
      [](double) { return 0.0; }, options);
  EXPECT_DOUBLE_EQ(mu, 0.02);
  ASSERT_EQ(asked.size(), 2U);
  EXPECT_EQ(asked[0], 0.1);
  EXPECT_DOUBLE_EQ(asked[1], 0.02);
}

TEST(IpoptsRule, ReadsItsOptions) {
  SolverOptions options;
  options.mu_linear_decrease_factor = 0.5;
  options.mu_superlinear_decrease_power = 1.1;
  options.barrier_tol_factor = 2.0;
  EXPECT_DOUBLE_EQ(next(0.1, 0.15, 0.0, options), 0.05);
  EXPECT_EQ(next(0.1, 0.25, 0.0, options), 0.1);
}

TEST(PapersRule, DecreasesOncePerIterateWhenTheResidualIsBelowMu) {
  SolverOptions options;
  options.minmax_barrier_rule = BarrierRule::Paper;
  EXPECT_DOUBLE_EQ(next(0.1, 1e9, 0.1, options), 0.02);
  EXPECT_DOUBLE_EQ(next(0.1, 0.0, 0.0, options), 0.02);
  EXPECT_EQ(next(0.1, 0.0, 0.1001, options), 0.1);
}

TEST(BothRules, StopAtTheFinalMu) {
  for (const BarrierRule rule : {BarrierRule::Ipopt, BarrierRule::Paper}) {
    SolverOptions options;
    options.minmax_barrier_rule = rule;
    EXPECT_EQ(next(1e-3, 0.0, 0.0, options, 5e-4), 5e-4);
    EXPECT_EQ(next(5e-4, 0.0, 0.0, options, 5e-4), 5e-4);
  }
}

TEST(BoundaryFraction, GrowsToOneButIsAtLeastTauMin) {
  SolverOptions options;
  EXPECT_EQ(boundary_fraction(0.1, options), 0.99);
  EXPECT_DOUBLE_EQ(boundary_fraction(1e-4, options), 0.9999);
  options.tau_min = 0.5;
  EXPECT_DOUBLE_EQ(boundary_fraction(0.1, options), 0.9);
  EXPECT_EQ(boundary_fraction(10.0, options), 0.5);
}

}  // namespace
}  // namespace ipminmax
