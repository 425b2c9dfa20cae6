#pragma once

#include <memory>

#include "core/model/budget.hpp"
#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"
#include "core/search/outcome.hpp"

namespace ipminmax {

struct KeptWork;

/// One solve of a model as it is from its own starting point: with second derivatives from
/// differences where it has none, with bounds of fixed variables moved apart where too few degrees
/// of freedom are left, from another start where it is undefined at its own. Of the options that
/// speak of other starts and other y only minmax_max_restarts counts. kept: of the last solve,
/// replaced by that of this one; null: nothing is kept.
[[nodiscard]] Result solve_from_start(Problem& problem, const SolverOptions& options,
                                      Budget& budget, const SolveObserver& observer,
                                      KeptWork* kept);

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

  /// As solve_from_start.
  [[nodiscard]] Result solve(Problem& problem, const SolverOptions& options, Budget& budget,
                             const SolveObserver& observer);

 private:
  std::unique_ptr<KeptWork> kept_;
};

}  // namespace ipminmax
