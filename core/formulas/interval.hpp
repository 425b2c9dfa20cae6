#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <numbers>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "../../linalg/api.hpp"
#include "numbers.hpp"

/// @file
/// Numbers that enclose: formulas written once for any number type (autodiff_problem.hpp) are
/// bounded over whole boxes, for proofs (proof.hpp). Every operation rounds outward, whatever the
/// compiler does with the rest of the program. A result of + - * / sqrt, which is correctly
/// rounded, is moved by one unit in the last place, that of another function of the C library by
/// kLibraryUlps. Sources: R. E. Moore, R. B. Kearfott, M. J. Cloud, Introduction to Interval
/// Analysis (SIAM 2009); errors of the functions: the GNU C library's manual, "Known Maximum Errors
/// in Math Functions".
namespace ipminmax {

/// Thrown if the outcome of a comparison differs between the points of a box: formulas that branch
/// cannot be enclosed.
class UndecidedComparison : public std::domain_error {
 public:
  UndecidedComparison()
      : std::domain_error("the formulas compare values whose order differs within a box") {}
};

/// Base of a type T that encloses numbers: what follows from T's operator < and functions.
template <class T>
class Enclosing {
 public:
  friend bool operator>(const T& a, const T& b) { return b < a; }
  friend bool operator<=(const T& a, const T& b) { return !(b < a); }
  friend bool operator>=(const T& a, const T& b) { return !(a < b); }
  friend T hypot(const T& a, const T& b) { return sqrt(square(a) + square(b)); }
};

/// All numbers between two ends, which may be infinite.
class Interval : public autodiff::Number<Interval>, public Enclosing<Interval> {
 public:
  Interval(double value = 0.0) : Interval(value, value) {}  // NOLINT: conversion is the point
  /// Makes the interval of all numbers if an end is NaN or the ends are in the wrong order.
  Interval(double lower, double upper) : lower_(lower), upper_(upper) {
    if (!(lower <= upper) || lower == kInf || upper == -kInf) *this = all();
  }
  [[nodiscard]] static Interval all() {
    Interval r;
    r.lower_ = -kInf;
    r.upper_ = kInf;
    return r;
  }

  [[nodiscard]] double lower() const { return lower_; }
  [[nodiscard]] double upper() const { return upper_; }
  [[nodiscard]] bool contains(double x) const { return lower_ <= x && x <= upper_; }
  [[nodiscard]] bool is_zero() const { return lower_ == 0.0 && upper_ == 0.0; }
  /// Returns the largest absolute value.
  [[nodiscard]] double magnitude() const { return std::max(std::abs(lower_), std::abs(upper_)); }
  /// Returns a number inside, the midpoint if both ends are finite.
  [[nodiscard]] double middle() const {
    if (lower_ == -kInf) return upper_ == kInf ? 0.0 : upper_;
    return upper_ == kInf ? lower_ : std::clamp(0.5 * lower_ + 0.5 * upper_, lower_, upper_);
  }

  friend Interval operator+(const Interval& a, const Interval& b) {
    if (a.is_zero()) return b;
    if (b.is_zero()) return a;
    return {down(a.lower_ + b.lower_), up(a.upper_ + b.upper_)};
  }
  friend Interval operator-(const Interval& a) { return {-a.upper_, -a.lower_}; }
  friend Interval operator-(const Interval& a, const Interval& b) { return a + -b; }
  friend Interval operator*(const Interval& a, const Interval& b) {
    if (a.is_zero() || b.is_zero()) return 0.0;
    return hull(a, b,
                {times(a.lower_, b.lower_), times(a.lower_, b.upper_), times(a.upper_, b.lower_),
                 times(a.upper_, b.upper_)});
  }
  friend Interval operator/(const Interval& a, const Interval& b) {
    if (b.contains(0.0)) return all();
    if (a.is_zero()) return 0.0;
    return hull(a, b,
                {over(a.lower_, b.lower_), over(a.lower_, b.upper_), over(a.upper_, b.lower_),
                 over(a.upper_, b.upper_)});
  }

