#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "core/problem.hpp"
#include "linalg/numbers.hpp"

/// The only comparisons of points and of values, besides those that Ipopt's tolerances define: a
/// difference counts beside the range of what is compared, so that the same model in other units
/// gives the same answer.
namespace ipminmax {

/// The values seen of one function at points that are compared.
struct ValueRange {
  double least = kInfinity;
  double most = -kInfinity;
  /// Sum of the absolute terms of a value: a value is known to a few units of rounding of them.
  double terms = 0.0;
  /// What differences can matter where values are large; far from there, as at the ends of a wide
  /// box, the function may be anything.
  double cap = kInfinity;
  double accuracy = 0.0;  ///< differences up to it are left undecided by a solve

  void see(double value) {
    if (!std::isfinite(value)) return;
    least = std::min(least, value);
    most = std::max(most, value);
    terms = std::max(terms, std::abs(value));
  }
  [[nodiscard]] double size() const { return most > least ? std::min(most - least, cap) : 0.0; }
  /// The smallest difference that counts: `tol` of the range, and more than rounding explains.
  [[nodiscard]] double resolution(double tol) const {
    constexpr double kUnitsOfRounding = 64.0;  // of a function of some tens of operations
    const double near = std::min(terms, cap + std::min(std::abs(least), std::abs(most)));
    return std::max({tol * size(), accuracy, kUnitsOfRounding * kEpsilon * near});
  }
};

/// Whether a exceeds b by a difference that counts. False where one of them is NaN.
[[nodiscard]] inline bool clearly_greater(double a, double b, const ValueRange& range, double tol) {
  return a - b > range.resolution(tol) || (a > b && std::isinf(a - b));
}

/// Whether lower <= value <= upper up to a difference that counts. False where it is NaN.
[[nodiscard]] inline bool is_met(double value, double lower, double upper, const ValueRange& range,
                                 double tol) {
  return !std::isnan(value) && !clearly_greater(value, upper, range, tol) &&
         !clearly_greater(lower, value, range, tol);
}

/// How far a value is outside its bounds; negative inside, NaN where the value is.
[[nodiscard]] inline double excess(double value, double lower, double upper) {
  return std::max(lower - value, value - upper);
}

/// The same of constraint j with that value.
[[nodiscard]] inline double excess_of_row(const ProblemStructure& s, std::size_t j, double value) {
  return excess(value, s.constraint_lower[j], s.constraint_upper[j]);
}

/// In what differences of each variable are measured: the width of its box, or, without two finite
/// bounds, the spread of the values seen, or, where these are one, its size.
class VariableRanges {
 public:
  explicit VariableRanges(const ProblemStructure& structure)
      : box_(structure.variable_players.size()),
        least_(box_.size(), kInfinity),
        most_(box_.size(), -kInfinity) {
    for (std::size_t i = 0; i < box_.size(); ++i)
      box_[i] = structure.variable_upper[i] - structure.variable_lower[i];
  }
  /// v: n values.
  void see(std::span<const double> v) {
    for (std::size_t i = 0; i < box_.size() && i < v.size(); ++i) {
      least_[i] = std::min(least_[i], v[i]);
      most_[i] = std::max(most_[i], v[i]);
    }
  }
  [[nodiscard]] double of(std::size_t i) const {
    constexpr double kOfOnePoint = 1e-6;  // of the size: how searches for the same point may differ
    return spread_or_size(i, kOfOnePoint);
  }
  /// How far a solve moved the variable, however little: more than rounding.
  [[nodiscard]] double moved(std::size_t i) const {
    constexpr double kOfRounding = 1e-12;  // of the size
    return spread_or_size(i, kOfRounding);
  }

 private:
  /// least: of the size; a spread below it is that of one value.
  [[nodiscard]] double spread_or_size(std::size_t i, double least) const {
    constexpr double kNoBound = 1e19;  // nlp_upper_bound_inf
    if (box_[i] < kNoBound) return box_[i];
    const double spread = most_[i] - least_[i];
    const double size = std::max(std::abs(least_[i]), std::abs(most_[i]));
    return spread > least * size ? spread : size;
  }

  std::vector<double> box_, least_, most_;
};

/// Of what differences in a variable step by a share, so that units do not matter: its size, at v
/// or at the start, but no more than half of its box and no less than a tenth of that, or than 1 in
/// a wide one. A start of 0 without a box says nothing: then at least 1.
[[nodiscard]] inline double length_of(double v, double start, double lower, double upper) {
  constexpr double kNoBound = 1e19, kLeastShare = 0.1;
  const double half = 0.5 * (upper - lower);
  const bool boxed = half > 0.0 && half < kNoBound;
  double least = std::abs(start);
  if (boxed) least = std::max(least, std::min(kLeastShare * half, 1.0));
  const double size = std::max(std::abs(v), least > 0.0 ? least : 1.0);
  return boxed ? std::min(size, half) : size;
}

/// Whether two points agree in the given variables, each to tol of its range.
/// variables: indices; of others nothing is asked.
template <class Indices>
[[nodiscard]] bool same_point(std::span<const double> a, std::span<const double> b,
                              const VariableRanges& ranges, const Indices& variables, double tol) {
  constexpr double kRounding = 4.0 * kEpsilon;
  return std::ranges::all_of(variables, [&](auto index) {
    const auto i = static_cast<std::size_t>(index);
    const double size = std::max(std::abs(a[i]), std::abs(b[i]));
    return std::abs(a[i] - b[i]) <= std::max(tol * ranges.of(i), kRounding * size);
  });
}

}  // namespace ipminmax
