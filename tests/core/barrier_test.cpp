#include <cmath>
#include <optional>
#include <stdexcept>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>

#include "core/kkt/system.hpp"
#include "core/method/barrier.hpp"

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

TEST(IpoptsRule, LeavesSlowDecreasesToLaterIterates) {
  for (const double factor : {0.9999999, std::nextafter(1.0, 0.0)}) {
    SolverOptions options;
    options.mu_linear_decrease_factor = factor;
    options.mu_superlinear_decrease_power = std::nextafter(1.0, 2.0);
    int asked = 0;
    const auto zero_error = [&](double) {
      if (++asked > 1000000) throw std::runtime_error("does not end");
      return 0.0;
    };
    const double mu = next_barrier(
        0.1, 1e-9, zero_error, [](double) { return 0.0; }, options);
    EXPECT_LE(mu, 0.1);
    EXPECT_GT(mu, 0.099);
    EXPECT_LE(asked, 1000);
  }
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

TEST(LoqosOracle, IsZeroForEqualProductsAndLargeForSpreadOnes) {
  EXPECT_EQ(loqo_barrier({.average = 0.5, .smallest = 0.5, .bounds = 2}), 0.0);
  // xi = 1/2: 0.1 * (0.05 * 0.5 / 0.5)^3 * average
  EXPECT_DOUBLE_EQ(loqo_barrier({.average = 1.0, .smallest = 0.5, .bounds = 2}), 0.1 * 1.25e-4);
  // xi -> 0: 0.1 * 2^3 * average
  EXPECT_DOUBLE_EQ(loqo_barrier({.average = 3.0, .smallest = 1e-9, .bounds = 2}), 2.4);
  EXPECT_EQ(loqo_barrier({}), 0.0);
}

/// One variable with lower bound 0 and the iterate v, z.
class OneBound : public ::testing::Test {
 protected:
  OneBound() {
    const auto x = model_.variable(Player::Min, "x", 0.0, testing::kNoBound);
    model_.objective(square(x));
    problem_.emplace(model_, std::vector<double>{1.0});
    options_.bound_relax_factor = 0.0;
    canonical_.emplace(*problem_, options_, counts_, timing_);
    EXPECT_EQ(canonical_->build(), "");
    at_ = canonical_->starting_point();
    at_.v[0] = 2.0;
    at_.z_lower[0] = 0.5;
    step_ = zero_step(*canonical_);
  }
  testing::Model model_;
  std::optional<testing::AutodiffProblem> problem_;
  SolverOptions options_;
  Counts counts_;
  Timing timing_;
  std::optional<CanonicalProblem> canonical_;
  Iterate at_;
  Step step_;
  OracleWork work_;
};

TEST_F(OneBound, ProbingIsTheCubeOfTheReductionByThePredictor) {
  EXPECT_DOUBLE_EQ(complementarity_of(*canonical_, at_).average, 1.0);
  step_.v[0] = -1.0;  // 2 * 0.5 -> 1 * 0.25
  step_.z_lower[0] = -0.25;
  EXPECT_DOUBLE_EQ(probing_barrier(*canonical_, at_, step_, work_), std::pow(0.25, 3.0));
  step_.v[0] = 98.0;  // the product grows: mu may, too, up to 100 times
  step_.z_lower[0] = 9.5;
  EXPECT_DOUBLE_EQ(probing_barrier(*canonical_, at_, step_, work_), 100.0);
}

TEST_F(OneBound, QualityFunctionCentersWhenThePredictorIsCutShort) {
  const SquaredResidual residual{.dual = 1.0, .primal = 0.0, .complementarity = 1.0};
  Step centering = step_;
  // A predictor that the bounds allow in full and that leaves no product: the least mu.
  step_.z_lower[0] = -0.49;
  EXPECT_LT(quality_function_barrier(*canonical_, at_, residual, step_, centering, 0.99, work_),
            2e-6);
  // One that the bound stops at a hundredth of its length, until centering undoes it.
  step_.z_lower[0] = -50.0;
  centering.z_lower[0] = 100.0;
  const double mu =
      quality_function_barrier(*canonical_, at_, residual, step_, centering, 0.99, work_);
  EXPECT_GT(mu, 0.3);
  EXPECT_LT(mu, 0.5);
}

/// A rule whose oracle answers 1e-3 and whose monotone rule halves mu.
double next(AdaptiveBarrier& rule, double mu, double residual, bool accepted = true) {
  BarrierState now;
  now.residual = residual;
  now.merit = {residual, residual};
  now.average = 1.0;
  now.step_accepted = accepted;
  return rule.next(
      mu, now, [] { return std::optional<double>(1e-3); }, [](double from) { return 0.5 * from; });
}

TEST(AdaptiveRule, FollowsTheOracleWhileTheResidualFallsElseTheMonotoneRule) {
  for (const auto test :
       {AdaptiveGlobalization::KktError, AdaptiveGlobalization::ObjectiveFilter}) {
    SolverOptions options;
    options.adaptive_mu_globalization = test;
    options.adaptive_mu_kkterror_red_iters = 1;
    AdaptiveBarrier rule(options, 1e-9, 1e-11, 1.0);
    EXPECT_EQ(next(rule, 0.1, 4.0), 1e-3);
    EXPECT_EQ(next(rule, 1e-3, 2.0), 1e-3);
    EXPECT_DOUBLE_EQ(next(rule, 1e-3, 2.5), 0.8) << "a phase begins at 0.8 of the average";
    EXPECT_DOUBLE_EQ(next(rule, 0.8, 2.5), 0.4) << "and goes on monotonically";
    EXPECT_FALSE(rule.is_free());
    EXPECT_EQ(next(rule, 0.4, 1.0), 1e-3) << "until there is progress";
    EXPECT_DOUBLE_EQ(next(rule, 1e-3, 0.1, false), 0.8) << "a failed line search is none";
    rule.reset();
    EXPECT_EQ(next(rule, 0.8, 100.0), 1e-3);
  }
}

TEST(AdaptiveRule, NeverMonotoneModeAlwaysFollowsTheOracle) {
  SolverOptions options;
  options.adaptive_mu_globalization = AdaptiveGlobalization::NeverMonotone;
  AdaptiveBarrier rule(options, 1e-9, 1e-11, 1.0);
  for (const double residual : {1.0, 10.0, 100.0}) EXPECT_EQ(next(rule, 0.1, residual), 1e-3);
}

TEST(AdaptiveRule, ReadsItsOptions) {
  SolverOptions options;
  options.mu_max = 1e-4;
  AdaptiveBarrier capped(options, 1e-9, 1e-11, 1.0);
  EXPECT_EQ(next(capped, 0.1, 1.0), 1e-4);
  options.mu_max = 0.0;
  options.mu_max_fact = 1e-5;
  AdaptiveBarrier relative(options, 1e-9, 1e-11, 10.0);
  EXPECT_DOUBLE_EQ(next(relative, 0.1, 1.0), 1e-4);
  options = {};
  options.adaptive_mu_kkterror_red_iters = 1;
  options.adaptive_mu_kkterror_red_fact = 0.5;
  options.adaptive_mu_monotone_init_factor = 0.3;
  AdaptiveBarrier strict(options, 1e-9, 1e-2, 1.0);
  EXPECT_EQ(next(strict, 0.1, 1.0), 1e-2) << "least mu";
  EXPECT_DOUBLE_EQ(next(strict, 0.1, 0.6), 0.3);
}

TEST(LeastAdaptiveBarrier, IsMuMinUnlessAToleranceNeedsLess) {
  SolverOptions options;
  EXPECT_EQ(least_adaptive_barrier(options, 1.0), 1e-11);
  options.mu_min = 1.0;
  EXPECT_DOUBLE_EQ(least_adaptive_barrier(options, 1.0), 5e-9);
  options.mu_target = 1e-3;
  EXPECT_EQ(least_adaptive_barrier(options, 1.0), 1e-3);
}

}  // namespace
}  // namespace ipminmax
