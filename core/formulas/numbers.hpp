#pragma once

#include <cmath>

/// @file
/// What the number types of formulas share: operators and functions that follow from others, and
/// one table of functions with their derivatives, for doubles and for intervals.
namespace ipminmax::autodiff {

/// Base of a number type T: what follows from T's own operators, abs and pow.
template <class T>
class Number {
 public:
  using FormulaNumber = void;

  friend T& operator+=(T& a, const T& b) { return a = a + b; }
  friend T& operator-=(T& a, const T& b) { return a = a - b; }
  friend T& operator*=(T& a, const T& b) { return a = a * b; }
  friend T& operator/=(T& a, const T& b) { return a = a / b; }
  friend T operator+(const T& a) { return a; }
  friend T fabs(const T& a) { return abs(a); }
  friend T pow(const T& a, int p) { return pow(a, static_cast<double>(p)); }
};

/// Value and derivatives of a function of one number.
template <class T>
struct Unary {
  T value, a, aa;
};

/// derivatives_of_f(x): f, f' and f'' at x. Operations stand in the order in which doubles are
/// rounded; square(x) is tighter than x x for intervals.
namespace table {

using std::acos, std::asin, std::atan, std::cos, std::cosh, std::exp, std::log, std::pow, std::sin,
    std::sinh, std::sqrt, std::tanh;

inline double square(double x) { return x * x; }

template <class T>
Unary<T> derivatives_of_sqrt(const T& x) {
  const T root = sqrt(x);
  return {root, 0.5 / root, -0.25 / (root * x)};
}
template <class T>
Unary<T> derivatives_of_exp(const T& x) {
  const T e = exp(x);
  return {e, e, e};
}
template <class T>
Unary<T> derivatives_of_log(const T& x) {
  const T inverse = 1.0 / x;
  return {log(x), inverse, -inverse * inverse};
}
template <class T>
Unary<T> derivatives_of_sin(const T& x) {
  const T s = sin(x);
  return {s, cos(x), -s};
}
template <class T>
Unary<T> derivatives_of_cos(const T& x) {
  const T c = cos(x);
  return {c, -sin(x), -c};
}
template <class T>
Unary<T> derivatives_of_asin(const T& x) {
  const T c = 1.0 - square(x), root = sqrt(c);
  return {asin(x), 1.0 / root, x / (c * root)};
}
template <class T>
Unary<T> derivatives_of_acos(const T& x) {
  const T c = 1.0 - square(x), root = sqrt(c);
  return {acos(x), -1.0 / root, -x / (c * root)};
}
template <class T>
Unary<T> derivatives_of_atan(const T& x) {
  const T d = 1.0 / (1.0 + square(x));
  return {atan(x), d, -2.0 * x * d * d};
}
template <class T>
Unary<T> derivatives_of_sinh(const T& x) {
  const T s = sinh(x);
  return {s, cosh(x), s};
}
template <class T>
Unary<T> derivatives_of_cosh(const T& x) {
  const T c = cosh(x);
  return {c, sinh(x), c};
}
template <class T>
Unary<T> derivatives_of_tanh(const T& x) {
  const T t = tanh(x), slope = 1.0 - square(t);
  return {t, slope, -2.0 * t * slope};
}
template <class T>
Unary<T> derivatives_of_square(const T& x) {
  return {square(x), 2.0 * x, 2.0};
}
template <class T>
Unary<T> derivatives_of_pow(const T& x, double p) {
  return {pow(x, p), p * pow(x, p - 1.0), p == 2.0 ? T(2.0) : T(p) * (p - 1.0) * pow(x, p - 2.0)};
}

}  // namespace table

#define IPMINMAX_TABLE(use)                                                                       \
  use(sqrt) use(exp) use(log) use(sin) use(cos) use(asin) use(acos) use(atan) use(sinh) use(cosh) \
      use(tanh)

/// Base of a number type with derivatives, which befriends it: T::unary(a, f) is f(a), f as the
/// functions of the table.
template <class T>
class Differentiated : public Number<T> {
  template <class F>
  static T apply(const T& a, F f) {
    return T::unary(a, f);
  }

 public:
#define IPMINMAX_DIFFERENTIATED(function)                                               \
  friend T function(const T& a) {                                                       \
    return apply(a, [](const auto& x) { return table::derivatives_of_##function(x); }); \
  }
  IPMINMAX_TABLE(IPMINMAX_DIFFERENTIATED)
  IPMINMAX_DIFFERENTIATED(square)
#undef IPMINMAX_DIFFERENTIATED
};

}  // namespace ipminmax::autodiff
