#pragma once

#include <limits>
#include <span>
#include <string>

#include "options.hpp"
#include "problem.hpp"

namespace IPMINMAX_API ipminmax {

/// Of a game that is convex in x and concave in y, with linear constraints of each player's own: its
/// value lies between `least` and `most`. NaN: there is none, message says why.
struct DualityGap {
  double most = std::numeric_limits<double>::quiet_NaN();   ///< max over y of f at the given x
  double least = std::numeric_limits<double>::quiet_NaN();  ///< min over x of f at the given y
  /// They differ by no more than tol, or minmax_worst_case_tol of the range of f over some points:
  /// this one is a saddle point over all of x and y, perhaps one of several, its value exact.
  bool saddle_point = false;
  std::string message;  ///< for people, without line end
  [[nodiscard]] double size() const { return most - least; }
};

/// The duality gap at a point of n values, by two solves from there; one within Min's bounds and
/// constraints and Max's, as a solve returns it. Convexity, and concavity where not stated by
/// minmax_concave_in_y, are seen from second derivatives at the point, at two random ones and at both
/// solves' answers.
/// Limits of options hold for both solves together, max_iter for each. std::invalid_argument: v
/// has not n finite values. Exceptions of the model pass through.
///
/// Where a solve (solver.hpp) leaves the second-order test of a game undecided it looks for the gap
/// itself, and its message says so if the answer is a saddle point.
[[nodiscard]] DualityGap duality_gap(Problem& problem, std::span<const double> v,
                                     const SolverOptions& options);

}  // namespace ipminmax
