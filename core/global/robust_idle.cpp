#include <algorithm>
#include <utility>

#include "core/global/robust_search.hpp"

// Copies of y on which x does not rest.
namespace ipminmax {
namespace {

bool is_certified(const Result& result) {
  return result.certificate.kind == PointKind::LocalMinmax;
}

}  // namespace

/// A copy whose row is inactive stands at a maximum of it, but has a multiplier of zero in the
/// second-order test, so that neither it nor what Max's rows tie to it has curvature there. Where
/// the test is undecided such copies are held.
void RobustSearch::hold_idle(Solved& solved) {
  if (!is_success(solved.result.status) || is_certified(solved.result) || budget_.used_up()) return;
  const Place unsettled = place_;
  std::vector<std::size_t> idle;
  for (std::size_t k = 0; k < place_.worst_cases.size(); ++k) {
    RobustCopies::WorstCase& one = place_.worst_cases[k];
    if (solved.copies->is_active(solved.result, k) || one.held) continue;
    if (one.copied || options_.minmax_robust_copies) idle.push_back(k);
  }
  if (idle.empty()) return;
  keep_point(*solved.copies, solved.result);
  for (const std::size_t k : idle) place_.worst_cases[k].held = place_.worst_cases[k].copied = true;
  Solved settled = solve_worst_cases();
  // A y that is held does not follow x into Y(x).
  const auto holds_x = [&](std::size_t k) { return settled.copies->is_active(settled.result, k); };
  if (!is_certified(settled.result) || std::ranges::any_of(idle, holds_x)) {
    place_ = unsettled;
    return;
  }
  solved = std::move(settled);
  keep_point(*solved.copies, solved.result);
  for (const std::size_t k : idle) {  // the next solve looks for them anew
    place_.worst_cases[k].held = false;
    place_.worst_cases[k].copied = unsettled.worst_cases[k].copied;
  }
}

}  // namespace ipminmax
