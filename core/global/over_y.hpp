#pragma once

#include <algorithm>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "core/global/witnesses.hpp"
#include "core/model/budget.hpp"
#include "core/model/compare.hpp"
#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/proof.hpp"
#include "core/proof/enclosure.hpp"
#include "core/result.hpp"
#include "core/robust/robust_copies.hpp"
#include "core/worst_case.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

/// Starts of y for robust constraints (or an objective treated as one), and for f, that
/// minmax_worst_case_starts asks for.
[[nodiscard]] Index starts_over_y_of_rows(const SolverOptions& options);
[[nodiscard]] Index starts_over_y_of_objective(const SolverOptions& options);

/// Whether there may be more starts than these, where more maxima are to be expected.
[[nodiscard]] inline bool may_look_longer(const SolverOptions& options) {
  return options.minmax_worst_case_starts < 0 && !options.minmax_concave_in_y;
}

/// Whether a distance to the limit is small beside the range of a row: a maximum that is not known
/// may exceed the limit.
[[nodiscard]] inline bool is_near_limit(double distance, double range) {
  constexpr double kNear = 0.25;
  return !(distance > kNear * range);
}

/// Most variables that are held at all their corners where others follow them.
inline constexpr std::size_t kMostHeld = 3;

/// Options of one of several solves of a model. A solve by itself restarts where it fails; one of
/// several does not, since the others begin elsewhere. If all have failed, one more may restart.
[[nodiscard]] SolverOptions without_restarts(SolverOptions options);

/// Who maximizes over y, and where the work goes.
struct MaximizationContext {
  SolverOptions options;
  Budget& budget;
  Index start;                   ///< in whose name the listener is told
  const ProblemStructure& told;  ///< the model that he knows: what stands behind it is cut
  Result& work;                  ///< maximizations, counts, iterations, times are added
  /// What is to be proved, too; null: what minmax_worst_case_proof asks for.
  const ProofRequest* proof = nullptr;
  ProofShare share{};              ///< of that
  Index drawn = 0;                 ///< random starts that other searches have had
  Witnesses* witnesses = nullptr;  ///< to which starts and maxima are added
  /// Size of the function where that is known: values at infeasible points show its range up to
  /// that.
  double size = 0.0;
  const VariableRanges* sizes = nullptr;  ///< of Min's variables; null: their values
  /// Gives what follows from the rest of a maximum (n values) its values; false: it has none.
  /// Empty: nothing does.
  std::function<bool(std::vector<double>&)> complete{};
};

/// A bounded side of a robust constraint.
struct RobustBound {
  Index constraint = -1;
  int side = 1;           ///< 1: of the upper bound, -1: of the lower one
  double bound = 0.0;     ///< of side times the constraint
  double accepted = 0.0;  ///< the bound, relaxed

  /// Whether it is the one that a worst case is about.
  [[nodiscard]] bool is_of(const RobustWorstCase& one) const {
    return constraint == one.constraint && side == one.side;
  }
};

/// What maximizing f, or side times a robust constraint, over y at one x has found.
struct MaximaOverY : RobustBound {
  std::vector<WorstCaseMaximum> maxima;  ///< distinct, the largest value first
  Points starts;                         ///< where the maximizations began, n values each
  /// Of the values at the feasible points that the maximizations went through.
  ValueRange range;
  Index made = 0;
  bool maximized = false;     ///< at least one ended as a maximum
  bool unbounded = false;     ///< one ran to infinity
  bool single_branch = true;  ///< all at one maximum, K_yy right at every iterate
  bool finished = true;       ///< false: the budget was used up
  bool conclusive = true;     ///< false: after the most starts a higher maximum is to be expected
  bool completed = true;      ///< false: some maxima could not be, and are left out
  /// Of few variables that others follow: those that have no value, n values each.
  Points infeasible_vertices;
  /// Of the largest value, where it was asked for and no maximum was above the limit. A higher y
  /// that it has seen is one of the maxima.
  std::optional<WorstCaseProof> proof;
  double tol = 0.0;  ///< of the range: values that differ by less are as high

