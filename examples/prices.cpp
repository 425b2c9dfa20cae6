// What the price of the disturbance does to a plan and to a feedback (docs/modelling.md).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ipminmax/core/autodiff_problem.hpp>
#include <ipminmax/core/solver.hpp>

/// A cart pushed by a motor and by wind, 10 stages of 0.2 s, motor = u_k + a position_k + b speed_k:
/// f = sum of position^2 + 0.1 motor^2 + 0.01 u^2 - price wind^2.
struct Cart {
  static constexpr std::size_t T = 10;
  double price = 5.0;

  // Variables: u_0 .. u_9, wind_0 .. wind_9, positions 1 .. 10, speeds 1 .. 10, a, b.
  template <class N>
  N position(std::span<const N> v, std::size_t k) const {
    return k == 0 ? N(1.0) : v[2 * T + k - 1];
  }
  template <class N>
  N speed(std::span<const N> v, std::size_t k) const {
    return k == 0 ? N(0.0) : v[3 * T + k - 1];
  }
  template <class N>
  N motor(std::span<const N> v, std::size_t k) const {
    return v[k] + v[4 * T] * position(v, k) + v[4 * T + 1] * speed(v, k);
  }
  template <class N>
  N objective(std::span<const N> v) const {
    N f = 0.0;
    for (std::size_t k = 0; k < T; ++k) {
      const N p = position(v, k + 1), m = motor(v, k), w = v[T + k];
      f += p * p + 0.1 * m * m + 0.01 * v[k] * v[k] - price * w * w;
    }
    return f;
  }
  template <class N>
  void constraints(std::span<const N> v, std::span<N> g) const {
    for (std::size_t k = 0; k < T; ++k) {
      const N s = speed(v, k);
      g[k] = position(v, k + 1) - position(v, k) - 0.2 * s;
      g[T + k] = speed(v, k + 1) - s - 0.2 * (motor(v, k) + v[T + k]) + 0.02 * s * s * s;
    }
  }
};

/// gains: whether a, b may differ from zero.
inline ipminmax::ModelData cart_data(bool gains) {
  using ipminmax::Player;
  constexpr std::size_t T = Cart::T;
  ipminmax::ModelData d;
  d.players.assign(4 * T + 2, Player::Max);  // wind and states
  d.start.assign(4 * T + 2, 0.0);
  d.lower.assign(4 * T + 2, -2e19);
  d.upper.assign(4 * T + 2, 2e19);
  const auto bound = [&](std::size_t i, double low, double up) {
    d.lower[i] = low, d.upper[i] = up;
  };
  for (std::size_t k = 0; k < T; ++k) {
    d.players[k] = Player::Min;
    bound(k, -5.0, 5.0);
    bound(T + k, -1.0, 1.0);
  }
  for (const std::size_t i : {4 * T, 4 * T + 1}) {
    d.players[i] = Player::Min;
    bound(i, gains ? -20.0 : 0.0, 0.0);
  }
  d.constraint_lower.assign(2 * T, 0.0);
  d.constraint_upper.assign(2 * T, 0.0);
  return d;
}

int main() {
  for (const double price : {50.0, 5.0, 1.5, 0.8, 0.3}) {
    std::printf("price %4.1f:", price);
    for (const bool gains : {false, true}) {
      ipminmax::AutodiffProblem problem(Cart{price}, cart_data(gains));
      const ipminmax::Result result = ipminmax::solve(problem, {});
      const bool certified = result.certificate.kind == ipminmax::PointKind::LocalMinmax;
      double wind = 0.0;
      for (std::size_t k = 0; k < Cart::T; ++k)
        wind = std::max(wind, std::abs(result.v[Cart::T + k]));
      std::printf(" %s ", gains ? " feedback" : "open loop");
      if (certified)
        std::printf("%.2f (wind %.3f)%s", result.objective, wind, gains ? "" : " |");
      else
        std::printf("no local minmax%s", gains ? "" : "   |");
    }
    std::puts("");
  }
}
