// A tubular column under a compressive load, the cheapest that neither yields nor buckles although
// load, stiffness and both dimensions are uncertain:
//
//   min over (d, t)   9.82 d t + 2 d                          d mean diameter, t thickness, in cm
//   subject to        P / (pi d t) <= sigma                   no yielding
//                     P <= pi^3 E d t (d^2 + t^2) / (8 L^2)   no buckling
//   for every         P = 2500 (1 + 0.1 y_0) kgf,  E = 0.85e6 (1 + 0.1 y_1) kgf/cm^2,
//                     d + 0.1 y_2 and t + 0.01 y_3 instead of d and t,   |y| <= rho
//
// Each constraint has a worst y of its own. (The nominal problem, rho = 0, is Rao's.) Both are
// written as logarithms of quotients, g <= 0.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ipminmax/core/robust.hpp>
#include <numbers>
#include <random>
#include <span>
#include <stdexcept>
#include <utility>

#include "command_line.hpp"
#include "report.hpp"

namespace {

using ipminmax::Index;
using ipminmax::Player;

constexpr double kLoad = 2500.0, kStrength = 500.0, kStiffness = 0.85e6, kLength = 250.0;
constexpr double kLoadShare = 0.1, kStiffnessShare = 0.1, kDiameterError = 0.1,
                 kThicknessError = 0.01;

/// Variables d, t of Min and y_0, ..., y_3 of Max; constraints yielding, buckling (both Min's:
/// robust) and |y|^2 <= rho^2 (Max's).
class Column final : public ipminmax::Problem {
 public:
  /// rho 0: the nominal problem, y fixed.
  explicit Column(double rho) {
    s_.variable_players = {Player::Min, Player::Min, Player::Max,
                           Player::Max, Player::Max, Player::Max};
    s_.variable_lower = {2.0, 0.2, -rho, -rho, -rho, -rho};
    s_.variable_upper = {14.0, 0.8, rho, rho, rho, rho};
    s_.constraint_players = {Player::Min, Player::Min, Player::Max};
    s_.constraint_lower = {-2e19, -2e19, -2e19};
    s_.constraint_upper = {0.0, 0.0, rho > 0.0 ? rho * rho : 2e19};
    s_.jacobian = {{0, 0}, {0, 1}, {0, 2}, {0, 4}, {0, 5}, {1, 0}, {1, 1}, {1, 2},
                   {1, 3}, {1, 4}, {1, 5}, {2, 2}, {2, 3}, {2, 4}, {2, 5}};
    s_.hessian = {{0, 0}, {1, 0}, {1, 1}, {4, 0}, {4, 1}, {5, 0},
                  {5, 1}, {4, 4}, {5, 4}, {5, 5}, {2, 2}, {3, 3}};
  }

  const ipminmax::ProblemStructure& structure() const override { return s_; }
  bool starting_point(ipminmax::StartingPoint& start) override {
    constexpr std::array<double, 6> kStart = {8.0, 0.5, 0.0, 0.0, 0.0, 0.0};
    std::copy(kStart.begin(), kStart.end(), start.v.begin());
    return true;
  }
  bool objective(std::span<const double> v, bool, double& f) override {
    f = 9.82 * v[0] * v[1] + 2.0 * v[0];
    return true;
  }
  bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    std::fill(grad.begin(), grad.end(), 0.0);
    grad[0] = 9.82 * v[1] + 2.0;
    grad[1] = 9.82 * v[0];
    return true;
  }
  bool constraints(std::span<const double> v, bool, std::span<double> g) override {
    const Real r(v);
    if (!(r.load > 0.0 && r.stiffness > 0.0 && r.d > 0.0 && r.t > 0.0)) return false;
    constexpr double kPi = std::numbers::pi;
    g[0] = std::log(r.load / (kPi * r.d * r.t * kStrength));
    g[1] = std::log(8.0 * kLength * kLength * r.load /
                    (kPi * kPi * kPi * r.stiffness * r.d * r.t * (r.d * r.d + r.t * r.t)));
    g[2] = v[2] * v[2] + v[3] * v[3] + v[4] * v[4] + v[5] * v[5];
    return true;
  }
  bool jacobian(std::span<const double> v, bool, std::span<double> values) override {
    const Real r(v);
    const double size = r.d * r.d + r.t * r.t, load = kLoad * kLoadShare / r.load;
    const double yield_d = -1.0 / r.d, yield_t = -1.0 / r.t;
    const double buckle_d = yield_d - 2.0 * r.d / size, buckle_t = yield_t - 2.0 * r.t / size;
    const std::array<double, 15> entries = {yield_d,
                                            yield_t,
                                            load,
                                            kDiameterError * yield_d,
                                            kThicknessError * yield_t,
                                            buckle_d,
                                            buckle_t,
                                            load,
                                            -kStiffness * kStiffnessShare / r.stiffness,
                                            kDiameterError * buckle_d,
                                            kThicknessError * buckle_t,
                                            2.0 * v[2],
                                            2.0 * v[3],
                                            2.0 * v[4],
                                            2.0 * v[5]};
    std::copy(entries.begin(), entries.end(), values.begin());
    return true;
  }
  bool hessian(std::span<const double> v, bool, double sigma, std::span<const double> lambda, bool,
               std::span<double> values) override {
    const Real r(v);
    const double size = r.d * r.d + r.t * r.t, both = lambda[0] + lambda[1];
    // Second derivatives in the real d and t of -ln d - ln t and -ln(d^2 + t^2).
    const double across = 2.0 * (r.d * r.d - r.t * r.t) / (size * size);
    const double dd = both / (r.d * r.d) + lambda[1] * across;
    const double tt = both / (r.t * r.t) - lambda[1] * across;
    const double dt = lambda[1] * 4.0 * r.d * r.t / (size * size);
    const double load = kLoad * kLoadShare / r.load;
    const double stiffness = kStiffness * kStiffnessShare / r.stiffness;
    const double a = kDiameterError, b = kThicknessError, ball = 2.0 * lambda[2];
    const std::array<double, 12> entries = {dd,
                                            dt + 9.82 * sigma,
                                            tt,
                                            a * dd,
                                            a * dt,
                                            b * dt,
                                            b * tt,
                                            a * a * dd + ball,
                                            a * b * dt,
                                            b * b * tt + ball,
                                            -both * load * load + ball,
                                            lambda[1] * stiffness * stiffness + ball};
    std::copy(entries.begin(), entries.end(), values.begin());
    return true;
  }

