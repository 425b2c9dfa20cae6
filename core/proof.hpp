#pragma once

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "autodiff_problem.hpp"
#include "interval.hpp"
#include "iteration.hpp"
#include "options.hpp"
#include "problem.hpp"
#include "result.hpp"

namespace IPMINMAX_API ipminmax {

/// A model's functions over boxes of its variables, for proofs. A problem that has them derives
/// from this, too. Both throw UndecidedComparison where the formulas branch within the box.
class BoxFunctions {
 public:
  virtual ~BoxFunctions() = default;
  /// f. v: n
  [[nodiscard]] virtual IntervalJet objective_over(std::span<const IntervalJet> v) const = 0;
  /// v: n, g: m
  virtual void constraints_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const = 0;
};

/// The model of AutodiffProblem, with its formulas over boxes.
template <class Functions>
class ProvableProblem final : public AutodiffProblem<Functions>, public BoxFunctions {
 public:
  using AutodiffProblem<Functions>::AutodiffProblem;
  [[nodiscard]] IntervalJet objective_over(std::span<const IntervalJet> v) const override {
    return this->functions().template objective<IntervalJet>(v);
  }
  void constraints_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const override {
    if constexpr (requires { this->functions().template constraints<IntervalJet>(v, g); }) {
      this->functions().template constraints<IntervalJet>(v, g);
    }
  }
};
template <class Functions>
ProvableProblem(Functions, ModelData) -> ProvableProblem<Functions>;

/// What is to be proved, and how hard to try.
struct ProofRequest {
  Index constraint = -1;  ///< of Min's that reads Max variables; -1: the objective
  bool least = false;     ///< the least value over y (of a constraint with a lower bound)
  /// Gap at which the value counts as proved, over max(1, |value|).
  double tolerance = 1e-6;
  Index starts = 8;              ///< maximizations that look for the value first
  Index most_boxes = 1'000'000;  ///< looked at
};

/// The largest value over all y in Y(x) of f or a constraint, at one x, enclosed: no y gives more
/// than `proved`, and one that gives `seen` is known. For the least value both are turned round.
struct WorstCaseProof {
  double seen = std::numeric_limits<double>::quiet_NaN();    ///< NaN: no point of Y(x) was found
  double proved = std::numeric_limits<double>::quiet_NaN();  ///< infinite: no bound was found
  bool complete = false;  ///< the gap is within the tolerance, or Y(x) is proved to be empty
  bool empty = false;     ///< Y(x) is proved to be empty
  std::vector<double> v;  ///< n: x and the y that was seen; empty: none
  Index boxes = 0;        ///< looked at
  Index left = 0;         ///< not decided
  double seconds = 0.0;
  std::optional<Status> interrupted;
  std::string message;  ///< one sentence
};

/// Proves how large f or a robust constraint can become over all of y at the x of v: branch and bound
/// over Max's free variables, at most IntervalJet::kMostDirections, all with two bounds. Boxes are
/// bounded by interval arithmetic with outward rounding (interval.hpp): the formulas themselves,
/// their mean-value form, their second-order form, and the latter two of the Lagrangian with the
/// multipliers of the value seen, f <= f + lambda (u - g) on Y(x). Boxes in which a constraint of
/// Max's fails everywhere go; where all of them hold everywhere so do boxes without a stationary
/// point and those that f bends upward in.
///
/// What is proved is the claim about the formulas; what is trusted is the model's code, the compiler
/// and the C library's accuracy.
///
/// The problem has to be a BoxFunctions, too (ProvableProblem), else std::invalid_argument, as for v
/// (n finite values) and request. Limits of time and the observer, who hears of the maximizations
/// and of every thousandth box, end the proof with what is proved so far.
[[nodiscard]] WorstCaseProof prove_worst_case(Problem& problem, std::span<const double> v,
                                              const SolverOptions& options,
                                              const ProofRequest& request = {},
                                              const MultistartObserver& observer = {});

}  // namespace ipminmax
