#pragma once

#include <functional>
#include <vector>

#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// When a proof ends.
struct ProofEffort {
  double tolerance;  ///< gap over max(1, |value|)
  Index most_boxes;
  /// Asked with the boxes looked at and the bound: false ends it.
  std::function<bool(Index, double)> go_on;
};

/// Encloses the largest value of the objective of `inner` over its free variables (those between
/// different bounds, the others held there), which have to meet its constraints. seen: the n values
/// of a point that may have it, or none. The proof is one of inner's objective.
///
/// Nothing is proved, and the message says why, where inner has no functions over boxes, the
/// formulas branch, or there are variables that cannot be cut and the formulas over all of them at
/// once do not tell.
[[nodiscard]] WorstCaseProof enclose_maximum(Problem& inner, const SolverOptions& options,
                                             const std::vector<double>& seen,
                                             const ProofEffort& effort);

/// As what an enclosed maximum of `sign` times f (constraint -1) or a constraint says of it.
void describe(Index constraint, double sign, WorstCaseProof& proof);

}  // namespace ipminmax
