#pragma once

#include <vector>

#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/proof/boxes.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// The share of one process in a proof that several make: each takes every so many parts of the
/// domain.
struct ProofShare {
  Index process = 0;
  Index processes = 0;  ///< 0: the domain is one part, and this process's
};
/// Parts, the same for any number of processes.
inline constexpr Index kPartsOfAProof = 64;

/// Encloses the largest value of the objective of `inner` over its free variables (those between
/// different bounds, the others held there), which have to meet its constraints. seen: the n values
/// of a point that may have it, or none. The proof is one of inner's objective.
///
/// Nothing is proved, and the message says why, where inner has no functions over boxes, the
/// formulas branch, or there are variables that cannot be cut and the formulas over all of them at
/// once do not tell.
[[nodiscard]] WorstCaseProof enclose_maximum(Problem& inner, const SolverOptions& options,
                                             const std::vector<double>& seen,
                                             const BoxEffort& effort, ProofShare share = {});

/// Adds what another process has proved of its parts of the domain.
void add_share(WorstCaseProof&& other, WorstCaseProof& proof);

/// As what an enclosed maximum of `sign` times f (constraint -1) or a constraint says of it.
void describe(Index constraint, double sign, WorstCaseProof& proof);

}  // namespace ipminmax
