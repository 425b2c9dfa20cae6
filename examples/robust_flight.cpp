// Model predictive control of a planar quadrotor in gusts: it flies to a point close to a wall,
// above a floor, and its position must respect both for every gust, not for the forecast alone.
//
//   min over thrust a_k, turn rate q_k   sum of squared distances to the target + price of controls,
//                                        along the path without gusts
//   subject to   p_x(k; gusts) <= wall,  p_z(k; gusts) >= floor   for every sequence of gusts in a box
//
// The air's drag depends on the velocity against the gust, so the flown path is a nonlinear
// function of the gusts; each bound has a worst sequence of its own. The closed loop meets the
// gusts that push towards wall and floor; a controller that trusts the forecast flies beside it.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <ipminmax/core/robust.hpp>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "report.hpp"
#include "svg_plot.hpp"

namespace {

using ipminmax::Index;
using ipminmax::Player;

constexpr double kStep = 0.1, kGravity = 9.81, kDrag = 0.3, kSmooth = 0.1;
constexpr double kWall = 1.0, kFloor = 0.0, kTargetX = 0.97, kTargetZ = 0.3;
constexpr double kSpeedPrice = 0.1, kThrustPrice = 2e-3, kRatePrice = 2e-3;
constexpr double kMostThrust = 2.0 * kGravity, kMostRate = 4.0, kMostTilt = 0.8;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Drag r sqrt(r^2 + e^2), smooth at rest, and its derivatives.
double drag(double r) { return kDrag * r * std::hypot(r, kSmooth); }
double drag_slope(double r) {
  return kDrag * (2.0 * r * r + kSmooth * kSmooth) / std::hypot(r, kSmooth);
}
double drag_curvature(double r) {
  const double s = std::hypot(r, kSmooth);
  return kDrag * r * (2.0 * r * r + 3.0 * kSmooth * kSmooth) / (s * s * s);
}

struct State {
  std::array<double, 2> position{}, velocity{};
  double tilt = 0.0;
};

std::array<double, 2> push_of(double thrust, double tilt) {
  return {-thrust * std::sin(tilt), thrust * std::cos(tilt) - kGravity};
}

State fly(const State& from, double thrust, double rate, const std::array<double, 2>& gust) {
  State to = from;
  const std::array<double, 2> push = push_of(thrust, from.tilt);
  for (std::size_t i = 0; i < 2; ++i) {
    to.position[i] += kStep * from.velocity[i];
    to.velocity[i] += kStep * (push[i] - drag(from.velocity[i] - gust[i]));
  }
  to.tilt += kStep * rate;
  return to;
}

/// Stages k = 0, ..., T - 1, axes i = 0 (x) and 1 (z). Min: thrust, turn rate and accelerations
/// they give, states of the forecast path at k = 1, ..., T. Max: gusts at k = 0, ..., T - 2; later
/// ones move no position within the horizon.
class Flight final : public ipminmax::Problem {
 public:
  Flight(int horizon, double gust) : t_(horizon) { describe(gust); }

  [[nodiscard]] Index thrust(Index k) const { return k; }
  [[nodiscard]] Index rate(Index k) const { return t_ + k; }
  [[nodiscard]] Index push(Index k, Index i) const { return 2 * t_ + 2 * k + i; }
  [[nodiscard]] Index tilt(Index k) const { return 4 * t_ + k - 1; }
  [[nodiscard]] Index position(Index k, Index i) const { return 5 * t_ + 4 * (k - 1) + i; }
  [[nodiscard]] Index velocity(Index k, Index i) const { return position(k, i) + 2; }
  [[nodiscard]] Index gust(Index k, Index i) const { return 9 * t_ + 2 * k + i; }

