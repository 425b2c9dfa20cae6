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
  const RowUnits& units;  ///< of solved
  const SolverOptions& options;
  Budget& budget;
  Index start;   ///< of x: told in its name
  Index starts;  ///< of y per side of a robust constraint; 0: worst cases are not looked for
  Witnesses& witnesses;  ///< to which maxima over y are added
};

/// A result of copies in the shape and the units of the model that was asked for.
[[nodiscard]] Result in_asked_shape(const RobustForm& form, const RobustCopies& copies,
                                    const Result& result);

/// The worst cases of a result of copies, then the highest maximum of each constraint without one.
/// ranges: beside which y are compared.
[[nodiscard]] std::vector<RobustWorstCase> list_worst_cases(const RobustForm& form,
                                                            const RobustCopies& copies,
                                                            const Result& result,
                                                            const Scans& scans,
                                                            const VariableRanges& ranges);

/// What was seen over y at the x of v. verified: no y violates a constraint.
[[nodiscard]] SearchOverY search_over_y(const RobustForm& form, const Scans& scans,
                                        const std::vector<double>& v, bool verified);

}  // namespace ipminmax
