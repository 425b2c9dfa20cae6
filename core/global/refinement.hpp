#pragma once

#include <vector>

#include "core/model/budget.hpp"
#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"
#include "core/search/one_start.hpp"

namespace ipminmax {

/// One start of x, and what its solves share.
struct StartOfX {
  Problem& model;  ///< well formed
  const SolverOptions& options;
  Budget& budget;
  Index number;
  bool among_others;    ///< starts that run beside this one may make it useless
  KeptWork& structure;  ///< of the thread on the model
  const std::vector<RobustWorstCase>& known;  ///< near start 0, of a solve before
};

/// Refines a start over y: solved, its robust constraints (f, too, with minmax_epigraph) maximized
/// over y, solved again with the worst cases found, until none is violated; at a kink of the
/// maximum over y (minmax_epigraph_at_kinks) over the branches that meet there. Audited with the y
/// that it has met itself, so that it does not depend on others. A robust constraint that one of
/// these violates is solved again with it.
/// v: n values to begin at; empty: the model's own start.
[[nodiscard]] Result refine(const StartOfX& start, const std::vector<double>& v);

/// Whether the model's indices can be followed and it has robust constraints.
[[nodiscard]] bool has_rows_for_every_y(const ProblemStructure& structure,
                                        const SolverOptions& options);

}  // namespace ipminmax
