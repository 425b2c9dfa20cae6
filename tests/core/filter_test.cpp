#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "core/method/filter.hpp"

// Constants of Waechter and Biegler 2006: gamma_theta = 1e-5, gamma_phi = 1e-8, delta = 1,
// s_theta = 1.1, s_phi = 2.3, eta_phi = 1e-8, gamma_alpha = 0.05,
// theta_min = 1e-4 max(1, theta_0), theta_max = 1e4 max(1, theta_0).

namespace ipminmax {
namespace {

using Verdict = Filter::Verdict;

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TEST(FilterTest, EmptyFilterAcceptsUpToThetaMax) {
  Filter filter;
  EXPECT_TRUE(filter.acceptable({1e4, 1e30}));
  EXPECT_FALSE(filter.acceptable({1.001e4, -1e30}));
  filter.set_scale(50.0);
  EXPECT_TRUE(filter.acceptable({5e5, 0.0}));
  EXPECT_FALSE(filter.acceptable({5.001e5, 0.0}));
  filter.set_scale(1e-3);  // max(1, theta_0)
  EXPECT_TRUE(filter.acceptable({1e4, 0.0}));
  EXPECT_FALSE(filter.acceptable({1.001e4, 0.0}));
}

TEST(FilterTest, LimitsHowFarPhiRisesWhereAsked) {
  const Merit from{6.0, 3e3}, above{1e-3, 3.1e8}, below{1e-3, 2.9e8};
  Filter filter;
  EXPECT_EQ(filter.test(from, -1.0, 1.0, above), Verdict::Sufficient);
  filter.minimize();
  EXPECT_EQ(filter.test(from, -1.0, 1.0, above), Verdict::Reject);
  EXPECT_EQ(filter.test(from, -1.0, 1.0, below), Verdict::Sufficient);
  EXPECT_NEAR(filter.largest_acceptable(from, -1.0, 1.0, above.theta), 1e5 * from.phi + from.phi,
              1.0);
  EXPECT_EQ(filter.test({6.0, -0.1}, -1.0, 1.0, {1e-3, 0.9e6}), Verdict::Sufficient);
  EXPECT_EQ(filter.test({6.0, -0.1}, -1.0, 1.0, {1e-3, 1.1e6}), Verdict::Reject);
}

TEST(FilterTest, EntriesHaveTheMarginsOfThePaper) {
  Filter filter;
  filter.add({2.0, 3.0});  // (1 - 1e-5) 2 and 3 - 1e-8 2
  EXPECT_FALSE(filter.acceptable({2.0, 3.0}));
  EXPECT_FALSE(filter.acceptable({2.0 - 1.9e-5, 3.0}));
  EXPECT_TRUE(filter.acceptable({2.0 - 2.1e-5, 3.0}));
  EXPECT_FALSE(filter.acceptable({2.0, 3.0 - 1.9e-8}));
  EXPECT_TRUE(filter.acceptable({2.0, 3.0 - 2.1e-8}));
}

TEST(FilterTest, AcceptableMeansBetterInOneOfTheTwoThanEveryEntry) {
  Filter filter;
  filter.add({4.0, 1.0});
  filter.add({1.0, 4.0});
  EXPECT_TRUE(filter.acceptable({0.5, 9.0}));
  EXPECT_TRUE(filter.acceptable({9.0, 0.5}));
  EXPECT_TRUE(filter.acceptable({2.0, 2.0}));
  EXPECT_FALSE(filter.acceptable({5.0, 2.0}));
  EXPECT_FALSE(filter.acceptable({2.0, 5.0}));
}

TEST(FilterTest, ResetForgetsEntriesButNotTheScale) {
  Filter filter;
  filter.set_scale(10.0);
  filter.add({1.0, 1.0});
  ASSERT_FALSE(filter.acceptable({2.0, 2.0}));
  filter.reset();
  EXPECT_TRUE(filter.acceptable({2.0, 2.0}));
  EXPECT_TRUE(filter.acceptable({9e4, 2.0}));
  EXPECT_FALSE(filter.acceptable({1.1e5, 2.0}));
}

TEST(FilterTest, FeasibleDescentHasToSatisfyArmijo) {
  const Filter filter;
  const Merit from{0.0, 1.0};
  // eta alpha slope = 1e-8 * 0.5 * -200 = -1e-6.
  EXPECT_EQ(filter.test(from, -200.0, 0.5, {0.0, 1.0 - 2e-6}), Verdict::Armijo);
  EXPECT_EQ(filter.test(from, -200.0, 0.5, {0.0, 1.0 - 5e-7}), Verdict::Reject);
  EXPECT_EQ(filter.test(from, -200.0, 0.5, {0.0, 2.0}), Verdict::Reject);
}

TEST(FilterTest, ArmijoAllowsForRounding) {
  const Filter filter;
  const Merit from{0.0, 1e6};
  const double one_ulp = std::nextafter(1e6, kInf);
  EXPECT_EQ(filter.test(from, -1e-6, 1.0, {0.0, one_ulp}), Verdict::Armijo);
  EXPECT_EQ(filter.test(from, -1e-6, 1.0, {0.0, 1e6 + 1e-6}), Verdict::Reject);
}

TEST(FilterTest, SwitchingConditionComparesSlopeAndViolation) {
  const Filter filter;
  // alpha (-slope)^2.3 > theta^1.1 with theta = 1e-6: right side 2.51e-7, slope about -1.35e-3.
  const double right = std::pow(1e-6, 1.1);
  const double slope = -std::pow(right, 1.0 / 2.3);
  const Merit from{1e-6, 1.0};
  const Merit less_theta{0.5e-6, 1.0};  // theta falls, phi does not
  EXPECT_EQ(filter.test(from, 1.01 * slope, 1.0, less_theta), Verdict::Reject) << "phi step";
  EXPECT_EQ(filter.test(from, 0.99 * slope, 1.0, less_theta), Verdict::Sufficient);
  EXPECT_EQ(filter.test(from, 1.01 * slope, 0.5, less_theta), Verdict::Sufficient);
  EXPECT_EQ(filter.test(from, 1.0, 1.0, less_theta), Verdict::Sufficient) << "no descent";
}

TEST(FilterTest, AboveThetaMinEitherDecreaseSuffices) {
  const Filter filter;
  const Merit from{1.0, 1.0};
  const double slope = -1e3;
  EXPECT_EQ(filter.test(from, slope, 1.0, {1.0 - 2e-5, 5.0}), Verdict::Sufficient);
  EXPECT_EQ(filter.test(from, slope, 1.0, {5.0, 1.0 - 2e-8}), Verdict::Sufficient);
  EXPECT_EQ(filter.test(from, slope, 1.0, {1.0 - 0.5e-5, 1.0 - 0.5e-8}), Verdict::Reject);
  EXPECT_EQ(filter.test(from, slope, 1.0, {2.0, 2.0}), Verdict::Reject);
}

TEST(FilterTest, StepsThatPhiFallsByEnterNoPairsWhateverThetaMin) {
  Filter filter;
  const Merit from{2e-4, 1.0};  // above theta_min
  EXPECT_EQ(filter.test(from, -10.0, 1.0, {3e3, -5.0}), Verdict::Sufficient) << "a game";
  filter.minimize();
  EXPECT_EQ(filter.test(from, -10.0, 1.0, {3e3, -5.0}), Verdict::Armijo);
  EXPECT_EQ(filter.test(from, -10.0, 1.0, {1e-4, 1.5}), Verdict::Sufficient) << "phi rises";
  EXPECT_EQ(filter.test(from, -1e-4, 1.0, {1e-4, 0.5}), Verdict::Sufficient) << "slow";
}

TEST(FilterTest, ThetaMinGrowsWithTheFirstViolation) {
  Filter filter;
  const Merit from{1e-3, 1.0};
  const Merit less_theta{0.5e-3, 1.0};
  EXPECT_EQ(filter.test(from, -10.0, 1.0, less_theta), Verdict::Sufficient);
  filter.set_scale(100.0);  // theta_min = 1e-2: now a step on phi
  EXPECT_EQ(filter.test(from, -10.0, 1.0, less_theta), Verdict::Reject);
}

TEST(FilterTest, RejectsWhatAnEntryDominates) {
  Filter filter;
  filter.add({0.1, 0.0});
  EXPECT_EQ(filter.test({1.0, 1.0}, -1.0, 1.0, {0.5, 0.5}), Verdict::Dominated);
  EXPECT_EQ(filter.test({1.0, 1.0}, -1.0, 1.0, {0.05, 0.5}), Verdict::Sufficient);
  EXPECT_EQ(filter.test({0.0, 5.0}, -1.0, 1.0, {0.2, 1.0}), Verdict::Dominated);
}

TEST(FilterTest, RejectsWhatIsNotANumber) {
  const Filter filter;
  const Merit from{1.0, 1.0};
  EXPECT_EQ(filter.test(from, -1.0, 1.0, {0.0, kNaN}), Verdict::Reject);
  EXPECT_EQ(filter.test(from, -1.0, 1.0, {0.0, -kInf}), Verdict::Reject);
  EXPECT_EQ(filter.test(from, -1.0, 1.0, {kNaN, 0.0}), Verdict::Reject);
}

TEST(FilterTest, SmallestStepIsThePapers) {
  const Filter filter;
  // Eq. (23), all times gamma_alpha = 0.05.
  EXPECT_DOUBLE_EQ(filter.smallest_step({1.0, 0.0}, 1.0), 0.05 * 1e-5) << "no descent";
  EXPECT_DOUBLE_EQ(filter.smallest_step({1.0, 0.0}, -1e-4), 0.05 * 1e-5);
  EXPECT_DOUBLE_EQ(filter.smallest_step({1.0, 0.0}, -2.0), 0.05 * 0.5e-8);
  const double theta = 1e-5;  // at most theta_min: the switching condition's bound counts too
  EXPECT_DOUBLE_EQ(
      filter.smallest_step({theta, 0.0}, -10.0),
      0.05 * std::min(1e-8 * theta / 10.0, std::pow(theta, 1.1) / std::pow(10.0, 2.3)));
  EXPECT_DOUBLE_EQ(filter.smallest_step({theta, 0.0}, -1e6),
                   0.05 * std::pow(theta, 1.1) / std::pow(1e6, 2.3));
  EXPECT_EQ(filter.smallest_step({0.0, 0.0}, -1.0), 0.0) << "feasible: never gives up";
}

TEST(FilterTest, LargestAcceptablePhiIsWhereTheTestChanges) {
  std::mt19937_64 generator(7);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  int finite = 0, none = 0, free = 0;
  for (int k = 0; k < 2000; ++k) {
    Filter filter;
    const auto theta = [&] {
      return uniform(generator) < 0.2 ? 0.0 : std::pow(10.0, 12.0 * uniform(generator) - 7.0);
    };
    const auto phi = [&] { return 4.0 * uniform(generator) - 2.0; };
    for (int entries = k % 4; entries > 0; --entries) filter.add({theta(), phi()});
    const Merit from{theta(), phi()};
    const double slope = k % 3 == 0 ? uniform(generator) : -uniform(generator);
    const double alpha = uniform(generator);
    const double to = theta();
    const double largest = filter.largest_acceptable(from, slope, alpha, to);
    const auto accepts = [&](double value) {
      return Filter::accepted(filter.test(from, slope, alpha, {to, value}));
    };
    if (largest == kInf) {
      ++free;
      EXPECT_TRUE(accepts(1e30));
    } else if (largest == -kInf) {
      ++none;
      EXPECT_FALSE(accepts(-1e30));
    } else {
      ++finite;
      EXPECT_TRUE(accepts(largest - 1e-12)) << k;
      EXPECT_FALSE(accepts(largest + 1e-12)) << k;
    }
  }
  EXPECT_GT(std::min({finite, none, free}), 50);
}

}  // namespace
}  // namespace ipminmax