  /// Returns the numbers in both. If there are none, which only rounding can cause, returns a.
  friend Interval intersection(const Interval& a, const Interval& b) {
    const double lower = std::max(a.lower_, b.lower_), upper = std::min(a.upper_, b.upper_);
    return lower <= upper ? Interval(lower, upper) : a;
  }

  friend bool operator<(const Interval& a, const Interval& b) {
    if (a.upper_ < b.lower_) return true;
    if (a.lower_ >= b.upper_) return false;
    throw UndecidedComparison();
  }
  friend bool operator==(const Interval& a, const Interval& b) {
    if (a.lower_ == a.upper_ && b.lower_ == b.upper_) return a.lower_ == b.lower_;
    if (a.upper_ < b.lower_ || b.upper_ < a.lower_) return false;
    throw UndecidedComparison();
  }

  /// Of the numbers for which they are defined.
  friend Interval sqrt(const Interval& a) {
    if (a.upper_ < 0.0) return all();
    return {a.lower_ <= 0.0 ? 0.0 : down(std::sqrt(a.lower_)), up(std::sqrt(a.upper_))};
  }
  friend Interval log(const Interval& a) {
    if (a.upper_ <= 0.0) return all();
    return {a.lower_ <= 0.0 ? -kInf : wide_down(std::log(a.lower_)), wide_up(std::log(a.upper_))};
  }
  friend Interval asin(const Interval& a) {
    if (a.upper_ < -1.0 || a.lower_ > 1.0) return all();
    return {wide_down(std::asin(std::max(a.lower_, -1.0))),
            wide_up(std::asin(std::min(a.upper_, 1.0)))};
  }
  friend Interval acos(const Interval& a) {
    if (a.upper_ < -1.0 || a.lower_ > 1.0) return all();
    return {std::max(0.0, wide_down(std::acos(std::min(a.upper_, 1.0)))),
            wide_up(std::acos(std::max(a.lower_, -1.0)))};
  }

  friend Interval exp(const Interval& a) {
    return {std::max(0.0, wide_down(std::exp(a.lower_))), wide_up(std::exp(a.upper_))};
  }
  friend Interval atan(const Interval& a) {
    return {wide_down(std::atan(a.lower_)), wide_up(std::atan(a.upper_))};
  }
  friend Interval sinh(const Interval& a) {
    return {wide_down(std::sinh(a.lower_)), wide_up(std::sinh(a.upper_))};
  }
  friend Interval cosh(const Interval& a) {
    const Interval size = abs(a);
    return {std::max(1.0, wide_down(std::cosh(size.lower_))), wide_up(std::cosh(size.upper_))};
  }
  friend Interval tanh(const Interval& a) {
    return {std::max(-1.0, wide_down(std::tanh(a.lower_))),
            std::min(1.0, wide_up(std::tanh(a.upper_)))};
  }
  friend Interval cos(const Interval& a) {
    constexpr double kMost = 1e9;  // beyond, whole turns cannot be told
    if (!(a.magnitude() < kMost)) return {-1.0, 1.0};
    const Interval turns = a / (pi() * 2.0);
    const double low = std::min(wide_down(std::cos(a.lower_)), wide_down(std::cos(a.upper_)));
    const double high = std::max(wide_up(std::cos(a.lower_)), wide_up(std::cos(a.upper_)));
    const bool one = std::ceil(turns.lower_) <= std::floor(turns.upper_);
    const Interval half = turns - 0.5;  // whole ones: -1
    const bool minus_one = std::ceil(half.lower_) <= std::floor(half.upper_);
    return {minus_one ? -1.0 : std::max(-1.0, low), one ? 1.0 : std::min(1.0, high)};
  }
  friend Interval sin(const Interval& a) { return cos(a - pi() * 0.5); }
  friend Interval tan(const Interval& a) {
    const Interval c = cos(a);
    // Less than half a turn without a pole: increasing.
    if (c.contains(0.0) || !(a.upper_ - a.lower_ < 3.0)) return all();
    return {wide_down(std::tan(a.lower_)), wide_up(std::tan(a.upper_))};
  }
  friend Interval abs(const Interval& a) {
    if (a.lower_ >= 0.0) return a;
    if (a.upper_ <= 0.0) return -a;
    return {0.0, a.magnitude()};
  }
  friend Interval square(const Interval& a) {
    const Interval size = abs(a);
    return {size.lower_ == 0.0 ? 0.0 : std::max(0.0, down(size.lower_ * size.lower_)),
            size.is_zero() ? 0.0 : up(size.upper_ * size.upper_)};
  }
  /// Of a >= 0 unless p is whole.
  friend Interval pow(const Interval& a, double p) {
    if (p == 0.0) return 1.0;
    if (p == 1.0) return a;
    if (p == 2.0) return square(a);
    if (p < 0.0) return Interval(1.0) / pow(a, -p);
    const bool whole = std::floor(p) == p;
    const bool even = whole && std::fmod(p, 2.0) == 0.0;
    if (!whole && a.upper_ < 0.0) return all();
    const Interval base = even ? abs(a) : a;
    const double from = whole ? base.lower_ : std::max(0.0, base.lower_);
    const double low = wide_down(std::pow(from, p));
    return {from >= 0.0 ? std::max(0.0, low) : low, wide_up(std::pow(base.upper_, p))};
  }
  friend Interval pow(const Interval& a, const Interval& p) {
    if (p.lower_ == p.upper_) return pow(a, p.lower_);
    return a.lower_ < 0.0 ? all() : exp(p * log(a));  // of a < 0 where p is whole
  }
  friend Interval atan2(const Interval& y, const Interval& x) {
    if (x.lower_ > 0.0) return atan(y / x);
    if (y.lower_ > 0.0) return pi() * 0.5 - atan(x / y);
    if (y.upper_ < 0.0) return -(pi() * 0.5) - atan(x / y);
    return {-pi().upper_, pi().upper_};
  }

