#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "core/global/points.hpp"
#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"

// Where maximizations over y begin. y are the variables of a problem that are not fixed.
namespace ipminmax {

/// Which variables y are, and what ties them.
struct SetOfY {
  std::vector<std::size_t> free;   ///< variables that are not fixed
  std::vector<std::size_t> boxed;  ///< of these with two bounds
  std::size_t equations = 0;       ///< constraints that are equations
  bool has_rows;                   ///< there are constraints, perhaps without bounds
  bool has_inequalities = false;

  SetOfY(const ProblemStructure& structure, const SolverOptions& options);
  /// None of the variables can run away.
  [[nodiscard]] bool is_box() const { return boxed.size() == free.size(); }
  /// A box, and states that follow from variables in it by equations. Else Y may consist of several
  /// parts, of which the starts may see a few.
  [[nodiscard]] bool is_connected() const {
    return !has_rows ||
           (!has_inequalities && !boxed.empty() && equations + boxed.size() <= free.size());
  }
  /// The same, and the equations determine all that has not two bounds.
  [[nodiscard]] bool follows_box() const {
    return is_connected() && equations + boxed.size() == free.size();
  }
};

/// Whether the constraints hold; false where they are undefined.
[[nodiscard]] bool is_feasible(Problem& inner, const SolverOptions& options,
                               std::span<const double> v);

/// Options of a solve that is not to forget where it begins: from a large barrier parameter the
/// central path leads to the same maxima whatever the start.
[[nodiscard]] SolverOptions staying_near(const SolverOptions& options);

/// From the middle of the box of y, or from the center, a point of a convex Y, where that is not in
/// Y, towards the corner next to a random point, as far as Max's constraints hold; then along
/// single variables to bounds while f grows, and back into Y. Below a convex function the start
/// decides which of many vertices is reached, and random points of a box of many variables are far
/// outside of the half spaces that cut it.
[[nodiscard]] std::vector<double> start_above(Problem& inner, const SolverOptions& options,
                                              std::span<const double> center,
                                              std::vector<double> random, Index start,
                                              Counts& counts);

/// Beside a maximum: one variable of it moved to another bound, `most` places at most, those with
/// the highest f + lambda'g first. What follows the move may make up for a loss.
[[nodiscard]] Points next_to(Problem& inner, const SolverOptions& options, std::vector<double> v,
                             const std::vector<double>& lambda, std::size_t most, Counts& counts);

}  // namespace ipminmax
