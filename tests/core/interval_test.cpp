// Intervals enclose: every operation against points inside, in long double.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/formulas/autodiff.hpp"
#include "core/formulas/interval.hpp"

namespace ipminmax {
namespace {

using Long = long double;

struct UnaryCase {
  const char* name;
  Interval (*over)(const Interval&);
  Long (*at)(Long);
  double from, to;  ///< arguments
};

const std::vector<UnaryCase> kUnary = {
    {"sqrt", [](const Interval& a) { return sqrt(a); }, [](Long x) { return std::sqrt(x); }, 0, 50},
    {"exp", [](const Interval& a) { return exp(a); }, [](Long x) { return std::exp(x); }, -30, 30},
    {"log", [](const Interval& a) { return log(a); }, [](Long x) { return std::log(x); }, 1e-9, 9},
    {"sin", [](const Interval& a) { return sin(a); }, [](Long x) { return std::sin(x); }, -40, 40},
    {"cos", [](const Interval& a) { return cos(a); }, [](Long x) { return std::cos(x); }, -40, 40},
    {"tan", [](const Interval& a) { return tan(a); }, [](Long x) { return std::tan(x); }, -9, 9},
    {"asin", [](const Interval& a) { return asin(a); }, [](Long x) { return std::asin(x); }, -1, 1},
    {"acos", [](const Interval& a) { return acos(a); }, [](Long x) { return std::acos(x); }, -1, 1},
    {"atan", [](const Interval& a) { return atan(a); }, [](Long x) { return std::atan(x); }, -9, 9},
    {"sinh", [](const Interval& a) { return sinh(a); }, [](Long x) { return std::sinh(x); }, -9, 9},
    {"cosh", [](const Interval& a) { return cosh(a); }, [](Long x) { return std::cosh(x); }, -9, 9},
    {"tanh", [](const Interval& a) { return tanh(a); }, [](Long x) { return std::tanh(x); }, -9, 9},
    {"abs", [](const Interval& a) { return abs(a); }, [](Long x) { return std::abs(x); }, -9, 9},
    {"square", [](const Interval& a) { return square(a); }, [](Long x) { return x * x; }, -9, 9},
    {"pow 3", [](const Interval& a) { return pow(a, 3); }, [](Long x) { return x * x * x; }, -9, 9},
    {"pow 4", [](const Interval& a) { return pow(a, 4.0); }, [](Long x) { return x * x * x * x; },
     -9, 9},
    {"pow -2", [](const Interval& a) { return pow(a, -2); }, [](Long x) { return 1 / (x * x); }, -9,
     9},
    {"pow 1.7", [](const Interval& a) { return pow(a, 1.7); },
     [](Long x) { return std::pow(x, Long(1.7)); }, 0, 9},
    {"pow -0.5", [](const Interval& a) { return pow(a, -0.5); },
     [](Long x) { return 1 / std::sqrt(x); }, 0.1, 9}};

struct BinaryCase {
  const char* name;
  Interval (*over)(const Interval&, const Interval&);
  Long (*at)(Long, Long);
};

const std::vector<BinaryCase> kBinary = {
    {"+", [](const Interval& a, const Interval& b) { return a + b; },
     [](Long x, Long y) { return x + y; }},
    {"-", [](const Interval& a, const Interval& b) { return a - b; },
     [](Long x, Long y) { return x - y; }},
    {"*", [](const Interval& a, const Interval& b) { return a * b; },
     [](Long x, Long y) { return x * y; }},
    {"/", [](const Interval& a, const Interval& b) { return a / b; },
     [](Long x, Long y) { return x / y; }},
    {"atan2", [](const Interval& a, const Interval& b) { return atan2(a, b); },
     [](Long x, Long y) { return std::atan2(x, y); }},
    {"hypot", [](const Interval& a, const Interval& b) { return hypot(a, b); },
     [](Long x, Long y) { return std::hypot(x, y); }},
    {"pow", [](const Interval& a, const Interval& b) { return pow(a, b); },
     [](Long x, Long y) { return std::pow(x, y); }}};

/// Of every size, points among them.
Interval some_interval(std::mt19937_64& random, double from, double to) {
  std::uniform_real_distribution<double> place(from, to), size(-16.0, 0.5);
  const double a = place(random);
  const double width = (to - from) * std::pow(10.0, size(random));
  return {a, random() % 8 == 0 ? a : std::min(to, a + width)};
}

double some_point(std::mt19937_64& random, const Interval& a) {
  const auto choice = random() % 4;
  if (choice == 0) return a.lower();
  if (choice == 1) return a.upper();
  std::uniform_real_distribution<double> share(0.0, 1.0);
  return std::clamp(a.lower() + share(random) * (a.upper() - a.lower()), a.lower(), a.upper());
}

TEST(Interval, FunctionsEnclose) {
  std::mt19937_64 random(20260);
  for (const UnaryCase& f : kUnary) {
    for (int k = 0; k < 20000; ++k) {
      const Interval a = some_interval(random, f.from, f.to);
      const double x = some_point(random, a);
      const Interval over = f.over(a);
      const Long value = f.at(x);
      ASSERT_TRUE(static_cast<Long>(over.lower()) <= value &&
                  value <= static_cast<Long>(over.upper()))
          << f.name << " at " << x << " in [" << a.lower() << ", " << a.upper() << "]";
    }
  }
}

TEST(Interval, OperationsEnclose) {
  std::mt19937_64 random(20261);
  for (const BinaryCase& f : kBinary) {
    for (int k = 0; k < 20000; ++k) {
      const Interval a = some_interval(random, -9.0, 9.0), b = some_interval(random, -9.0, 9.0);
      const double x = some_point(random, a), y = some_point(random, b);
      const Interval over = f.over(a, b);
      const Long value = f.at(x, y);
      if (!std::isfinite(value)) continue;
      ASSERT_TRUE(static_cast<Long>(over.lower()) <= value &&
                  value <= static_cast<Long>(over.upper()))
          << f.name << " at " << x << ", " << y;
    }
  }
}

/// Nearly as narrow as can be: a bound that is always infinite would enclose, too.
TEST(Interval, IsTight) {
  const auto width = [](const Interval& a) { return a.upper() - a.lower(); };
  for (const UnaryCase& f : kUnary) {
    const double x = 0.25 * f.from + 0.75 * f.to + 0.1;
    if (x > f.to) continue;
    const double value = static_cast<double>(f.at(x));
    EXPECT_LT(width(f.over(x)), 1e-13 * std::max(1.0, std::abs(value) * std::abs(x))) << f.name;
  }
  EXPECT_EQ(sin(Interval(0.0, 4.0)).upper(), 1.0);
  EXPECT_EQ(cos(Interval(3.0, 3.5)).lower(), -1.0);
  EXPECT_LT(cos(Interval(3.0, 3.5)).upper(), -0.9);
  EXPECT_EQ(square(Interval(-1.0, 2.0)).lower(), 0.0);
}

/// Ends among zeros, the smallest and the largest numbers and infinity, and numbers of every size.
double some_end(std::mt19937_64& random) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  constexpr std::array kSpecial = {0.0,
                                   -0.0,
                                   5e-324,
                                   -5e-324,
                                   2.3e-308,
                                   1e-200,
                                   1.0,
                                   -1.0,
                                   0.5,
                                   3.0,
                                   -2.0,
                                   1e9,
                                   1e200,
                                   -1e200,
                                   1.7e308,
                                   -1.7e308,
                                   kInfinite,
                                   -kInfinite,
                                   0.7853981633974483};
  if (random() % 2 == 0) return kSpecial[random() % kSpecial.size()];
  std::uniform_real_distribution<double> mantissa(-1.0, 1.0), exponent(-12.0, 12.0);
  return mantissa(random) * std::pow(10.0, exponent(random));
}

Interval any_interval(std::mt19937_64& random) {
  const double a = some_end(random), b = random() % 4 == 0 ? a : some_end(random);
  return {std::min(a, b), std::max(a, b)};
}

double any_point(std::mt19937_64& random, const Interval& a) {
  const double x = random() % 2 == 0 ? some_point(random, a) : some_end(random);
  return (std::isfinite(x) && a.contains(x) ? x : a.middle()) + 0.0;  // not -0
}

/// Whether it holds the value, which long double knows to its own rounding.
bool holds(const Interval& a, Long value) {
  return std::isnan(value) ||
         (static_cast<Long>(a.lower()) <= value && value <= static_cast<Long>(a.upper()));
}

/// 10^6 operations.
TEST(Interval, OperationsOnAnyOperandsEnclose) {
  std::mt19937_64 random(20263);
  constexpr int kOperands = 20'000;
  for (const UnaryCase& f : kUnary) {
    for (int k = 0; k < kOperands; ++k) {
      const Interval a = any_interval(random);
      const double x = any_point(random, a);
      const Interval over = f.over(a);
      ASSERT_TRUE(over.lower() <= over.upper() && holds(over, f.at(x)))
          << f.name << " at " << x << " in [" << a.lower() << ", " << a.upper() << "]: ["
          << over.lower() << ", " << over.upper() << "]";
    }
  }
  for (const BinaryCase& f : kBinary) {
    for (int k = 0; k < 5 * kOperands; ++k) {
      const Interval a = any_interval(random), b = any_interval(random);
      const double x = any_point(random, a), y = any_point(random, b);
      const Interval over = f.over(a, b);
      ASSERT_TRUE(over.lower() <= over.upper() && holds(over, f.at(x, y)))
          << f.name << " at " << x << ", " << y << " in [" << a.lower() << ", " << a.upper()
          << "], [" << b.lower() << ", " << b.upper() << "]: [" << over.lower() << ", "
          << over.upper() << "]";
    }
  }
}

TEST(Interval, InfiniteEndsAndUndefinedValues) {
  const Interval all = Interval::all(), zero = 0.0;
  EXPECT_TRUE((all * zero).is_zero());
  EXPECT_EQ((all + Interval(1.0)).upper(), all.upper());
  EXPECT_EQ((Interval(1.0) / Interval(-1.0, 1.0)).lower(), all.lower());
  EXPECT_EQ(log(Interval(-1.0, 1.0)).lower(), all.lower());
  EXPECT_EQ(sqrt(Interval(-1.0, 4.0)).lower(), 0.0);
  EXPECT_EQ(exp(Interval(800.0)).upper(), all.upper());
  EXPECT_TRUE(exp(Interval(800.0)).lower() > 1e308);
  EXPECT_EQ(tan(Interval(1.0, 2.0)).lower(), all.lower());
  EXPECT_EQ(Interval(std::nan("")).upper(), all.upper());
  const Interval far(1.0, all.upper()), near_minus(all.lower(), -1.0);
  EXPECT_EQ((far / near_minus).lower(), all.lower());
  EXPECT_EQ((far / near_minus).upper(), 0.0);
  EXPECT_EQ((far / far).lower(), 0.0);
  EXPECT_EQ((far / far).upper(), all.upper());
}

/// A slope tells where a function goes from any point of the box, into its neighbours, too: where
/// the function has a kink or none of the values, it may be any between, or any.
TEST(IntervalJet, SlopesAtTheEndsOfBoxes) {
  const auto slope = [](double lower, double upper, auto f) {
    return f(IntervalJet({lower, upper}, 0, 1)).gradient(0);
  };
  const auto is_open = [](const Interval& a) { return a.lower() < 0.0 && a.upper() > 0.0; };
  const auto reciprocal = [](const IntervalJet& y) { return 1.0 / y - y; };
  for (const auto& [lower, upper] : {std::pair(0.0, 1.0), {-1.0, 0.0}, {0.0, 0.0}, {-1.0, 1.0}}) {
    EXPECT_TRUE(is_open(slope(lower, upper, [](const IntervalJet& y) { return abs(y); })));
    EXPECT_TRUE(is_open(slope(lower, upper, reciprocal)));
    EXPECT_TRUE(is_open(slope(lower, upper, [](const IntervalJet& y) { return log(y) + y; })));
  }
  EXPECT_TRUE(is_open(slope(1.0, 2.0, [](const IntervalJet& y) { return tan(y); })));
  EXPECT_GT(slope(0.0, 1.0, [](const IntervalJet& y) { return tan(y); }).lower(), 0.9);
  EXPECT_EQ(slope(0.5, 1.0, [](const IntervalJet& y) { return abs(y); }).lower(), 1.0);
}

TEST(Interval, ComparisonsThatDifferAreRefused) {
  EXPECT_TRUE(Interval(0.0, 1.0) < Interval(2.0));
  EXPECT_FALSE(Interval(2.0, 3.0) < Interval(2.0));
  EXPECT_THROW(static_cast<void>(Interval(0.0, 1.0) < Interval(0.5)), UndecidedComparison);
  EXPECT_THROW(static_cast<void>(IntervalJet(Interval(0.0, 1.0)) > IntervalJet(0.5)),
               UndecidedComparison);
}

/// All functions in one formula of two variables, none near where it is undefined.
template <class T>
T everything(const T& x, const T& y) {
  return sqrt(x + 3.0) * exp(y) - log(x * y + 5.0) + sin(x) * cos(y) / (2.0 + square(y)) +
         tan(0.3 * x) + asin(0.3 * y) - acos(0.3 * x) * atan(x - y) + sinh(x) + cosh(y) -
         tanh(x * y) + pow(x + 3.0, 1.5) - pow(y, 3) + atan2(x, y + 3.0) + hypot(x + 3.0, y) +
         abs(x + 4.0) - fabs(y - 4.0) + pow(x + 3.0, y);
}

// Derivatives at points against differences, and over boxes against points.
TEST(IntervalJet, DerivativesEnclose) {
  std::mt19937_64 random(20262);
  std::uniform_real_distribution<double> place(-1.0, 1.0), size(0.0, 0.2);
  for (int k = 0; k < 300; ++k) {
    const double x = place(random), y = place(random);
    const IntervalJet at = everything(IntervalJet(x, 0, 2), IntervalJet(y, 1, 2));
    const double h = 1e-3;
    const auto f = [](double a, double b) { return everything<Plain>(a, b).value(); };
    const double slopes[2] = {(f(x + h, y) - f(x - h, y)) / (2 * h),
                              (f(x, y + h) - f(x, y - h)) / (2 * h)};
    const double mixed =
        (f(x + h, y + h) - f(x + h, y - h) - f(x - h, y + h) + f(x - h, y - h)) / (4 * h * h);
    const double bent = (f(x + h, y) - 2 * f(x, y) + f(x - h, y)) / (h * h);
    for (const std::size_t i : {0U, 1U}) {
      EXPECT_NEAR(at.gradient(i).middle(), slopes[i], 1e-3);
      EXPECT_LT(at.gradient(i).upper() - at.gradient(i).lower(), 1e-11);
    }
    EXPECT_NEAR(at.hessian(1, 0).middle(), mixed, 1e-3);
    EXPECT_NEAR(at.hessian(0, 0).middle(), bent, 1e-3);
    const Interval over_x(x - size(random), x + size(random)), over_y(y - size(random), y);
    const IntervalJet over = everything(IntervalJet(over_x, 0, 2), IntervalJet(over_y, 1, 2));
    const auto inside = [](const Interval& a, const Interval& b) {
      return a.lower() >= b.lower() && a.upper() <= b.upper();
    };
    EXPECT_TRUE(inside(at.value(), over.value()));
    for (const std::size_t i : {0U, 1U}) {
      EXPECT_TRUE(inside(at.gradient(i), over.gradient(i)));
      for (std::size_t j = 0; j <= i; ++j) {
        EXPECT_TRUE(inside(at.hessian(i, j), over.hessian(i, j)));
      }
    }
  }
}

}  // namespace
}  // namespace ipminmax
