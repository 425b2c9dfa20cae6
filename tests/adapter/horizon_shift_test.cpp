// The helper of the examples that moves a solution one stage ahead.
#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>
#include <vector>

#include "adapter/control/horizon_shift.hpp"
#include "adapter/ipopt/minmax_application.hpp"

namespace ipminmax {
namespace {

TEST(HorizonShift, MovesEveryBlockOneStageAhead) {
  Result last;
  last.v = {9.0, 1.0, 2.0, 3.0, 10.0, 11.0, 20.0, 21.0, 30.0, 31.0};
  last.z_lower = {0.9, 0.1, 0.2, 0.3, 1.0, 1.1, 2.0, 2.1, 3.0, 3.1};
  last.z_upper = std::vector<double>(10, 0.0);
  last.lambda = {4.0, 5.0, 6.0, 7.0};
  // A parameter, three stages of one control, three stages of two states; one row per stage, and a
  // terminal one.
  const HorizonShift shift(3, {{1, 1}, {4, 2}}, {{0, 1}});
  const PrimalDual next = shift.next(last);
  EXPECT_EQ(next.v, (std::vector{9.0, 2.0, 3.0, 3.0, 20.0, 21.0, 30.0, 31.0, 30.0, 31.0}));
  EXPECT_EQ(next.z_lower, (std::vector{0.9, 0.2, 0.3, 0.3, 2.0, 2.1, 3.0, 3.1, 3.0, 3.1}));
  EXPECT_EQ(next.z_upper, last.z_upper);
  EXPECT_EQ(next.lambda, (std::vector{5.0, 6.0, 6.0, 7.0}));
  EXPECT_THROW(static_cast<void>(HorizonShift(4, {{4, 2}}, {}).next(last)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(HorizonShift(3, {}, {{0, 2}}).next(last)), std::invalid_argument);
  // Sums beyond the largest number.
  constexpr std::size_t kLargest = std::numeric_limits<std::size_t>::max();
  for (const StageBlock& block : {StageBlock{kLargest, 1}, {1, kLargest / 2 + 1}, {2, kLargest}}) {
    EXPECT_THROW(static_cast<void>(HorizonShift(2, {block}, {}).next(last)), std::invalid_argument);
  }
  EXPECT_EQ(HorizonShift(kLargest, {{10, 0}}, {}).next(last).v, last.v);
}

TEST(HorizonShift, WorstCasesBecomeThoseOfTheStageBefore) {
  // Three stages of one variable; two constraints per stage, the second one robust, and a terminal
  // one that is.
  Result last;
  last.v.assign(3, 0.0);
  for (const Index constraint : {1, 5, 6}) {
    last.worst_cases.push_back({.constraint = constraint, .v = {1.0, 2.0, 3.0}});
  }
  const auto moved = HorizonShift(3, {{0, 1}}, {{0, 2}}).worst_cases(last);
  ASSERT_EQ(moved.size(), 3U);  // of stage 0: gone; of the last one: twice; of the terminal one
  for (const auto& found : moved) EXPECT_EQ(found.v, (std::vector{2.0, 3.0, 3.0}));
  EXPECT_EQ(moved[0].constraint, 3);
  EXPECT_EQ(moved[1].constraint, 5);
  EXPECT_EQ(moved[2].constraint, 6);
  // Stages without end: products beyond the largest number.
  constexpr std::size_t kLargest = std::numeric_limits<std::size_t>::max();
  const auto endless = HorizonShift(kLargest / 2 + 1, {}, {{0, 2}}).worst_cases(last);
  ASSERT_EQ(endless.size(), 2U);
  EXPECT_EQ(endless[0].constraint, 3);
  EXPECT_EQ(endless[1].constraint, 4);
}

TEST(HorizonShift, OptionsForWarmAndColdStarts) {
  const Ipopt::SmartPtr<MinMaxApplication> application = new MinMaxApplication(false);
  ASSERT_EQ(application->Initialize(""), Ipopt::Solve_Succeeded);
  Ipopt::OptionsList& options = *application->Options();
  bool warm = false;
  double value = 0.0;
  warm_start(options, 1e-5);
  options.GetBoolValue("warm_start_init_point", warm, "");
  EXPECT_TRUE(warm);
  for (const char* name : {"mu_init", "warm_start_bound_push", "warm_start_slack_bound_frac"}) {
    options.GetNumericValue(name, value, "");
    EXPECT_EQ(value, 1e-5) << name;
  }
  cold_start(options);
  options.GetBoolValue("warm_start_init_point", warm, "");
  EXPECT_FALSE(warm);
  options.GetNumericValue("mu_init", value, "");
  EXPECT_EQ(value, 0.1);
}

}  // namespace
}  // namespace ipminmax
