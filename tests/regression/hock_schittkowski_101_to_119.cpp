#include <cmath>
#include <numbers>
#include <span>

#include <regression/hock_schittkowski_groups.hpp>

namespace ipminmax::testing {
namespace {

constexpr double kInf = kNoBound;

/// c x1^a1 ... x7^a7
Expression monomial(const std::array<Expression, 7>& x, double c,
                    const std::array<double, 7>& exponents) {
  Expression product = c;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (exponents[i] == 0.0) continue;
    product = product * (exponents[i] == 1.0 ? x[i] : pow(x[i], exponents[i]));
  }
  return product;
}

MinimizationProblem hs101_to_103(const char* name, double objective, double a) {
  Draft p(name, objective, {6.0, 6.0, 6.0, 6.0, 6.0, 6.0, 6.0});
  const auto x = p.variables<7>({0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.01},
                                {10.0, 10.0, 10.0, 10.0, 10.0, 10.0, 10.0});
  const Expression f = monomial(x, 10.0, {1.0, -1.0, 0.0, 2.0, 0.0, -3.0, a}) +
                       monomial(x, 15.0, {-1.0, -2.0, 1.0, 1.0, -1.0, 0.0, -0.5}) +
                       monomial(x, 20.0, {-2.0, 1.0, 0.0, -1.0, -2.0, 1.0, 0.0}) +
                       monomial(x, 25.0, {2.0, 2.0, -1.0, 0.0, 0.5, -2.0, 1.0});
  p.minimize(f);
  p.at_most(monomial(x, 0.5, {0.5, 0.0, -1.0, 0.0, 0.0, -2.0, 1.0}) +
                monomial(x, 0.7, {3.0, 1.0, -2.0, 0.0, 0.0, 1.0, 0.5}) +
                monomial(x, 0.2, {0.0, -1.0, 1.0, -0.5, 0.0, 2.0 / 3.0, 0.25}),
            1.0);
  p.at_most(monomial(x, 1.3, {-0.5, 1.0, -1.0, 0.0, -1.0, 1.0, 0.0}) +
                monomial(x, 0.8, {0.0, 0.0, 1.0, -1.0, -1.0, 2.0, 0.0}) +
                monomial(x, 3.1, {-1.0, 0.5, 0.0, -2.0, -1.0, 1.0 / 3.0, 0.0}),
            1.0);
  p.at_most(monomial(x, 2.0, {1.0, 0.0, -1.5, 0.0, 1.0, -1.0, 1.0 / 3.0}) +
                monomial(x, 0.1, {0.0, 1.0, -0.5, 0.0, 1.0, -1.0, -0.5}) +
                monomial(x, 1.0, {-1.0, 1.0, 0.5, 0.0, 1.0, 0.0, 0.0}) +
                monomial(x, 0.65, {0.0, -2.0, 1.0, 0.0, 1.0, -1.0, 1.0}),
            1.0);
  p.at_most(monomial(x, 0.2, {-2.0, 1.0, 0.0, -1.0, 0.5, 0.0, 1.0 / 3.0}) +
                monomial(x, 0.3, {0.5, 2.0, 1.0, 1.0 / 3.0, -2.0 / 3.0, 0.0, 0.25}) +
                monomial(x, 0.4, {-3.0, -2.0, 1.0, 0.0, 1.0, 0.0, 0.75}) +
                monomial(x, 0.5, {0.0, 0.0, -2.0, 1.0, 0.0, 0.0, 0.5}),
            1.0);
  p.range(100.0, f, 3000.0);
  return p;
}

MinimizationProblem hs101() { return hs101_to_103("hs101", 1809.76476, -0.25); }
MinimizationProblem hs102() { return hs101_to_103("hs102", 911.880571, 0.125); }
MinimizationProblem hs103() { return hs101_to_103("hs103", 543.667958, 0.5); }

MinimizationProblem hs104() {
  Draft p("hs104", 3.9511634396, {6.0, 3.0, 0.4, 0.2, 6.0, 6.0, 1.0, 0.5});
  const auto [x1, x2, x3, x4, x5, x6, x7, x8] = p.variables<8>(0.1, 10.0);
  const Expression f =
      0.4 * pow(x1, 0.67) * pow(x7, -0.67) + 0.4 * pow(x2, 0.67) * pow(x8, -0.67) + 10.0 - x1 - x2;
  p.minimize(f);
  p.at_most(0.0588 * x5 * x7 + 0.1 * x1, 1.0);
  p.at_most(0.0588 * x6 * x8 + 0.1 * x1 + 0.1 * x2, 1.0);
  p.at_most(4.0 * x3 / x5 + 2.0 * pow(x3, -0.71) / x5 + 0.0588 * pow(x3, -1.3) * x7, 1.0);
  p.at_most(4.0 * x4 / x6 + 2.0 * pow(x4, -0.71) / x6 + 0.0588 * pow(x4, -1.3) * x8, 1.0);
  p.range(1.0, f, 4.2);
  return p;
}

// Maximum likelihood of a mixture of three normal distributions; 235 observations. Published as
// 1138.416240, which these formulas undercut.
MinimizationProblem hs105() {
  struct Group {
    double value;
    int observations;
  };
  constexpr Group kData[] = {{95, 1},   {105, 1},  {110, 4},  {115, 4},  {120, 15}, {125, 15},
                             {130, 15}, {135, 13}, {140, 21}, {145, 12}, {150, 17}, {155, 4},
                             {160, 20}, {165, 8},  {170, 17}, {175, 8},  {180, 6},  {185, 6},
                             {190, 7},  {195, 4},  {200, 3},  {205, 3},  {210, 8},  {215, 1},
                             {220, 6},  {230, 5},  {235, 1},  {240, 7},  {245, 1},  {250, 2}};
  Draft p("hs105", 1136.307304, {0.1, 0.2, 100.0, 125.0, 175.0, 11.2, 13.2, 15.8});
  const auto [x1, x2, x3, x4, x5, x6, x7, x8] =
      p.variables<8>({0.001, 0.001, 100.0, 130.0, 170.0, 5.0, 5.0, 5.0},
                     {0.499, 0.449, 180.0, 210.0, 240.0, 25.0, 25.0, 25.0});
  const auto density = [](double y, const Expression& mean, const Expression& deviation) {
    return exp(-0.5 * square((y - mean) / deviation)) / deviation;
  };
  Expression f;
  for (const auto& [y, observations] : kData) {
    f -= observations * log((x1 * density(y, x3, x6) + x2 * density(y, x4, x7) +
                             (1.0 - x1 - x2) * density(y, x5, x8)) /
                            std::sqrt(2.0 * std::numbers::pi));
  }
  p.minimize(f);
  p.at_most(x1 + x2, 1.0);
  return p.several_minima();
}

MinimizationProblem hs106() {
  Draft p("hs106", 7049.2480, {5000.0, 5000.0, 5000.0, 200.0, 350.0, 150.0, 225.0, 425.0});
  const auto [x1, x2, x3, x4, x5, x6, x7, x8] =
      p.variables<8>({100.0, 1000.0, 1000.0, 10.0, 10.0, 10.0, 10.0, 10.0},
                     {10000.0, 10000.0, 10000.0, 1000.0, 1000.0, 1000.0, 1000.0, 1000.0});
  p.minimize(x1 + x2 + x3);
  p.at_most(0.0025 * (x4 + x6), 1.0);
  p.at_most(0.0025 * (x5 + x7 - x4), 1.0);
  p.at_most(0.01 * (x8 - x5), 1.0);
  p.at_least(x1 * x6 - 833.33252 * x4 - 100.0 * x1, -83333.333);
  p.at_least(x2 * x7 - 1250.0 * x5 - x2 * x4 + 1250.0 * x4, 0.0);
  p.at_least(x3 * x8 - x3 * x5 + 2500.0 * x5, 1250000.0);
  return p;
}

MinimizationProblem hs107() {
  const double c = 48.4 / 50.176 * std::sin(0.25);
  const double d = 48.4 / 50.176 * std::cos(0.25);
  Draft p("hs107", 5055.011803, {0.8, 0.8, 0.2, 0.2, 1.0454, 1.0454, 1.0454, 0.0, 0.0});
  const auto [x1, x2, x3, x4, x5, x6, x7, x8, x9] =
      p.variables<9>({0.0, 0.0, -kInf, -kInf, 0.90909, 0.90909, 0.90909, -kInf, -kInf},
                     {kInf, kInf, kInf, kInf, 1.0909, 1.0909, 1.0909, kInf, kInf});
  p.minimize(3000.0 * x1 + 1000.0 * cube(x1) + 2000.0 * x2 + 666.667 * cube(x2));
  const Expression y1 = sin(x8), y2 = cos(x8), y3 = sin(x9), y4 = cos(x9);
  const Expression y5 = sin(x8 - x9), y6 = cos(x8 - x9);
  p.equal(-x1 + 2.0 * c * square(x5) - x5 * x6 * (d * y1 + c * y2) - x5 * x7 * (d * y3 + c * y4),
          -0.4);
  p.equal(-x2 + 2.0 * c * square(x6) + x5 * x6 * (d * y1 - c * y2) + x6 * x7 * (d * y5 - c * y6),
          -0.4);
  p.equal(2.0 * c * square(x7) + x5 * x7 * (d * y3 - c * y4) - x6 * x7 * (d * y5 + c * y6), -0.8);
  p.equal(-x3 + 2.0 * d * square(x5) + x5 * x6 * (c * y1 - d * y2) + x5 * x7 * (c * y3 - d * y4),
          -0.2);
  p.equal(-x4 + 2.0 * d * square(x6) - x5 * x6 * (c * y1 + d * y2) - x6 * x7 * (c * y5 + d * y6),
          -0.2);
  p.equal(2.0 * d * square(x7) - x5 * x7 * (c * y3 + d * y4) + x6 * x7 * (c * y5 - d * y6), 0.337);
  return p;
}

// The hexagon of largest area with diameter one: turned and mirrored copies are as good.
MinimizationProblem hs108() {
  Draft p("hs108", -std::numbers::sqrt3 / 2.0, {1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0});
  const auto [x1, x2, x3, x4, x5, x6, x7, x8, x9] =
      p.variables<9>({-kInf, -kInf, -kInf, -kInf, -kInf, -kInf, -kInf, -kInf, 0.0},
                     {kInf, kInf, kInf, kInf, kInf, kInf, kInf, kInf, kInf});
  p.minimize(-0.5 * (x1 * x4 - x2 * x3 + x3 * x9 - x5 * x9 + x5 * x8 - x6 * x7));
  p.at_most(square(x3) + square(x4), 1.0);
  p.at_most(square(x9), 1.0);
  p.at_most(square(x5) + square(x6), 1.0);
  p.at_most(square(x1) + square(x2 - x9), 1.0);
  p.at_most(square(x1 - x5) + square(x2 - x6), 1.0);
  p.at_most(square(x1 - x7) + square(x2 - x8), 1.0);
  p.at_most(square(x3 - x5) + square(x4 - x6), 1.0);
  p.at_most(square(x3 - x7) + square(x4 - x8), 1.0);
  p.at_most(square(x7) + square(x8 - x9), 1.0);
  p.at_least(x1 * x4 - x2 * x3, 0.0);
  p.at_least(x3 * x9, 0.0);
  p.at_least(-x5 * x9, 0.0);
  p.at_least(x5 * x8 - x6 * x7, 0.0);
  return p.degenerate().nonunique().several_minima();
}

// Published as 5362.06928, which these formulas undercut.
MinimizationProblem hs109() {
  constexpr double kA = 50.176;
  const double b = std::sin(0.25);
  const double c = std::cos(0.25);
  Draft p("hs109", 5326.85131, {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  const auto [x1, x2, x3, x4, x5, x6, x7, x8, x9] =
      p.variables<9>({0.0, 0.0, -0.55, -0.55, 196.0, 196.0, 196.0, -400.0, -400.0},
                     {kInf, kInf, 0.55, 0.55, 252.0, 252.0, 252.0, 800.0, 800.0});
  p.minimize(3.0 * x1 + 1e-6 * cube(x1) + 2.0 * x2 + 0.522074e-6 * cube(x2));
  p.range(-0.55, x4 - x3, 0.55);
  p.at_most(square(x1) + square(x8), 2250000.0);
  p.at_most(square(x2) + square(x9), 2250000.0);
  p.equal(x5 * x6 * sin(-x3 - 0.25) + x5 * x7 * sin(-x4 - 0.25) + 2.0 * b * square(x5) - kA * x1,
          -400.0 * kA);
  p.equal(x5 * x6 * sin(x3 - 0.25) + x6 * x7 * sin(x3 - x4 - 0.25) + 2.0 * b * square(x6) - kA * x2,
          -400.0 * kA);
  p.equal(x5 * x7 * sin(x4 - 0.25) + x6 * x7 * sin(x4 - x3 - 0.25) + 2.0 * b * square(x7),
          -881.779 * kA);
  p.equal(kA * x8 + x5 * x6 * cos(-x3 - 0.25) + x5 * x7 * cos(-x4 - 0.25) - 2.0 * c * square(x5) +
              0.7533e-3 * kA * square(x5),
          200.0 * kA);
  p.equal(kA * x9 + x5 * x6 * cos(x3 - 0.25) + x6 * x7 * cos(x3 - x4 - 0.25) -
              2.0 * c * square(x6) + 0.7533e-3 * kA * square(x6),
          200.0 * kA);
  p.equal(x5 * x7 * cos(x4 - 0.25) + x6 * x7 * cos(x4 - x3 - 0.25) - 2.0 * c * square(x7) +
              0.7533e-3 * kA * square(x7),
          -22.938 * kA);
  return p.several_minima();
}

MinimizationProblem hs110() {
  Draft p("hs110", -45.77846971, std::vector<double>(10, 9.0));
  const auto x = p.variables<10>(2.001, 9.999);
  Expression f;
  Expression product = 1.0;
  for (const Expression& xi : x) {
    f += square(log(xi - 2.0)) + square(log(10.0 - xi));
    product = product * xi;
  }
  p.minimize(f - pow(product, 0.2));
  return p;
}

/// Free energies of the ten substances of 111 and 112.
constexpr std::array<double, 10> kFreeEnergy = {-6.089,  -17.164, -34.054, -5.914,  -24.721,
                                                -14.986, -24.1,   -10.708, -26.662, -22.179};

/// Chemical equilibrium of the amounts x.
void add_equilibrium(Draft& p, const std::array<Expression, 10>& x) {
  p.equal(x[0] + 2.0 * x[1] + 2.0 * x[2] + x[5] + x[9], 2.0);
  p.equal(x[3] + 2.0 * x[4] + x[5] + x[6], 1.0);
  p.equal(x[2] + x[6] + x[7] + 2.0 * x[8] + x[9], 1.0);
}

// As 112, in the logarithms of the amounts.
MinimizationProblem hs111() {
  Draft p("hs111", -47.76109026, std::vector<double>(10, -2.3));
  const auto x = p.variables<10>(-100.0, 100.0);
  std::array<Expression, 10> amounts;
  Expression total;
  for (std::size_t j = 0; j < 10; ++j) total += amounts[j] = exp(x[j]);
  Expression f;
  for (std::size_t j = 0; j < 10; ++j) f += amounts[j] * (kFreeEnergy[j] + x[j] - log(total));
  p.minimize(f);
  add_equilibrium(p, amounts);
  return p;
}

MinimizationProblem hs112() {
  Draft p("hs112", -47.76109026, std::vector<double>(10, 0.1));
  const auto x = p.variables<10>(1e-6);
  Expression total;
  for (const Expression& xj : x) total += xj;
  Expression f;
  for (std::size_t j = 0; j < 10; ++j) f += x[j] * (kFreeEnergy[j] + log(x[j] / total));
  p.minimize(f);
  add_equilibrium(p, x);
  return p;
}

MinimizationProblem hs113() {
  Draft p("hs113", 24.3062091, {2.0, 3.0, 5.0, 5.0, 1.0, 2.0, 7.0, 3.0, 6.0, 10.0});
  const auto [x1, x2, x3, x4, x5, x6, x7, x8, x9, x10] = p.variables<10>();
  p.minimize(square(x1) + square(x2) + x1 * x2 - 14.0 * x1 - 16.0 * x2 + square(x3 - 10.0) +
             4.0 * square(x4 - 5.0) + square(x5 - 3.0) + 2.0 * square(x6 - 1.0) + 5.0 * square(x7) +
             7.0 * square(x8 - 11.0) + 2.0 * square(x9 - 10.0) + square(x10 - 7.0) + 45.0);
  p.at_most(4.0 * x1 + 5.0 * x2 - 3.0 * x7 + 9.0 * x8, 105.0);
  p.at_most(10.0 * x1 - 8.0 * x2 - 17.0 * x7 + 2.0 * x8, 0.0);
  p.at_most(-8.0 * x1 + 2.0 * x2 + 5.0 * x9 - 2.0 * x10, 12.0);
  p.at_most(3.0 * square(x1 - 2.0) + 4.0 * square(x2 - 3.0) + 2.0 * square(x3) - 7.0 * x4, 120.0);
  p.at_most(5.0 * square(x1) + 8.0 * x2 + square(x3 - 6.0) - 2.0 * x4, 40.0);
  p.at_most(0.5 * square(x1 - 8.0) + 2.0 * square(x2 - 4.0) + 3.0 * square(x5) - x6, 30.0);
  p.at_most(square(x1) + 2.0 * square(x2 - 2.0) - 2.0 * x1 * x2 + 14.0 * x5 - 6.0 * x6, 0.0);
  p.at_most(-3.0 * x1 + 6.0 * x2 + 12.0 * square(x9 - 8.0) - 7.0 * x10, 0.0);
  return p;
}

MinimizationProblem hs114() {
  constexpr double kA = 0.99;
  constexpr double kB = 0.9;
  Draft p("hs114", -1768.80696,
          {1745.0, 12000.0, 110.0, 3048.0, 1974.0, 89.2, 92.8, 8.0, 3.6, 145.0});
  const auto [x1, x2, x3, x4, x5, x6, x7, x8, x9, x10] =
      p.variables<10>({1e-5, 1e-5, 1e-5, 1e-5, 1e-5, 85.0, 90.0, 3.0, 1.2, 145.0},
                      {2000.0, 16000.0, 120.0, 5000.0, 2000.0, 93.0, 95.0, 12.0, 4.0, 162.0});
  p.minimize(5.04 * x1 + 0.035 * x2 + 10.0 * x3 + 3.36 * x5 - 0.063 * x4 * x7);
  const Expression g1 = 35.82 - 0.222 * x10 - kB * x9;
  const Expression g2 = -133.0 + 3.0 * x7 - kA * x10;
  const Expression g5 = 1.12 * x1 + 0.13167 * x1 * x8 - 0.00667 * x1 * square(x8) - kA * x4;
  const Expression g6 = 57.425 + 1.098 * x8 - 0.038 * square(x8) + 0.325 * x6 - kA * x7;
  p.at_least(g1, 0.0);
  p.at_least(g2, 0.0);
  p.at_least(-g1 + (1.0 / kB - kB) * x9, 0.0);
  p.at_least(-g2 + (1.0 / kA - kA) * x10, 0.0);
  p.at_least(g5, 0.0);
  p.at_least(g6, 0.0);
  p.at_least(-g5 + (1.0 / kA - kA) * x4, 0.0);
  p.at_least(-g6 + (1.0 / kA - kA) * x7, 0.0);
  p.equal(1.22 * x4 - x1 - x5, 0.0);
  p.equal(98000.0 * x3 / (x4 * x9 + 1000.0 * x3) - x6, 0.0);
  p.equal((x2 + x5) / x1 - x8, 0.0);
  return p;
}

MinimizationProblem hs116() {
  constexpr double kA = 0.002;
  constexpr double kB = 1.262626;
  constexpr double kC = 1.231059;
  Draft p("hs116", 97.5875096,
          {0.5, 0.8, 0.9, 0.1, 0.14, 0.5, 489.0, 80.0, 650.0, 450.0, 150.0, 150.0, 150.0});
  const auto [x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11, x12, x13] = p.variables<13>(
      {0.1, 0.1, 0.1, 1e-4, 0.1, 0.1, 0.1, 0.1, 500.0, 0.1, 1.0, 1e-4, 1e-4},
      {1.0, 1.0, 1.0, 0.1, 0.9, 0.9, 1000.0, 1000.0, 1000.0, 500.0, 150.0, 150.0, 150.0});
  const Expression f = x11 + x12 + x13;
  p.minimize(f);
  p.at_least(x3 - x2, 0.0);
  p.at_least(x2 - x1, 0.0);
  p.at_least(-kA * x7 + kA * x8, -1.0);
  p.at_least(x13 - kB * x10 + kC * x3 * x10, 0.0);
  const auto separation = [&p](const Expression& a, const Expression& b) {
    p.at_least(b - 0.03475 * a - 0.975 * a * b + 0.00975 * square(a), 0.0);
  };
  separation(x2, x5);
  separation(x3, x6);
  separation(x1, x4);
  p.at_least(x12 - kB * x9 + kC * x2 * x9, 0.0);
  p.at_least(x11 - kB * x8 + kC * x1 * x8, 0.0);
  p.at_least(x5 * x7 - x1 * x8 - x4 * x7 + x4 * x8, 0.0);
  p.at_least(-kA * (x2 * x9 + x5 * x8 - x1 * x8 - x6 * x9) - x5 - x6, -1.0);
  p.at_least(x2 * x9 - x3 * x10 - x6 * x9 - 500.0 * x2 + 500.0 * x6 + x2 * x10, 0.0);
  p.at_least(x2 - kA * (x2 * x10 - x3 * x10), 0.9);
  p.range(50.0, f, 250.0);
  return p;
}

MinimizationProblem hs117() {
  std::vector<double> start(15, 0.001);
  start[6] = 60.0;
  Draft p("hs117", 32.34867897, start);
  const auto all = p.variables<15>(0.0);
  const std::span x = std::span(all).first<10>();
  const std::span y = std::span(all).last<5>();
  Expression f;
  for (std::size_t i = 0; i < 10; ++i) f -= colville::kB[i] * x[i];
  for (std::size_t j = 0; j < 5; ++j) {
    f += 2.0 * colville::kD[j] * cube(y[j]);
    for (std::size_t k = 0; k < 5; ++k) f += colville::kC[k][j] * y[k] * y[j];
  }
  p.minimize(f);
  for (std::size_t j = 0; j < 5; ++j) {
    Expression row = 3.0 * colville::kD[j] * square(y[j]);
    for (std::size_t k = 0; k < 5; ++k) row += 2.0 * colville::kC[k][j] * y[k];
    for (std::size_t k = 0; k < 10; ++k) row -= colville::kA[k][j] * x[k];
    p.at_least(row, -colville::kE[j]);
  }
  return p;
}

MinimizationProblem hs118() {
  constexpr double kDemand[5] = {60.0, 50.0, 70.0, 85.0, 100.0};
  Draft p(
      "hs118", 664.82045,
      {20.0, 55.0, 15.0, 20.0, 60.0, 20.0, 20.0, 60.0, 20.0, 20.0, 60.0, 20.0, 20.0, 60.0, 20.0});
  const auto x =
      p.variables<15>({8.0, 43.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0},
                      {21.0, 57.0, 16.0, 90.0, 120.0, 60.0, 90.0, 120.0, 60.0, 90.0, 120.0, 60.0,
                       90.0, 120.0, 60.0});
  Expression f;
  for (std::size_t k = 0; k < 15; k += 3) {
    f += 2.3 * x[k] + 0.0001 * square(x[k]) + 1.7 * x[k + 1] + 0.0001 * square(x[k + 1]) +
         2.2 * x[k + 2] + 0.00015 * square(x[k + 2]);
  }
  p.minimize(f);
  for (std::size_t k = 0; k < 12; k += 3) {
    p.range(-7.0, x[k + 3] - x[k], 6.0);
    p.range(-7.0, x[k + 4] - x[k + 1], 7.0);
    p.range(-7.0, x[k + 5] - x[k + 2], 6.0);
  }
  for (std::size_t k = 0; k < 5; ++k) {
    p.at_least(x[3 * k] + x[3 * k + 1] + x[3 * k + 2], kDemand[k]);
  }
  return p;
}

MinimizationProblem hs119() {
  // a_ij = 1 for these j beside i itself, otherwise 0
  const std::vector<std::size_t> partners[16] = {{4, 7, 8, 16},
                                                 {3, 7, 10},
                                                 {7, 9, 10, 14},
                                                 {7, 11, 15},
                                                 {6, 10, 12, 16},
                                                 {8, 15},
                                                 {11, 13},
                                                 {10, 15},
                                                 {12, 16},
                                                 {14},
                                                 {13},
                                                 {14},
                                                 {14},
                                                 {},
                                                 {},
                                                 {}};
  constexpr double kB[8][8] = {{0.22, 0.20, 0.19, 0.25, 0.15, 0.11, 0.12, 0.13},
                               {-1.46, 0.0, -1.30, 1.82, -1.15, 0.0, 0.80, 0.0},
                               {1.29, -0.89, 0.0, 0.0, -1.16, -0.96, 0.0, -0.49},
                               {-1.10, -1.06, 0.95, -0.54, 0.0, -1.78, -0.41, 0.0},
                               {0.0, 0.0, 0.0, -1.43, 1.51, 0.59, -0.33, -0.43},
                               {0.0, -1.72, -0.33, 0.0, 1.62, 1.24, 0.21, -0.26},
                               {1.12, 0.0, 0.0, 0.31, 0.0, 0.0, 1.12, 0.0},
                               {0.0, 0.45, 0.26, -1.10, 0.58, 0.0, -1.03, 0.10}};
  constexpr double kC[8] = {2.5, 1.1, -3.1, -3.5, 1.3, 2.1, 2.3, -1.5};
  Draft p("hs119", 244.899698, std::vector<double>(16, 10.0));
  const auto x = p.variables<16>(0.0, 5.0);
  std::array<Expression, 16> y;
  for (std::size_t i = 0; i < 16; ++i) y[i] = square(x[i]) + x[i] + 1.0;
  Expression f;
  for (std::size_t i = 0; i < 16; ++i) {
    f += square(y[i]);
    for (const std::size_t j : partners[i]) f += y[i] * y[j - 1];
  }
  p.minimize(f);
  for (std::size_t i = 0; i < 8; ++i) {
    Expression row = x[8 + i];
    if (i == 6) row -= 0.36 * x[8];
    for (std::size_t j = 0; j < 8; ++j) row += kB[i][j] * x[j];
    p.equal(row, kC[i]);
  }
  return p;
}

}  // namespace

std::vector<MinimizationProblem> hock_schittkowski_101_to_119() {
  return {hs101(), hs102(), hs103(), hs104(), hs105(), hs106(), hs107(), hs108(), hs109(),
          hs110(), hs111(), hs112(), hs113(), hs114(), hs116(), hs117(), hs118(), hs119()};
}

}  // namespace ipminmax::testing
