#include <algorithm>
#include <string>
#include <utility>

#include "core/global/robust_search.hpp"
#include "core/model/compare.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/robust/epigraph.hpp"
#include "core/search/outcome.hpp"
#include "core/search/random_starts.hpp"
#include "linalg/numbers.hpp"

// Robust constraints that cannot be met: which, by how much, and by which y.
namespace ipminmax {
namespace {

/// Times constr_viol_tol, in the units of the rows: a least violation that is none of rounding.
constexpr double kClearViolation = 10.0;

}  // namespace

/// After a search that failed: minimizes the largest violation of the robust constraints over y.
/// Where that stays above the tolerance they cannot be met here.
void RobustSearch::name_infeasible(std::vector<double> start) {
  const bool failed = search_failed(answer_.status) || answer_.over_y.better_known;
  if (!failed || budget_.used_up()) return;
  if (!answer_.v.empty() && all_finite(answer_.v)) start = answer_.v;
  start.resize(form_.asked.structure().variable_players.size());
  if (!all_finite(start)) return;
  InRowUnits rows(form_.asked, units_of_rows(form_.asked, start));
  Epigraph problem(rows);
  if (!problem.relaxes_any()) return;
  start.push_back(1.0);
  SolverOptions options = options_;
  options.minmax_worst_case_proof = false;  // what is seen is enough
  RobustSearch search({problem, form_.asked, rows.units(), form_.witnesses}, options, starts_,
                      budget_, start_);
  search.names_infeasible_ = false;
  Result least = search.run(std::move(start));
  add_work(least, work_);
  if (!is_success(least.status) || least.over_y.better_known || !least.over_y.finished) return;
  const ProblemStructure& s = form_.asked.structure();
  double largest = 0.0, violation = 0.0;
  const RobustWorstCase* worst = nullptr;
  const auto excess_of = [&](const std::vector<double>& g, std::size_t row) {
    return excess(g[row], s.constraint_lower[row], s.constraint_upper[row]);
  };
  for (RobustWorstCase& found : least.worst_cases) {
    std::vector<double> g(s.constraint_players.size());
    if (!form_.asked.constraints(found.v, true, g)) return;
    const auto row = at(found.constraint);
    found.value = g[row];  // was that of the relaxed row
    const double beside = excess_of(g, row) * rows.units().factor[row];
    if (beside <= largest) continue;
    largest = beside;
    violation = excess_of(g, row);
    worst = &found;
  }
  if (worst == nullptr || !(largest > kClearViolation * options_.constr_viol_tol)) return;
  least.message =
      "robust constraints cannot be met near this x: the least worst-case violation is " +
      number_text(violation, 6) + ", of " + constraint_name(s, worst->constraint) + " at " +
      describe_y(s, worst->constraint, worst->v);
  least.status = Status::LocallyInfeasible;
  least.certificate = {};
  least.certificate.kind = PointKind::InfeasiblePoint;
  least.over_y.largest_violation = violation;
  for (std::size_t row = 0; row < least.constraints.size(); ++row)
    least.error.primal = std::max(least.error.primal, excess_of(least.constraints, row));
  answer_ = std::move(least);
}

}  // namespace ipminmax