 private:
  static constexpr double kInf = std::numeric_limits<double>::infinity();
  /// Twice the largest error in the manual's table, of cosh and tanh.
  static constexpr double kLibraryUlps = 4.0;

  static double down(double x) { return std::nextafter(x, -kInf); }
  static double up(double x) { return std::nextafter(x, kInf); }
  static double margin(double x) {
    return kLibraryUlps * std::numeric_limits<double>::epsilon() * std::abs(x);
  }
  static double wide_down(double x) {
    return std::isfinite(x) ? down(down(x - margin(x))) : down(x);
  }
  static double wide_up(double x) { return std::isfinite(x) ? up(up(x + margin(x))) : up(x); }
  static double times(double x, double y) { return x == 0.0 || y == 0.0 ? 0.0 : x * y; }
  /// Of infinite ends the limit, which other ends of theirs enclose.
  static double over(double x, double y) { return std::isinf(y) ? 0.0 : x / y; }
  /// Of a product or quotient of a and b, whose signs decide on its own where it underflows.
  static Interval hull(const Interval& a, const Interval& b, std::initializer_list<double> ends) {
    const auto [least, most] = std::minmax(ends);
    const bool same = (a.lower_ >= 0.0 && b.lower_ >= 0.0) || (a.upper_ <= 0.0 && b.upper_ <= 0.0);
    const bool unlike =
        (a.lower_ >= 0.0 && b.upper_ <= 0.0) || (a.upper_ <= 0.0 && b.lower_ >= 0.0);
    return {same ? std::max(0.0, down(least)) : down(least),
            unlike ? std::min(0.0, up(most)) : up(most)};
  }
  /// The nearest double is below.
  static Interval pi() { return {std::numbers::pi, up(std::numbers::pi)}; }

  double lower_ = 0.0, upper_ = 0.0;
};

/// A value over a box with its first and second derivatives along a few directions. A direction is
/// a variable whose derivative along it is 1. Derivatives also enclose those just outside the ends
/// of the box. If the box touches a kink, a pole or an end of the formula's domain, they contain
/// all one-sided slopes. So a slope of strict sign has this sign in touching boxes as well.
class IntervalJet : public autodiff::Differentiated<IntervalJet>, public Enclosing<IntervalJet> {
 public:
  /// Largest number of directions; the work of a proof grows exponentially with it.
  static constexpr std::size_t kMostDirections = 8;

