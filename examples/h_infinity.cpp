// Finite-horizon H-infinity game against its Riccati recursion. Below the critical gamma the
// disturbance gains more than it pays, the maximum over w is infinite and the solver says so.

#include <cstdio>
#include <ipminmax/core/solver.hpp>

#include "command_line.hpp"
#include "report.hpp"
#include "riccati.hpp"

namespace {

int run(int argc, char** argv) {
  int horizon = 20;
  double factor = 1.2;
  CommandLine command_line("h_infinity: control of an oscillator in the worst weather");
  command_line.add("--horizon", horizon, "stages (20)");
  command_line.add("--factor", factor, "gamma over its critical value (1.2)");
  if (!command_line.parse(argc, argv)) return 0;
  if (horizon < 1) throw std::invalid_argument("--horizon must be positive");
  if (!(factor > 0.0)) throw std::invalid_argument("--factor must be positive");

  shared_dynamics::System system = shared_dynamics::oscillator(horizon, false);
  const double critical = shared_dynamics::critical_gamma(system);
  system.gamma = factor * critical;
  std::printf("gamma        %.10g, critical %.10g\n", system.gamma, critical);
  shared_dynamics::Game game(system);
  const ipminmax::Result result = ipminmax::solve(game, {});
  const int exit_status = report(result);
  if (factor > 1.0 && !result.v.empty()) {
    const auto known = shared_dynamics::riccati(system);
    std::printf("Riccati      %.10g, first control %.8f (here %.8f)\n", known.value, known.u0[0],
                result.v[static_cast<std::size_t>(game.u(0, 0))]);
  }
  return exit_status;
}

}  // namespace

int main(int argc, char** argv) {
  return guarded("h_infinity", [&] { return run(argc, argv); });
}
