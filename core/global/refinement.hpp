#pragma once

#include <vector>

#include "core/global/audit.hpp"
#include "core/model/budget.hpp"
#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"
#include "core/search/one_start.hpp"

namespace ipminmax {

/// One start of x, refined over y: solved, its robust constraints (f, too, with minmax_epigraph)
/// maximized over y, solved again with the worst cases found, until none is violated; at a kink of
/// the maximum over y (minmax_epigraph_at_kinks) over the branches that meet there.
struct Refinement {
  const SolverOptions& options;
  Budget& budget;
  bool among_others;  ///< starts that run beside this one may make it useless
  const std::vector<RobustWorstCase>& known;  ///< near the start, of a solve before
  Witnesses& witnesses;                       ///< to which the y that are met are added

  /// v: n values to begin at; empty: the model's own start. structure: of the thread on the model,
  /// which is well formed. What is known against the result is in its statements; it has not been
  /// audited.
  [[nodiscard]] Result from(Problem& model, const std::vector<double>& v, Index start,
                            SearchStructure& structure) const;

 private:
  [[nodiscard]] Result over_branches(Problem& model, const std::vector<double>& v, Index start,
                                     bool at_kink) const;
};

/// Whether the model's indices can be followed and it has robust constraints.
[[nodiscard]] bool has_rows_for_every_y(const ProblemStructure& structure,
                                        const SolverOptions& options);

}  // namespace ipminmax
