#pragma once

#include <memory>

#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"
#include "core/solver.hpp"

namespace ipminmax {

struct KeptWork;

/// What the searches of one thread on one model have in common and is computed once: the pattern of
/// the second derivatives where it has to be detected, orderings, symbolic factorizations. Nothing
/// that depends on where a search began or went, so that each gives the same answer, bit by bit,
/// whichever searches came before.
class SearchStructure {
 public:
  SearchStructure();
  ~SearchStructure();
  SearchStructure(SearchStructure&&) noexcept;

  /// Looks around the model's own starting point for the entries of its second derivatives where it
  /// gives none. Returns the model's calls. Exceptions of the model pass through.
  Counts detect(Problem& problem, const SolverOptions& options);

  /// As the function solve.
  [[nodiscard]] Result solve(Problem& problem, const SolverOptions& options,
                             const SolveObserver& observer);

 private:
  std::unique_ptr<KeptWork> kept_;
};

}  // namespace ipminmax
