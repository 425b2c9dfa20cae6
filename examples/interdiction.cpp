// A defender pays to shrink the set an attacker chooses from: Y(x) depends on x.

#include "interdiction.hpp"

#include <cstdio>
#include <ipminmax/core/solver.hpp>

#include "command_line.hpp"
#include "report.hpp"

namespace {

int run(int argc, char** argv) {
  double price = 1.0, capacity = 2.0, d0 = 1.0, d1 = 1.0;
  CommandLine command_line("interdiction: min over x, max over |y| <= c - x, of w x^2/2 + d'y");
  command_line.add("--price", price, "w (1)");
  command_line.add("--capacity", capacity, "c (2)");
  command_line.add("--d0", d0, "damage per unit of y0 (1)");
  command_line.add("--d1", d1, "damage per unit of y1 (1)");
  if (!command_line.parse(argc, argv)) return 0;
  if (!(price > 0.0 && capacity > 0.0))
    throw std::invalid_argument("--price and --capacity must be positive");

  Interdiction problem(price, capacity, {d0, d1});
  const ipminmax::Result result = ipminmax::solve(problem, {});
  const int exit_status = report(result);
  if (!result.v.empty())
    std::printf("x = %.8f, y = (%.8f, %.8f)\n", result.v[0], result.v[1], result.v[2]);
  std::printf("formula      x = %.8f, value %.10g\n", problem.best_x(), problem.best_value());
  return exit_status;
}

}  // namespace

int main(int argc, char** argv) {
  return guarded("interdiction", [&] { return run(argc, argv); });
}
