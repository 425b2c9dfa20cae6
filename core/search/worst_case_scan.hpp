#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "core/model/robust_copies.hpp"
#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// What maximizations of one side of a robust constraint over y have found at one x.
struct SideScan {
  Index constraint = 0;
  double bound = 0.0;                           ///< of side times the constraint
  double scale = 0.0;                           ///< range of its values seen
  std::vector<RobustCopies::WorstCase> maxima;  ///< distinct, the largest value first
  std::vector<double> values;                   ///< theirs, side times the constraint
  std::vector<std::vector<double>> starts;      ///< where the maximizations began

  /// Excess over the bound, relative to the scale; negative: the constraint holds.
  [[nodiscard]] double excess(std::size_t k) const {
    return (values[k] - bound) / std::max(scale, std::numeric_limits<double>::min());
  }
};

/// The side of a constraint that is violated most, or nearest to it; null: no maximum was found.
[[nodiscard]] const SideScan* worst_side(const std::vector<SideScan>& scans, Index constraint);

/// The robust constraints of a model whose indices can be followed, ascending.
[[nodiscard]] std::vector<Index> robust_constraints(const ProblemStructure& structure);

/// Maximizes each bounded side of each robust constraint over all of y at the x of a point, from as
/// many starts as `starts` says and from the worst cases in `also`. maximizations, work: added to.
[[nodiscard]] std::vector<SideScan> scan_worst_cases(
    Problem& model, const std::vector<double>& x, const SolverOptions& options, int starts,
    const std::vector<RobustCopies::WorstCase>& also, Index& maximizations, Result& work);

}  // namespace ipminmax
