#pragma once

#include <string>
#include <vector>

#include "core/global/audit.hpp"
#include "core/model/budget.hpp"
#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"
#include "core/search/one_start.hpp"

namespace ipminmax {

/// One start of x, refined over y: solved, its robust constraints (f, too, with minmax_epigraph)
/// scanned over y, solved again with the worst cases found, until none is violated; at a kink of the
/// maximum over y (minmax_epigraph_at_kinks) over the branches that meet there.
class Refinement {
 public:
  /// The model's structure is well formed, the options are allowed.
  /// among_others: starts that run beside this one may make it useless.
  /// known: worst cases near the start, of a solve before.
  /// witnesses: to which the y that are met are added.
  Refinement(const SolverOptions& options, Budget& budget, bool among_others,
             const std::vector<RobustWorstCase>& known, Witnesses& witnesses)
      : options_(options),
        budget_(budget),
        among_others_(among_others),
        known_(known),
        witnesses_(witnesses) {}

  /// v: n values to begin at; empty: the model's own start. structure: of the thread on the model.
  /// What is known against the result is in its statements; it has not been audited.
  [[nodiscard]] Result from(Problem& model, const std::vector<double>& v, Index start,
                            SearchStructure& structure) const;

 private:
  [[nodiscard]] Result from_start(Problem& model, const std::vector<double>& v, Index start,
                                  SearchStructure& structure) const;
  [[nodiscard]] Result as_asked(Problem& model, const std::vector<double>& v, Index start,
                                SearchStructure& structure) const;
  [[nodiscard]] Result over_branches(Problem& model, const std::vector<double>& v, Index start,
                                     bool at_kink) const;
  [[nodiscard]] Result over_branches(Problem& epigraph, Problem& model,
                                     const std::vector<double>& v, Index start, bool at_kink) const;

  const SolverOptions& options_;
  Budget& budget_;
  bool among_others_;
  const std::vector<RobustWorstCase>& known_;
  Witnesses& witnesses_;
};

/// Whether the model's indices can be followed and it has robust constraints.
[[nodiscard]] bool has_rows_for_every_y(const ProblemStructure& structure,
                                        const SolverOptions& options);

/// Why f cannot be treated as a robust constraint, or nothing be proved, as asked; empty: it can.
[[nodiscard]] std::string error_over_y(Problem& model, const SolverOptions& options);

}  // namespace ipminmax