  /// The state now, and the controls of the last answer one stage later with the path that follows.
  void set(const State& now, std::span<const double> last) {
    now_ = now;
    guess_.assign(s_.variable_players.size(), 0.0);
    State state = now;
    for (Index k = 0; k < t_; ++k) {
      const Index from = std::min<Index>(k + 1, t_ - 1);
      const double a = last.empty() ? kGravity : last[at(thrust(from))];
      const double q = last.empty() ? 0.0 : last[at(rate(from))];
      const std::array<double, 2> pushed = push_of(a, state.tilt);
      state = fly(state, a, q, {0.0, 0.0});
      guess_[at(thrust(k))] = a;
      guess_[at(rate(k))] = q;
      guess_[at(tilt(k + 1))] = state.tilt;
      for (Index i = 0; i < 2; ++i) {
        guess_[at(push(k, i))] = pushed[at(i)];
        guess_[at(position(k + 1, i))] = state.position[at(i)];
        guess_[at(velocity(k + 1, i))] = state.velocity[at(i)];
      }
    }
  }

  [[nodiscard]] const ipminmax::ProblemStructure& structure() const override { return s_; }
  [[nodiscard]] bool starting_point(ipminmax::StartingPoint& start) override {
    std::copy(guess_.begin(), guess_.end(), start.v.begin());
    return guess_.size() == start.v.size();
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    f = 0.0;
    each_square([&](Index i, double target, double price) {
      f += 0.5 * price * (v[at(i)] - target) * (v[at(i)] - target);
    });
    return true;
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    std::fill(grad.begin(), grad.end(), 0.0);
    each_square(
        [&](Index i, double target, double price) { grad[at(i)] = price * (v[at(i)] - target); });
    return true;
  }
  [[nodiscard]] bool constraints(std::span<const double> v, bool, std::span<double> g) override {
    for (Index j = 0; j < bound_row(t_ + 1, 0); ++j) g[at(j)] = row_value(v, j);
    return true;
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool, std::span<double> values) override {
    std::size_t entry = 0;
    each_slope(v, all_, [&](Index, Index, double value) { values[entry++] = value; });
    return true;
  }
  /// A position that is maximized over the gusts is evaluated alone.
  [[nodiscard]] bool constraint_rows(std::span<const Index> rows, std::span<const double> v, bool,
                                     std::span<double> g) override {
    for (const Index j : rows) g[at(j)] = row_value(v, j);
    return true;
  }
  [[nodiscard]] bool jacobian_rows(std::span<const Index> rows, std::span<const double> v, bool,
                                   std::span<double> values) override {
    std::vector<double> asked(all_.size(), 0.0);
    for (const Index j : rows) asked[at(j)] = 1.0;
    std::size_t entry = 0;
    each_slope(v, asked, [&](Index, Index, double value) { values[entry++] = value; });
    return true;
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    std::size_t entry = 0;
    each_curvature(v, sigma, lambda, [&](Index, Index, double value) { values[entry++] = value; });
    return true;
  }

 private:
  /// Rows of stage k: tilt, then acceleration, position and velocity of each axis.
  [[nodiscard]] Index row(Index k, Index i) const { return 7 * k + 1 + i; }
  /// Position at k = 2, ..., T in gusts; at k = 1 it is settled.
  [[nodiscard]] Index bound_row(Index k, Index i) const { return 7 * t_ + 2 * (k - 2) + i; }
  [[nodiscard]] double row_value(std::span<const double> v, Index j) const {
    const Index k = j / 7, of_axes = j % 7 - 1, i = (of_axes + 2) % 2;
    if (j >= bound_row(2, 0)) {
      const Index position = j - bound_row(2, 0);
      return flown(v, 2 + position / 2, position % 2, false).place;
    }
    if (of_axes < 0) return v[at(tilt(k + 1))] - tilt_at(v, k) - kStep * v[at(rate(k))];
    const double speed = velocity_at(v, k, i);
    if (of_axes < 2) return v[at(push(k, i))] - push_of(v[at(thrust(k))], tilt_at(v, k))[at(i)];
    if (of_axes < 4) return v[at(position(k + 1, i))] - position_at(v, k, i) - kStep * speed;
    return v[at(velocity(k + 1, i))] - speed - kStep * (v[at(push(k, i))] - drag(speed));
  }
  [[nodiscard]] double tilt_at(std::span<const double> v, Index k) const {
    return k == 0 ? now_.tilt : v[at(tilt(k))];
  }
  [[nodiscard]] double position_at(std::span<const double> v, Index k, Index i) const {
    return k == 0 ? now_.position[at(i)] : v[at(position(k, i))];
  }
  [[nodiscard]] double velocity_at(std::span<const double> v, Index k, Index i) const {
    return k == 0 ? now_.velocity[at(i)] : v[at(velocity(k, i))];
  }

