#include "core/global/refinement.hpp"

#include <algorithm>
#include <cmath>
#include <new>
#include <optional>
#include <utility>

#include "core/global/choice.hpp"
#include "core/global/robust_search.hpp"
#include "core/model/initial_point.hpp"
#include "core/model/norms.hpp"
#include "core/model/parameters.hpp"
#include "core/model/structure_check.hpp"
#include "core/robust.hpp"
#include "core/robust/epigraph.hpp"
#include "core/search/random_starts.hpp"

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

std::string error_over_y(Problem& model, const SolverOptions& options) {
  const char* asked = options.minmax_worst_case_proof    ? "minmax_worst_case_proof"
                      : options.minmax_epigraph          ? "minmax_epigraph"
                      : options.minmax_epigraph_at_kinks ? "minmax_epigraph_at_kinks"
                                                         : nullptr;
  if (asked == nullptr || !has_valid_indices(model.structure()) ||
      !has_max_variables(model.structure())) {
    return {};
  }
  if (options.minmax_worst_case_proof && model.over_boxes() == nullptr) {
    return "minmax_worst_case_proof needs a model whose formulas are known (docs/proof.md)";
  }
  bool mirrored = options.obj_scaling_factor < 0.0;
  if (options.nlp_scaling_method == Scaling::User) {
    UserScaling scaling;
    if (model.user_scaling(scaling) && scaling.objective < 0.0) mirrored = !mirrored;
  }
  if (!mirrored) return {};
  return std::string(asked) +
         " cannot be used with a negative factor of the objective, by which y minimizes f";
}

Result Refinement::from(Problem& model, const std::vector<double>& v, Index start,
                        SearchStructure& structure) const {
  Result result;
  try {
    result = from_start(model, v, start, structure);
  } catch (const std::bad_alloc&) {  // between two solves
    budget_.stop(Status::OutOfMemory);
    result = without_point(Status::OutOfMemory, "out of memory");
  }
  witnesses_.add(result);
  return result;
}

Result Refinement::from_start(Problem& model, const std::vector<double>& v, Index start,
                              SearchStructure& structure) const {
  const bool can_branch =
      has_valid_indices(model.structure()) && has_max_variables(model.structure());
  if (options_.minmax_epigraph && can_branch) return over_branches(model, v, start, false);
  Result answer = as_asked(model, v, start, structure);
  const bool has_point = !answer.v.empty() && all_finite(answer.v);
  if (!options_.minmax_epigraph_at_kinks || !can_branch || !has_point ||
      !may_be_kink(answer.status)) {
    return answer;
  }
  budget_.say(start, "a kink of the worst case: the epigraph form from here");
  // From the maxima over y where the search ended, then from where it began.
  for (const bool anew : {false, true}) {
    if (budget_.used_up()) {
      answer.over_y.finished = false;
      break;
    }
    Result branches =
        anew ? over_branches(model, v, start, false) : over_branches(model, answer.v, start, true);
    // The errors of a search over branches are those of its copies of y: only a certified answer is
    // one.
    const bool found = stands(branches) && branches.certificate.kind == PointKind::LocalMinmax &&
                       better(branches, answer);
    Result& chosen = found ? branches : answer;
    add_work(found ? answer : branches, chosen);
    if (found) return branches;
  }
  return answer;
}

Result Refinement::as_asked(Problem& model, const std::vector<double>& v, Index start,
                            SearchStructure& structure) const {
  if (has_rows_for_every_y(model.structure(), options_)) {
    const auto from = v.empty() ? model_start(model) : std::optional(v);
    InRowUnits rows(model, from ? units_of_rows(model, *from)
                                : own_units(model.structure().constraint_players.size()));
    RobustSearch search({rows, model, rows.units(), witnesses_}, options_,
                        starts_over_y_of_rows(options_), budget_, start);
    return search.run(v, known_);
  }
  Restarted restarted(model, v);
  return structure.solve(restarted, options_, budget_, budget_.observer_of(start, among_others_));
}

Result Refinement::over_branches(Problem& model, const std::vector<double>& v, Index start,
                                 bool at_kink) const {
  std::vector<bool> reads_y;
  if (const auto from = v.empty() ? model_start(model) : std::optional(v))
    reads_y = read_by_objective(model, *from);
  Epigraph epigraph(model, reads_y);
  Result answer = over_branches(epigraph, model, v, start, at_kink);
  if (!epigraph.reads_more()) return answer;
  if (budget_.interrupted()) {
    answer.over_y.finished = false;
    return answer;
  }
  Epigraph all(model, {});
  Result with_all = over_branches(all, model, v, start, at_kink);
  add_work(answer, with_all);
  return with_all;
}

Result Refinement::over_branches(Problem& epigraph, Problem& model, const std::vector<double>& v,
                                 Index start, bool at_kink) const {
  const Index starts = options_.minmax_epigraph ? starts_over_y_of_objective(options_)
                                                : std::max(Index{parameters::kPatience},
                                                           starts_over_y_of_objective(options_));
  std::vector<double> own = v;
  if (!own.empty()) {
    double f = 0.0;
    own.push_back(model.objective(v, true, f) && std::isfinite(f) ? f : 0.0);
  }
  const auto from = own.empty() ? model_start(epigraph) : std::optional(own);
  const Index row_of_f = static_cast<Index>(model.structure().constraint_players.size());
  InRowUnits rows(epigraph, from ? units_of_rows(epigraph, *from, row_of_f)
                                 : own_units(static_cast<std::size_t>(row_of_f) + 1));
  RobustSearch search({rows, model, rows.units(), witnesses_}, options_, starts, budget_, start);
  Result answer = search.run(std::move(own), {}, at_kink);
  const auto m = static_cast<Index>(model.structure().constraint_players.size());
  answer.over_y.branches = static_cast<Index>(std::ranges::count_if(
      answer.worst_cases, [&](const RobustWorstCase& found) { return found.constraint == m; }));
  if (answer.certificate.kind == PointKind::LocalMinmax && answer.over_y.branches > 1) {
    answer.message = "x minimizes the largest of " + std::to_string(answer.over_y.branches) +
                     " local worst cases";
  }
  return answer;
}

}  // namespace ipminmax
