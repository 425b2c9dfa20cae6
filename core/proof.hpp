#pragma once

#include <memory>
#include <span>

#include "formulas/autodiff_problem.hpp"
#include "formulas/interval.hpp"
#include "iteration.hpp"
#include "options.hpp"
#include "problem.hpp"
#include "result.hpp"

namespace IPMINMAX_API ipminmax {

/// An AutodiffProblem whose formulas can also be evaluated over boxes of its variables, with
/// minmax_threads above 1 by several threads at once.
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
  [[nodiscard]] std::unique_ptr<Problem> clone() const override {
    return std::make_unique<ProvableProblem>(this->functions(), this->data());
  }
};
template <class Functions>
ProvableProblem(Functions, ModelData) -> ProvableProblem<Functions>;

/// What prove_worst_case proves, and how much work it may do.
struct ProofRequest {
  Index constraint = -1;  ///< a robust constraint; -1: the objective
  bool least = false;     ///< prove the least value over y (for a constraint with a lower bound)
  /// Gap at which the value counts as proved, relative to the range of the values seen.
  double tolerance = 1e-6;
  Index starts = 8;              ///< maximizations that look for the value first
  Index most_boxes = 1'000'000;  ///< largest number of boxes examined
};

/// Proves a bound of the largest value of f or of a robust constraint over all of y at the x of v
/// (n values). The method is branch and bound over Max's variables that are neither fixed nor
/// determined by others (BoxFunctions): for f over all of these, for a constraint over those that
/// it depends on, also through Max's constraints. There may be 8 (IntervalJet::kMostDirections) of
/// them at most, each with two bounds. A box is bounded by interval arithmetic with outward
/// rounding (interval.hpp): by the formulas, their mean-value form and their second-order form, of
/// f and of its Lagrangian f + lambda (u - g), which is at least f where Max's constraints g <= u
/// hold; lambda are the multipliers at the y of the value seen. A box is discarded if a constraint
/// of Max fails everywhere in it. If all of them hold everywhere, it is also discarded if it has no
/// stationary point or if f is convex along some direction in it.
///
/// The proof is about the formulas. It trusts the model's code, the compiler and the accuracy of
/// the C library.
///
/// Throws std::invalid_argument if the problem has no functions over boxes, v is not n finite
/// values, or the request is invalid. More than 8 such variables, or one without two bounds, only
/// leave the proof incomplete, unless the bound over all of y at once is tight. A time limit or the
/// observer ends the proof with what is proved so far; the observer is called for the maximizations
/// and for every thousandth box.
///
/// The option minmax_worst_case_proof does the same for f and every robust constraint at the answer
/// of a solve (Result::over_y.proofs).
[[nodiscard]] WorstCaseProof prove_worst_case(Problem& problem, std::span<const double> v,
                                              const SolverOptions& options,
                                              const ProofRequest& request = {},
                                              const MultistartObserver& observer = {});

/// Proves the same on all ranks of an MPI program, each of which must call this with equal
/// arguments. The domain is divided into 64 parts with at most most_boxes / 64 boxes each. All
/// ranks return the same answer, bit by bit, for any number of ranks. The calling thread calls MPI;
/// another thread calls the model.
///
/// Throws as prove_worst_case; SolverUnavailable as multistart_over_ranks; std::runtime_error if
/// the model of another rank threw or a rank has died.
[[nodiscard]] WorstCaseProof prove_worst_case_over_ranks(Problem& problem,
                                                         std::span<const double> v,
                                                         const SolverOptions& options,
                                                         const ProofRequest& request = {},
                                                         const MultistartObserver& observer = {});

}  // namespace ipminmax
