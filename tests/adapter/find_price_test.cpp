// The least price of the disturbance.
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include <examples/riccati.hpp>
#include <examples/stage_models.hpp>

#include "adapter/control/find_price.hpp"
#include "adapter/control/stages.hpp"

namespace ipminmax {
namespace {

/// The oscillator of examples/shared_dynamics.hpp.
struct Spring {
  static constexpr std::size_t states = 2, controls = 1, disturbances = 1;
  double price = 4.0;
  void dynamics(auto s, auto u, auto w, auto next) const {
    next[0] = s[0] + 0.2 * s[1];
    next[1] = -0.2 * s[0] + 0.9 * s[1] + 0.2 * u[0] + 0.1 * w[0];
  }
  auto cost(auto s, auto u, auto w) const {
    return s[0] * s[0] + s[1] * s[1] + 0.1 * u[0] * u[0] - price * w[0] * w[0];
  }
  auto terminal_cost(auto s) const { return s[0] * s[0] + s[1] * s[1]; }
};

TEST(FindPrice, IsTheSquareOfTheCriticalGamma) {
  for (const int horizon : {5, 20, 60}) {
    shared_dynamics::System system = shared_dynamics::oscillator(horizon, false);
    const double critical = shared_dynamics::critical_gamma(system);
    StageGame game(Spring{}, {.stages = static_cast<std::size_t>(horizon),
                              .discretization = Discretization::Discrete,
                              .initial = {1.0, 0.0}});
    const PriceCurve curve = find_price(game, [&](double price) { game.model().price = price; });
    EXPECT_NEAR(curve.least, critical * critical, 2e-3 * critical * critical) << curve.message;
    EXPECT_GT(curve.refused, 0.0);
    EXPECT_LT(curve.refused, curve.least);
    EXPECT_EQ(game.model().price, curve.least);
    for (const PricePoint& point : curve.points) {
      EXPECT_EQ(point.certified, point.price >= curve.least) << point.price;
      if (!point.certified) continue;
      system.gamma = std::sqrt(point.price);
      EXPECT_NEAR(point.value, shared_dynamics::riccati(system).value + 1.0, 1e-6) << point.price;
    }
  }
}

TEST(FindPrice, RisesFromAPriceThatIsTooLow) {
  StageGame game(Spring{},
                 {.stages = 20, .discretization = Discretization::Discrete, .initial = {1.0, 0.0}});
  shared_dynamics::System system = shared_dynamics::oscillator(20, false);
  const double critical = std::pow(shared_dynamics::critical_gamma(system), 2);
  const PriceCurve curve = find_price(game, [&](double price) { game.model().price = price; },
                                      {.from = 0.01 * critical, .least = 1e-3 * critical});
  EXPECT_NEAR(curve.least, critical, 2e-3 * critical) << curve.message;
}

TEST(FindPrice, SaysWhereBoundsHoldTheDisturbance) {
  StageGame game(Spring{}, {.stages = 3,
                            .discretization = Discretization::Discrete,
                            .initial = {1.0, 0.0},
                            .disturbance_lower = {-0.01},
                            .disturbance_upper = {0.01}});
  const PriceCurve curve = find_price(game, [&](double price) { game.model().price = price; },
                                      {.least = 1e-2, .ratio = 0.25});
  EXPECT_EQ(curve.least, 1e-2) << curve.message;
  EXPECT_EQ(curve.refused, 0.0);
  EXPECT_NE(curve.message.find("bounds, not the price"), std::string::npos) << curve.message;
}

TEST(FindPrice, SaysWhereNoneIsFound) {
  StageGame game(Spring{},
                 {.stages = 20, .discretization = Discretization::Discrete, .initial = {1.0, 0.0}});
  const PriceCurve curve = find_price(game, [&](double price) { game.model().price = price; },
                                      {.from = 1e-3, .most = 1e-2, .least = 1e-4});
  EXPECT_TRUE(std::isnan(curve.least));
  EXPECT_TRUE(curve.result.v.empty());
  EXPECT_NE(curve.message.find("no local minmax"), std::string::npos) << curve.message;
  EXPECT_GE(curve.points.size(), 2U);
}

TEST(FindPrice, PursuitWithFreeTimeGetsACurve) {
  StageGame game(stage_models::Pursuit{}, stage_models::Pursuit::horizon(10));
  const PriceCurve curve = find_price(game, [&](double price) { game.model().price = price; },
                                      {.from = 20.0, .tolerance = 0.05});
  ASSERT_FALSE(std::isnan(curve.least)) << curve.message;
  double before = -1e20;
  for (const PricePoint& point : curve.points) {
    if (!point.certified) continue;
    EXPECT_GE(point.value, before - 1e-6) << point.price;  // a cheaper disturbance gains more
    before = point.value;
  }
  EXPECT_EQ(curve.table().substr(0, 12), "price,value,");
  EXPECT_NE(curve.picture().find("<polyline"), std::string::npos);
  const auto file = std::filesystem::temp_directory_path() / "ipminmax_price_curve.svg";
  write_price_curve(curve, file.string());
  EXPECT_EQ(std::filesystem::file_size(file), curve.picture().size());
  std::filesystem::remove(file);
  EXPECT_THROW(write_price_curve(curve, "/nowhere/curve.csv"), std::runtime_error);
}

TEST(FindPrice, RefusesASearchThatCannotBe) {
  StageGame game(Spring{}, {.initial = {1.0, 0.0}});
  const auto none = [](double) {};
  EXPECT_THROW(static_cast<void>(find_price(game, none, {.from = -1.0})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(find_price(game, none, {.ratio = 1.0})), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(find_price(game, none, {.tolerance = std::nan("")})),
               std::invalid_argument);
}

}  // namespace
}  // namespace ipminmax
