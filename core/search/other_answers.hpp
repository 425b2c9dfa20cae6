#pragma once

#include <vector>

#include "core/problem.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// Min's variables of n values, in their order.
[[nodiscard]] std::vector<double> min_part(const ProblemStructure& structure,
                                           const std::vector<double>& v);

/// Difference from which one value of f counts as worse than another: a millionth, or tol, of the
/// range of the values compared and of what f took on the way to them, at most max(1, |f|). least,
/// largest: of the values compared; seen: range on the way, infinite where nothing is known of it.
[[nodiscard]] double clear_difference(double least, double largest, double seen, double tol);

/// Whether the y of one of the points (n values each), where Max's constraints let him take it at
/// the x of the result, is clearly worse there than the result's own: at the cost of an evaluation
/// each, without any maximization. Then result.worst_case has the worst of them, `higher` set, and
/// 0 starts.
///
/// objectives: of the points where they lie; they tell which differences of f count, as do tol and
/// the values seen. A y that violates Max's constraints by more than constr_viol_tol is left out.
struct OtherAnswers {
  std::vector<std::vector<double>> points;
  std::vector<double> objectives;
  double tol = 0.0;
  double constr_viol_tol = 0.0;

  void add(const std::vector<double>& v, double f) {
    points.push_back(v);
    objectives.push_back(f);
  }
};
/// counts: evaluations are added.
void compare_with(const OtherAnswers& others, Problem& problem, Result& result, Counts& counts);

}  // namespace ipminmax
