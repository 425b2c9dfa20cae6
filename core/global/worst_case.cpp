#include "core/worst_case.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/global/audit.hpp"
#include "core/global/choice.hpp"
#include "core/global/over_y.hpp"
#include "core/model/compare.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/proof/enclosure.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// Values of maxima in the summary.
constexpr std::size_t kMostListed = 10;
/// Of the range of f over y: maxima whose values differ by less are as high.
constexpr double kValuesAgree = 1e-6;

/// What the maximizations say of f at a point with the value `here`.
WorstCase summary(Problem& problem, const std::vector<double>& v, double here,
                  const MaximaOverY& maxima, const SolverOptions& options) {
  WorstCase found;
  found.starts = maxima.made;
  found.unbounded = maxima.unbounded;
  found.single_branch = maxima.single_branch;
  found.stated_concave = options.minmax_concave_in_y;
  found.maxima =
      static_cast<Index>(std::ranges::count_if(maxima.maxima, &WorstCaseMaximum::certified));
  if (maxima.maxima.empty()) {
    found.higher = found.unbounded;
    return found;
  }
  const ProblemStructure& structure = problem.structure();
  found.value = maxima.maxima.front().value;
  found.v = maxima.maxima.front().v;
  found.y = max_part(structure, found.v);
  for (std::size_t k = 0; k < std::min(kMostListed, maxima.maxima.size()); ++k) {
    found.branches.push_back(maxima.maxima[k].value);
  }
  // Both values are of the same branch where they differ by no more than a maximization is exact.
  ValueRange range = maxima.range;
  range.see(here);
  const double tol = std::max(options.tol, kValuesAgree);
  double clear = range.resolution(tol);
  if (found.value - here > clear && std::isfinite(here))
    clear = std::max(clear, change_with_x(problem, v, found.v, options.tol));
  found.higher = found.unbounded || found.value - here > clear;
  for (const WorstCaseMaximum& maximum : maxima.maxima) {
    if (found.value - maximum.value <= clear) ++found.competing;
  }
  if (maxima.range.size() == 0.0) found.competing = 1;  // f does not vary with y
  return found;
}

}  // namespace

void look_for_worst_case(Problem& problem, Index starts, const Points& given,
                         const MaximizationContext& context, Result& result) {
  MaximaOverY maxima = maximize_objective(problem, result.v, starts, given, context);
  result.worst_case = summary(problem, result.v, result.objective, maxima, context.options);
  SearchOverY& y = result.over_y;
  y.asked = starts;
  y.functions += 1;
  y.finished = y.finished && maxima.finished && maxima.maximized;
  y.better_known = y.better_known || result.worst_case.higher;
  if (!maxima.proof) return;
  describe(-1, 1.0, *maxima.proof);
  y.finished = y.finished && maxima.proof->complete;
  y.proofs.push_back(std::move(*maxima.proof));
}

WorstCaseCheck check_worst_case(Problem& problem, std::span<const double> v,
                                const SolverOptions& options, Index starts, const Points& given,
                                const MultistartObserver& observer) {
  require_point("the point of a worst-case check", problem.structure(), v);
  WorstCaseCheck check;
  if (!has_max_variables(problem.structure())) return check;
  double here = -kInfinity;
  if (!problem.objective(v, true, here) || std::isnan(here)) here = -kInfinity;
  Budget budget(options, observer);
  Result work;
  MaximaOverY maxima = maximize_objective(problem, v, std::max<Index>(1, starts), given,
                                          {options, budget, 0, problem.structure(), work});
  check.interrupted = budget.interrupted();
  check.found = summary(problem, {v.begin(), v.end()}, here, maxima, options);
  check.maxima = std::move(maxima.maxima);
  return check;
}

void add_worst_case(Problem& problem, const SolverOptions& options, Result& result,
                    const MultistartObserver& observer) {
  const Index starts = starts_over_y_of_objective(options);
  // A negative factor of the objective makes the inner player minimize: no maxima to look for.
  if (starts == 0 || result.v.empty() || result.objective_scale < 0.0 || !all_finite(result.v) ||
      !has_max_variables(problem.structure())) {
    return;
  }
  Budget budget(options, observer);
  Result work;
  look_for_worst_case(problem, starts, {}, {options, budget, 0, problem.structure(), work}, result);
  result.over_y.maximizations += work.over_y.maximizations;
  audit(problem, options, Witnesses(), budget, result, result.counts);
}

}  // namespace ipminmax
