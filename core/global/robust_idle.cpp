#include <algorithm>
#include <utility>

#include "core/global/robust_search.hpp"
#include "core/model/norms.hpp"
#include "core/search/outcome.hpp"

// Copies of y on which x does not rest.
namespace ipminmax {
namespace {

bool is_certified(const Result& result) {
  return result.certificate.kind == PointKind::LocalMinmax;
}

}  // namespace

/// A copy whose row is inactive has a multiplier of zero, so neither it nor what Max's rows tie to
/// it has curvature. The row is maximized alone; where the maximum keeps the bound, the copy is
/// held there for the certificate, else it goes on from there. Whether the answer is left violating
/// a row.
bool RobustSearch::hold_idle(Solved& solved) {
  const std::vector<std::size_t> idle = idle_worst_cases(solved);
  if (idle.empty()) return false;
  const bool failed = !is_success(solved.result.status);
  const Place unsettled = place_;
  keep_point(*solved.copies, solved.result);
  const Place kept = place_;
  std::vector<RobustCopies::WorstCase> own;
  for (const std::size_t k : idle) own.push_back(kept.worst_cases[k]);
  const std::vector<SideScan> scans = scan(without_values(own));
  const bool violated = hold_or_move(idle, scans);
  Solved settled = solve_worst_cases();
  // A y that is held does not follow x into Y(x).
  const auto holds_x = [&](std::size_t k) {
    return place_.worst_cases[k].held && settled.copies->is_active(settled.result, k);
  };
  const bool better = is_success(settled.result.status) &&
                      (failed || violated || is_certified(settled.result)) &&
                      std::ranges::none_of(idle, holds_x);
  if (better) {
    solved = std::move(settled);
    keep_point(*solved.copies, solved.result);
    for (const std::size_t k : idle) {  // the next solve looks for them anew
      place_.worst_cases[k].held = kept.worst_cases[k].held;
      place_.worst_cases[k].copied = kept.worst_cases[k].copied;
    }
  } else {
    place_ = failed ? unsettled : kept;
  }
  if (!better || !is_violated(scans)) return is_violated(scans);
  // The copies that went on from there may have left it.
  std::vector<KnownWorstCase> found;
  for (const SideScan& side : scans) {
    if (!side.maxima.empty()) found.push_back({{side.constraint, side.maxima[0].v}});
  }
  return is_violated(scan(found));
}

/// Takes the idle copies to the maxima of their rows. Whether one of these violates its row.
bool RobustSearch::hold_or_move(const std::vector<std::size_t>& idle,
                                const std::vector<SideScan>& scans) {
  bool violated = false;
  for (const std::size_t k : idle) {
    RobustCopies::WorstCase& worst_case = place_.worst_cases[k];
    const SideScan* side = worst_side(scans, worst_case.constraint);
    if (side == nullptr) continue;
    const bool holds = side->excess(0) <= options_.minmax_worst_case_tol;
    // Where others stand for the same constraint, they may be the largest one.
    const bool alone = std::ranges::count(place_.worst_cases, worst_case.constraint,
                                          &RobustCopies::WorstCase::constraint) == 1;
    if (alone) worst_case.v = side->maxima[0].v;
    violated = violated || (alone && !holds);
    worst_case.held = holds || !alone;
    worst_case.copied = worst_case.copied || worst_case.held;
  }
  return violated;
}

bool RobustSearch::is_violated(const std::vector<SideScan>& scans) const {
  return std::ranges::any_of(scans, [&](const SideScan& side) {
    return !side.maxima.empty() && side.excess(0) > options_.minmax_worst_case_tol;
  });
}

/// A second-order test that is undecided, or a search that failed, for the sake of idle copies.
bool RobustSearch::may_hold_idle(const Result& result) const {
  return !is_certified(result) && !stopped_from_outside(result.status) && !result.v.empty() &&
         all_finite(result.v) && all_finite(result.constraints) && all_finite(result.lambda);
}

/// With Max variables of their own, or copies.
std::vector<std::size_t> RobustSearch::idle_worst_cases(const Solved& solved) const {
  std::vector<std::size_t> idle;
  bool any_active = false;
  for (std::size_t k = 0; k < place_.worst_cases.size(); ++k) {
    if (solved.copies->is_active(solved.result, k)) {
      any_active = true;
    } else if (!place_.worst_cases[k].held &&
               (place_.worst_cases[k].copied || options_.minmax_robust_copies)) {
      idle.push_back(k);
    }
  }
  // A search that failed where nothing holds x has not come near.
  if (!any_active && !is_success(solved.result.status)) idle.clear();
  return idle;
}

}  // namespace ipminmax
