// Terminal cost and terminal set of a short horizon (docs/stages.md).
#include <cstdio>
#include <ipminmax/adapter/stages.hpp>

/// A mass on a spring, s = (place, speed), pushed by u and by w: s <- A s + b (u + w).
struct Mass {
  static constexpr std::size_t states = 2, controls = 1, disturbances = 1, terminal_limits = 1;
  static constexpr double h = 0.1, a[2][2] = {{1.0, h}, {-h, 1.0 - 0.5 * h}}, b[2] = {0.0, h};
  static constexpr double q[2] = {1.0, 0.1}, effort = 0.1, price = 10.0;
  double p[2][2] = {{q[0], 0.0}, {0.0, q[1]}}, gain[2] = {};

  /// P <- Q + A'PA - A'Pb b'PA / (r + b'Pb), 1 / r = 1 / effort - 1 / price, to its fixed point.
  Mass() {
    const double r = 1.0 / (1.0 / effort - 1.0 / price);
    for (int k = 0; k < 1000; ++k) {
      const double scale = r + h * h * p[1][1];
      double pa[2][2];
      for (int j : {0, 1}) {
        for (int i : {0, 1}) pa[i][j] = p[i][0] * a[0][j] + p[i][1] * a[1][j];
        gain[j] = -r / effort * h * pa[1][j] / scale;  // u = gain s
      }
      for (int i : {0, 1}) {
        for (int j : {0, 1}) {
          p[i][j] = (i == j ? q[i] : 0.0) + a[0][i] * pa[0][j] + a[1][i] * pa[1][j] -
                    h * h * pa[1][i] * pa[1][j] / scale;
        }
      }
    }
  }
  void dynamics(auto s, auto u, auto w, auto next) const {
    for (int i : {0, 1}) next[i] = a[i][0] * s[0] + a[i][1] * s[1] + b[i] * (u[0] + w[0]);
  }
  auto cost(auto s, auto u, auto w) const {
    return q[0] * s[0] * s[0] + q[1] * s[1] * s[1] + effort * u[0] * u[0] - price * w[0] * w[0];
  }
  auto terminal_cost(auto s) const {  // s'Ps
    return p[0][0] * s[0] * s[0] + 2.0 * p[0][1] * s[0] * s[1] + p[1][1] * s[1] * s[1];
  }
  void terminal_limits_of(auto s, auto g) const { g[0] = terminal_cost(s) - 0.1; }
};

int main() {
  const Mass mass;
  for (const std::size_t stages : {20, 40}) {
    ipminmax::StageGame game(mass, {.stages = stages,
                                    .discretization = ipminmax::Discretization::Discrete,
                                    .initial = {1.0, 0.0},
                                    .disturbance_lower = {-0.1},
                                    .disturbance_upper = {0.1},
                                    .gain_lower = {mass.gain[0], mass.gain[1]},
                                    .gain_upper = {mass.gain[0], mass.gain[1]}});
    const ipminmax::StageAnswer plan = game.solve();
    std::printf("%zu stages: %.6f, s'Ps at most %.3f at the end, %s\n", stages,
                plan.result.objective, mass.terminal_cost(plan.states.back()),
                plan.certified() ? "certified" : plan.result.message.c_str());
  }
}