  /// The position of one axis at stage k in gusts, p' = v, v' = push - drag(v - gust), and its
  /// derivatives in (push_0, gust_0, push_1, gust_1, ..., push_{k-2}, gust_{k-2}). Only the drag is
  /// nonlinear: with r_j the gradient of v_j - gust_j and a_j = d place / d v_j,
  /// Hessian = -h sum_j a_{j+1} drag''_j r_j r_j'.
  struct Position {
    double place = 0.0;
    Eigen::VectorXd gradient;
    Eigen::MatrixXd hessian;
  };
  [[nodiscard]] Position flown(std::span<const double> v, Index k, Index i, bool bends) const {
    const Index n = 2 * (k - 1);
    Eigen::VectorXd against(k - 1), speed_gradient = Eigen::VectorXd::Zero(n);
    std::vector<Eigen::VectorXd> r;
    double place = now_.position[at(i)], speed = now_.velocity[at(i)];
    for (Index j = 0; j < k; ++j) {
      place += kStep * speed;
      if (j > k - 2) break;
      against[j] = speed - v[at(gust(j, i))];
      r.push_back(speed_gradient - Eigen::VectorXd::Unit(n, 2 * j + 1));
      speed += kStep * (v[at(push(j, i))] - drag(against[j]));
      speed_gradient +=
          kStep * (Eigen::VectorXd::Unit(n, 2 * j) - drag_slope(against[j]) * r.back());
    }
    Position out{place, Eigen::VectorXd::Zero(n), {}};
    if (bends) out.hessian.setZero(n, n);
    double a = kStep;  // a_{k-1}: the last velocity moves the position by h
    for (Index j = k - 2; j >= 0; --j) {
      out.gradient[2 * j] = kStep * a;
      out.gradient[2 * j + 1] = kStep * a * drag_slope(against[j]);
      if (bends)
        out.hessian -= kStep * a * drag_curvature(against[j]) * r[at(j)] * r[at(j)].transpose();
      a = kStep + a * (1.0 - kStep * drag_slope(against[j]));
    }
    return out;
  }
  /// Variable number c of those in Position.
  [[nodiscard]] Index flown_variable(Index c, Index i) const {
    return c % 2 == 0 ? push(c / 2, i) : gust(c / 2, i);
  }

  template <class Emit>
  void each_square(Emit emit) const {
    for (Index k = 0; k < t_; ++k) {
      emit(thrust(k), kGravity, kThrustPrice);
      emit(rate(k), 0.0, kRatePrice);
      emit(tilt(k + 1), 0.0, kSpeedPrice);
      for (Index i = 0; i < 2; ++i) {
        emit(position(k + 1, i), i == 0 ? kTargetX : kTargetZ, 1.0);
        emit(velocity(k + 1, i), 0.0, kSpeedPrice);
      }
    }
  }

