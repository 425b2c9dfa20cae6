// A line through points whose regressors an adversary may falsify, each within a ball of radius
// rho.

#include "robust_regression.hpp"

#include <cstdio>
#include <ipminmax/core/multistart.hpp>

#include "command_line.hpp"
#include "report.hpp"

namespace {

int run(int argc, char** argv) {
  double rho = 0.2;
  ipminmax::SolverOptions options;
  CommandLine command_line("robust_regression: least squares against falsified data");
  command_line.add("--rho", rho, "radius of the ball (0.2)");
  command_line.add("--starts", options.minmax_starts, "starting points (1)");
  if (!command_line.parse(argc, argv)) return 0;

  Eigen::MatrixXd data(6, 2);
  data << 1.0, 0.0, 1.0, 1.0, 1.0, 2.0, 1.0, 3.0, 1.0, 4.0, 1.0, 5.0;
  const Eigen::VectorXd target = (Eigen::VectorXd(6) << 2.0, 0.5, 4.5, 2.0, 6.8, 4.2).finished();
  RobustRegression problem(data, target, rho);
  const ipminmax::MultistartResult found = ipminmax::multistart(problem, options);
  const int exit_status = report(found.best);
  // Local maxima over e below the global one give local minmax values below phi(x).
  for (const ipminmax::DistinctPoint& point : found.points) {
    const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(point.result.v.data(), 2);
    std::printf("x = (%.6f, %.6f)  local minmax value %.8f, worst case of x %.8f, found %d times\n",
                x[0], x[1], point.result.objective, problem.worst_case(x), point.found);
  }
  return exit_status;
}

}  // namespace

int main(int argc, char** argv) {
  return guarded("robust_regression", [&] { return run(argc, argv); });
}
