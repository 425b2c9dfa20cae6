// Functions with known least values from the literature on global optimization, negated: the interval
// that is proved contains the truth, with 1 to 6 variables and up to thousands of local maxima.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/proof.hpp"

namespace ipminmax {
namespace {

constexpr double kPi = std::numbers::pi;

/// What is known of a function, and how hard it is.
struct Known {
  std::string name;
  double least;         ///< of the function
  double lower, upper;  ///< of each variable
  std::size_t variables;
  double tolerance = 1e-6;  ///< of the proof
};

/// y as elements of one number type.
template <class Span>
using Number = std::remove_cv_t<typename Span::element_type>;

template <class Function>
struct Negated {
  Function function;
  template <class T>
  T objective(std::span<const T> v) const {
    return v[0] - function(v.subspan(1));
  }
};

/// Prints what bench/README.md quotes.
template <class Function>
void expect_proved(const Known& known, Function function) {
  SCOPED_TRACE(known.name);
  const std::size_t n = known.variables;
  std::vector<Player> players(n + 1, Player::Max);
  players[0] = Player::Min;
  std::vector<double> lower(n + 1, known.lower), upper(n + 1, known.upper), start(n + 1);
  lower[0] = upper[0] = 0.0;
  for (std::size_t i = 1; i <= n; ++i) start[i] = 0.4 * known.lower + 0.6 * known.upper;
  ProvableProblem problem(Negated<Function>{function},
                          {.players = players, .start = start, .lower = lower, .upper = upper});
  const WorstCaseProof proof =
      prove_worst_case(problem, start, {}, {.tolerance = known.tolerance, .most_boxes = 300'000});
  std::printf("%-22s %zu %12.6g [%.9g, %.9g] %d boxes %.3f s\n", known.name.c_str(), n,
              -known.least, proof.seen, proof.proved, proof.boxes, proof.seconds);
  const double room = 2e-6 * std::max(1.0, std::abs(known.least));  // digits that are published
  EXPECT_TRUE(proof.complete) << proof.message;
  EXPECT_GE(proof.proved, -known.least - room);
  EXPECT_LE(proof.seen, -known.least + room);
  // At points of a lattice no value is above the bound.
  std::vector<double> v = start;
  const int points = n == 1 ? 20001 : n == 2 ? 201 : n == 3 ? 41 : n == 4 ? 15 : 7;
  std::vector<int> index(n, 0);
  double most = -1e300;
  for (std::size_t i = 0; i < n;) {
    for (std::size_t k = 0; k < n; ++k) {
      v[k + 1] = known.lower + (known.upper - known.lower) * index[k] / (points - 1);
    }
    double f = 0.0;
    if (problem.objective(v, true, f)) most = std::max(most, f);
    for (i = 0; i < n && ++index[i] == points; ++i) index[i] = 0;
  }
  EXPECT_GE(proof.proved, most - 1e-12 * std::abs(most));
}

TEST(ProvedMaxima, Polynomials) {
  expect_proved({"six-hump camel", -1.0316284535, -3.0, 3.0, 2}, [](auto y) {
    return y[0] * y[0] * (4.0 - 2.1 * square(y[0]) + pow(y[0], 4) / 3.0) + y[0] * y[1] +
           square(y[1]) * (4.0 * square(y[1]) - 4.0);
  });
  expect_proved({"three-hump camel", 0.0, -5.0, 5.0, 2}, [](auto y) {
    return 2.0 * square(y[0]) - 1.05 * pow(y[0], 4) + pow(y[0], 6) / 6.0 + y[0] * y[1] +
           square(y[1]);
  });
  expect_proved({"Goldstein-Price", 3.0, -2.0, 2.0, 2, 1e-5}, [](auto y) {
    const auto a = y[0], b = y[1];
    return (1.0 + square(a + b + 1.0) * (19.0 - 14.0 * a + 3.0 * square(a) - 14.0 * b +
                                         6.0 * a * b + 3.0 * square(b))) *
           (30.0 + square(2.0 * a - 3.0 * b) * (18.0 - 32.0 * a + 12.0 * square(a) + 48.0 * b -
                                                36.0 * a * b + 27.0 * square(b)));
  });
  expect_proved({"Booth", 0.0, -10.0, 10.0, 2}, [](auto y) {
    return square(y[0] + 2.0 * y[1] - 7.0) + square(2.0 * y[0] + y[1] - 5.0);
  });
  expect_proved({"Matyas", 0.0, -10.0, 10.0, 2},
                [](auto y) { return 0.26 * (square(y[0]) + square(y[1])) - 0.48 * y[0] * y[1]; });
  expect_proved({"Beale", 0.0, -4.5, 4.5, 2}, [](auto y) {
    return square(1.5 - y[0] + y[0] * y[1]) + square(2.25 - y[0] + y[0] * square(y[1])) +
           square(2.625 - y[0] + y[0] * pow(y[1], 3));
  });
  expect_proved({"Himmelblau", 0.0, -6.0, 6.0, 2}, [](auto y) {
    return square(square(y[0]) + y[1] - 11.0) + square(y[0] + square(y[1]) - 7.0);
  });
  expect_proved({"Zettl", -0.0037912372, -5.0, 5.0, 2}, [](auto y) {
    return square(square(y[0]) + square(y[1]) - 2.0 * y[0]) + 0.25 * y[0];
  });
  for (const std::size_t n : {1U, 2U, 3U, 4U}) {
    expect_proved({"Styblinski-Tang", -39.16616570377 * static_cast<double>(n), -5.0, 5.0, n},
                  [](auto y) {
                    Number<decltype(y)> f = 0.0;
                    for (const auto& a : y) f += 0.5 * (pow(a, 4) - 16.0 * square(a) + 5.0 * a);
                    return f;
                  });
  }
  for (const std::size_t n : {2U, 3U}) {
    expect_proved({"Rosenbrock", 0.0, -2.0, 2.0, n}, [](auto y) {
      Number<decltype(y)> f = 0.0;
      for (std::size_t i = 0; i + 1 < y.size(); ++i) {
        f += 100.0 * square(y[i + 1] - square(y[i])) + square(1.0 - y[i]);
      }
      return f;
    });
    expect_proved({"Dixon-Price", 0.0, -10.0, 10.0, n}, [](auto y) {
      Number<decltype(y)> f = square(y[0] - 1.0);
      for (std::size_t i = 1; i < y.size(); ++i) {
        f += static_cast<double>(i + 1) * square(2.0 * square(y[i]) - y[i - 1]);
      }
      return f;
    });
  }
  constexpr std::array kTrid = {-2.0, -7.0, -16.0, -30.0};
  for (const std::size_t n : {2U, 3U, 4U, 5U}) {
    const double half = static_cast<double>(n * n);
    expect_proved({"Trid", kTrid[n - 2], -half, half, n}, [](auto y) {
      Number<decltype(y)> f = square(y[0] - 1.0);
      for (std::size_t i = 1; i < y.size(); ++i) f += square(y[i] - 1.0) - y[i] * y[i - 1];
      return f;
    });
  }
  expect_proved({"sphere", 0.0, -5.12, 5.12, 6}, [](auto y) {
    Number<decltype(y)> f = 0.0;
    for (const auto& a : y) f += square(a);
    return f;
  });
}

TEST(ProvedMaxima, Waves) {
  for (const std::size_t n : {1U, 2U, 3U, 4U, 5U, 6U}) {
    expect_proved({"Rastrigin", 0.0, -5.12, 5.12, n}, [](auto y) {
      Number<decltype(y)> f = 0.0;
      for (const auto& a : y) f += square(a) + 10.0 * (1.0 - cos(2.0 * kPi * a));
      return f;
    });
  }
  for (const std::size_t n : {1U, 2U}) {
    expect_proved({"Griewank", 0.0, -60.0, 60.0, n}, [](auto y) {
      Number<decltype(y)> f = 1.0, product = 1.0;
      for (std::size_t i = 0; i < y.size(); ++i) {
        f += square(y[i]) / 4000.0;
        product *= cos(y[i] / std::sqrt(static_cast<double>(i + 1)));
      }
      return f - product;
    });
  }
  for (const std::size_t n : {1U, 2U, 3U, 4U}) {
    expect_proved({"Levy", 0.0, -10.0, 10.0, n}, [](auto y) {
      const auto w = [&](std::size_t i) { return 1.0 + (y[i] - 1.0) / 4.0; };
      const std::size_t last = y.size() - 1;
      Number<decltype(y)> f = square(sin(kPi * w(0)));
      for (std::size_t i = 0; i < last; ++i) {
        f += square(w(i) - 1.0) * (1.0 + 10.0 * square(sin(kPi * w(i) + 1.0)));
      }
      return f + square(w(last) - 1.0) * (1.0 + square(sin(2.0 * kPi * w(last))));
    });
  }
  expect_proved({"Branin", 0.39788735773, 0.0, 15.0, 2}, [](auto y) {
    const auto a = y[0] - 5.0, b = y[1];  // in [-5, 10] and [0, 15]
    return square(b - 5.1 / (4.0 * kPi * kPi) * square(a) + 5.0 / kPi * a - 6.0) +
           10.0 * (1.0 - 1.0 / (8.0 * kPi)) * cos(a) + 10.0;
  });
  expect_proved({"McCormick", -1.9132229549, -1.6, 4.0, 2}, [](auto y) {
    return sin(y[0] + y[1]) + square(y[0] - y[1]) - 1.5 * y[0] + 2.5 * y[1] + 1.0;
  });
  expect_proved({"Bohachevsky", 0.0, -100.0, 100.0, 2}, [](auto y) {
    return square(y[0]) + 2.0 * square(y[1]) - 0.3 * cos(3.0 * kPi * y[0]) -
           0.4 * cos(4.0 * kPi * y[1]) + 0.7;
  });
  expect_proved({"Shubert", -186.7309088, -10.0, 10.0, 2}, [](auto y) {
    Number<decltype(y)> product = 1.0;
    for (const auto& a : y) {
      Number<decltype(y)> sum = 0.0;
      for (double i = 1.0; i <= 5.0; i += 1.0) sum += i * cos((i + 1.0) * a + i);
      product *= sum;
    }
    return product;
  });
  expect_proved({"Schwefel", -418.9828872724, 1.0, 500.0, 1},
                [](auto y) { return -(y[0] * sin(sqrt(y[0]))); });
  expect_proved({"Schwefel", -837.9657745449, 1.0, 500.0, 2},
                [](auto y) { return -(y[0] * sin(sqrt(y[0])) + y[1] * sin(sqrt(y[1]))); });
}

TEST(ProvedMaxima, Peaks) {
  expect_proved({"Easom", -1.0, -20.0, 20.0, 2}, [](auto y) {
    return -(cos(y[0]) * cos(y[1]) * exp(-(square(y[0] - kPi) + square(y[1] - kPi))));
  });
  constexpr std::array<std::array<double, 3>, 4> kA3 = {
      {{3.0, 10.0, 30.0}, {0.1, 10.0, 35.0}, {3.0, 10.0, 30.0}, {0.1, 10.0, 35.0}}};
  constexpr std::array<std::array<double, 3>, 4> kP3 = {{{0.3689, 0.1170, 0.2673},
                                                         {0.4699, 0.4387, 0.7470},
                                                         {0.1091, 0.8732, 0.5547},
                                                         {0.0381, 0.5743, 0.8828}}};
  constexpr std::array kC = {1.0, 1.2, 3.0, 3.2};
  expect_proved({"Hartman 3", -3.86278214782, 0.0, 1.0, 3}, [&](auto y) {
    Number<decltype(y)> f = 0.0;
    for (std::size_t i = 0; i < 4; ++i) {
      Number<decltype(y)> e = 0.0;
      for (std::size_t j = 0; j < 3; ++j) e += kA3[i][j] * square(y[j] - kP3[i][j]);
      f -= kC[i] * exp(-e);
    }
    return f;
  });
  constexpr std::array<std::array<double, 4>, 5> kShekel = {{{4.0, 4.0, 4.0, 4.0},
                                                             {1.0, 1.0, 1.0, 1.0},
                                                             {8.0, 8.0, 8.0, 8.0},
                                                             {6.0, 6.0, 6.0, 6.0},
                                                             {3.0, 7.0, 3.0, 7.0}}};
  constexpr std::array kWidth = {0.1, 0.2, 0.2, 0.4, 0.4};
  expect_proved({"Shekel 5", -10.1531996791, 0.0, 10.0, 4}, [&](auto y) {
    Number<decltype(y)> f = 0.0;
    for (std::size_t i = 0; i < 5; ++i) {
      Number<decltype(y)> e = kWidth[i];
      for (std::size_t j = 0; j < 4; ++j) e += square(y[j] - kShekel[i][j]);
      f -= 1.0 / e;
    }
    return f;
  });
}

}  // namespace
}  // namespace ipminmax
