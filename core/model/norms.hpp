#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <span>

namespace ipminmax {

/// The larger of two numbers, NaN when either is.
[[nodiscard]] inline double largest(double a, double b) { return a >= b || std::isnan(a) ? a : b; }

/// Largest |v_i| for begin <= i < end, zero where there are none, NaN when one is.
[[nodiscard]] inline double max_norm(const Eigen::VectorXd& v, Eigen::Index begin,
                                     Eigen::Index end) {
  double norm = 0.0;
  for (Eigen::Index i = begin; i < end; ++i) norm = largest(norm, std::abs(v[i]));
  return norm;
}
/// The same of a whole vector, or of an expression, entry by entry.
template <class Derived>
[[nodiscard]] double max_norm(const Eigen::MatrixBase<Derived>& v) {
  double norm = 0.0;
  for (Eigen::Index i = 0; i < v.size(); ++i) norm = largest(norm, std::abs(v.coeff(i)));
  return norm;
}

[[nodiscard]] inline bool all_finite(std::span<const double> values) {
  return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
}

}  // namespace ipminmax
