#include <cmath>
#include <numbers>

#include <regression/hock_schittkowski_groups.hpp>

namespace ipminmax::testing {
namespace {

constexpr double kInf = kNoBound;

MinimizationProblem hs001() {
  Draft p("hs001", 0.0, {-2.0, 1.0});
  const auto [x1, x2] = p.variables<2>({-kInf, -1.5}, {kInf, kInf});
  p.minimize(rosenbrock(x1, x2));
  return p;
}

MinimizationProblem hs002() {
  Draft p("hs002", 0.0504261879, {-2.0, 1.0});
  const auto [x1, x2] = p.variables<2>({-kInf, 1.5}, {kInf, kInf});
  p.minimize(rosenbrock(x1, x2));
  return p.several_minima();
}

MinimizationProblem hs003() {
  Draft p("hs003", 0.0, {10.0, 1.0});
  const auto [x1, x2] = p.variables<2>({-kInf, 0.0}, {kInf, kInf});
  p.minimize(x2 + 1e-5 * square(x2 - x1));
  return p;
}

MinimizationProblem hs004() {
  Draft p("hs004", 8.0 / 3.0, {1.125, 0.125});
  const auto [x1, x2] = p.variables<2>({1.0, 0.0}, {kInf, kInf});
  p.minimize(cube(x1 + 1.0) / 3.0 + x2);
  return p;
}

MinimizationProblem hs005() {
  Draft p("hs005", -std::numbers::sqrt3 / 2.0 - std::numbers::pi / 3.0, {0.0, 0.0});
  const auto [x1, x2] = p.variables<2>({-1.5, -3.0}, {4.0, 3.0});
  p.minimize(sin(x1 + x2) + square(x1 - x2) - 1.5 * x1 + 2.5 * x2 + 1.0);
  return p.several_minima();
}

MinimizationProblem hs006() {
  Draft p("hs006", 0.0, {-1.2, 1.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(square(1.0 - x1));
  p.equal(10.0 * (x2 - square(x1)), 0.0);
  return p;
}

MinimizationProblem hs007() {
  Draft p("hs007", -std::numbers::sqrt3, {2.0, 2.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(log(1.0 + square(x1)) - x2);
  p.equal(square(1.0 + square(x1)) + square(x2), 4.0);
  return p;
}

// A system of equations: no objective to speak of.
MinimizationProblem hs008() {
  Draft p("hs008", -1.0, {2.0, 1.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(-1.0);
  p.equal(square(x1) + square(x2), 25.0);
  p.equal(x1 * x2, 9.0);
  return p;
}

MinimizationProblem hs009() {
  Draft p("hs009", -0.5, {0.0, 0.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(sin(std::numbers::pi / 12.0 * x1) * cos(std::numbers::pi / 16.0 * x2));
  p.equal(4.0 * x1 - 3.0 * x2, 0.0);
  return p;
}

MinimizationProblem hs010() {
  Draft p("hs010", -1.0, {-10.0, 10.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(x1 - x2);
  p.at_least(-3.0 * square(x1) + 2.0 * x1 * x2 - square(x2), -1.0);
  return p;
}

MinimizationProblem hs011() {
  Draft p("hs011", -8.498464223, {4.9, 0.1});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(square(x1 - 5.0) + square(x2) - 25.0);
  p.at_least(-square(x1) + x2, 0.0);
  return p;
}

MinimizationProblem hs012() {
  Draft p("hs012", -30.0, {0.0, 0.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(0.5 * square(x1) + square(x2) - x1 * x2 - 7.0 * x1 - 7.0 * x2);
  p.at_most(4.0 * square(x1) + square(x2), 25.0);
  return p;
}

// The solution (1, 0) is a cusp without multipliers.
MinimizationProblem hs013() {
  Draft p("hs013", 1.0, {-2.0, -2.0});
  const auto [x1, x2] = p.variables<2>(0.0);
  p.minimize(square(x1 - 2.0) + square(x2));
  p.at_least(cube(1.0 - x1) - x2, 0.0);
  return p.degenerate();
}

MinimizationProblem hs014() {
  Draft p("hs014", 9.0 - 2.875 * std::sqrt(7.0), {2.0, 2.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(square(x1 - 2.0) + square(x2 - 1.0));
  p.at_least(-0.25 * square(x1) - square(x2), -1.0);
  p.equal(x1 - 2.0 * x2, -1.0);
  return p;
}

MinimizationProblem hs015() {
  Draft p("hs015", 306.5, {-2.0, 1.0});
  const auto [x1, x2] = p.variables<2>({-kInf, -kInf}, {0.5, kInf});
  p.minimize(rosenbrock(x1, x2));
  p.at_least(x1 * x2, 1.0);
  p.at_least(x1 + square(x2), 0.0);
  return p.several_minima();
}

MinimizationProblem hs016() {
  Draft p("hs016", 0.25, {-2.0, 1.0});
  const auto [x1, x2] = p.variables<2>({-0.5, -kInf}, {0.5, 1.0});
  p.minimize(rosenbrock(x1, x2));
  p.at_least(x1 + square(x2), 0.0);
  p.at_least(square(x1) + x2, 0.0);
  return p.several_minima();
}

MinimizationProblem hs017() {
  Draft p("hs017", 1.0, {-2.0, 1.0});
  const auto [x1, x2] = p.variables<2>({-0.5, -kInf}, {0.5, 1.0});
  p.minimize(rosenbrock(x1, x2));
  p.at_least(square(x2) - x1, 0.0);
  p.at_least(square(x1) - x2, 0.0);
  return p.degenerate();
}

MinimizationProblem hs018() {
  Draft p("hs018", 5.0, {2.0, 2.0});
  const auto [x1, x2] = p.variables<2>({2.0, 0.0}, {50.0, 50.0});
  p.minimize(0.01 * square(x1) + square(x2));
  p.at_least(x1 * x2, 25.0);
  p.at_least(square(x1) + square(x2), 25.0);
  return p;
}

MinimizationProblem hs019() {
  Draft p("hs019", -6961.81381, {20.1, 5.84});
  const auto [x1, x2] = p.variables<2>({13.0, 0.0}, {100.0, 100.0});
  p.minimize(cube(x1 - 10.0) + cube(x2 - 20.0));
  p.at_least(square(x1 - 5.0) + square(x2 - 5.0), 100.0);
  p.at_least(-square(x2 - 5.0) - square(x1 - 6.0), -82.81);
  return p;
}

MinimizationProblem hs020() {
  Draft p("hs020", 81.5 - 25.0 * std::numbers::sqrt3, {-2.0, 1.0});
  const auto [x1, x2] = p.variables<2>({-0.5, -kInf}, {0.5, kInf});
  p.minimize(rosenbrock(x1, x2));
  p.at_least(x1 + square(x2), 0.0);
  p.at_least(square(x1) + x2, 0.0);
  p.at_least(square(x1) + square(x2), 1.0);
  return p.several_minima();
}

MinimizationProblem hs021() {
  Draft p("hs021", -99.96, {-1.0, -1.0});
  const auto [x1, x2] = p.variables<2>({2.0, -50.0}, {50.0, 50.0});
  p.minimize(0.01 * square(x1) + square(x2) - 100.0);
  p.at_least(10.0 * x1 - x2, 10.0);
  return p;
}

MinimizationProblem hs022() {
  Draft p("hs022", 1.0, {2.0, 2.0});
  const auto [x1, x2] = p.variables<2>();
  p.minimize(square(x1 - 2.0) + square(x2 - 1.0));
  p.at_least(-x1 - x2, -2.0);
  p.at_least(-square(x1) + x2, 0.0);
  return p;
}

MinimizationProblem hs023() {
  Draft p("hs023", 2.0, {3.0, 1.0});
  const auto [x1, x2] = p.variables<2>(-50.0, 50.0);
  p.minimize(square(x1) + square(x2));
  p.at_least(x1 + x2, 1.0);
  p.at_least(square(x1) + square(x2), 1.0);
  p.at_least(9.0 * square(x1) + square(x2), 9.0);
  p.at_least(square(x1) - x2, 0.0);
  p.at_least(square(x2) - x1, 0.0);
  return p;
}

MinimizationProblem hs024() {
  const double s = std::numbers::sqrt3;
  Draft p("hs024", -1.0, {1.0, 0.5});
  const auto [x1, x2] = p.variables<2>(0.0);
  p.minimize((square(x1 - 3.0) - 9.0) * cube(x2) / (27.0 * s));
  p.at_least(x1 / s - x2, 0.0);
  p.at_least(x1 + s * x2, 0.0);
  p.at_least(-x1 - s * x2, -6.0);
  return p.several_minima();
}

MinimizationProblem hs025() {
  Draft p("hs025", 0.0, {100.0, 12.5, 3.0});
  const auto [x1, x2, x3] = p.variables<3>({0.1, 0.0, 0.0}, {100.0, 25.6, 5.0});
  Expression f;
  for (int i = 1; i <= 99; ++i) {
    const double u = 25.0 + std::pow(-50.0 * std::log(0.01 * i), 2.0 / 3.0);
    f += square(exp(-exp(x3 * log(u - x2)) / x1) - 0.01 * i);
  }
  p.minimize(f);
  return p.several_minima();
}

MinimizationProblem hs026() {
  Draft p("hs026", 0.0, {-2.6, 2.0, 2.0});
  const auto [x1, x2, x3] = p.variables<3>();
  p.minimize(square(x1 - x2) + pow(x2 - x3, 4.0));
  p.equal((1.0 + square(x2)) * x1 + pow(x3, 4.0), 3.0);
  return p.degenerate();
}

MinimizationProblem hs027() {
  Draft p("hs027", 0.04, {2.0, 2.0, 2.0});
  const auto [x1, x2, x3] = p.variables<3>();
  p.minimize(0.01 * square(x1 - 1.0) + square(x2 - square(x1)));
  p.equal(x1 + square(x3), -1.0);
  return p;
}

MinimizationProblem hs028() {
  Draft p("hs028", 0.0, {-4.0, 1.0, 1.0});
  const auto [x1, x2, x3] = p.variables<3>();
  p.minimize(square(x1 + x2) + square(x2 + x3));
  p.equal(x1 + 2.0 * x2 + 3.0 * x3, 1.0);
  return p;
}

MinimizationProblem hs029() {
  Draft p("hs029", -16.0 * std::numbers::sqrt2, {1.0, 1.0, 1.0});
  const auto [x1, x2, x3] = p.variables<3>();
  p.minimize(-x1 * x2 * x3);
  p.at_least(-square(x1) - 2.0 * square(x2) - 4.0 * square(x3), -48.0);
  return p;
}

MinimizationProblem hs030() {
  Draft p("hs030", 1.0, {1.0, 1.0, 1.0});
  const auto [x1, x2, x3] = p.variables<3>({1.0, -10.0, -10.0}, {10.0, 10.0, 10.0});
  p.minimize(square(x1) + square(x2) + square(x3));
  p.at_least(square(x1) + square(x2), 1.0);
  return p.degenerate();
}

MinimizationProblem hs031() {
  Draft p("hs031", 6.0, {1.0, 1.0, 1.0});
  const auto [x1, x2, x3] = p.variables<3>({-10.0, 1.0, -10.0}, {10.0, 10.0, 1.0});
  p.minimize(9.0 * square(x1) + square(x2) + 9.0 * square(x3));
  p.at_least(x1 * x2, 1.0);
  return p;
}

MinimizationProblem hs032() {
  Draft p("hs032", 1.0, {0.1, 0.7, 0.2});
  const auto [x1, x2, x3] = p.variables<3>(0.0);
  p.minimize(square(x1 + 3.0 * x2 + x3) + 4.0 * square(x1 - x2));
  p.at_least(6.0 * x2 + 4.0 * x3 - cube(x1), 3.0);
  p.equal(x1 + x2 + x3, 1.0);
  return p;
}

MinimizationProblem hs033() {
  Draft p("hs033", std::numbers::sqrt2 - 6.0, {0.0, 0.0, 3.0});
  const auto [x1, x2, x3] = p.variables<3>({0.0, 0.0, 0.0}, {kInf, kInf, 5.0});
  p.minimize((x1 - 1.0) * (x1 - 2.0) * (x1 - 3.0) + x3);
  p.at_least(square(x3) - square(x2) - square(x1), 0.0);
  p.at_least(square(x1) + square(x2) + square(x3), 4.0);
  return p.several_minima();
}

MinimizationProblem hs034() {
  Draft p("hs034", -std::log(std::log(10.0)), {0.0, 1.05, 2.9});
  const auto [x1, x2, x3] = p.variables<3>({0.0, 0.0, 0.0}, {100.0, 100.0, 10.0});
  p.minimize(-x1);
  p.at_least(x2 - exp(x1), 0.0);
  p.at_least(x3 - exp(x2), 0.0);
  return p;
}

MinimizationProblem hs035() {
  Draft p("hs035", 1.0 / 9.0, {0.5, 0.5, 0.5});
  const auto [x1, x2, x3] = p.variables<3>(0.0);
  p.minimize(9.0 - 8.0 * x1 - 6.0 * x2 - 4.0 * x3 + 2.0 * square(x1) + 2.0 * square(x2) +
             square(x3) + 2.0 * x1 * x2 + 2.0 * x1 * x3);
  p.at_least(-x1 - x2 - 2.0 * x3, -3.0);
  return p;
}

MinimizationProblem hs036() {
  Draft p("hs036", -3300.0, {10.0, 10.0, 10.0});
  const auto [x1, x2, x3] = p.variables<3>({0.0, 0.0, 0.0}, {20.0, 11.0, 42.0});
  p.minimize(-x1 * x2 * x3);
  p.at_least(-x1 - 2.0 * x2 - 2.0 * x3, -72.0);
  return p;
}

MinimizationProblem hs037() {
  Draft p("hs037", -3456.0, {10.0, 10.0, 10.0});
  const auto [x1, x2, x3] = p.variables<3>(0.0, 42.0);
  p.minimize(-x1 * x2 * x3);
  p.at_least(-x1 - 2.0 * x2 - 2.0 * x3, -72.0);
  p.at_least(x1 + 2.0 * x2 + 2.0 * x3, 0.0);
  return p;
}

MinimizationProblem hs038() {
  Draft p("hs038", 0.0, {-3.0, -1.0, -3.0, -1.0});
  const auto [x1, x2, x3, x4] = p.variables<4>(-10.0, 10.0);
  p.minimize(rosenbrock(x1, x2) + 90.0 * square(x4 - square(x3)) + square(1.0 - x3) +
             10.1 * (square(x2 - 1.0) + square(x4 - 1.0)) + 19.8 * (x2 - 1.0) * (x4 - 1.0));
  return p;
}

MinimizationProblem hs039() {
  Draft p("hs039", -1.0, {2.0, 2.0, 2.0, 2.0});
  const auto [x1, x2, x3, x4] = p.variables<4>();
  p.minimize(-x1);
  p.equal(x2 - cube(x1) - square(x3), 0.0);
  p.equal(square(x1) - x2 - square(x4), 0.0);
  return p;
}

MinimizationProblem hs040() {
  Draft p("hs040", -0.25, {0.8, 0.8, 0.8, 0.8});
  const auto [x1, x2, x3, x4] = p.variables<4>();
  p.minimize(-x1 * x2 * x3 * x4);
  p.equal(cube(x1) + square(x2), 1.0);
  p.equal(square(x1) * x4 - x3, 0.0);
  p.equal(square(x4) - x2, 0.0);
  return p;
}

MinimizationProblem hs041() {
  Draft p("hs041", 52.0 / 27.0, {2.0, 2.0, 2.0, 2.0});
  const auto [x1, x2, x3, x4] = p.variables<4>({0.0, 0.0, 0.0, 0.0}, {1.0, 1.0, 1.0, 2.0});
  p.minimize(2.0 - x1 * x2 * x3);
  p.equal(x1 + 2.0 * x2 + 2.0 * x3 - x4, 0.0);
  return p;
}

MinimizationProblem hs042() {
  Draft p("hs042", 28.0 - 10.0 * std::numbers::sqrt2, {1.0, 1.0, 1.0, 1.0});
  const auto [x1, x2, x3, x4] = p.variables<4>();
  p.minimize(square(x1 - 1.0) + square(x2 - 2.0) + square(x3 - 3.0) + square(x4 - 4.0));
  p.equal(x1, 2.0);
  p.equal(square(x3) + square(x4), 2.0);
  return p;
}

MinimizationProblem hs043() {
  Draft p("hs043", -44.0, {0.0, 0.0, 0.0, 0.0});
  const auto [x1, x2, x3, x4] = p.variables<4>();
  p.minimize(square(x1) + square(x2) + 2.0 * square(x3) + square(x4) - 5.0 * x1 - 5.0 * x2 -
             21.0 * x3 + 7.0 * x4);
  p.at_most(square(x1) + square(x2) + square(x3) + square(x4) + x1 - x2 + x3 - x4, 8.0);
  p.at_most(square(x1) + 2.0 * square(x2) + square(x3) + 2.0 * square(x4) - x1 - x4, 10.0);
  p.at_most(2.0 * square(x1) + square(x2) + square(x3) + 2.0 * x1 - x2 - x4, 5.0);
  return p;
}

MinimizationProblem hs044() {
  Draft p("hs044", -15.0, {0.0, 0.0, 0.0, 0.0});
  const auto [x1, x2, x3, x4] = p.variables<4>(0.0);
  p.minimize(x1 - x2 - x3 - x1 * x3 + x1 * x4 + x2 * x3 - x2 * x4);
  p.at_most(x1 + 2.0 * x2, 8.0);
  p.at_most(4.0 * x1 + x2, 12.0);
  p.at_most(3.0 * x1 + 4.0 * x2, 12.0);
  p.at_most(2.0 * x3 + x4, 8.0);
  p.at_most(x3 + 2.0 * x4, 8.0);
  p.at_most(x3 + x4, 5.0);
  return p.several_minima();
}

MinimizationProblem hs045() {
  Draft p("hs045", 1.0, {2.0, 2.0, 2.0, 2.0, 2.0});
  const auto [x1, x2, x3, x4, x5] =
      p.variables<5>({0.0, 0.0, 0.0, 0.0, 0.0}, {1.0, 2.0, 3.0, 4.0, 5.0});
  p.minimize(2.0 - x1 * x2 * x3 * x4 * x5 / 120.0);
  return p.several_minima();
}

MinimizationProblem hs046() {
  Draft p("hs046", 0.0, {std::numbers::sqrt2 / 2.0, 1.75, 0.5, 2.0, 2.0});
  const auto [x1, x2, x3, x4, x5] = p.variables<5>();
  p.minimize(square(x1 - x2) + square(x3 - 1.0) + pow(x4 - 1.0, 4.0) + pow(x5 - 1.0, 6.0));
  p.equal(square(x1) * x4 + sin(x4 - x5), 1.0);
  p.equal(x2 + pow(x3, 4.0) * square(x4), 2.0);
  return p.degenerate();
}

// The published value 0 at (1, 1, 1, 1, 1) is no minimum: the cubic term makes it lower nearby.
MinimizationProblem hs047() {
  Draft p("hs047", -0.0267141887, {2.0, std::numbers::sqrt2, -1.0, 2.0 - std::numbers::sqrt2, 0.5});
  const auto [x1, x2, x3, x4, x5] = p.variables<5>();
  p.minimize(square(x1 - x2) + cube(x2 - x3) + pow(x3 - x4, 4.0) + pow(x4 - x5, 4.0));
  p.equal(x1 + square(x2) + cube(x3), 3.0);
  p.equal(x2 - square(x3) + x4, 1.0);
  p.equal(x1 * x5, 1.0);
  return p.several_minima();
}

MinimizationProblem hs048() {
  Draft p("hs048", 0.0, {3.0, 5.0, -3.0, 2.0, -2.0});
  const auto [x1, x2, x3, x4, x5] = p.variables<5>();
  p.minimize(square(x1 - 1.0) + square(x2 - x3) + square(x4 - x5));
  p.equal(x1 + x2 + x3 + x4 + x5, 5.0);
  p.equal(x3 - 2.0 * (x4 + x5), -3.0);
  return p;
}

MinimizationProblem hs049() {
  Draft p("hs049", 0.0, {10.0, 7.0, 2.0, -3.0, 0.8});
  const auto [x1, x2, x3, x4, x5] = p.variables<5>();
  p.minimize(square(x1 - x2) + square(x3 - 1.0) + pow(x4 - 1.0, 4.0) + pow(x5 - 1.0, 6.0));
  p.equal(x1 + x2 + x3 + 4.0 * x4, 7.0);
  p.equal(x3 + 5.0 * x5, 6.0);
  return p.degenerate();
}

MinimizationProblem hs050() {
  Draft p("hs050", 0.0, {35.0, -31.0, 11.0, 5.0, -5.0});
  const auto [x1, x2, x3, x4, x5] = p.variables<5>();
  p.minimize(square(x1 - x2) + square(x2 - x3) + pow(x3 - x4, 4.0) + square(x4 - x5));
  p.equal(x1 + 2.0 * x2 + 3.0 * x3, 6.0);
  p.equal(x2 + 2.0 * x3 + 3.0 * x4, 6.0);
  p.equal(x3 + 2.0 * x4 + 3.0 * x5, 6.0);
  return p;
}

}  // namespace

std::vector<MinimizationProblem> hock_schittkowski_001_to_050() {
  return {hs001(), hs002(), hs003(), hs004(), hs005(), hs006(), hs007(), hs008(), hs009(), hs010(),
          hs011(), hs012(), hs013(), hs014(), hs015(), hs016(), hs017(), hs018(), hs019(), hs020(),
          hs021(), hs022(), hs023(), hs024(), hs025(), hs026(), hs027(), hs028(), hs029(), hs030(),
          hs031(), hs032(), hs033(), hs034(), hs035(), hs036(), hs037(), hs038(), hs039(), hs040(),
          hs041(), hs042(), hs043(), hs044(), hs045(), hs046(), hs047(), hs048(), hs049(), hs050()};
}

}  // namespace ipminmax::testing
