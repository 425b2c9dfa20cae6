#include <cmath>
#include <numbers>

#include <regression/hock_schittkowski_groups.hpp>

namespace ipminmax::testing {
namespace {

constexpr double kInf = kNoBound;

MinimizationProblem hs051() {
  Draft p("hs051", 0.0, {2.5, 0.5, 2.0, -1.0, 0.5});
  const auto [x1, x2, x3, x4, x5] = p.variables<5>();
  p.minimize(square(x1 - x2) + square(x2 + x3 - 2.0) + square(x4 - 1.0) + square(x5 - 1.0));
  p.equal(x1 + 3.0 * x2, 4.0);
  p.equal(x3 + x4 - 2.0 * x5, 0.0);
  p.equal(x2 - x5, 0.0);
  return p;
}

MinimizationProblem hs052() {
  Draft p("hs052", 1859.0 / 349.0, {2.0, 2.0, 2.0, 2.0, 2.0});
  const auto [x1, x2, x3, x4, x5] = p.variables<5>();
  p.minimize(square(4.0 * x1 - x2) + square(x2 + x3 - 2.0) + square(x4 - 1.0) + square(x5 - 1.0));
  p.equal(x1 + 3.0 * x2, 0.0);
  p.equal(x3 + x4 - 2.0 * x5, 0.0);
  p.equal(x2 - x5, 0.0);
  return p;
}

MinimizationProblem hs053() {
  Draft p("hs053", 176.0 / 43.0, {2.0, 2.0, 2.0, 2.0, 2.0});
  const auto [x1, x2, x3, x4, x5] = p.variables<5>(-10.0, 10.0);
  p.minimize(square(x1 - x2) + square(x2 + x3 - 2.0) + square(x4 - 1.0) + square(x5 - 1.0));
  p.equal(x1 + 3.0 * x2, 0.0);
  p.equal(x3 + x4 - 2.0 * x5, 0.0);
  p.equal(x2 - x5, 0.0);
  return p;
}

// Far from the solution the objective is flat: solvers stop with 0.
MinimizationProblem hs054() {
  Draft p("hs054", -std::exp(-27.0 / 280.0), {6e3, 1.5, 4e6, 2.0, 3e-3, 5e7});
  const auto [x1, x2, x3, x4, x5, x6] =
      p.variables<6>({0.0, -10.0, 0.0, 0.0, -1.0, 0.0}, {2e4, 10.0, 1e7, 20.0, 1.0, 2e8});
  const Expression y1 = (x1 - 1e4) / 8e3;
  const Expression y2 = x2 - 1.0;
  const Expression h = (square(y1) + 0.4 * y1 * y2 + square(y2)) / 0.96 + square((x3 - 2e6) / 7e6) +
                       square((x4 - 10.0) / 50.0) + square((x5 - 1e-3) / 0.05) +
                       square((x6 - 1e8) / 5e8);
  p.minimize(-exp(-0.5 * h));
  p.equal(x1 + 4e3 * x2, 1.76e4);
  return p.several_minima();
}

// The six equations have rank five; Ipopt takes six equations in six variables for a square system
// and looks only for a feasible point.
MinimizationProblem hs055() {
  Draft p("hs055", 19.0 / 3.0, {1.0, 2.0, 0.0, 0.0, 0.0, 2.0});
  const auto [x1, x2, x3, x4, x5, x6] =
      p.variables<6>({0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, {1.0, kInf, kInf, 1.0, kInf, kInf});
  p.minimize(x1 + 2.0 * x2 + 4.0 * x5 + exp(x1 * x4));
  p.equal(x1 + 2.0 * x2 + 5.0 * x5, 6.0);
  p.equal(x1 + x2 + x3, 3.0);
  p.equal(x4 + x5 + x6, 2.0);
  p.equal(x1 + x4, 1.0);
  p.equal(x2 + x5, 2.0);
  p.equal(x3 + x6, 2.0);
  return p.degenerate().several_minima();
}

MinimizationProblem hs056() {
  const double a = std::asin(std::sqrt(1.0 / 4.2));
  const double b = std::asin(std::sqrt(5.0 / 7.2));
  Draft p("hs056", -3.456, {1.0, 1.0, 1.0, a, a, a, b});
  const auto [x1, x2, x3, x4, x5, x6, x7] = p.variables<7>();
  p.minimize(-x1 * x2 * x3);
  p.equal(x1 - 4.2 * square(sin(x4)), 0.0);
  p.equal(x2 - 4.2 * square(sin(x5)), 0.0);
  p.equal(x3 - 4.2 * square(sin(x6)), 0.0);
  p.equal(x1 + 2.0 * x2 + 2.0 * x3 - 7.2 * square(sin(x7)), 0.0);
  return p.several_minima();
}

MinimizationProblem hs057() {
  constexpr std::array<double, 44> kA = {8,  8,  10, 10, 10, 10, 12, 12, 12, 12, 14, 14, 14, 16, 16,
                                         16, 18, 18, 20, 20, 20, 22, 22, 22, 24, 24, 24, 26, 26, 26,
                                         28, 28, 30, 30, 30, 32, 32, 34, 36, 36, 38, 38, 40, 42};
  constexpr std::array<double, 44> kB = {
      0.49, 0.49, 0.48, 0.47, 0.48, 0.47, 0.46, 0.46, 0.45, 0.43, 0.45, 0.43, 0.43, 0.44, 0.43,
      0.43, 0.46, 0.45, 0.42, 0.42, 0.43, 0.41, 0.41, 0.40, 0.42, 0.40, 0.40, 0.41, 0.40, 0.41,
      0.41, 0.40, 0.40, 0.40, 0.38, 0.41, 0.40, 0.40, 0.41, 0.38, 0.40, 0.40, 0.39, 0.39};
  Draft p("hs057", 0.02845966972, {0.42, 5.0});
  const auto [x1, x2] = p.variables<2>({0.4, -4.0}, {kInf, kInf});
  Expression f;
  for (std::size_t i = 0; i < kA.size(); ++i) {
    f += square(kB[i] - x1 - (0.49 - x1) * exp(-(kA[i] - 8.0) * x2));
  }
  p.minimize(f);
  p.at_least(0.49 * x2 - x1 * x2, 0.09);
  return p.several_minima();
}

// Published as -7.8042263; the published formulas give the value here.
MinimizationProblem hs059() {
  Draft p("hs059", -7.80278947, {90.0, 10.0});
  const auto [x1, x2] = p.variables<2>({0.0, 0.0}, {75.0, 65.0});
  p.minimize(-75.196 + 3.8112 * x1 - 0.12694 * square(x1) + 0.0020567 * cube(x1) -
             1.0345e-5 * pow(x1, 4.0) + 6.8306 * x2 - 0.030234 * x1 * x2 +
             1.28134e-3 * x2 * square(x1) + 2.266e-7 * pow(x1, 4.0) * x2 - 0.25645 * square(x2) +
             0.0034604 * cube(x2) - 1.3514e-5 * pow(x2, 4.0) + 28.106 / (x2 + 1.0) +
             5.2375e-6 * square(x1) * square(x2) + 6.3e-8 * cube(x1) * square(x2) -
             7e-10 * cube(x1) * cube(x2) - 3.405e-4 * x1 * square(x2) + 1.6638e-6 * x1 * cube(x2) +
             2.8673 * exp(0.0005 * x1 * x2) - 3.5256e-5 * cube(x1) * x2);
  p.at_least(x1 * x2, 700.0);
  p.at_least(x2 - square(x1) / 125.0, 0.0);
  p.at_least(square(x2 - 50.0) - 5.0 * (x1 - 55.0), 0.0);
  return p.several_minima();
}

MinimizationProblem hs060() {
  Draft p("hs060", 0.03256820025, {2.0, 2.0, 2.0});
  const auto [x1, x2, x3] = p.variables<3>(-10.0, 10.0);
  p.minimize(square(x1 - 1.0) + square(x1 - x2) + pow(x2 - x3, 4.0));
  p.equal(x1 * (1.0 + square(x2)) + pow(x3, 4.0), 4.0 + 3.0 * std::numbers::sqrt2);
  return p;
}

// At the start the gradients of the constraints leave x2 and x3 out.
MinimizationProblem hs061() {
  Draft p("hs061", -143.6461422, {0.0, 0.0, 0.0});
  const auto [x1, x2, x3] = p.variables<3>();
  p.minimize(4.0 * square(x1) + 2.0 * square(x2) + 2.0 * square(x3) - 33.0 * x1 + 16.0 * x2 -
             24.0 * x3);
  p.equal(3.0 * x1 - 2.0 * square(x2), 7.0);
  p.equal(4.0 * x1 - square(x3), 11.0);
  return p.several_minima();
}

MinimizationProblem hs062() {
  Draft p("hs062", -26272.51448, {0.7, 0.2, 0.1});
  const auto [x1, x2, x3] = p.variables<3>(0.0, 1.0);
  p.minimize(-32.174 * (255.0 * log((x1 + x2 + x3 + 0.03) / (0.09 * x1 + x2 + x3 + 0.03)) +
                        280.0 * log((x2 + x3 + 0.03) / (0.07 * x2 + x3 + 0.03)) +
                        290.0 * log((x3 + 0.03) / (0.13 * x3 + 0.03))));
  p.equal(x1 + x2 + x3, 1.0);
  return p;
}

MinimizationProblem hs063() {
  Draft p("hs063", 961.7151721, {2.0, 2.0, 2.0});
  const auto [x1, x2, x3] = p.variables<3>(0.0);
  p.minimize(1000.0 - square(x1) - 2.0 * square(x2) - square(x3) - x1 * x2 - x1 * x3);
  p.equal(8.0 * x1 + 14.0 * x2 + 7.0 * x3, 56.0);
  p.equal(square(x1) + square(x2) + square(x3), 25.0);
  return p;
}

MinimizationProblem hs064() {
  Draft p("hs064", 6299.842428, {1.0, 1.0, 1.0});
  const auto [x1, x2, x3] = p.variables<3>(1e-5);
  p.minimize(5.0 * x1 + 50000.0 / x1 + 20.0 * x2 + 72000.0 / x2 + 10.0 * x3 + 144000.0 / x3);
  p.at_least(-4.0 / x1 - 32.0 / x2 - 120.0 / x3, -1.0);
  return p;
}

MinimizationProblem hs065() {
  Draft p("hs065", 0.9535288567, {-5.0, 5.0, 0.0});
  const auto [x1, x2, x3] = p.variables<3>({-4.5, -4.5, -5.0}, {4.5, 4.5, 5.0});
  p.minimize(square(x1 - x2) + square(x1 + x2 - 10.0) / 9.0 + square(x3 - 5.0));
  p.at_most(square(x1) + square(x2) + square(x3), 48.0);
  return p;
}

MinimizationProblem hs066() {
  Draft p("hs066", 0.5181632741, {0.0, 1.05, 2.9});
  const auto [x1, x2, x3] = p.variables<3>({0.0, 0.0, 0.0}, {100.0, 100.0, 10.0});
  p.minimize(0.2 * x3 - 0.8 * x1);
  p.at_least(x2 - exp(x1), 0.0);
  p.at_least(x3 - exp(x2), 0.0);
  return p;
}

// A mixture of two gamma densities fitted to 19 observations.
MinimizationProblem hs070() {
  constexpr std::array<double, 19> kObserved = {
      0.00189, 0.1038, 0.268, 0.506, 0.577, 0.604,  0.725,  0.898,   0.947,  0.845,
      0.702,   0.528,  0.385, 0.257, 0.159, 0.0869, 0.0453, 0.01509, 0.00189};
  Draft p("hs070", 0.007498464, {2.0, 4.0, 0.04, 2.0});
  const auto [x1, x2, x3, x4] =
      p.variables<4>({1e-5, 1e-5, 1e-5, 1e-5}, {100.0, 100.0, 1.0, 100.0});
  const auto power = [](const Expression& base, const Expression& exponent) {
    return exp(exponent * log(base));
  };
  const Expression b = x3 + (1.0 - x3) * x4;
  const Expression weight1 = x3 * power(b, x2) * sqrt(x2 / 6.2832) / (1.0 + 1.0 / (12.0 * x2));
  const Expression weight2 =
      (1.0 - x3) * power(b / x4, x1) * sqrt(x1 / 6.2832) / (1.0 + 1.0 / (12.0 * x1));
  Expression f;
  for (std::size_t i = 0; i < kObserved.size(); ++i) {
    const double c = i == 0 ? 0.1 : static_cast<double>(i);
    const double time = c / 7.658;
    f +=
        square(weight1 * exp((x2 - 1.0) * std::log(time) + x2 - time * b * x2) +
               weight2 * exp((x1 - 1.0) * std::log(time) + x1 - time * b * x1 / x4) - kObserved[i]);
  }
  p.minimize(f);
  p.at_least(b, 0.0);
  return p.several_minima();
}

MinimizationProblem hs071() {
  Draft p("hs071", 17.0140173, {1.0, 5.0, 5.0, 1.0});
  const auto [x1, x2, x3, x4] = p.variables<4>(1.0, 5.0);
  p.minimize(x1 * x4 * (x1 + x2 + x3) + x3);
  p.at_least(x1 * x2 * x3 * x4, 25.0);
  p.equal(square(x1) + square(x2) + square(x3) + square(x4), 40.0);
  return p;
}

MinimizationProblem hs072() {
  Draft p("hs072", 727.67937, {1.0, 1.0, 1.0, 1.0});
  const auto [x1, x2, x3, x4] = p.variables<4>({0.001, 0.001, 0.001, 0.001}, {4e5, 3e5, 2e5, 1e5});
  p.minimize(1.0 + x1 + x2 + x3 + x4);
  p.at_most(4.0 / x1 + 2.25 / x2 + 1.0 / x3 + 0.25 / x4, 0.0401);
  p.at_most(0.16 / x1 + 0.36 / x2 + 0.64 / x3 + 0.64 / x4, 0.010085);
  return p;
}

MinimizationProblem hs073() {
  Draft p("hs073", 29.894378, {1.0, 1.0, 1.0, 1.0});
  const auto [x1, x2, x3, x4] = p.variables<4>(0.0);
  p.minimize(24.55 * x1 + 26.75 * x2 + 39.0 * x3 + 40.5 * x4);
  p.at_least(2.3 * x1 + 5.6 * x2 + 11.1 * x3 + 1.3 * x4, 5.0);
  p.at_least(12.0 * x1 + 11.9 * x2 + 41.8 * x3 + 52.1 * x4 -
                 1.645 * sqrt(0.28 * square(x1) + 0.19 * square(x2) + 20.5 * square(x3) +
                              0.62 * square(x4)),
             21.0);
  p.equal(x1 + x2 + x3 + x4, 1.0);
  return p;
}

MinimizationProblem hs074_or_075(const char* name, double objective, double a) {
  Draft p(name, objective, {0.0, 0.0, 0.0, 0.0});
  const auto [x1, x2, x3, x4] = p.variables<4>({0.0, 0.0, -a, -a}, {1200.0, 1200.0, a, a});
  p.minimize(3.0 * x1 + 1e-6 * cube(x1) + 2.0 * x2 + 2e-6 / 3.0 * cube(x2));
  p.range(-a, x4 - x3, a);
  p.equal(1000.0 * sin(-x3 - 0.25) + 1000.0 * sin(-x4 - 0.25) - x1, -894.8);
  p.equal(1000.0 * sin(x3 - 0.25) + 1000.0 * sin(x3 - x4 - 0.25) - x2, -894.8);
  p.equal(1000.0 * sin(x4 - 0.25) + 1000.0 * sin(x4 - x3 - 0.25), -1294.8);
  return p;
}

MinimizationProblem hs074() { return hs074_or_075("hs074", 5126.4981, 0.55); }
MinimizationProblem hs075() { return hs074_or_075("hs075", 5174.4129, 0.48); }

MinimizationProblem hs076() {
  Draft p("hs076", -4.681818181, {0.5, 0.5, 0.5, 0.5});
  const auto [x1, x2, x3, x4] = p.variables<4>(0.0);
  p.minimize(square(x1) + 0.5 * square(x2) + square(x3) + 0.5 * square(x4) - x1 * x3 + x3 * x4 -
             x1 - 3.0 * x2 + x3 - x4);
  p.at_most(x1 + 2.0 * x2 + x3 + x4, 5.0);
  p.at_most(3.0 * x1 + x2 + 2.0 * x3 - x4, 4.0);
  p.at_least(x2 + 4.0 * x3, 1.5);
  return p;
}

MinimizationProblem hs077() {
  Draft p("hs077", 0.24150513, {2.0, 2.0, 2.0, 2.0, 2.0});
  const auto [x1, x2, x3, x4, x5] = p.variables<5>();
  p.minimize(square(x1 - 1.0) + square(x1 - x2) + square(x3 - 1.0) + pow(x4 - 1.0, 4.0) +
             pow(x5 - 1.0, 6.0));
  p.equal(square(x1) * x4 + sin(x4 - x5), 2.0 * std::numbers::sqrt2);
  p.equal(x2 + pow(x3, 4.0) * square(x4), 8.0 + std::numbers::sqrt2);
  return p;
}

/// The constraints that 78, 80 and 81 share.
void add_constraints_of_78(Draft& p, const std::array<Expression, 5>& x) {
  const auto& [x1, x2, x3, x4, x5] = x;
  p.equal(square(x1) + square(x2) + square(x3) + square(x4) + square(x5), 10.0);
  p.equal(x2 * x3 - 5.0 * x4 * x5, 0.0);
  p.equal(cube(x1) + cube(x2), -1.0);
}

Expression product(const std::array<Expression, 5>& x) { return x[0] * x[1] * x[2] * x[3] * x[4]; }

MinimizationProblem hs078() {
  Draft p("hs078", -2.91970041, {-2.0, 1.5, 2.0, -1.0, -1.0});
  const auto x = p.variables<5>();
  p.minimize(product(x));
  add_constraints_of_78(p, x);
  return p.several_minima();
}

MinimizationProblem hs079() {
  Draft p("hs079", 0.0787768209, {2.0, 2.0, 2.0, 2.0, 2.0});
  const auto [x1, x2, x3, x4, x5] = p.variables<5>();
  p.minimize(square(x1 - 1.0) + square(x1 - x2) + square(x2 - x3) + pow(x3 - x4, 4.0) +
             pow(x4 - x5, 4.0));
  p.equal(x1 + square(x2) + cube(x3), 2.0 + 3.0 * std::numbers::sqrt2);
  p.equal(x2 - square(x3) + x4, 2.0 * std::numbers::sqrt2 - 2.0);
  p.equal(x1 * x5, 2.0);
  return p.several_minima();
}

MinimizationProblem hs080() {
  Draft p("hs080", 0.0539498478, {-2.0, 2.0, 2.0, -1.0, -1.0});
  const auto x = p.variables<5>({-2.3, -2.3, -3.2, -3.2, -3.2}, {2.3, 2.3, 3.2, 3.2, 3.2});
  p.minimize(exp(product(x)));
  add_constraints_of_78(p, x);
  return p.several_minima();
}

MinimizationProblem hs081() {
  Draft p("hs081", 0.0539498478, {-2.0, 2.0, 2.0, -1.0, -1.0});
  const auto x = p.variables<5>({-2.3, -2.3, -3.2, -3.2, -3.2}, {2.3, 2.3, 3.2, 3.2, 3.2});
  p.minimize(exp(product(x)) - 0.5 * square(cube(x[0]) + cube(x[1]) + 1.0));
  add_constraints_of_78(p, x);
  return p.several_minima();
}

MinimizationProblem hs083() {
  Draft p("hs083", -30665.53867, {78.0, 33.0, 27.0, 27.0, 27.0});
  const auto [x1, x2, x3, x4, x5] =
      p.variables<5>({78.0, 33.0, 27.0, 27.0, 27.0}, {102.0, 45.0, 45.0, 45.0, 45.0});
  p.minimize(5.3578547 * square(x3) + 0.8356891 * x1 * x5 + 37.293239 * x1 - 40792.141);
  p.range(0.0, 85.334407 + 0.0056858 * x2 * x5 + 0.0006262 * x1 * x4 - 0.0022053 * x3 * x5, 92.0);
  p.range(0.0, 80.51249 - 90.0 + 0.0071317 * x2 * x5 + 0.0029955 * x1 * x2 + 0.0021813 * square(x3),
          20.0);
  p.range(0.0, 9.300961 - 20.0 + 0.0047026 * x3 * x5 + 0.0012547 * x1 * x3 + 0.0019085 * x3 * x4,
          5.0);
  return p;
}

MinimizationProblem hs084() {
  Draft p("hs084", -5280335.133, {2.52, 2.0, 37.5, 9.25, 6.8});
  const auto [x1, x2, x3, x4, x5] =
      p.variables<5>({0.0, 1.2, 20.0, 9.0, 6.5}, {1000.0, 2.4, 60.0, 9.3, 7.0});
  p.minimize(24345.0 + 8720288.849 * x1 - 150512.5253 * x1 * x2 + 156.6950325 * x1 * x3 -
             476470.3222 * x1 * x4 - 729482.8271 * x1 * x5);
  p.range(0.0,
          -145421.402 * x1 + 2931.1506 * x1 * x2 - 40.427932 * x1 * x3 + 5106.192 * x1 * x4 +
              15711.36 * x1 * x5,
          294000.0);
  p.range(0.0,
          -155011.1084 * x1 + 4360.53352 * x1 * x2 + 12.9492344 * x1 * x3 + 10236.884 * x1 * x4 +
              13176.786 * x1 * x5,
          294000.0);
  p.range(0.0,
          -326669.5104 * x1 + 7390.68412 * x1 * x2 - 27.8986976 * x1 * x3 + 16643.076 * x1 * x4 +
              30988.146 * x1 * x5,
          277200.0);
  return p;
}

MinimizationProblem hs086() {
  Draft p("hs086", -32.34867897, {0.0, 0.0, 0.0, 0.0, 1.0});
  const auto x = p.variables<5>(0.0);
  Expression f;
  for (std::size_t j = 0; j < 5; ++j) {
    f += colville::kE[j] * x[j] + colville::kD[j] * cube(x[j]);
    for (std::size_t i = 0; i < 5; ++i) f += colville::kC[i][j] * x[i] * x[j];
  }
  p.minimize(f);
  for (std::size_t i = 0; i < 10; ++i) {
    Expression row;
    for (std::size_t j = 0; j < 5; ++j) row += colville::kA[i][j] * x[j];
    p.at_least(row, colville::kB[i]);
  }
  return p;
}

MinimizationProblem hs093() {
  Draft p("hs093", 135.075961, {5.54, 4.4, 12.02, 11.82, 0.702, 0.852});
  const auto [x1, x2, x3, x4, x5, x6] = p.variables<6>(0.0);
  const Expression a = x1 * x4 * (x1 + x2 + x3);
  const Expression b = x2 * x3 * (x1 + 1.57 * x2 + x4);
  p.minimize(0.0204 * a + 0.0187 * b + 0.0607 * a * square(x5) + 0.0437 * b * square(x6));
  p.at_least(0.001 * x1 * x2 * x3 * x4 * x5 * x6, 2.07);
  p.at_most(0.00062 * a * square(x5) + 0.00058 * b * square(x6), 1.0);
  return p;
}

MinimizationProblem hs095_to_098(const char* name, double objective,
                                 const std::array<double, 4>& b) {
  Draft p(name, objective, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  const auto [x1, x2, x3, x4, x5, x6] =
      p.variables<6>({0.0, 0.0, 0.0, 0.0, 0.0, 0.0}, {0.31, 0.046, 0.068, 0.042, 0.028, 0.0134});
  p.minimize(4.3 * x1 + 31.8 * x2 + 63.3 * x3 + 15.8 * x4 + 68.5 * x5 + 4.7 * x6);
  p.at_least(17.1 * x1 + 38.2 * x2 + 204.2 * x3 + 212.3 * x4 + 623.4 * x5 + 1495.5 * x6 -
                 169.0 * x1 * x3 - 3580.0 * x3 * x5 - 3810.0 * x4 * x5 - 18500.0 * x4 * x6 -
                 24300.0 * x5 * x6,
             b[0]);
  p.at_least(17.9 * x1 + 36.8 * x2 + 113.9 * x3 + 169.7 * x4 + 337.8 * x5 + 1385.2 * x6 -
                 139.0 * x1 * x3 - 2450.0 * x4 * x5 - 16600.0 * x4 * x6 - 17200.0 * x5 * x6,
             b[1]);
  p.at_least(-273.0 * x2 - 70.0 * x4 - 819.0 * x5 + 26000.0 * x4 * x5, b[2]);
  p.at_least(159.9 * x1 - 311.0 * x2 + 587.0 * x4 + 391.0 * x5 + 2198.0 * x6 - 14000.0 * x1 * x6,
             b[3]);
  return p;
}

MinimizationProblem hs095() {
  return hs095_to_098("hs095", 0.015619514, {4.97, -1.88, -29.08, -78.02});
}
MinimizationProblem hs096() {
  return hs095_to_098("hs096", 0.015619513, {4.97, -1.88, -69.08, -118.02});
}
MinimizationProblem hs097() {
  MinimizationProblem p = hs095_to_098("hs097", 3.1358089, {32.97, 25.12, -29.08, -78.02});
  p.several_minima = true;
  return p;
}
MinimizationProblem hs098() {
  MinimizationProblem p = hs095_to_098("hs098", 3.1358089, {32.97, 25.12, -124.08, -173.02});
  p.several_minima = true;
  return p;
}

MinimizationProblem hs099() {
  constexpr double kThrust[8] = {0.0, 50.0, 50.0, 75.0, 75.0, 75.0, 100.0, 100.0};
  constexpr double kTime[8] = {0.0, 25.0, 50.0, 100.0, 150.0, 200.0, 290.0, 380.0};
  constexpr double kGravity = 32.0;
  Draft p("hs099", -8.31079892e8, {0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5});
  const auto x = p.variables<7>(0.0, 1.58);
  Expression range, speed, height;
  for (std::size_t i = 1; i < 8; ++i) {
    const double dt = kTime[i] - kTime[i - 1];
    const Expression acceleration = kThrust[i] * sin(x[i - 1]) - kGravity;
    range += kThrust[i] * dt * cos(x[i - 1]);
    height += 0.5 * dt * dt * acceleration + dt * speed;
    speed += dt * acceleration;
  }
  p.minimize(-square(range));
  p.equal(height, 1e5);
  p.equal(speed, 1e3);
  return p;
}

MinimizationProblem hs100() {
  Draft p("hs100", 680.6300573, {1.0, 2.0, 0.0, 4.0, 0.0, 1.0, 1.0});
  const auto [x1, x2, x3, x4, x5, x6, x7] = p.variables<7>();
  p.minimize(square(x1 - 10.0) + 5.0 * square(x2 - 12.0) + pow(x3, 4.0) + 3.0 * square(x4 - 11.0) +
             10.0 * pow(x5, 6.0) + 7.0 * square(x6) + pow(x7, 4.0) - 4.0 * x6 * x7 - 10.0 * x6 -
             8.0 * x7);
  p.at_most(2.0 * square(x1) + 3.0 * pow(x2, 4.0) + x3 + 4.0 * square(x4) + 5.0 * x5, 127.0);
  p.at_most(7.0 * x1 + 3.0 * x2 + 10.0 * square(x3) + x4 - x5, 282.0);
  p.at_most(23.0 * x1 + square(x2) + 6.0 * square(x6) - 8.0 * x7, 196.0);
  p.at_most(4.0 * square(x1) + square(x2) - 3.0 * x1 * x2 + 2.0 * square(x3) + 5.0 * x6 - 11.0 * x7,
            0.0);
  return p;
}

}  // namespace

std::vector<MinimizationProblem> hock_schittkowski_051_to_100() {
  return {hs051(), hs052(), hs053(), hs054(), hs055(), hs056(), hs057(), hs059(), hs060(), hs061(),
          hs062(), hs063(), hs064(), hs065(), hs066(), hs070(), hs071(), hs072(), hs073(), hs074(),
          hs075(), hs076(), hs077(), hs078(), hs079(), hs080(), hs081(), hs083(), hs084(), hs086(),
          hs093(), hs095(), hs096(), hs097(), hs098(), hs099(), hs100()};
}

}  // namespace ipminmax::testing
