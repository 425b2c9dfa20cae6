#pragma once

#include <span>

#include "autodiff_problem.hpp"
#include "interval.hpp"
#include "iteration.hpp"
#include "options.hpp"
#include "problem.hpp"
#include "result.hpp"

namespace IPMINMAX_API ipminmax {

/// The model of AutodiffProblem, with its formulas over boxes. With minmax_threads above 1 several
/// threads evaluate them.
template <class Functions>
class ProvableProblem final : public AutodiffProblem<Functions>, public BoxFunctions {
 public:
  using AutodiffProblem<Functions>::AutodiffProblem;
  [[nodiscard]] const BoxFunctions* over_boxes() const override { return this; }
  [[nodiscard]] IntervalJet objective_over(std::span<const IntervalJet> v) const override {
    return this->functions().template objective<IntervalJet>(v);
  }
  void constraints_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const override {
    if constexpr (requires { this->functions().template constraints<IntervalJet>(v, g); }) {
      this->functions().template constraints<IntervalJet>(v, g);
    } else if constexpr (requires { this->functions().template constraint<IntervalJet>(0, v); }) {
      for (std::size_t j = 0; j < g.size(); ++j)
        g[j] = this->functions().template constraint<IntervalJet>(j, v);
    }
  }
  [[nodiscard]] bool is_concurrent() const override { return true; }
};
template <class Functions>
ProvableProblem(Functions, ModelData) -> ProvableProblem<Functions>;

/// What is to be proved, and how hard to try.
struct ProofRequest {
  Index constraint = -1;  ///< of Min's that reads Max variables; -1: the objective
  bool least = false;     ///< the least value over y (of a constraint with a lower bound)
  /// Gap at which the value counts as proved, over the range of the values seen.
  double tolerance = 1e-6;
  Index starts = 8;              ///< maximizations that look for the value first
  Index most_boxes = 1'000'000;  ///< looked at
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
/// std::invalid_argument: the problem has no functions over boxes, v is not n finite values, or the
/// request is wrong. Variables that cannot be cut leave the proof incomplete, unless the formulas
/// over all of y at once are tight. Limits of time and the observer, who hears of the maximizations
/// and of every thousandth box, end the proof with what is proved so far.
///
/// Option minmax_worst_case_proof does the same for f and every robust constraint at the answer of
/// a solve (Result::over_y.proofs).
[[nodiscard]] WorstCaseProof prove_worst_case(Problem& problem, std::span<const double> v,
                                              const SolverOptions& options,
                                              const ProofRequest& request = {},
                                              const MultistartObserver& observer = {});

/// The same by all ranks of an MPI program that call this with equal arguments: each searches its
/// share of 64 parts of the domain, most_boxes / 64 boxes in each at most. All get the same answer,
/// with the same bits for any number of ranks. The model is called in another thread than the
/// calling one, which is the one that calls MPI.
///
/// Throws as prove_worst_case, SolverUnavailable as multistart_over_ranks does, and
/// std::runtime_error where another rank's model threw or a rank has died.
[[nodiscard]] WorstCaseProof prove_worst_case_over_ranks(Problem& problem,
                                                         std::span<const double> v,
                                                         const SolverOptions& options,
                                                         const ProofRequest& request = {},
                                                         const MultistartObserver& observer = {});

}  // namespace ipminmax
