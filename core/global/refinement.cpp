#include "core/global/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/global/choice.hpp"
#include "core/global/robust_search.hpp"
#include "core/model/initial_point.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/robust.hpp"
#include "core/robust/epigraph.hpp"
#include "core/search/starts.hpp"

namespace ipminmax {
namespace {

/// Whether a search may have ended where branches of inner maxima meet.
bool may_be_kink(Status status) {
  using enum Status;
  return status == NoLocalMinmaxFound || status == NotLocalMinmax || status == TinyStep ||
         status == MaxIterations || status == LocallyInfeasible ||
         status == InertiaCorrectionFailed || status == RestorationFailed;
}

}  // namespace

bool has_robust_constraints(const ProblemStructure& structure) {
  return !robust_constraints(structure).empty();
}

bool has_rows_for_every_y(const ProblemStructure& structure, const SolverOptions& options) {
  return options.minmax_robust_constraints && has_robust_constraints(structure);
}

Result Refinement::from(Problem& model, const std::vector<double>& v, Index start,
                        KeptWork& structure) const {
  const bool can_branch =
      has_valid_indices(model.structure()) && has_max_variables(model.structure());
  if (options.minmax_epigraph && can_branch) return over_branches(model, v, start, false);
  const auto as_asked = [&] {
    if (has_rows_for_every_y(model.structure(), options)) {
      InRowUnits rows(model, v);
      return search_worst_cases({rows, model, rows.units(), options, budget, start,
                                 starts_over_y_of_rows(options), witnesses},
                                v, known);
    }
    Restarted restarted(model, v);
    return solve_from_start(restarted, options, budget, budget.observer_of(start, among_others),
                            &structure);
  };
  Result answer = as_asked();
  const bool has_point = !answer.v.empty() && all_finite(answer.v);
  if (!options.minmax_epigraph_at_kinks || !can_branch || !has_point || !may_be_kink(answer.status))
    return answer;
  budget.say(start, "a kink of the worst case: the epigraph form from here");
  // From the maxima over y where the search ended, then from where it began.
  for (const bool at_kink : {true, false}) {
    if (budget.used_up()) {
      answer.over_y.finished = false;
      break;
    }
    Result branches = over_branches(model, at_kink ? answer.v : v, start, at_kink);
    // The errors of a search over branches are those of its copies of y: only a certified answer is
    // one.
    const bool found = stands(branches) && is_certified(branches) && better(branches, answer);
    if (found) std::swap(answer, branches);
    add_work(branches, answer);
    if (found) break;
  }
  return answer;
}

/// With all of y if f turns out to read more of it than was seen around the start.
Result Refinement::over_branches(Problem& model, const std::vector<double>& v, Index start,
                                 bool at_kink) const {
  constexpr Index kLeastStartsAtKinks = 10;
  const Index starts = std::max(starts_over_y_of_objective(options),
                                options.minmax_epigraph ? 0 : kLeastStartsAtKinks);
  const auto row_of_f = static_cast<Index>(model.structure().constraint_players.size());
  std::vector<double> own = v;
  if (!own.empty()) {
    double f = 0.0;
    own.push_back(model.objective(v, true, f) && std::isfinite(f) ? f : 0.0);
  }
  std::vector<bool> reads_y;
  if (const auto from = v.empty() ? model_start(model) : std::optional(v))
    reads_y = read_by_objective(model, *from);
  for (std::optional<Result> before;; reads_y.clear()) {
    Epigraph epigraph(model, reads_y);
    InRowUnits rows(epigraph, own, row_of_f);
    Result answer = search_worst_cases(
        {rows, model, rows.units(), options, budget, start, starts, witnesses}, own, {}, at_kink);
    answer.over_y.branches = static_cast<Index>(
        std::ranges::count(answer.worst_cases, row_of_f, &RobustWorstCase::constraint));
    if (is_certified(answer) && answer.over_y.branches > 1) {
      answer.message = "x minimizes the largest of " + std::to_string(answer.over_y.branches) +
                       " local worst cases";
    }
    if (before) add_work(*before, answer);
    const bool ends = !epigraph.reads_more();
    if (!ends && budget.interrupted()) answer.over_y.finished = false;
    if (ends || budget.interrupted()) return answer;
    before = std::move(answer);
  }
}

}  // namespace ipminmax
