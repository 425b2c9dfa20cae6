#include <cmath>
#include <numbers>

#include <regression/hock_schittkowski_groups.hpp>

namespace ipminmax::testing {
namespace {

constexpr double kInf = kNoBound;

MinimizationProblem hs201() {
  Draft p("hs201", 0.0, {8.0, 9.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(4.0 * square(x1 - 5.0) + square(x2 - 6.0));
  return p;
}

MinimizationProblem hs202() {
  Draft p("hs202", 0.0, {15.0, -2.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(square(-13.0 + x1 - 2.0 * x2 + 5.0 * square(x2) - cube(x2)) +
             square(-29.0 + x1 - 14.0 * x2 + square(x2) + cube(x2)));
  return p.several_minima();
}

MinimizationProblem hs203_or_205(const char* name, std::vector<double> start) {
  Draft p(name, 0.0, std::move(start));
  const auto [x1, x2] = p.variables<2>();
  p.minimize(square(1.5 - x1 * (1.0 - x2)) + square(2.25 - x1 * (1.0 - square(x2))) +
             square(2.625 - x1 * (1.0 - cube(x2))));
  return p;
}

MinimizationProblem hs203() { return hs203_or_205("hs203", {2.0, 0.2}); }
MinimizationProblem hs205() { return hs203_or_205("hs205", {0.0, 0.0}); }

/// weight (x2 - x1^power)^2 + weight1 (1 - x1)^2
MinimizationProblem valley(const char* name, double weight, double power, double weight1) {
  Draft p(name, 0.0, {-1.2, 1.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(weight * square(x2 - pow(x1, power)) + weight1 * square(1.0 - x1));
  return p;
}

MinimizationProblem hs206() { return valley("hs206", 1.0, 2.0, 100.0); }
MinimizationProblem hs207() { return valley("hs207", 1.0, 2.0, 1.0); }
MinimizationProblem hs208() { return valley("hs208", 100.0, 2.0, 1.0); }
MinimizationProblem hs209() { return valley("hs209", 1e4, 2.0, 1.0); }
MinimizationProblem hs210() { return valley("hs210", 1e6, 2.0, 1.0); }
MinimizationProblem hs211() { return valley("hs211", 100.0, 3.0, 1.0); }

MinimizationProblem hs212() {
  Draft p("hs212", 0.0, {2.0, 0.0});
  const auto [x1, x2] = p.variables<2>();
  const Expression a = 4.0 * (x1 + x2);
  p.minimize(square(a) + square(a + (x1 - x2) * (square(x1 - 2.0) + square(x2) - 1.0)));
  return p;
}

// The eighth power leaves no curvature at the solution.
MinimizationProblem hs213() {
  Draft p("hs213", 0.0, {3.0, 1.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(pow(10.0 * square(x1 - x2) + square(x1 - 1.0), 4.0));
  return p.degenerate();
}

// Feasible only to one side; the bound and the curve touch at the solution.
MinimizationProblem hs215() {
  Draft p("hs215", 0.0, {1.0, 1.0});
  const auto [x1, x2] = p.variables<2>({0.0, -kInf}, {kInf, kInf});
  p.minimize(x2);
  p.at_least(x2 - square(x1), 0.0);
  return p.degenerate();
}

MinimizationProblem hs216() {
  Draft p("hs216", 0.99937523, {-1.2, 1.0});
  const auto [x1, x2] = p.variables<2>(-3.0, 10.0);
  p.minimize(100.0 * square(square(x1) - x2) + square(x1 - 1.0));
  p.equal(x1 * (x1 - 4.0) - 2.0 * x2, -12.0);
  return p;
}

MinimizationProblem hs217() {
  Draft p("hs217", -0.8, {10.0, 10.0});
  const auto [x1, x2] = p.variables<2>({0.0, -kInf}, {kInf, kInf});
  p.minimize(-x2);
  p.at_least(1.0 + x1 - 2.0 * x2, 0.0);
  p.equal(square(x1) + square(x2), 1.0);
  return p;
}

MinimizationProblem hs218() {
  Draft p("hs218", 0.0, {9.0, 100.0});
  const auto [x1, x2] = p.variables<2>({-kInf, 0.0}, {kInf, kInf});
  p.minimize(x2);
  p.at_least(x2 - square(x1), 0.0);
  return p.degenerate();
}

MinimizationProblem hs219() {
  Draft p("hs219", -1.0, {10.0, 10.0, 10.0, 10.0});
  const auto [x1, x2, x3, x4] = p.variables<4>();
  p.minimize(-x1);
  p.equal(x2 - cube(x1) - square(x3), 0.0);
  p.equal(square(x1) - x2 - square(x4), 0.0);
  return p;
}

// The gradient of the equation vanishes in x1 at the solution.
MinimizationProblem hs220() {
  Draft p("hs220", 1.0, {25000.0, 25000.0});
  const auto [x1, x2] = p.variables<2>({1.0, 0.0}, {kInf, kInf});
  p.minimize(x1);
  p.equal(cube(x1 - 1.0) - x2, 0.0);
  return p.degenerate();
}

// A cusp without multipliers, as in 13.
MinimizationProblem hs221() {
  Draft p("hs221", -1.0, {0.25, 0.25});
  const auto [x1, x2] = p.variables<2>(0.0, 1.0);
  p.minimize(-x1);
  p.at_least(-cube(x1 - 1.0) - x2, 0.0);
  return p.degenerate();
}

MinimizationProblem hs222() {
  Draft p("hs222", -1.5, {1.3, 0.2});
  const auto [x1, x2] = p.variables<2>(0.0);
  p.minimize(-x1);
  p.at_least(0.125 - cube(x1 - 1.0) - x2, 0.0);
  return p;
}

MinimizationProblem hs223() {
  Draft p("hs223", -std::log(std::log(10.0)), {0.1, 3.3});
  const auto [x1, x2] = p.variables<2>({0.0, 0.0}, {1.0, 10.0});
  p.minimize(-x1);
  p.at_least(exp(exp(x1)), 0.0);
  p.at_least(x2 - exp(exp(x1)), 0.0);
  return p;
}

MinimizationProblem hs224() {
  Draft p("hs224", -304.0, {0.1, 0.1});
  const auto [x1, x2] = p.variables<2>(0.0, 6.0);
  p.minimize(2.0 * square(x1) + square(x2) - 48.0 * x1 - 40.0 * x2);
  p.range(0.0, x1 + 3.0 * x2, 18.0);
  p.range(0.0, x1 + x2, 8.0);
  return p;
}

MinimizationProblem hs225() {
  Draft p("hs225", 2.0, {3.0, 1.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(square(x1) + square(x2));
  p.at_least(x1 + x2, 1.0);
  p.at_least(square(x1) + square(x2), 1.0);
  p.at_least(9.0 * square(x1) + square(x2), 9.0);
  p.at_least(square(x1) - x2, 0.0);
  p.at_least(square(x2) - x1, 0.0);
  return p;
}

MinimizationProblem hs226() {
  Draft p("hs226", -0.5, {0.8, 0.05});
  const auto [x1, x2] = p.variables<2>(0.0);
  p.minimize(-x1 * x2);
  p.range(0.0, square(x1) + square(x2), 1.0);
  return p;
}

MinimizationProblem hs227() {
  Draft p("hs227", 1.0, {0.5, 0.5});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(square(x1 - 2.0) + square(x2 - 1.0));
  p.at_least(-square(x1) + x2, 0.0);
  p.at_least(x1 - square(x2), 0.0);
  return p;
}

MinimizationProblem hs228() {
  Draft p("hs228", -3.0, {0.0, 0.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(square(x1) + x2);
  p.at_most(x1 + x2, 1.0);
  p.at_most(square(x1) + square(x2), 9.0);
  return p;
}

MinimizationProblem hs229() {
  Draft p("hs229", 0.0, {-1.2, 1.0});
  const auto [x1, x2] = p.variables<2>(-2.0, 2.0);
  p.minimize(rosenbrock(x1, x2));
  return p;
}

MinimizationProblem hs230() {
  Draft p("hs230", 0.375, {0.0, 0.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(x2);
  p.at_least(-2.0 * square(x1) + cube(x1) + x2, 0.0);
  p.at_least(-2.0 * square(1.0 - x1) + cube(1.0 - x1) + x2, 0.0);
  return p;
}

MinimizationProblem hs231() {
  Draft p("hs231", 0.0, {-1.2, 1.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(rosenbrock(x1, x2));
  p.at_least(x1 / 3.0 + x2, -0.1);
  p.at_least(-x1 / 3.0 + x2, -0.1);
  return p;
}

MinimizationProblem hs232() {
  const double s = std::numbers::sqrt3;
  Draft p("hs232", -1.0, {2.0, 0.5});
  const auto [x1, x2] = p.variables<2>(0.0);
  p.minimize(-(9.0 - square(x1 - 3.0)) * cube(x2) / (27.0 * s));
  p.at_least(x1 / s - x2, 0.0);
  p.range(0.0, x1 + s * x2, 6.0);
  return p.several_minima();
}

MinimizationProblem hs233() {
  Draft p("hs233", 0.0, {1.2, 1.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(rosenbrock(x1, x2));
  p.at_least(square(x1) + square(x2), 0.25);
  return p;
}

MinimizationProblem hs234() {
  Draft p("hs234", -0.8, {1.0, 1.0});
  const auto [x1, x2] = p.variables<2>(0.2, 2.0);
  p.minimize(pow(x2 - x1, 4.0) - (1.0 - x1));
  p.at_most(square(x1) + square(x2), 1.0);
  return p.degenerate();
}

MinimizationProblem hs235() {
  Draft p("hs235", 0.04, {-2.0, 3.0, 1.0});
  const auto [x1, x2, x3] = p.variables<3>();
  p.minimize(0.01 * square(x1 - 1.0) + square(x2 - square(x1)));
  p.equal(x1 + square(x3), -1.0);
  return p;
}

MinimizationProblem hs240() {
  Draft p("hs240", 0.0, {100.0, -1.0, 2.5});
  const auto [x1, x2, x3] = p.variables<3>();
  p.minimize(square(x1 - x2 + x3) + square(-x1 + x2 + x3) + square(x1 + x2 - x3));
  return p;
}

MinimizationProblem hs248() {
  Draft p("hs248", -0.8, {-0.1, -1.0, 0.1});
  const auto [x1, x2, x3] = p.variables<3>();
  p.minimize(-x2);
  p.at_least(1.0 - 2.0 * x2 + x1, 0.0);
  p.equal(square(x1) + square(x2) + square(x3), 1.0);
  return p.degenerate();
}

MinimizationProblem hs249() {
  Draft p("hs249", 1.0, {1.0, 1.0, 1.0});
  const auto [x1, x2, x3] = p.variables<3>({1.0, -kInf, -kInf}, {kInf, kInf, kInf});
  p.minimize(square(x1) + square(x2) + square(x3));
  p.at_least(square(x1) + square(x2), 1.0);
  return p.degenerate();
}

MinimizationProblem hs250() {
  Draft p("hs250", -3300.0, {10.0, 10.0, 10.0});
  const auto [x1, x2, x3] = p.variables<3>({0.0, 0.0, 0.0}, {20.0, 11.0, 42.0});
  p.minimize(-x1 * x2 * x3);
  p.range(0.0, x1 + 2.0 * x2 + 2.0 * x3, 72.0);
  return p;
}

MinimizationProblem hs254() {
  Draft p("hs254", -std::numbers::sqrt3, {1.0, 1.0, 1.0});
  const auto [x1, x2, x3] = p.variables<3>({-kInf, -kInf, 1.0}, {kInf, kInf, kInf});
  p.minimize(log(x3) / std::numbers::ln10 - x2);
  p.equal(square(x2) + square(x3), 4.0);
  p.equal(x3 - square(x1), 1.0);
  return p.degenerate();
}

// Powell's singular function: a singular Hessian at the solution.
MinimizationProblem hs256() {
  Draft p("hs256", 0.0, {3.0, -1.0, 0.0, 1.0});
  const auto [x1, x2, x3, x4] = p.variables<4>();
  p.minimize(square(x1 + 10.0 * x2) + 5.0 * square(x3 - x4) + pow(x2 - 2.0 * x3, 4.0) +
             10.0 * pow(x1 - x4, 4.0));
  return p.degenerate();
}

MinimizationProblem hs258() {
  Draft p("hs258", 0.0, {-3.0, -1.0, -3.0, -1.0});
  const auto [x1, x2, x3, x4] = p.variables<4>();
  p.minimize(rosenbrock(x1, x2) + 90.0 * square(x4 - square(x3)) + square(1.0 - x3) +
             10.1 * (square(x2 - 1.0) + square(x4 - 1.0)) + 19.8 * (x2 - 1.0) * (x4 - 1.0));
  return p;
}

// 39 with two more inequalities that the equations imply: no strict complementarity.
MinimizationProblem hs263() {
  Draft p("hs263", -1.0, {10.0, 10.0, 10.0, 10.0});
  const auto [x1, x2, x3, x4] = p.variables<4>();
  p.minimize(-x1);
  p.at_least(x2 - cube(x1), 0.0);
  p.at_least(square(x1) - x2, 0.0);
  p.equal(x2 - cube(x1) - square(x3), 0.0);
  p.equal(square(x1) - x2 - square(x4), 0.0);
  return p.degenerate();
}

MinimizationProblem hs264() {
  Draft p("hs264", -44.0, {0.0, 0.0, 0.0, 0.0});
  const auto [x1, x2, x3, x4] = p.variables<4>();
  p.minimize(square(x1) + square(x2) + 2.0 * square(x3) + square(x4) - 5.0 * x1 - 5.0 * x2 -
             21.0 * x3 + 7.0 * x4);
  p.at_most(square(x1) + square(x2) + square(x3) + square(x4) + x1 - x2 + x3 - x4, 8.0);
  p.at_most(square(x1) + 2.0 * square(x2) + square(x3) + 2.0 * square(x4) - x1 - x4, 9.0);
  p.at_most(2.0 * square(x1) + square(x2) + square(x3) + 2.0 * x1 - x2 - x4, 5.0);
  return p;
}

MinimizationProblem hs269() {
  Draft p("hs269", 176.0 / 43.0, {2.0, 2.0, 2.0, 2.0, 2.0});
  const auto [x1, x2, x3, x4, x5] = p.variables<5>();
  p.minimize(square(x1 - x2) + square(x2 + x3 - 2.0) + square(x4 - 1.0) + square(x5 - 1.0));
  p.equal(x1 + 3.0 * x2, 0.0);
  p.equal(x3 + x4 - 2.0 * x5, 0.0);
  p.equal(x2 - x5, 0.0);
  return p;
}

/// x' H x for the ill-conditioned Hilbert matrix H.
MinimizationProblem hilbert(const char* name, std::size_t n) {
  std::vector<double> start;
  for (std::size_t i = 1; i <= n; ++i) start.push_back(-4.0 / static_cast<double>(i));
  MinimizationProblem p{.name = name, .start = start, .degenerate = true};
  std::vector<Expression> x;
  for (std::size_t i = 1; i <= n; ++i) {
    x.push_back(p.model.variable(Player::Min, "x" + std::to_string(i)));
  }
  Expression f;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) f += x[i] * x[j] / static_cast<double>(i + j + 1);
  }
  p.model.objective(f);
  return p;
}

MinimizationProblem hs274() { return hilbert("hs274", 2); }
MinimizationProblem hs275() { return hilbert("hs275", 4); }
MinimizationProblem hs276() { return hilbert("hs276", 6); }

MinimizationProblem hs325() {
  Draft p("hs325", 3.7913414, {-3.0, 0.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(square(x1) + x2);
  p.at_most(x1 + x2, 1.0);
  p.at_most(x1 + square(x2), 1.0);
  p.equal(square(x1) + square(x2), 9.0);
  return p;
}

}  // namespace

std::vector<MinimizationProblem> schittkowski_from_201() {
  return {hs201(), hs202(), hs203(), hs205(), hs206(), hs207(), hs208(), hs209(), hs210(), hs211(),
          hs212(), hs213(), hs215(), hs216(), hs217(), hs218(), hs219(), hs220(), hs221(), hs222(),
          hs223(), hs224(), hs225(), hs226(), hs227(), hs228(), hs229(), hs230(), hs231(), hs232(),
          hs233(), hs234(), hs235(), hs240(), hs248(), hs249(), hs250(), hs254(), hs256(), hs258(),
          hs263(), hs264(), hs269(), hs274(), hs275(), hs276(), hs325()};
}

}  // namespace ipminmax::testing
