#pragma once

#include <limits>
#include <span>
#include <string>

#include "options.hpp"
#include "problem.hpp"

namespace IPMINMAX_API ipminmax {

/// The duality gap of a game that is convex in x and concave in y and in which each player has
/// linear constraints of his own. The value of the game lies between `least` and `most`. NaN: f was
/// not found to be so, or a solve failed; message says why.
struct DualityGap {
  double most = std::numeric_limits<double>::quiet_NaN();   ///< max over y of f at the given x
  double least = std::numeric_limits<double>::quiet_NaN();  ///< min over x of f at the given y
  /// Whether most and least differ by at most the smaller of tol and R / 1000, or by at most
  /// minmax_worst_case_tol (1e-6) times R. R is the range of f over some points. The point is then
  /// a saddle point over all of x and y, perhaps one of several, and f there is the value of the
  /// game, to this accuracy.
  bool saddle_point = false;
  std::string message;  ///< the gap in words, without a line end
  [[nodiscard]] double size() const { return most - least; }
};

/// Computes the duality gap at a feasible point v (n values) by two solves from there. Convexity,
/// and concavity unless minmax_concave_in_y states it, are checked by second derivatives at the
/// point, at eight random points and at both answers, and by values of f at further points. Limits
/// hold for both solves together, max_iter for each. Throws std::invalid_argument if v has not n
/// finite values. Exceptions of the model pass through.
///
/// A solve (solver.hpp) that ends with an undecided second-order test computes the gap itself. If
/// this shows a saddle point, the message of the Result says so.
[[nodiscard]] DualityGap duality_gap(Problem& problem, std::span<const double> v,
                                     const SolverOptions& options);

}  // namespace ipminmax
