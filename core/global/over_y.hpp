#pragma once

#include <algorithm>
#include <limits>
#include <optional>
#include <vector>

#include "core/model/budget.hpp"
#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/proof.hpp"
#include "core/proof/enclosure.hpp"
#include "core/result.hpp"
#include "core/robust/robust_copies.hpp"
#include "core/worst_case.hpp"

namespace ipminmax {

/// Starts of y for robust constraints (or an objective treated as one), and for f, that
/// minmax_worst_case_starts asks for.
[[nodiscard]] Index starts_over_y_of_rows(const SolverOptions& options);
[[nodiscard]] Index starts_over_y_of_objective(const SolverOptions& options);

/// Whether there may be more starts than these, where more maxima are to be expected.
[[nodiscard]] inline bool may_look_longer(const SolverOptions& options) {
  return options.minmax_worst_case_starts < 0 && !options.minmax_concave_in_y;
}

/// Most variables that are held at all their corners where others follow them.
inline constexpr std::size_t kMostHeld = 3;

struct SideScan;

/// Who maximizes over y, and where the work goes.
struct MaximizationContext {
  const SolverOptions& options;
  Budget& budget;
  Index start;                   ///< in whose name the listener is told
  const ProblemStructure& told;  ///< the model that he knows: what stands behind it is cut
  Result& work;                  ///< counts, iterations, factorizations and times are added
  SearchOverY& looked;           ///< maximizations are added
  /// What is to be proved, too; null: what minmax_worst_case_proof asks for.
  const ProofRequest* proof = nullptr;
  ProofShare share{};  ///< of that
  Index drawn = 0;     ///< random starts that other scans over y have had
  /// What a scan at the same x has found, where this is the last look; null: it is not. Where y
  /// follows equations, the first starts see most, and it is left as it is.
  const std::vector<SideScan>* before = nullptr;
};

/// What maximizing one function over y at one x has found.
struct MaximaOverY {
  std::vector<WorstCaseMaximum> maxima;     ///< distinct, the largest value first
  std::vector<std::vector<double>> starts;  ///< where the maximizations began, n values each
  /// Values seen on the way tell which differences count, up to the terms of the highest maximum:
  /// on the way they may be anything.
  double least = std::numeric_limits<double>::infinity();
  double most = -std::numeric_limits<double>::infinity();
  double terms = std::numeric_limits<double>::infinity();
  Index made = 0;
  bool maximized = false;     ///< at least one ended as a maximum
  bool unbounded = false;     ///< one ran to infinity
  bool single_branch = true;  ///< all at one maximum, K_yy right at every iterate
  bool finished = true;       ///< false: the budget was used up
  bool settled = true;        ///< false: after the most starts a higher maximum is to be expected
  /// Of few variables that others follow: those that have no value, n values each.
  std::vector<std::vector<double>> valueless_corners;
  /// Of the largest value, where it was asked for and no maximum was above the limit. A higher y
  /// that it has seen is one of the maxima.
  std::optional<WorstCaseProof> proof;

  [[nodiscard]] double range() const { return std::clamp(most - least, 0.0, terms); }
};

/// Maximizes a problem whose Min variables are fixed from its own start, the best corner of a box
/// of few variables, the given points (n values each) and random ones, `starts` in all or, if more,
/// one for each that is given. limit: more random ones, unless their number is an option's, while
/// they find other maxima and none is above it, but one could be.
[[nodiscard]] MaximaOverY maximize_over_y(Problem& inner, Index starts,
                                          const std::vector<std::vector<double>>& given,
                                          const MaximizationContext& context,
                                          std::optional<double> limit = {});

/// The maximizer's problem of f at the x of v: Min variables are fixed, Min constraints absent.
[[nodiscard]] MaximaOverY maximize_objective(Problem& model, std::span<const double> v,
                                             Index starts,
                                             const std::vector<std::vector<double>>& given,
                                             const MaximizationContext& context);

/// Maximizes f over y at the x of a result, from its y, the given points' and random ones; kept in
/// result.worst_case and result.over_y.
void look_for_worst_case(Problem& problem, Index starts,
                         const std::vector<std::vector<double>>& given,
                         const MaximizationContext& context, Result& result);

/// Cuts what another form of a model has behind the model's own n variables and m constraints.
void cut(std::size_t n, std::size_t m, Result& result);

/// What maximizations of one side of a robust constraint over y have found at one x.
struct SideScan {
  Index constraint = 0;
  double bound = 0.0;                           ///< of side times the constraint
  double accepted = 0.0;                        ///< the bound, or a value that a solve let pass
  double scale = 0.0;                           ///< of its values, MaximaOverY::range()
  bool settled = true;                          ///< maximized, as often as was asked for
  bool may_be_higher = false;                   ///< after the most starts, and no proof says other
  std::vector<RobustCopies::WorstCase> maxima;  ///< distinct, the largest value first
  std::vector<double> values;                   ///< theirs, side times the constraint
  std::vector<std::vector<double>> starts;      ///< where the maximizations began
  std::vector<RobustCopies::WorstCase> valueless_corners;  ///< as MaximaOverY's
  std::optional<WorstCaseProof> proof;

  /// Excess over the bound, or over what a solve accepts, relative to the scale; negative: the
  /// constraint holds.
  [[nodiscard]] double excess(std::size_t k) const {
    return (values[k] - accepted) / std::max(scale, std::numeric_limits<double>::min());
  }
};

/// The side of a constraint that is violated most, or nearest to it; null: no maximum was found.
[[nodiscard]] const SideScan* worst_side(const std::vector<SideScan>& scans, Index constraint);

/// A worst case that maximizations begin from, too, the value of its constraint in the solve, and
/// how far below the maximum the barrier leaves it.
struct KnownWorstCase {
  RobustCopies::WorstCase worst_case;
  double value = std::numeric_limits<double>::quiet_NaN();
  double gap = 0.0;
};

/// Maximizes each bounded side of each robust constraint over all of y at the x of a point. scopes:
/// of the model. Of context.looked the functions and proofs are those of this x.
[[nodiscard]] std::vector<SideScan> scan_robust_constraints(
    Problem& model, const std::vector<double>& x, Index starts,
    const std::vector<KnownWorstCase>& known, const RobustScopes& scopes,
    const MaximizationContext& context);

}  // namespace ipminmax
