#pragma once

#include <tuple>
#include <vector>

#include "core/multistart.hpp"

// One order of answers, and one rule for what is clearly worse.
namespace ipminmax {

/// Rank of a result in better(): lexicographic, smaller is better.
using Rank = std::tuple<int, int, double>;

[[nodiscard]] Rank rank_of(const Result& result);

/// Difference from which one value of f counts as worse than another: a millionth, or tol, of the
/// range of the values compared and of what f took on the way to them, at most max(1, |f|). least,
/// largest: of the values compared; seen: range on the way, infinite where nothing is known of it.
[[nodiscard]] double clear_difference(double least, double largest, double seen, double tol);

/// How far the difference of f between two y at the same x may come from the error of x: its change
/// as each free Min variable moves by tol max(1, |x_i|). a, b: n values each.
[[nodiscard]] double uncertain_difference(Problem& problem, const std::vector<double>& a,
                                          const std::vector<double>& b, double tol);

/// Adds one more certified point, unless it is known: then one more start has found it, and the
/// higher value stands for both. by_x: where several y are worst, any of them may stand in v, and
/// points with the same x are one.
void add_distinct(const ProblemStructure& structure, bool by_x, double tol, Index start,
                  Result&& result, std::vector<DistinctPoint>& points);

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

/// Makes the statements of a result one: what was cut short (by `why`, where it is known), or known
/// to be worse for another y, is no success; what is no success is no certified local minmax.
void settle(std::optional<Status> why, Result& result);

}  // namespace ipminmax
