#pragma once

#include <vector>

#include "core/global/over_y.hpp"
#include "core/robust/robust_copies.hpp"

namespace ipminmax {

/// A model in the form in which it is solved and as it was asked for: the same, its epigraph form,
/// which has one more variable and one more row, both last, or one of them with its rows in other
/// units.
struct RobustForm {
  Problem& solved;
  Problem& asked;
  RowUnits units;        ///< of solved
  Witnesses& witnesses;  ///< to which maxima over y are added
};

/// A result of copies in the shape and the units of the model that was asked for.
[[nodiscard]] Result in_asked_shape(const RobustForm& form, const RobustCopies& copies,
                                    const Result& result);

/// The worst cases of a result of copies, then the highest maximum of each constraint without one.
/// Two are the same whose y agree up to tol of the ranges.
[[nodiscard]] std::vector<RobustWorstCase> list_worst_cases(
    const RobustForm& form, const RobustCopies& copies, const Result& result,
    const std::vector<SideScan>& scans, const VariableRanges& ranges, double tol);

/// What was seen over y at the x of v. verified: no y violates a constraint.
[[nodiscard]] SearchOverY search_over_y(const RobustForm& form, const std::vector<SideScan>& scans,
                                        const std::vector<double>& v, bool verified);

}  // namespace ipminmax
