// Robust model predictive control of an oscillator with shared dynamics: motor and gust push the
// same mass, so the states are the maximizer's variables and the dynamics his constraints.

#include <algorithm>
#include <cstdio>
#include <ipminmax/core/solver.hpp>

#include "command_line.hpp"
#include "report.hpp"
#include "shared_dynamics.hpp"

namespace {

int run(int argc, char** argv) {
  int horizon = 20;
  double position = 2.0, u_max = 3.0, w_max = 0.05, gamma = 2.0;
  bool linear = false;
  CommandLine command_line("robust_mpc: one solve of a pendulum's (or spring's) control problem");
  command_line.add("--horizon", horizon, "stages (20)");
  command_line.add("--position", position, "where the mass starts, at rest (2)");
  command_line.add("--u-max", u_max, "largest push of the motor (3)");
  command_line.add("--w-max", w_max, "largest gust (0.05)");
  command_line.add("--gamma", gamma, "price of gusts (2)");
  command_line.add_flag("--linear", linear, "a spring instead of a pendulum");
  if (!command_line.parse(argc, argv)) return 0;
  if (horizon < 1) throw std::invalid_argument("--horizon must be positive");
  if (!(u_max > 0.0 && w_max > 0.0))
    throw std::invalid_argument("--u-max and --w-max must be positive");

  shared_dynamics::System system = shared_dynamics::oscillator(horizon, !linear);
  system.x0[0] = position;
  system.u_max = u_max;
  system.w_max = w_max;
  system.gamma = gamma;
  shared_dynamics::Game game(system);
  const ipminmax::Result result = ipminmax::solve(game, {});
  const int exit_status = report(result);
  if (result.v.empty()) return exit_status;
  const auto value = [&](ipminmax::Index i) { return result.v[static_cast<std::size_t>(i)]; };
  std::printf("\n%5s %10s %10s %10s %10s\n", "stage", "motor", "gust", "position", "velocity");
  for (int k = 0; k < std::min(horizon, 20); ++k)
    std::printf("%5d %10.5f %10.5f %10.5f %10.5f\n", k, value(game.u(k, 0)), value(game.w(k, 0)),
                value(game.x(k + 1, 0)), value(game.x(k + 1, 1)));
  return exit_status;
}

}  // namespace

int main(int argc, char** argv) {
  return guarded("robust_mpc", [&] { return run(argc, argv); });
}
