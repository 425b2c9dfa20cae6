#include <algorithm>
#include <utility>

#include "core/global/robust_search.hpp"
#include "core/reduction/solve_reduced.hpp"
#include "core/search/random_starts.hpp"

// Worst cases that are maximized exactly: the reduction.
namespace ipminmax {
namespace {

/// First barrier parameter.
constexpr double kMu = 1e-4;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

/// From the place, with the worst cases at hand; none: that failed.
std::optional<RobustSearch::Solved> RobustSearch::solve_exactly() {
  const ProblemStructure& s = model_.structure();
  Reduction reduction{model_, place_.worst_cases, reads_y_, place_.v, budget_, nullptr};
  for (std::size_t k = 0; k < place_.worst_cases.size(); ++k) {
    auto& one = reduction.worst_cases[k];
    one.copied = one.copied || options_.minmax_robust_copies;
    const bool two_sided = s.constraint_lower[at(one.constraint)] > options_.nlp_lower_bound_inf &&
                           s.constraint_upper[at(one.constraint)] < options_.nlp_upper_bound_inf;
    if (!two_sided || one.side != 0 || !one.copied) continue;
    one.side = 1;
    auto other = one;
    other.side = -1;
    reduction.worst_cases.push_back(std::move(other));
  }
  SolverOptions options = near_solution(options_, kMu);
  options.warm_start_init_point = false;
  options.minmax_max_restarts = 0;
  SolveObserver observer = observer_;
  if (observer_.on_iteration) {
    observer.on_iteration = [&](const IterationInfo& info) {
      IterationInfo seen = info;
      seen.v = info.v.first(asked_.structure().variable_players.size());
      seen.result = [&] {
        return in_asked_shape(*reduction.rows, reduction.rows->with_worst_cases(info.result()));
      };
      return observer_.on_iteration(seen);
    };
  }
  ReducedSolve reduced = solve_reduced(reduction, options, observer);
  work_.over_y.solves += reduced.solves;
  work_.over_y.maximizations += reduced.maximizations;
  add_work(reduced.result, work_);
  if (!is_success(reduced.result.status)) return std::nullopt;
  place_.worst_cases = std::move(reduction.worst_cases);
  Result result = reduced.rows->with_worst_cases(std::move(reduced.result));
  return Solved{std::move(reduced.rows), std::move(result)};
}

/// Maximizes the rows of inactive copies from these alone, where y is not looked at otherwise.
/// Whether one was violated: then the next solve goes on from the maxima, and is exact.
bool RobustSearch::finds_drifted(const Solved& solved) {
  if (place_.drifted || budget_.used_up()) return false;
  std::vector<KnownWorstCase> known;
  for (const std::size_t k : idle_worst_cases(solved)) known.push_back({place_.worst_cases[k]});
  if (known.empty()) return false;
  const Index functions = work_.over_y.functions;
  const double violation = violation_;
  const std::vector<SideScan> scans = scan(known);
  place_.drifted = have_drifted(scans, *solved.copies, solved.result);
  if (!place_.drifted) {  // that was no search over y
    work_.over_y.functions = functions;
    violation_ = violation;
    return false;
  }
  for (std::size_t k = 0; k < place_.worst_cases.size(); ++k) {
    auto& one = place_.worst_cases[k];
    const SideScan* side = worst_side(scans, one.constraint);
    if (side == nullptr || solved.copies->is_active(solved.result, k)) continue;
    one.v = side->maxima[0].v;
  }
  return true;
}

/// Whether a row is violated of which no copy is active: the multiplier of such a row is that of the
/// barrier, and its copies follow their own barrier, not the row.
bool RobustSearch::have_drifted(const std::vector<SideScan>& scans, const WorstCaseRows& copies,
                                const Result& result) const {
  return std::ranges::any_of(scans, [&](const SideScan& side) {
    if (side.maxima.empty() || !(side.excess(0) > options_.minmax_worst_case_tol)) return false;
    for (std::size_t k = 0; k < place_.worst_cases.size(); ++k) {
      if (place_.worst_cases[k].constraint == side.constraint && copies.is_active(result, k)) {
        return false;
      }
    }
    return true;
  });
}

}  // namespace ipminmax
