#pragma once

#include <ipminmax/adapter/stages.hpp>

/// Six games of control against disturbance for <ipminmax/adapter/stages.hpp>: dynamics, cost and
/// numbers of each.
namespace stage_models {

using ipminmax::Discretization;
using ipminmax::Horizon;

/// Pursuit in three dimensions with free final time. State: the evader's position seen from the
/// pursuer, the pursuer's velocity. He accelerates, the evader runs at priced speed; time costs.
struct Pursuit {
  static constexpr std::size_t states = 6, controls = 3, disturbances = 3;
  double price = 6.0, time_price = 1.0;
  void dynamics(auto s, auto u, auto w, auto rate) const {
    for (std::size_t i = 0; i < 3; ++i) {
      rate[i] = w[i] - s[3 + i];
      rate[3 + i] = u[i];
    }
  }
  auto cost(auto s, auto u, auto w) const {
    auto sum = time_price + 0.0 * s[0];
    for (std::size_t i = 0; i < 3; ++i) sum += 0.05 * u[i] * u[i] - price * w[i] * w[i];
    return sum;
  }
  auto terminal_cost(auto s) const { return 2.0 * (s[0] * s[0] + s[1] * s[1] + s[2] * s[2]); }
  static Horizon horizon(std::size_t stages) {
    return {.stages = stages,
            .step = 2.0 / static_cast<double>(stages),
            .initial = {2.0, 1.0, 0.5, 0.0, 0.5, 0.0},
            .control_lower = {-8.0, -8.0, -8.0},
            .control_upper = {8.0, 8.0, 8.0},
            .disturbance_lower = {-1.0, -1.0, -1.0},
            .disturbance_upper = {1.0, 1.0, 1.0},
            .duration_lower = 0.2,
            .duration_upper = 10.0};
  }
};

/// A planar quadrotor in wind, as in quadrotor_tnlp.hpp.
struct Quadrotor {
  static constexpr std::size_t states = 6, controls = 2, disturbances = 2;
  double price = 4.0;
  void dynamics(auto s, auto u, auto w, auto rate) const {
    for (std::size_t i = 0; i < 3; ++i) rate[i] = s[3 + i];
    const auto thrust = u[0] + u[1];
    rate[3] = -thrust * sin(s[2]) + w[0];
    rate[4] = thrust * cos(s[2]) - 9.81 + w[1];
    rate[5] = 6.0 * (u[0] - u[1]);
  }
  auto cost(auto s, auto u, auto w) const {
    const double weight[] = {1.0, 1.0, 0.5, 0.2, 0.2, 0.1};
    auto sum = -price * (w[0] * w[0] + w[1] * w[1]);
    for (std::size_t i = 0; i < 6; ++i) sum += weight[i] * s[i] * s[i];
    for (std::size_t i = 0; i < 2; ++i) sum += 0.05 * (u[i] - 4.905) * (u[i] - 4.905);
    return sum;
  }
  static Horizon horizon(std::size_t stages) {
    return {.stages = stages,
            .step = 2.0 / static_cast<double>(stages),
            .initial = {3.0, -2.0, 0.0, 0.0, 0.0, 0.0},
            .control_lower = {0.0, 0.0},
            .control_upper = {9.0, 9.0},
            .control_guess = {4.905, 4.905},
            .disturbance_lower = {-2.0, -2.0},
            .disturbance_upper = {2.0, 2.0}};
  }
};

/// Van der Pol's oscillator, pushed by a motor and by gusts.
struct VanDerPol {
  static constexpr std::size_t states = 2, controls = 1, disturbances = 1;
  double price = 12.0;
  void dynamics(auto s, auto u, auto w, auto rate) const {
    rate[0] = s[1];
    rate[1] = (1.0 - s[0] * s[0]) * s[1] - s[0] + u[0] + w[0];
  }
  auto cost(auto s, auto u, auto w) const {
    return s[0] * s[0] + s[1] * s[1] + u[0] * u[0] - price * w[0] * w[0];
  }
  static Horizon horizon(std::size_t stages) {
    return {.stages = stages,
            .step = 2.0 / static_cast<double>(stages),
            .discretization = Discretization::HermiteSimpson,
            .initial = {1.0, 0.0},
            .control_lower = {-2.0},
            .control_upper = {2.0},
            .disturbance_lower = {-1.0},
            .disturbance_upper = {1.0}};
  }
};

/// A pole on a cart, kept upright while gusts push the pole. State: position, angle from the
/// vertical, their speeds; masses 1 and 0.1 kg, 0.5 m.
struct CartPole {
  static constexpr std::size_t states = 4, controls = 1, disturbances = 1;
  double price = 60.0;
  void dynamics(auto s, auto u, auto w, auto rate) const {
    const auto sine = sin(s[1]), cosine = cos(s[1]);
    const auto mass = 1.0 + 0.1 * sine * sine;
    rate[0] = s[2];
    rate[1] = s[3];
    rate[2] = (u[0] + 0.1 * sine * (0.5 * s[3] * s[3] - 9.81 * cosine)) / mass;
    rate[3] =
        (1.1 * 9.81 * sine - u[0] * cosine - 0.05 * s[3] * s[3] * sine * cosine) / (0.5 * mass) +
        w[0];
  }
  auto cost(auto s, auto u, auto w) const {
    return s[0] * s[0] + 10.0 * s[1] * s[1] + 0.1 * (s[2] * s[2] + s[3] * s[3]) +
           0.05 * u[0] * u[0] - price * w[0] * w[0];
  }
  static Horizon horizon(std::size_t stages) {
    return {.stages = stages,
            .step = 1.0 / static_cast<double>(stages),
            .initial = {0.0, 0.3, 0.0, 0.0},
            .control_lower = {-20.0},
            .control_upper = {20.0},
            .disturbance_lower = {-2.0},
            .disturbance_upper = {2.0}};
  }
};

/// A planar arm of two links of 1 kg and 1 m without gravity; unknown torques act at the joints.
/// State: angles, speeds.
struct RobotArm {
  static constexpr std::size_t states = 4, controls = 2, disturbances = 2;
  double price = 60.0;
  void dynamics(auto s, auto u, auto w, auto rate) const {
    const auto c = cos(s[1]), pull = 0.5 * sin(s[1]);
    const auto a = 5.0 / 3.0 + c, b = 1.0 / 3.0 + 0.5 * c;  // inertia [a b; b 1/3]
    const auto first = u[0] + w[0] + pull * s[3] * (2.0 * s[2] + s[3]);
    const auto second = u[1] + w[1] - pull * s[2] * s[2];
    const auto determinant = a * (1.0 / 3.0) - b * b;
    rate[0] = s[2];
    rate[1] = s[3];
    rate[2] = (first * (1.0 / 3.0) - b * second) / determinant;
    rate[3] = (a * second - b * first) / determinant;
  }
  auto cost(auto s, auto u, auto w) const {
    return s[0] * s[0] + s[1] * s[1] + 0.1 * (s[2] * s[2] + s[3] * s[3]) +
           0.02 * (u[0] * u[0] + u[1] * u[1]) - price * (w[0] * w[0] + w[1] * w[1]);
  }
  static Horizon horizon(std::size_t stages) {
    return {.stages = stages,
            .step = 1.5 / static_cast<double>(stages),
            .discretization = Discretization::ImplicitMidpoint,
            .initial = {1.5, -1.0, 0.0, 0.0},
            .final_guess = {0.0, 0.0, 0.0, 0.0},
            .control_lower = {-10.0, -5.0},
            .control_upper = {10.0, 5.0},
            .disturbance_lower = {-1.0, -1.0},
            .disturbance_upper = {1.0, 1.0}};
  }
};

/// A race car as a bicycle on a winding road, in coordinates of the road: way along it, distance
/// from its middle, heading against it, speed. Gusts push sideways; leaving the middle costs.
struct RaceCar {
  static constexpr std::size_t states = 4, controls = 2, disturbances = 1;
  double price = 4.0;
  void dynamics(auto s, auto u, auto w, auto rate) const {
    const auto curvature = 0.1 * sin(0.2 * s[0]);
    rate[0] = s[3] * cos(s[2]) / (1.0 - s[1] * curvature);
    rate[1] = s[3] * sin(s[2]) + w[0];
    rate[2] = s[3] * u[1] / 2.5 - curvature * rate[0];
    rate[3] = u[0] - 0.02 * s[3] * s[3];
  }
  auto cost(auto s, auto u, auto w) const {
    return -0.2 * s[3] + 0.5 * s[1] * s[1] + s[2] * s[2] + 0.02 * u[0] * u[0] + 5.0 * u[1] * u[1] -
           price * w[0] * w[0];
  }
  static Horizon horizon(std::size_t stages) {
    return {.stages = stages,
            .step = 2.0 / static_cast<double>(stages),
            .initial = {0.0, 1.0, 0.0, 10.0},
            .control_lower = {-6.0, -0.4},
            .control_upper = {3.0, 0.4},
            .disturbance_lower = {-1.0},
            .disturbance_upper = {1.0}};
  }
};

}  // namespace stage_models
