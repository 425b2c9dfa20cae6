#pragma once

#include <optional>
#include <vector>

#include "core/kkt/inertia_correction.hpp"
#include "core/kkt/system.hpp"
#include "core/method/globalized_method.hpp"
#include "core/model/budget.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/structure_check.hpp"
#include "core/result.hpp"
#include "core/search/search.hpp"

namespace ipminmax {

/// Arrays that the next solve of a problem of the same shape writes over; what they hold means
/// nothing to it.
struct SolveArrays {
  CanonicalArrays canonical;
  KktArrays kkt;
  GlobalizedArrays method;
  SearchArrays search;
  ResultArrays result;
};

/// What a solve leaves to the next one.
struct KeptWork {
  ModelShape shape;
  std::optional<GradientScaling> scaling;
  std::optional<KktAnalysis> analysis;
  ShiftMemory shifts;
  /// Of robust constraints, where the last solve succeeded.
  std::vector<RobustWorstCase> worst_cases;
  /// For searches that must not depend on those before: shape, analysis and pattern are those of
  /// the first and stay, the rest is not kept.
  bool structure_only = false;
  /// Of second derivatives by differences, detected; empty: not known.
  std::optional<std::vector<Triplet>> hessian_pattern;

  SolveArrays arrays;

  /// All but the arrays.
  void forget();
  /// Whether it serves a solve of the problem; what does not fit is forgotten first.
  [[nodiscard]] bool fits(const ProblemStructure& structure, const SolverOptions& options);
};

/// One solve of a model with second derivatives: the best of a list of searches, all within one
/// budget of iterations. Where too few degrees of freedom are left without the fixed variables,
/// their bounds are moved apart, as in Ipopt. kept: of the last solve, replaced by that of this
/// one; null: nothing is kept.
[[nodiscard]] Result run_searches(Problem& problem, const SolverOptions& options, Budget& budget,
                                  const SolveObserver& observer, KeptWork* kept);

}  // namespace ipminmax
