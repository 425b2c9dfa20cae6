#include "core/global/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <new>
#include <optional>
#include <utility>

#include "core/global/audit.hpp"
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

/// With all of y if f turns out to read more of it than was seen around the start.
Result over_branches(const StartOfX& start, const std::vector<double>& v, bool at_kink,
                     Witnesses& met) {
  const auto& [model, options, budget, number, among_others, structure, of_start] = start;
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
        {rows, model, rows.units(), options, budget, number, starts, met}, own, {}, at_kink);
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

/// What is known against the result is in its statements; it has not been audited.
Result solve_over_y(const StartOfX& start, const std::vector<double>& v,
                    const std::vector<RobustWorstCase>& known, Witnesses& met) {
  const auto& [model, options, budget, number, among_others, structure, of_start] = start;
  const bool can_branch =
      check_indices(model.structure()).empty() && has_max_variables(model.structure());
  if (options.minmax_epigraph && can_branch) return over_branches(start, v, false, met);
  Result answer;
  if (has_rows_for_every_y(model.structure(), options)) {
    InRowUnits rows(model, v);
    answer = search_worst_cases(
        {rows, model, rows.units(), options, budget, number, starts_over_y_of_rows(options), met},
        v, known);
  } else {
    Restarted restarted(model, v);
    answer = solve_from_start(restarted, options, budget, budget.observer_of(number, among_others),
                              &structure);
  }
  const bool has_point = !answer.v.empty() && all_finite(answer.v);
  if (!options.minmax_epigraph_at_kinks || !can_branch || !has_point || !may_be_kink(answer.status))
    return answer;
  budget.say(number, "a kink of the worst case: the epigraph form from here");
  // From the maxima over y where the search ended, then from where it began.
  for (const bool at_kink : {true, false}) {
    if (budget.used_up()) {
      answer.over_y.finished = false;
      break;
    }
    Result branches = over_branches(start, at_kink ? answer.v : v, at_kink, met);
    // The errors of a search over branches are those of its copies of y: only a certified answer is
    // one.
    const bool found = stands(branches) && is_certified(branches) && better(branches, answer);
    if (found) std::swap(answer, branches);
    add_work(branches, answer);
    if (found) break;
  }
  return answer;
}

}  // namespace

bool has_robust_constraints(const ProblemStructure& structure) {
  return !robust_constraints(structure).empty();
}

bool has_rows_for_every_y(const ProblemStructure& structure, const SolverOptions& options) {
  return options.minmax_robust_constraints && has_robust_constraints(structure);
}

Result refine(const StartOfX& start, const std::vector<double>& v) try {
  constexpr int kMostRefuted = 2;
  std::vector<double> from = v;
  std::vector<RobustWorstCase> known;
  if (start.number == 0) known = start.known;
  Witnesses met(start.model.structure());
  std::optional<Result> refuted;
  for (int round = 0;; ++round) {
    Result result = solve_over_y(start, from, known, met);
    met.add(result);
    if (refuted) add_work(*refuted, result);
    audit(start.model, start.options, met, start.budget, result, result.counts);
    const bool by_row = result.over_y.better_known && !result.worst_case.higher &&
                        !result.worst_cases.empty() && !start.options.minmax_epigraph;
    if (!by_row || round == kMostRefuted || start.budget.used_up()) return result;
    from = result.v;
    known = result.worst_cases;
    for (RobustWorstCase& one : known) one.range = 0.0;  // none is followed alone
    refuted = std::move(result);
  }
} catch (const std::bad_alloc&) {  // between two solves
  start.budget.stop(Status::OutOfMemory);
  return without_point(Status::OutOfMemory, "out of memory");
}

}  // namespace ipminmax