  /// Positions with a weight of zero are not evaluated, here and in each_curvature.
  template <class Emit>
  void each_slope(std::span<const double> v, std::span<const double> weights, Emit emit) const {
    for (Index k = 0; k < t_; ++k) {
      emit(7 * k, tilt(k + 1), 1.0);
      emit(7 * k, rate(k), -kStep);
      if (k > 0) emit(7 * k, tilt(k), -1.0);
      const double a = v[at(thrust(k))], sine = std::sin(tilt_at(v, k)),
                   cosine = std::cos(tilt_at(v, k));
      for (Index i = 0; i < 2; ++i) {
        emit(row(k, i), push(k, i), 1.0);
        emit(row(k, i), thrust(k), i == 0 ? sine : -cosine);
        if (k > 0) emit(row(k, i), tilt(k), a * (i == 0 ? cosine : sine));
        emit(row(k, i) + 2, position(k + 1, i), 1.0);
        emit(row(k, i) + 4, velocity(k + 1, i), 1.0);
        emit(row(k, i) + 4, push(k, i), -kStep);
        if (k == 0) continue;
        emit(row(k, i) + 2, position(k, i), -1.0);
        emit(row(k, i) + 2, velocity(k, i), -kStep);
        emit(row(k, i) + 4, velocity(k, i), -1.0 + kStep * drag_slope(v[at(velocity(k, i))]));
      }
    }
    for (Index k = 2; k <= t_; ++k) {
      for (Index i = 0; i < 2; ++i) {
        const bool asked = weights[at(bound_row(k, i))] != 0.0;
        const Position p = asked ? flown(v, k, i, false) : Position{};
        for (Index c = 0; c < 2 * (k - 1); ++c) {
          emit(bound_row(k, i), flown_variable(c, i), asked ? p.gradient[c] : 0.0);
        }
      }
    }
  }

  template <class Emit>
  void each_curvature(std::span<const double> v, double sigma, std::span<const double> lambda,
                      Emit emit) const {
    each_square([&](Index i, double, double price) { emit(i, i, sigma * price); });
    for (Index k = 1; k < t_; ++k) {
      const double a = v[at(thrust(k))], sine = std::sin(v[at(tilt(k))]),
                   cosine = std::cos(v[at(tilt(k))]);
      for (Index i = 0; i < 2; ++i) {
        const double weight = lambda[at(row(k, i))];
        emit(tilt(k), thrust(k), weight * (i == 0 ? cosine : sine));
        emit(tilt(k), tilt(k), weight * a * (i == 0 ? -sine : cosine));
        emit(velocity(k, i), velocity(k, i),
             lambda[at(row(k, i) + 4)] * kStep * drag_curvature(v[at(velocity(k, i))]));
      }
    }
    for (Index k = 2; k <= t_; ++k) {
      for (Index i = 0; i < 2; ++i) {
        const double weight = lambda[at(bound_row(k, i))];
        const Position p = weight != 0.0 ? flown(v, k, i, true) : Position{};
        for (Index c = 0; c < 2 * (k - 1); ++c) {
          for (Index d = 0; d <= c; ++d) {
            emit(flown_variable(c, i), flown_variable(d, i),
                 weight != 0.0 ? weight * p.hessian(c, d) : 0.0);
          }
        }
      }
    }
  }

  void describe(double gust_limit) {
    const std::size_t n = at(gust(t_ - 1, 0)), m = at(bound_row(t_ + 1, 0));
    s_.variable_players.assign(n, Player::Min);
    s_.variable_lower.assign(n, -2e19);
    s_.variable_upper.assign(n, 2e19);
    s_.constraint_players.assign(m, Player::Min);
    s_.constraint_lower.assign(m, 0.0);
    s_.constraint_upper.assign(m, 0.0);
    const auto bound = [&](Index i, double lower, double upper) {
      s_.variable_lower[at(i)] = lower;
      s_.variable_upper[at(i)] = upper;
    };
    for (Index k = 0; k < t_; ++k) {
      bound(thrust(k), 0.0, kMostThrust);
      bound(rate(k), -kMostRate, kMostRate);
      bound(tilt(k + 1), -kMostTilt, kMostTilt);
    }
    for (Index i = gust(0, 0); i < gust(t_ - 1, 0); ++i) {
      s_.variable_players[at(i)] = Player::Max;
      bound(i, -gust_limit, gust_limit);
    }
    for (Index k = 2; k <= t_; ++k) {
      s_.constraint_lower[at(bound_row(k, 0))] = -2e19;
      s_.constraint_upper[at(bound_row(k, 0))] = kWall;
      s_.constraint_lower[at(bound_row(k, 1))] = kFloor;
      s_.constraint_upper[at(bound_row(k, 1))] = 2e19;
    }
    const std::vector<double> zeros(std::max(n, m), 0.0);
    all_.assign(m, 1.0);
    each_slope(zeros, zeros, [&](Index row, Index col, double) {
      s_.jacobian.push_back({row, col});
    });
    each_curvature(zeros, 0.0, zeros, [&](Index row, Index col, double) {
      s_.hessian.push_back({row, col});
    });
  }

