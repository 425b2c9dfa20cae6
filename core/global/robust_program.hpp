#pragma once

#include <vector>

#include "core/global/over_y.hpp"
#include "core/robust/row_units.hpp"

namespace ipminmax {

/// A robust program, and its model in the form in which it is solved and as it was asked for: the
/// same, its epigraph form, which has one more variable and one more row, both last, or one of them
/// with its rows in other units.
struct RobustProgram {
  Problem& solved;
  Problem& asked;
  const RowUnits& units;  ///< of solved
  const SolverOptions& options;
  Budget& budget;
  Index start;   ///< of x: told in its name
  Index starts;  ///< of y per bound of a robust constraint; 0: worst cases are not looked for
  Witnesses& witnesses;  ///< to which maxima over y are added

  const ProblemStructure& s = solved.structure();
  const ProblemStructure& asked_s = asked.structure();
  VariableRanges ranges{s};  ///< of points seen
  RobustScopes scopes{s};
  std::vector<bool> reads_y{};  ///< n: whether f reads a Max variable
  Result work{};                ///< of all solves and maximizations
};

/// A result of copies in the shape and the units of the model that was asked for.
[[nodiscard]] Result in_asked_shape(const RobustProgram& program, const RobustCopies& copies,
                                    const Result& result);

/// The same with its worst cases, then the highest maximum of each constraint without one, and with
/// what was seen over y at the x of v. verified: no y violates a constraint.
[[nodiscard]] Result answer_of(const RobustProgram& program, const RobustCopies& copies,
                               const Result& result, const MaximaOfRows& maxima,
                               const std::vector<double>& v, bool verified);

}  // namespace ipminmax
