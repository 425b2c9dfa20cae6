#pragma once

#include <memory>
#include <vector>

#include "core/reduction/reduced_rows.hpp"

namespace ipminmax {

/// A problem with worst cases of robust constraints that are maximized exactly at each x.
struct Reduction {
  Problem& model;
  std::vector<ReducedRows::WorstCase> worst_cases;  ///< every robust constraint has one
  std::vector<bool> reads_y;                        ///< n: whether f reads a Max variable
  std::vector<double> start;                        ///< n; empty: the model's
  Budget& budget;
  ReducedRows* rows = nullptr;  ///< of the solve that runs
};

/// What came of it.
struct ReducedSolve {
  std::unique_ptr<ReducedRows> rows;  ///< of the last solve
  Result result;                      ///< of the last solve; all work is counted in it
  Index solves = 0;
  Index maximizations = 0;
};

/// Solves; where steps grow short because y of a worst case leaps to another maximum, that one
/// becomes a worst case, too, and the solve goes on from there. reduction.worst_cases are those of
/// the last solve, at the y where it ended. A certified result has active worst cases that are
/// certified strict local maxima themselves.
[[nodiscard]] ReducedSolve solve_reduced(Reduction& reduction, const SolverOptions& options,
                                         const SolveObserver& observer);

}  // namespace ipminmax