  Index t_;
  State now_;
  std::vector<double> guess_;
  std::vector<double> all_;  ///< weights of one
  ipminmax::ProblemStructure s_;
};

struct Flown {
  std::vector<svg::Point> path{};  ///< x, z
  double nearest = 2e19;           ///< least distance to wall or floor; negative: beyond
  int certified = 0;
  ipminmax::Index solves = 0, worst_cases = 0;
};

/// The closed loop in the gusts that push towards wall and floor; the controller expects gusts up
/// to `expected`.
Flown fly_to_target(int horizon, int steps, double gust, double expected) {
  Flight flight(horizon, expected);
  ipminmax::SolverOptions options;
  options.minmax_worst_case_starts = 2;
  State now;
  now.position = {-1.0, 1.0};
  std::vector<double> last;
  Flown flown;
  flown.path.push_back({now.position[0], now.position[1]});
  for (int step = 0; step < steps; ++step) {
    flight.set(now, last);
    const ipminmax::RobustResult answer = ipminmax::solve_robust(flight, options);
    if (answer.result.v.empty()) throw std::runtime_error(answer.result.message);
    last = answer.result.v;
    flown.certified += answer.result.certificate.kind == ipminmax::PointKind::LocalMinmax ? 1 : 0;
    flown.solves += answer.solves;
    for (const ipminmax::RobustWorstCase& found : answer.worst_cases) {
      if (std::abs(found.multiplier) > 1e-6) ++flown.worst_cases;
    }
    now = fly(now, last[at(flight.thrust(0))], last[at(flight.rate(0))], {gust, -gust});
    flown.path.push_back({now.position[0], now.position[1]});
    flown.nearest = std::min({flown.nearest, kWall - now.position[0], now.position[1] - kFloor});
  }
  return flown;
}

int run(int argc, char** argv) {
  int horizon = 6, steps = 26;
  double gust = 1.0;
  std::string output = ".";
  CommandLine command_line(
      "robust_flight: a quadrotor that keeps off wall and floor in every gust");
  command_line.add("--horizon", horizon, "stages (6)");
  command_line.add("--steps", steps, "of the closed loop (26)");
  command_line.add("--gust", gust, "largest gust in m/s (1)");
  command_line.add("--output", output, "folder of robust_flight.svg (.)");
  if (!command_line.parse(argc, argv)) return 0;
  if (horizon < 3 || steps < 1 || !(gust > 0.0))
    throw std::invalid_argument("--horizon from 3, --steps from 1 on, --gust positive");

  const Flown robust = fly_to_target(horizon, steps, gust, gust);
  const Flown trusting = fly_to_target(horizon, steps, gust, 1e-3 * gust);
  std::printf(
      "for every gust   %d of %d steps certified, %d solves, %d active worst cases, "
      "nearest to wall or floor %.4f m\n",
      robust.certified, steps, robust.solves, robust.worst_cases, robust.nearest);
  std::printf("forecast alone   %d of %d steps certified, nearest to wall or floor %.4f m\n",
              trusting.certified, steps, trusting.nearest);
  svg::Panel panel;
  panel.title = "Flight to a wall, gusts push into it";
  panel.subtitle = "wall x = 1, floor z = 0, target (0.97, 0.3)";
  panel.series = {
      {.points = {{kWall, 1.2}, {kWall, kFloor}, {-1.2, kFloor}},
       .color = "#000000",
       .label = "wall and floor"},
      {.points = trusting.path,
       .mark = svg::Mark::LineAndDots,
       .color = "#c03030",
       .label = "forecast alone"},
      {.points = robust.path, .mark = svg::Mark::LineAndDots, .label = "for every gust"}};
  svg::write({panel}, std::filesystem::path(output) / "robust_flight.svg");
  return robust.certified == steps && robust.nearest >= -1e-6 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  return guarded("robust_flight", [&] { return run(argc, argv); });
}