  IntervalJet(double constant = 0.0) : value_(constant) {}  // NOLINT: conversion is the point
  explicit IntervalJet(const Interval& value) : value_(value) {}
  /// The variable of one direction among `directions`.
  IntervalJet(const Interval& value, std::size_t direction, std::size_t directions)
      : value_(value), directions_(directions) {
    gradient_[direction] = 1.0;
  }

  [[nodiscard]] const Interval& value() const { return value_; }
  [[nodiscard]] const Interval& gradient(std::size_t i) const { return gradient_[i]; }
  /// i >= j
  [[nodiscard]] const Interval& hessian(std::size_t i, std::size_t j) const {
    return hessian_[place(i, j)];
  }

  friend IntervalJet operator+(const IntervalJet& a, const IntervalJet& b) {
    return each(a, b, [](const Interval& x, const Interval& y) { return x + y; });
  }
  friend IntervalJet operator-(const IntervalJet& a, const IntervalJet& b) {
    return each(a, b, [](const Interval& x, const Interval& y) { return x - y; });
  }
  friend IntervalJet operator-(const IntervalJet& a) { return IntervalJet(0.0) - a; }
  friend IntervalJet operator*(const IntervalJet& a, const IntervalJet& b) {
    IntervalJet r(a.value_ * b.value_);
    r.directions_ = std::max(a.directions_, b.directions_);
    for (std::size_t i = 0; i < r.directions_; ++i) {
      r.gradient_[i] = a.gradient_[i] * b.value_ + a.value_ * b.gradient_[i];
      for (std::size_t j = 0; j <= i; ++j) {
        r.hessian_[place(i, j)] = a.hessian(i, j) * b.value_ + a.value_ * b.hessian(i, j) +
                                  a.gradient_[i] * b.gradient_[j] + a.gradient_[j] * b.gradient_[i];
      }
    }
    return r;
  }
  friend IntervalJet operator/(const IntervalJet& a, const IntervalJet& b) {
    const Interval inverse = Interval(1.0) / b.value_, slope = -(inverse * inverse);
    return a * chain(b, {inverse, slope, -2.0 * slope * inverse});
  }
  friend bool operator<(const IntervalJet& a, const IntervalJet& b) { return a.value_ < b.value_; }
  friend bool operator==(const IntervalJet& a, const IntervalJet& b) {
    return a.value_ == b.value_;
  }

  friend IntervalJet tan(const IntervalJet& a) {
    const Interval t = tan(a.value_), slope = Interval(1.0) / square(cos(a.value_));
    return chain(a, {t, slope, 2.0 * t * slope});
  }
  friend IntervalJet abs(const IntervalJet& a) {
    if (a.value_.lower() > 0.0) return a;
    if (a.value_.upper() < 0.0) return -a;
    return chain(a, {abs(a.value_), {-1.0, 1.0}, Interval::all()});
  }
  friend IntervalJet pow(const IntervalJet& a, double p) {
    if (p == 0.0) return 1.0;
    if (p == 1.0) return a;
    if (std::floor(p) != p && a.value_.lower() < 0.0) {  // an end of where it is defined
      return chain(a, {pow(a.value_, p), Interval::all(), Interval::all()});
    }
    return chain(a, autodiff::table::derivatives_of_pow(a.value_, p));
  }
  friend IntervalJet pow(const IntervalJet& a, const IntervalJet& p) {
    if (p.directions_ == 0 && p.value_.lower() == p.value_.upper()) return pow(a, p.value_.lower());
    if (a.value_.lower() < 0.0) return unknown(pow(a.value_, p.value_), a, p);
    return exp(p * log(a));
  }
  friend IntervalJet atan2(const IntervalJet& y, const IntervalJet& x) {
    const Interval half_turn = atan2(Interval(1.0), Interval(0.0, 0.0));
    if (x.value_.lower() > 0.0) return atan(y / x);
    if (y.value_.lower() > 0.0) return IntervalJet(half_turn) - atan(x / y);
    if (y.value_.upper() < 0.0) return IntervalJet(-half_turn) - atan(x / y);
    return unknown(atan2(y.value_, x.value_), y, x);  // the cut, or the origin
  }

