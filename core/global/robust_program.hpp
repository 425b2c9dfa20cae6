#pragma once

#include <cstddef>
#include <vector>

#include "core/global/over_y.hpp"
#include "core/robust/robust_copies.hpp"

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

/// Violation, beside the range of a row, that held y may leave before copies go on.
inline constexpr double kCoarse = 1e-3;

/// One at v of each constraint, of each side where it has two. A copy is needed where something
/// else reads the y, too.
[[nodiscard]] WorstCases worst_cases_at(const RobustProgram& program, const std::vector<double>& v);

/// Those of the last solve near their limits; or else the one nearest to its bound.
[[nodiscard]] WorstCases known_worst_cases(const RobustProgram& program,
                                           const std::vector<RobustWorstCase>& last);

/// The maxima that are active or nearly so at their x, or the one nearest to it, free to move with
/// x. One is enough of a constraint's maxima that have one gradient in x, as on a face of y.
[[nodiscard]] WorstCases active_maxima(RobustProgram& program, const MaximaOfRows& maxima,
                                       double nearly);

/// The y where maximizations at the x of v begin and end, and random ones: fewer than there are x
/// would leave x unbounded. One that Max constraints restrain begins anywhere.
[[nodiscard]] WorstCases many_scenarios(const RobustProgram& program, const MaximaOfRows& maxima,
                                        const std::vector<double>& v);

/// Adds one more worst case of each side whose largest maximum exceeds the bound; with held y one
/// of each maximum that does, and each vertex where the dependent states diverge, so that x moves to
/// where they do not. One that a copy has left to its barrier, or that violates the row slightly,
/// is held where it is: y's own error is of second order there. Whether there were any.
/// vertices: that were added so far.
[[nodiscard]] bool add_violated(const RobustProgram& program, const MaximaOfRows& maxima,
                                double tolerance, bool held, std::size_t& vertices,
                                WorstCases& list);

/// Moves y into its bounds. Whether it then meets Max's constraints, but for its dependent states:
/// the y of a start is nothing that Max may choose otherwise.
[[nodiscard]] bool move_to_max(RobustProgram& program, const RobustScope& scope,
                               std::vector<double>& v);

/// Moves y across the bounds that it is at, of variables or written as a row of one variable.
/// Whether there were any.
[[nodiscard]] bool cross_bounds(RobustProgram& program, const RobustScope& scope,
                                std::vector<double>& v);

/// Whether the x of two points of n values is the same. A Min variable that is zero has no size of
/// its own: a step that is small beside the other variables counts by what it changes of the
/// constraints at these worst cases, whose units are their sizes.
[[nodiscard]] bool is_same_x(RobustProgram& program, const WorstCases& worst_cases,
                             const std::vector<double>& v, const std::vector<double>& other);

/// A result of copies in the shape and the units of the model that was asked for.
[[nodiscard]] Result in_asked_shape(const RobustProgram& program, const RobustCopies& copies,
                                    const Result& result);

/// The same with its worst cases, then the highest maximum of each constraint without one, and with
/// what was seen over y at the x of v. verified: no y violates a constraint.
[[nodiscard]] Result answer_of(const RobustProgram& program, const RobustCopies& copies,
                               const Result& result, const MaximaOfRows& maxima,
                               const std::vector<double>& v, bool verified);

}  // namespace ipminmax