  // Of a robust constraint:
  double spread = 0.0;  ///< of the values seen in the last full search; the model's units
  Index age = 0;        ///< solves since that search

  [[nodiscard]] bool is_higher(double value, double other) const {
    return clearly_greater(value, other, range, tol);
  }
  [[nodiscard]] bool is_as_high(double value, double other) const {
    return !is_higher(value, other) && !is_higher(other, value);
  }
  /// Value of the maxima; -infinity: there is none.
  [[nodiscard]] double highest() const {
    double value = -kInfinity;
    for (const WorstCaseMaximum& maximum : maxima) value = std::max(value, maximum.value);
    return value;
  }
  /// The values of certified maxima that differ clearly.
  [[nodiscard]] std::vector<double> heights() const {
    std::vector<double> values;
    for (const WorstCaseMaximum& maximum : maxima) {
      const auto as_high = [&](double value) { return is_as_high(value, maximum.value); };
      if (maximum.certified && std::ranges::none_of(values, as_high))
        values.push_back(maximum.value);
    }
    return values;
  }
  [[nodiscard]] bool any_certified() const {
    return std::ranges::any_of(maxima, &WorstCaseMaximum::certified);
  }
  /// Whether it was maximized, as often as was asked for, and has a maximum.
  [[nodiscard]] bool is_complete() const {
    const bool has_value = !maxima.empty() || (proof && proof->complete);
    return finished && maximized && has_value && !unbounded;
  }
  /// Whether a higher maximum is to be expected after the most starts, and no proof excludes it.
  [[nodiscard]] bool may_be_higher() const { return !conclusive && !(proof && proof->complete); }
  /// Whether the k-th maximum exceeds the bound by more than a share of the range.
  [[nodiscard]] bool violates(std::size_t k, double tolerance) const {
    return clearly_greater(maxima[k].value, accepted, range, tolerance);
  }
  /// Excess over the bound beside the range; negative: the constraint holds.
  [[nodiscard]] double excess(std::size_t k) const {
    return (maxima[k].value - accepted) /
           std::max(range.size(), std::numeric_limits<double>::min());
  }
  /// The worst case at this y, which moves with x unless it is held.
  [[nodiscard]] GivenWorstCase at_y(std::vector<double> v, bool held = false) const {
    return {constraint, std::move(v), true, held, side};
  }
};

/// What was found of each bounded side of each robust constraint.
using MaximaOfRows = std::vector<MaximaOverY>;

/// Maximizes a problem whose Min variables are fixed from its own start, the best corner of a box
/// of few variables, the given points (n values each) and random ones, `starts` in all or, if more,
/// one for each that is given. limit: more random ones, unless their number is an option's, while
/// they find other maxima and none is above it, but one could be.
[[nodiscard]] MaximaOverY maximize_over_y(Problem& inner, Index starts, const Points& given,
                                          const MaximizationContext& context,
                                          std::optional<double> limit = {});

/// The maximizer's problem of f at the x of v: Min variables are fixed, Min constraints absent.
[[nodiscard]] MaximaOverY maximize_objective(Problem& model, std::span<const double> v,
                                             Index starts, const Points& given,
                                             const MaximizationContext& context);

/// Maximizes f over y at the x of a result, from its y, the given points' and random ones; kept in
/// result.worst_case and result.over_y.
void look_for_worst_case(Problem& problem, Index starts, const Points& given,
                         const MaximizationContext& context, Result& result);

/// Where the second-order test of a game's answer is undecided: says so if it is a saddle point
/// (gap.hpp). Work is added, iterations apart; the listener hears nothing.
void add_gap(Problem& model, const SolverOptions& options, Budget& budget, Result& result);

/// Cuts what another form of a model has behind the model's own variables and constraints.
void cut(const ProblemStructure& model, Result& result);

}  // namespace ipminmax