 private:
  /// What is built and how it is loaded.
  struct Real {
    explicit Real(std::span<const double> v)
        : load(kLoad * (1.0 + kLoadShare * v[2])),
          stiffness(kStiffness * (1.0 + kStiffnessShare * v[3])),
          d(v[0] + kDiameterError * v[4]),
          t(v[1] + kThicknessError * v[5]) {}
    double load, stiffness, d, t;
  };
  ipminmax::ProblemStructure s_;
};

/// Share of random y in the ball for which a design yields or buckles.
double share_of_failures(Column& column, double d, double t, double rho) {
  constexpr int kDraws = 20000;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-rho, rho);
  std::array<double, 3> g{};
  int drawn = 0, failures = 0;
  while (drawn < kDraws) {
    const std::array<double, 6> v = {
        d, t, uniform(random), uniform(random), uniform(random), uniform(random)};
    if (!column.constraints(v, true, g)) continue;
    if (g[2] > rho * rho) continue;
    ++drawn;
    if (std::max(g[0], g[1]) > 1e-8) ++failures;
  }
  return static_cast<double>(failures) / kDraws;
}

int run(int argc, char** argv) {
  double rho = 1.0;
  ipminmax::SolverOptions options;
  options.minmax_worst_case_starts = 10;
  CommandLine command_line("robust_design: a column that holds for every load and error");
  command_line.add("--rho", rho, "radius of the uncertainty (1)");
  if (!command_line.parse(argc, argv)) return 0;
  if (!(rho > 0.0 && rho < 5.0)) throw std::invalid_argument("--rho between 0 and 5");

  Column nominal(0.0), column(rho);
  const ipminmax::Result without = ipminmax::solve(nominal, options);
  const ipminmax::RobustResult answer = ipminmax::solve_robust(column, options);
  const int exit_status = report(answer.result);
  for (const auto& [name, v] :
       {std::pair("nominal", &without.v), std::pair("robust", &answer.result.v)})
    std::printf("%-12s d = %.4f, t = %.4f, cost %.4f, fails for %.2f %% of y\n", name, (*v)[0],
                (*v)[1], 9.82 * (*v)[0] * (*v)[1] + 2.0 * (*v)[0],
                100.0 * share_of_failures(column, (*v)[0], (*v)[1], rho));
  std::printf("\n%-12s %10s %10s %10s %10s %14s\n", "worst y of", "load", "stiffness", "diameter",
              "thickness", "multiplier");
  for (const ipminmax::RobustWorstCase& found : answer.worst_cases)
    std::printf("%-12s %10.5f %10.5f %10.5f %10.5f %14.6f\n",
                found.constraint == 0 ? "yielding" : "buckling", found.v[2], found.v[3], found.v[4],
                found.v[5], found.multiplier);
  return exit_status;
}

}  // namespace

int main(int argc, char** argv) {
  return guarded("robust_design", [&] { return run(argc, argv); });
}