 private:
  friend autodiff::Differentiated<IntervalJet>;
  static std::size_t place(std::size_t i, std::size_t j) { return i * (i + 1) / 2 + j; }

  template <class Operation>
  static IntervalJet each(const IntervalJet& a, const IntervalJet& b, Operation operation) {
    IntervalJet r(operation(a.value_, b.value_));
    r.directions_ = std::max(a.directions_, b.directions_);
    for (std::size_t i = 0; i < r.directions_; ++i) {
      r.gradient_[i] = operation(a.gradient_[i], b.gradient_[i]);
      for (std::size_t j = 0; j <= i; ++j) {
        r.hessian_[place(i, j)] = operation(a.hessian(i, j), b.hessian(i, j));
      }
    }
    return r;
  }
  /// Nothing is known of the derivatives.
  static IntervalJet unknown(const Interval& value, const IntervalJet& a, const IntervalJet& b) {
    IntervalJet r(value);
    r.directions_ = std::max(a.directions_, b.directions_);
    r.gradient_.fill(Interval::all());
    r.hessian_.fill(Interval::all());
    return r;
  }
  /// h(a) with h' and h'' over the values of a: h' a_i, h'' a_i a_j + h' a_ij.
  static IntervalJet chain(const IntervalJet& a, const autodiff::Unary<Interval>& h) {
    const auto& [value, first, second] = h;
    IntervalJet r(value);
    r.directions_ = a.directions_;
    for (std::size_t i = 0; i < a.directions_; ++i) {
      r.gradient_[i] = first * a.gradient_[i];
      for (std::size_t j = 0; j <= i; ++j) {
        const Interval product = i == j ? square(a.gradient_[i]) : a.gradient_[i] * a.gradient_[j];
        r.hessian_[place(i, j)] = second * product + first * a.hessian(i, j);
      }
    }
    return r;
  }
  template <class F>
  static IntervalJet unary(const IntervalJet& a, F f) {
    return chain(a, f(a.value_));
  }

  Interval value_;
  std::size_t directions_ = 0;
  std::array<Interval, kMostDirections> gradient_{};
  std::array<Interval, kMostDirections*(kMostDirections + 1) / 2> hessian_{};
};

}  // namespace ipminmax

namespace IPMINMAX_API ipminmax {

/// A model's functions over boxes of its variables, for proofs. Both throw std::domain_error if the
/// formulas cannot be enclosed, UndecidedComparison if they branch within the box.
class BoxFunctions {
 public:
  virtual ~BoxFunctions() = default;
  /// Returns f over the box v (n intervals with derivatives).
  [[nodiscard]] virtual IntervalJet objective_over(std::span<const IntervalJet> v) const = 0;
  /// Writes the constraints over the box v (n) into g (m).
  virtual void constraints_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const = 0;
  /// Writes the constraints into g and returns f.
  [[nodiscard]] virtual IntervalJet all_over(std::span<const IntervalJet> v,
                                             std::span<IntervalJet> g) const {
    constraints_over(v, g);
    return objective_over(v);
  }
  /// Returns whether several threads may call these functions at once.
  [[nodiscard]] virtual bool is_concurrent() const { return false; }

  /// Max's variables that the functions compute from the others, and the constraints that hold for
  /// this reason; for example states that follow from disturbances. The functions do not read them.
  struct Determined {
    std::vector<std::int32_t> variables{}, constraints{};
  };
  /// Returns these variables and constraints; by default there are none.
  [[nodiscard]] virtual Determined determined() const { return {}; }
  /// Computes these variables in v (n).
  virtual void determine(std::span<double> /*v*/) const {}
};

}  // namespace ipminmax
