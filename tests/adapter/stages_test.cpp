// Games by stages: derivatives, discretizations, players, feedback, limits, warm starts.
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <examples/riccati.hpp>
#include <examples/stage_models.hpp>

#include "adapter/control/stages.hpp"
#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/ipopt/problem_tnlp.hpp"
#include "core/diagnostics/derivative_test.hpp"

namespace ipminmax {
namespace {

template <class Model>
void expect_right_derivatives(Model model, Horizon horizon) {
  StageGame game(model, std::move(horizon));
  SolverOptions options;
  options.derivative_test = DerivativeTest::SecondOrder;
  options.point_perturbation_radius = 0.1;
  const DerivativeReport report = test_derivatives(game, options);
  EXPECT_EQ(report.failure, "");
  EXPECT_EQ(report.first_wrong, 0);
  EXPECT_EQ(report.second_wrong, 0);
  EXPECT_GT(report.second_tested, 10);
  for (const DerivativeEntry& entry : report.entries) {
    if (entry.finding != DerivativeFinding::Agrees)
      ADD_FAILURE() << describe(entry, game.structure());
  }
}

constexpr std::array kAll = {Discretization::Discrete, Discretization::Euler,
                             Discretization::RungeKutta4, Discretization::ImplicitMidpoint,
                             Discretization::HermiteSimpson};

template <class Model>
class StageModels : public testing::Test {};
using Models =
    testing::Types<stage_models::Pursuit, stage_models::Quadrotor, stage_models::VanDerPol,
                   stage_models::CartPole, stage_models::RobotArm, stage_models::RaceCar>;
TYPED_TEST_SUITE(StageModels, Models);

TYPED_TEST(StageModels, DerivativesAgreeWithDifferencesInEveryDiscretization) {
  for (const Discretization how : kAll) {
    SCOPED_TRACE(static_cast<int>(how));
    Horizon horizon = TypeParam::horizon(6);  // four stages at a time, then one by one
    horizon.step = 0.1;
    horizon.discretization = how;
    expect_right_derivatives(TypeParam{}, horizon);
  }
}

TYPED_TEST(StageModels, IsCertifiedAndTheNextStageStartsFromIt) {
  StageGame game(TypeParam{}, TypeParam::horizon(15));
  const StageAnswer plan = game.solve();
  EXPECT_TRUE(plan.certified()) << plan.result.message;
  ASSERT_EQ(plan.states.size(), 16U);
  ASSERT_EQ(plan.controls.size(), 15U);
  const StageAnswer next = game.solve_next(plan.states[1]);
  EXPECT_TRUE(next.certified()) << next.result.message;
  EXPECT_EQ(next.result.counts.analyses, 0);
  EXPECT_LE(next.result.iterations, plan.result.iterations);
  EXPECT_EQ(next.states[0], plan.states[1]);
}

/// examples/shared_dynamics.hpp: a spring with discrete linear dynamics.
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

TEST(Stages, ALinearQuadraticGameHasRiccatisAnswer) {
  const shared_dynamics::System system = shared_dynamics::oscillator(20, false);
  const auto known = shared_dynamics::riccati(system);
  StageGame game(Spring{},
                 {.stages = 20, .discretization = Discretization::Discrete, .initial = {1.0, 0.0}});
  const StageAnswer plan = game.solve();
  ASSERT_TRUE(plan.certified()) << plan.result.message;
  EXPECT_NEAR(plan.result.objective, known.value + 1.0, 1e-8);  // s_0 costs 1 here
  EXPECT_NEAR(plan.controls[0][0], known.u0[0], 1e-7);
  EXPECT_NEAR(plan.disturbances[0][0], known.w0[0], 1e-7);
  EXPECT_EQ(plan.duration, 2.0);
}

TEST(Stages, AHorizonMadeFromThatOfAGameStartsAtItsOwnState) {
  StageGame game(Spring{},
                 {.stages = 5, .discretization = Discretization::Discrete, .initial = {1.0, 0.0}});
  Horizon other = game.horizon();
  other.initial = {-3.0, 2.0};
  StageGame moved(Spring{}, other);
  std::vector<double> v(moved.structure().variable_players.size());
  StartingPoint start{v, false, {}, {}, {}};
  ASSERT_TRUE(moved.starting_point(start));
  EXPECT_EQ(std::vector(v.end() - 2, v.end()), other.initial);
}

/// s' = cos(t) s: s = exp(sin t).
struct Growth {
  static constexpr std::size_t states = 1, controls = 1, disturbances = 1;
  void dynamics(const auto& at, auto rate) const {
    rate[0] = cos(at.t) * at.s[0] + 0.0 * at.u[0] + at.w[0];
  }
  auto cost(const auto& at) const { return at.s[0] + at.u[0] * at.u[0] - at.w[0] * at.w[0]; }
};

TEST(Stages, DiscretizationsHaveTheirOrders) {
  const auto defect = [](Discretization how, double step) {
    StageGame game(Growth{}, {.stages = 4, .step = step, .discretization = how, .initial = {1.0}});
    std::vector<double> v(game.structure().variable_lower.size()), g(4);
    for (std::size_t k = 0; k <= 4; ++k)
      v[static_cast<std::size_t>(game.state(k, 0))] =
          std::exp(std::sin(step * static_cast<double>(k)));
    EXPECT_TRUE(game.constraints(v, true, g));
    return std::abs(g[3]);
  };
  const std::pair<Discretization, double> orders[] = {{Discretization::Euler, 1.0},
                                                      {Discretization::ImplicitMidpoint, 2.0},
                                                      {Discretization::RungeKutta4, 4.0},
                                                      {Discretization::HermiteSimpson, 4.0}};
  for (const auto& [how, order] : orders) {
    const double ratio = defect(how, 0.1) / defect(how, 0.05);
    EXPECT_GT(std::log2(ratio), order + 0.7) << static_cast<int>(how);
    EXPECT_LT(std::log2(ratio), order + 1.8) << static_cast<int>(how);
  }
}

TEST(Stages, SimulationFollowsTheDiscretization) {
  for (const Discretization how : kAll) {
    Horizon horizon = stage_models::CartPole::horizon(10);
    horizon.discretization = how;
    horizon.step = 0.01;
    StageGame game(stage_models::CartPole{}, horizon);
    const std::vector<double> s{0.1, 0.2, -0.1, 0.3}, u{1.0}, w{0.5};
    const std::vector<double> after = game.simulate(s, u, w);
    std::vector<double> v(game.structure().variable_lower.size(), 0.0),
        g(game.structure().constraint_lower.size());
    for (std::size_t i = 0; i < 4; ++i) {
      v[static_cast<std::size_t>(game.state(0, i))] = s[i];
      v[static_cast<std::size_t>(game.state(1, i))] = after[i];
    }
    v[static_cast<std::size_t>(game.control(0, 0))] = 1.0;
    v[static_cast<std::size_t>(game.disturbance(0, 0))] = 0.5;
    EXPECT_TRUE(game.constraints(v, true, g));
    const bool exact = how <= Discretization::RungeKutta4;  // one step of the game's own rule
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_NEAR(g[i], 0.0, exact ? 1e-15 : 1e-5) << static_cast<int>(how);
    const std::vector<double> finer = game.simulate(s, u, w, {}, 0, 20);
    if (how == Discretization::Discrete) continue;
    EXPECT_NE(finer, after);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(finer[i], after[i], 1e-2);
  }
}

TEST(Stages, StatesAndDynamicsAreMaxs) {
  StageGame game(stage_models::Pursuit{}, stage_models::Pursuit::horizon(3));
  const ProblemStructure& s = game.structure();
  const auto owner = [&](Index i) { return s.variable_players[static_cast<std::size_t>(i)]; };
  EXPECT_EQ(owner(game.state(2, 5)), Player::Max);
  EXPECT_EQ(owner(game.disturbance(1, 2)), Player::Max);
  EXPECT_EQ(owner(game.control(1, 2)), Player::Min);
  EXPECT_EQ(owner(game.duration()), Player::Min);
  for (const Player player : s.constraint_players) EXPECT_EQ(player, Player::Max);
  EXPECT_EQ(s.variable_names[static_cast<std::size_t>(game.control(1, 2))], "control2[1]");
}

TEST(Stages, AFreeDurationIsTheBest) {
  Horizon horizon = stage_models::Pursuit::horizon(12);
  const StageAnswer free = StageGame(stage_models::Pursuit{}, horizon).solve();
  ASSERT_TRUE(free.certified()) << free.result.message;
  EXPECT_GT(free.duration, 0.3);
  EXPECT_LT(free.duration, 9.0);
  for (const double change : {-0.05, 0.05}) {
    horizon.duration_lower = horizon.duration_upper = 0.0;
    horizon.step = (free.duration + change) / 12.0;
    const StageAnswer given = StageGame(stage_models::Pursuit{}, horizon).solve();
    ASSERT_TRUE(given.certified()) << given.result.message;
    EXPECT_GT(given.result.objective, free.result.objective);
  }
}

/// Unstable: a disturbance grows by e^3 until the end.
struct Unstable {
  static constexpr std::size_t states = 1, controls = 1, disturbances = 1;
  double price = 3.0;
  void dynamics(auto s, auto u, auto w, auto rate) const { rate[0] = s[0] + u[0] + w[0]; }
  auto cost(auto s, auto u, auto w) const {
    return s[0] * s[0] + 0.1 * u[0] * u[0] - price * w[0] * w[0];
  }
};

TEST(Stages, FeedbackHasAnswersWherePlansHaveNone) {
  Horizon horizon{.stages = 30, .step = 0.1, .initial = {0.5}};
  SolverOptions options;
  options.minmax_max_restarts = 0;
  EXPECT_FALSE(StageGame(Unstable{}, horizon).solve(options).certified());
  horizon.gain_lower = horizon.gain_upper = {-3.0};  // given
  StageGame given(Unstable{}, horizon);
  const StageAnswer closed = given.solve(options);
  EXPECT_TRUE(closed.certified()) << closed.result.message;
  EXPECT_EQ(closed.gains, std::vector<double>{-3.0});
  const double offset = closed.result.v[static_cast<std::size_t>(given.control(0, 0))];
  EXPECT_NEAR(closed.controls[0][0], offset - 3.0 * 0.5, 1e-9);
  horizon.gain_lower = {-10.0};  // Min's to choose
  horizon.gain_upper = {-2.0};
  const StageAnswer chosen = StageGame(Unstable{}, horizon).solve(options);
  EXPECT_TRUE(chosen.certified()) << chosen.result.message;
  EXPECT_LE(chosen.result.objective, closed.result.objective + 0.1);
}

// At a saddle point plans and policies have the same value; the policy acts against the wind.
TEST(Stages, FeedbackOfDisturbancesHasRightDerivativesAndTheSameSaddle) {
  Horizon horizon{.stages = 8, .step = 0.2, .initial = {0.5}};
  Unstable model{.price = 8.0};
  const StageAnswer open = StageGame(model, horizon).solve();
  ASSERT_TRUE(open.certified()) << open.result.message;
  horizon.memory = 2;
  horizon.gain_lower = {-2.0};
  horizon.gain_upper = {0.0};
  expect_right_derivatives(model, horizon);
  horizon.gain_lower = horizon.gain_upper = {};
  horizon.feedback_price = 1e-5;
  StageGame game(model, horizon);
  const StageAnswer closed = game.solve();
  ASSERT_TRUE(closed.certified()) << closed.result.message;
  ASSERT_EQ(closed.memory.size(), 2U);
  EXPECT_LT(closed.memory[0], -0.01);  // against the wind that blew
  EXPECT_NEAR(closed.result.objective, open.result.objective, 1e-4);
}

/// A mass that is to go as far as it may: its place has to stay below 1 in every wind.
struct Wall {
  static constexpr std::size_t states = 2, controls = 1, disturbances = 1, limits = 1;
  void dynamics(auto s, auto u, auto w, auto rate) const {
    rate[0] = s[1];
    rate[1] = u[0] + w[0];
  }
  auto cost(auto s, auto u, auto w) const {
    return (s[0] - 2.0) * (s[0] - 2.0) + 0.1 * u[0] * u[0] - 5.0 * w[0] * w[0];
  }
  void limits_of(auto s, auto, auto g) const { g[0] = s[0] - 1.0; }
};

/// The speed of a van der Pol oscillator, limited at the end of every stage.
struct SlowVanDerPol : stage_models::VanDerPol {
  static constexpr std::size_t limits = 1;
  double limit = 0.4;
  void limits_of(auto s, auto, auto g) const { g[0] = -s[1] - limit; }
  static Horizon horizon(std::size_t stages) {
    Horizon calm = VanDerPol::horizon(stages);
    calm.disturbance_lower = {-0.1};
    calm.disturbance_upper = {0.1};
    return calm;
  }
};

// The worst case of a stage's limit does not depend on the disturbances behind that stage: if they
// were free in it, its y would not be unique, and nothing certified where several limits are
// active.
TEST(Stages, LimitsOfTheStateInEveryStageAreCertified) {
  SolverOptions options;
  options.minmax_worst_case_starts = 0;
  for (const double limit : {0.38, 0.42, 0.46}) {
    SCOPED_TRACE(limit);
    StageGame game(SlowVanDerPol{{}, limit}, SlowVanDerPol::horizon(20));
    const StageAnswer plan = game.solve(options);
    EXPECT_TRUE(plan.certified()) << plan.result.message;
    const auto active = std::ranges::count_if(plan.worst_cases, &RobustWorstCase::active);
    EXPECT_GE(active, 3);
    for (const RobustWorstCase& worst : plan.worst_cases) {
      if (!worst.active) continue;
      // Its trajectory is one: v holds all of it.
      std::vector<double> rows(game.structure().constraint_players.size());
      ASSERT_TRUE(game.constraints(worst.v, true, rows));
      EXPECT_NEAR(rows[static_cast<std::size_t>(worst.constraint)], 0.0, 1e-6);
      for (std::size_t j = 0; j < rows.size(); ++j) {
        const bool of_max = game.structure().constraint_players[j] == Player::Max;
        EXPECT_NEAR(of_max ? rows[j] : 0.0, 0.0, 1e-8);
      }
    }
  }
}

/// The place of a cart, limited at the end of every stage.
struct WalledCartPole : stage_models::CartPole {
  static constexpr std::size_t limits = 1;
  void limits_of(auto s, auto, auto g) const { g[0] = s[0] - 0.3; }
};

// The gradients of limits of successive stages are nearly one, those of the dynamics are not.
TEST(Stages, NearlyDependentLimitsAreCertifiedWhereDynamicsDetermineTheStates) {
  Horizon calm = WalledCartPole::horizon(20);
  calm.disturbance_lower = {-0.2};
  calm.disturbance_upper = {0.2};
  StageGame game(WalledCartPole{}, calm);
  SolverOptions options;
  options.minmax_worst_case_starts = 0;
  const StageAnswer plan = game.solve(options);
  EXPECT_TRUE(plan.certified()) << plan.result.message;
  EXPECT_GE(std::ranges::count_if(plan.worst_cases, &RobustWorstCase::active), 8);
}

// Searches of a limit leave out the stages behind it; an answer has all of them.
TEST(Stages, WorstCasesOfLimitsAreWholeTrajectories) {
  Horizon calm = WalledCartPole::horizon(10);
  calm.disturbance_lower = {-0.2};
  calm.disturbance_upper = {0.2};
  StageGame game(WalledCartPole{}, calm);
  const ProblemStructure& s = game.structure();
  StageAnswer plan = game.solve();
  for (const bool again : {false, true}) {
    if (again) plan = game.solve_next(game.simulate(plan.states[0], plan.controls[0], {0.1}));
    EXPECT_TRUE(plan.certified()) << plan.result.message;
    EXPECT_EQ(plan.worst_cases.size(), 10U);
    std::vector<std::vector<double>> points{plan.result.v};
    for (const RobustWorstCase& worst : plan.worst_cases) points.push_back(worst.v);
    for (const std::vector<double>& v : points) {
      std::vector<double> g(s.constraint_players.size());
      ASSERT_TRUE(game.constraints(v, true, g));
      for (std::size_t j = 0; j < g.size(); ++j) {
        if (s.constraint_players[j] == Player::Min) continue;
        EXPECT_NEAR(g[j], s.constraint_upper[j], 1e-6) << again << ", constraint " << j;
      }
    }
  }
}

TEST(Stages, SingleRowsAreThoseOfAll) {
  StageGame game(WalledCartPole{}, WalledCartPole::horizon(10));
  const ProblemStructure& s = game.structure();
  std::vector<double> v(s.variable_players.size());
  for (std::size_t i = 0; i < v.size(); ++i) v[i] = std::sin(static_cast<double>(i));
  std::vector<double> g(s.constraint_players.size()), jacobian(s.jacobian.size()), one = g;
  StageGame other(WalledCartPole{}, WalledCartPole::horizon(10));
  ASSERT_TRUE(other.constraints(v, true, g) && other.jacobian(v, false, jacobian));
  for (const double shift : {0.0, 0.1}) {  // a later row first, then earlier ones at the same point
    for (const Index row : {32, 3, 33, 0, 49}) {
      std::vector<double> entries(jacobian.size());
      ASSERT_TRUE(game.constraint_rows({&row, 1}, v, true, one));
      ASSERT_TRUE(game.jacobian_rows({&row, 1}, v, false, entries));
      EXPECT_EQ(one[static_cast<std::size_t>(row)], g[static_cast<std::size_t>(row)]) << shift;
      for (std::size_t k = 0; k < entries.size(); ++k) {
        if (s.jacobian[k].row != row) continue;
        EXPECT_EQ(entries[k], jacobian[k]) << row;
      }
    }
    for (double& value : v) value += 0.1;
    ASSERT_TRUE(other.constraints(v, true, g) && other.jacobian(v, false, jacobian));
  }
}

/// A pendulum held upright by feedback; mass, length and friction are unknown and do not change.
struct UnknownPendulum {
  static constexpr std::size_t states = 5, controls = 1, disturbances = 0;
  void dynamics(auto s, auto u, auto, auto rate) const {
    const auto inertia = s[2] * s[3] * s[3];
    rate[0] = s[1];
    rate[1] = 9.81 * sin(s[0]) / s[3] + (u[0] - s[4] * s[1]) / inertia;
    for (std::size_t i = 2; i < states; ++i) rate[i] = 0.0 * s[i];
  }
  auto cost(auto s, auto u, auto) const {
    return s[0] * s[0] + 0.1 * s[1] * s[1] + 0.01 * u[0] * u[0];
  }
  static Horizon horizon(std::vector<double> spread, std::array<double, 2> lower,
                         std::array<double, 2> upper) {
    return {.stages = 12,
            .step = 0.25,
            .initial = {1.0, 0.0, 1.0, 1.0, 0.2},
            .initial_spread = std::move(spread),
            .control_lower = {0.0},
            .control_upper = {0.0},
            .gain_lower = {lower[0], lower[1], 0.0, 0.0, 0.0},
            .gain_upper = {upper[0], upper[1], 0.0, 0.0, 0.0}};
  }
};

/// The largest cost over the corners of the unknowns; gains that are given have no price.
double largest_over_corners(const std::array<double, 2>& gains, Horizon horizon) {
  horizon.initial_spread = {};
  for (std::size_t i = 0; i < 2; ++i) horizon.gain_lower[i] = horizon.gain_upper[i] = gains[i];
  double most = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const auto part = [&](int i) { return (corner >> i & 1) != 0 ? 1.3 : 0.7; };
    StageGame one(UnknownPendulum{}, horizon);
    one.set_initial(std::array{1.0, 0.0, part(0), part(1), 0.2 * part(2)});
    most = std::max(most, one.solve().result.objective);
  }
  return most;
}

/// Gains for the largest cost over the unknowns, of eight starts.
StageAnswer plan_gains(const Horizon& horizon) {
  StageGame game(UnknownPendulum{}, horizon);
  SolverOptions options;
  options.minmax_epigraph = true;
  options.minmax_worst_case_starts = 8;
  return game.solve(options);
}

/// What they cost at the corners of the unknowns, and themselves.
double largest_cost(const StageAnswer& plan, const Horizon& horizon) {
  const std::array<double, 2> gains = {plan.gains[0], plan.gains[1]};
  double most = largest_over_corners(gains, horizon);
  for (const double gain : gains) most += horizon.feedback_price * gain * gain;
  return most;
}

// On the way the trajectory of a corner of the unknowns diverges, which maximizations from random
// starts do not find: the gains move to where it does not. Ipopt with the eight corners given finds
// the same costs.
TEST(Stages, GainsMoveToWhereNoCornersTrajectoryDiverges) {
  const std::array<std::pair<std::size_t, double>, 2> known = {{{16, 3.15953}, {20, 2.95516}}};
  for (const auto& [stages, cost] : known) {
    Horizon horizon =
        UnknownPendulum::horizon({0.0, 0.0, 0.3, 0.3, 0.06}, {-60.0, -20.0}, {-11.0, -1.0});
    horizon.stages = stages;
    horizon.step = 3.0 / static_cast<double>(stages);
    const StageAnswer plan = plan_gains(horizon);
    ASSERT_TRUE(plan.certified()) << plan.result.message;
    EXPECT_NEAR(plan.result.objective, cost, 1e-5);
    EXPECT_NEAR(largest_cost(plan, horizon), cost, 1e-5);
  }
}

// Where gains have no price, those with which every trajectory stays are found, or the corner is
// named at which they do not.
TEST(Stages, CornersWhereTrajectoriesDivergeAreNamed) {
  Horizon horizon =
      UnknownPendulum::horizon({0.0, 0.0, 0.3, 0.3, 0.06}, {-60.0, -20.0}, {-11.0, -1.0});
  horizon.stages = 24;
  horizon.step = 3.0 / 24;
  horizon.feedback_price = 0.0;
  const StageAnswer plan = plan_gains(horizon);
  if (plan.certified()) {
    EXPECT_NEAR(largest_cost(plan, horizon), plan.result.objective, 1e-5);
  } else {
    EXPECT_NE(plan.result.message.find("state2[0]) = 0.7"), std::string::npos)
        << plan.result.message;
  }
}

// The largest cost has a kink where two corners of the unknowns share it; scenarios, of which the
// trajectories follow the gains, lead there. On the way to a maximum costs of 1e9 are seen, beside
// which all others look alike.
TEST(Stages, GainsAgainstUnknownParametersRestOnTwoCorners) {
  Horizon horizon =
      UnknownPendulum::horizon({0.0, 0.0, 0.3, 0.3, 0.06}, {-60.0, -20.0}, {-11.0, -1.0});
  for (const double price : {horizon.feedback_price, 0.0}) {
    horizon.feedback_price = price;
    const StageAnswer plan = plan_gains(horizon);
    ASSERT_TRUE(plan.certified()) << plan.result.message;
    ASSERT_GE(plan.worst_cases.size(), 2U);
    EXPECT_NEAR(plan.worst_cases[0].value, plan.worst_cases[1].value, 1e-6);
    EXPECT_NEAR(largest_cost(plan, horizon), plan.result.objective, 1e-5);
  }
}

TEST(Stages, LimitsHoldForEveryDisturbance) {
  StageGame game(Wall{}, {.stages = 4,
                          .step = 0.25,
                          .discretization = Discretization::Euler,
                          .initial = {0.0, 1.0},
                          .control_lower = {-10.0},
                          .control_upper = {10.0},
                          .disturbance_lower = {-0.5},
                          .disturbance_upper = {0.5}});
  EXPECT_EQ(std::ranges::count(game.structure().constraint_players, Player::Min), 4);
  SolverOptions options;
  options.minmax_worst_case_starts = 3;
  const StageAnswer plan = game.solve(options);
  ASSERT_TRUE(is_success(plan.result.status)) << plan.result.message;
  EXPECT_FALSE(plan.worst_cases.empty());
  // Whatever blows: the corners of the wind's box.
  for (int corner = 0; corner < 16; ++corner) {
    std::vector<double> s{0.0, 1.0};
    for (std::size_t k = 0; k < 4; ++k) {
      s = game.simulate(s, plan.controls[k], {(corner >> k & 1) != 0 ? 0.5 : -0.5});
      EXPECT_LE(s[0], 1.0 + 1e-6);
    }
  }
}

/// A terminal set that only the controls' sum decides: no robust row.
struct Budget {
  static constexpr std::size_t states = 1, controls = 1, disturbances = 1, parameters = 1;
  static constexpr std::size_t limits = 1, terminal_limits = 1;
  void dynamics(const auto& at, auto rate) const { rate[0] = at.p[0] * at.u[0] + at.w[0]; }
  auto cost(const auto& at) const {
    return at.s[0] * at.s[0] + 0.1 * at.u[0] * at.u[0] + 0.1 * at.p[0] * at.p[0] -
           20.0 * at.w[0] * at.w[0];
  }
  void limits_of(const auto& at, auto g) const { g[0] = at.u[0] * at.u[0] - 0.25; }
  void terminal_limits_of(const auto& at, auto g) const { g[0] = at.p[0] - 1.2; }
};

TEST(Stages, ParametersAndLimitsOfMinsAlone) {
  StageGame game(Budget{}, {.stages = 6,
                            .step = 0.2,
                            .initial = {1.0},
                            .control_guess = {-0.1},
                            .parameter_lower = {0.0},
                            .parameter_upper = {5.0},
                            .parameter_guess = {1.0}});
  const StageAnswer plan = game.solve();
  ASSERT_TRUE(plan.certified()) << plan.result.message;
  EXPECT_TRUE(plan.worst_cases.empty());
  ASSERT_EQ(plan.parameters.size(), 1U);
  EXPECT_NEAR(plan.parameters[0], 1.2, 1e-6);
  EXPECT_NEAR(plan.controls[0][0], -0.5, 1e-6);
}

/// Friction that changes with the sign of the speed: a branch.
struct Friction {
  static constexpr std::size_t states = 1, controls = 1, disturbances = 1;
  void dynamics(auto s, auto u, auto w, auto rate) const {
    const auto drag = s[0] > 0.0 ? 0.5 * s[0] * s[0] : -0.5 * s[0] * s[0] * s[0] * s[0];
    rate[0] = u[0] + w[0] - drag;
  }
  auto cost(auto s, auto u, auto w) const {
    return (s[0] + 0.3) * (s[0] + 0.3) + 0.1 * u[0] * u[0] - 5.0 * w[0] * w[0];
  }
};

TEST(Stages, BranchesOfFormulasAreFollowedStageByStage) {
  Horizon horizon{.stages = 8, .step = 0.2, .initial = {0.8}, .final_guess = {-0.5}};
  expect_right_derivatives(Friction{}, horizon);
  const StageAnswer plan = StageGame(Friction{}, horizon).solve();
  EXPECT_TRUE(plan.certified()) << plan.result.message;
  EXPECT_GT(plan.states[1][0], 0.0);
  EXPECT_LT(plan.states[8][0], 0.0);
}

TEST(Stages, AreATnlpWithNamesAndPlayers) {
  Horizon horizon = stage_models::VanDerPol::horizon(10);
  horizon.state_names = {"angle", "speed"};
  StageGame game(stage_models::VanDerPol{}, horizon);
  const StageAnswer plan = game.solve();
  const Ipopt::SmartPtr<MinMaxApplication> app = new MinMaxApplication(false);
  ASSERT_EQ(app->Initialize(""), Ipopt::Solve_Succeeded);
  ASSERT_EQ(app->OptimizeTNLP(new GameTNLP(game)), Ipopt::Solve_Succeeded);
  EXPECT_EQ(app->LastResult().v, plan.result.v);
  EXPECT_EQ(game.by_stage(app->LastResult()).states, plan.states);
}

TEST(Stages, BadInputIsNamed) {
  const auto refused = [](Horizon horizon) -> std::string {
    try {
      StageGame game(Unstable{}, std::move(horizon));
    } catch (const std::invalid_argument& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(refused({.initial = {1.0}}), "");
  EXPECT_NE(refused({}).find("initial"), std::string::npos);
  EXPECT_NE(refused({.stages = 0, .initial = {1.0}}).find("stages"), std::string::npos);
  EXPECT_NE(refused({.step = -1.0, .initial = {1.0}}).find("step"), std::string::npos);
  EXPECT_NE(refused({.initial = {1.0}, .control_lower = {2.0}, .control_upper = {1.0}})
                .find("bounds of controls"),
            std::string::npos);
  EXPECT_NE(refused({.initial = {1.0}, .disturbance_lower = {std::nan("")}}).find("disturbances"),
            std::string::npos);
  EXPECT_NE(refused({.initial = {1.0}, .gain_lower = {1.0, 2.0}}).find("gain_lower"),
            std::string::npos);
  StageGame game(Unstable{}, {.initial = {1.0}});
  EXPECT_THROW(game.set_initial(std::vector<double>{1.0, 2.0}), std::invalid_argument);
  EXPECT_THROW(game.set_start({}), std::invalid_argument);
  PrimalDual start;
  start.v.assign(game.structure().variable_lower.size(), 0.0);
  start.lambda = {1.0};
  EXPECT_THROW(game.set_start(start), std::invalid_argument);
  Result short_one;
  short_one.v = {1.0};
  EXPECT_THROW(static_cast<void>(game.by_stage(short_one)), std::invalid_argument);
  const std::vector<double> one{1.0}, none;
  EXPECT_THROW(static_cast<void>(game.simulate(none, one, one)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(game.simulate(one, none, one)), std::invalid_argument);
  EXPECT_THROW(static_cast<void>(game.simulate(one, one, none)), std::invalid_argument);
  for (const std::size_t stages : {std::size_t{1} << 62, std::size_t{1} << 31})
    EXPECT_NE(refused({.stages = stages, .initial = {1.0}}).find("stages"), std::string::npos);
}

/// A pendulum whose first state is known within bounds, against a limit of its angle at every
/// stage.
struct UncertainPendulum {
  static constexpr std::size_t states = 2, controls = 1, disturbances = 1, limits = 1;
  double bound = 1.0;
  void dynamics(auto s, auto u, auto w, auto rate) const {
    rate[0] = s[1];
    rate[1] = -1.0 * sin(s[0]) - 0.5 * s[1] + u[0] + 0.0 * w[0];
  }
  auto cost(auto s, auto u, auto w) const {
    return s[0] * s[0] + 0.1 * s[1] * s[1] + 0.1 * u[0] * u[0] - w[0] * w[0];
  }
  void limits_of(auto s, auto, auto g) const { g[0] = s[0] - bound; }
};

TEST(ProvableStageGame, StatesFollowFromWhatIsUncertain) {
  for (const Discretization how : {Discretization::Euler, Discretization::RungeKutta4}) {
    const double bound = how == Discretization::Euler ? 1.045 : 1.02;
    ProvableStageGame game(UncertainPendulum{bound}, {.stages = 8,
                                                      .step = 0.1,
                                                      .discretization = how,
                                                      .initial = {0.9, 0.3},
                                                      .initial_spread = {0.1, 0.1},
                                                      .disturbance_lower = {0.0},
                                                      .disturbance_upper = {0.0}});
    SolverOptions options;
    options.minmax_worst_case_proof = true;
    const StageAnswer plan = game.solve(options);
    ASSERT_TRUE(plan.certified()) << plan.result.message;
    ASSERT_EQ(plan.result.over_y.proofs.size(), 9U);  // f, and the limit at the end of each stage
    double highest = -1.0;
    for (const WorstCaseProof& proof : plan.result.over_y.proofs) {
      EXPECT_TRUE(proof.complete) << proof.message;
      if (proof.constraint >= 0) highest = std::max(highest, proof.proved);
    }
    EXPECT_NEAR(highest, 0.0, 1e-5);  // x rests on a limit
    double most = -1.0;
    for (int i = 0; i <= 20; ++i) {
      for (int j = 0; j <= 20; ++j) {
        std::vector<double> s = {0.8 + 0.01 * i, 0.2 + 0.01 * j};
        for (std::size_t k = 0; k < 8; ++k) {
          s = game.simulate(s, plan.controls[k], std::vector<double>{0.0}, {}, k);
          most = std::max(most, s[0] - bound);
        }
      }
    }
    EXPECT_LE(most, highest + 1e-12);
    // At the worst case that was seen the states are those that follow.
    for (const WorstCaseProof& proof : plan.result.over_y.proofs) {
      std::vector<double> g(game.structure().constraint_players.size());
      ASSERT_TRUE(game.constraints(proof.v, true, g));
      for (std::size_t j = 0; j < g.size(); ++j) {
        if (game.structure().constraint_players[j] != Player::Max) continue;
        EXPECT_NEAR(g[j], 0.0, 1e-12);
      }
    }
  }
  EXPECT_THROW(
      ProvableStageGame(UncertainPendulum{},
                        {.discretization = Discretization::HermiteSimpson, .initial = {0.0, 0.0}}),
      std::invalid_argument);
}

}  // namespace
}  // namespace ipminmax
