#pragma once

#include <vector>

#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/proof/boxes.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// Encloses the largest value of the objective of `inner` over its free variables (those between
/// different bounds, the others held there), which have to meet its constraints. seen: the n values
/// of a point that may have it, or none. The proof is one of inner's objective.
///
/// Nothing is proved, and the message says why, where inner has no functions over boxes, the
/// formulas branch, or there are variables that cannot be cut and the formulas over all of them at
/// once do not tell.
[[nodiscard]] WorstCaseProof enclose_maximum(Problem& inner, const SolverOptions& options,
                                             const std::vector<double>& seen,
                                             const BoxEffort& effort);

/// As what an enclosed maximum of `sign` times f (constraint -1) or a constraint says of it.
void describe(Index constraint, double sign, WorstCaseProof& proof);

}  // namespace ipminmax
