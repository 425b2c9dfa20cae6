#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/global/robust_search.hpp"
#include "core/model/parameters.hpp"
#include "core/multistart.hpp"
#include "core/search/random_starts.hpp"
#include "linalg/numbers.hpp"

// Scenarios: y that are held, added where they violate a robust constraint, until x stands up to
// them all.
namespace ipminmax {
namespace {

/// Distance to the bound, beside the range of a row, up to which a maximum is active where scenarios
/// have come to rest.
constexpr double kActive = 1e-5;

}  // namespace

/// One branch of y alone may leave x unbounded, or end: x first against scenarios, then the worst
/// cases at the x that these give move with it. Where they do not come to rest, scenarios alone
/// decide: x is a local minimum of fewer constraints than there are, and meets all of them.
void RobustSearch::exchange_from(const Place& first) {
  place_ = {first.v, std::move(place_.worst_cases), first.moved, false};
  take_scenarios();
  for (const double tolerance : {kCoarse, options_.minmax_worst_case_tol}) {
    const bool is_last = tolerance < kCoarse;
    const auto scans = exchange(tolerance, is_last);
    if (!scans) return;
    const Place scenarios = place_;
    const Result fixed = answer_;
    release(*scans, is_last ? kActive : kNearlyActive);
    if (!is_last) add_missed(active_, *scans);
    const bool moved = solve_rounds() && (!is_last || !better(fixed, answer_));
    if (!moved && is_last) answer_ = fixed;
    if (moved || budget_.used_up()) return;
    place_ = scenarios;
  }
}

/// Solves with scenarios of y, the worst of them added in each round, until none violates a row by
/// more than tolerance of its range. reports: the answer is then that of the last solve. Returns
/// the maxima at its x, or nothing where a solve failed.
std::optional<std::vector<SideScan>> RobustSearch::exchange(double tolerance, bool reports) {
  for (Index round = 0; round < kMostRounds; ++round) {
    Solved solved = solve_worst_cases();
    if (budget_.used_up()) return {};
    const auto& [copies, result] = solved;
    if (!is_success(result.status)) return {};
    keep_point(*copies, result);
    active_ = active_scenarios(*copies, result);
    std::vector<SideScan> scans = scan(active_);
    if (budget_.used_up()) return {};
    if (add_violated(scans, tolerance, true)) continue;
    if (reports && std::ranges::all_of(scans, &SideScan::settled)) {
      verified_ = place_.v;
      report(*copies, result);
      tell_what_is_open(scans);
    }
    return scans;
  }
  return {};
}

/// The scenarios that hold x where it is: local maxima are near them.
std::vector<RobustCopies::WorstCase> RobustSearch::active_scenarios(const RobustCopies& copies,
                                                                    const Result& result) const {
  double largest = 0.0;
  for (std::size_t k = 0; k < place_.worst_cases.size(); ++k) {
    largest = std::max(largest, std::abs(result.lambda[at(copies.row(k))]));
  }
  std::vector<RobustCopies::WorstCase> active;
  for (std::size_t k = 0; k < place_.worst_cases.size(); ++k) {
    if (std::abs(result.lambda[at(copies.row(k))]) > parameters::kTrace * largest) {
      active.push_back(place_.worst_cases[k]);
    }
  }
  return active;
}

/// The y where maximizations at this x begin and end, and random ones: fewer than there are x would
/// leave x unbounded. One that Max constraints restrain begins anywhere.
void RobustSearch::take_scenarios() {
  const ProblemStructure& s = model_.structure();
  const std::vector<SideScan> scans = scan(place_.worst_cases);
  place_.worst_cases.clear();
  const auto of_min = static_cast<Index>(std::ranges::count(s.variable_players, Player::Min));
  for (const SideScan& side : scans) {
    const RobustScope scope = scopes_.of(side.constraint);
    const bool held = can_be_held(s, scope);
    if (scope.constraints.empty()) {
      for (const auto& v : side.starts) {
        place_.worst_cases.push_back({side.constraint, v, true, true});
      }
      for (Index start = starts_;
           start < std::min<Index>(parameters::kFew * of_min, parameters::kPlenty); ++start) {
        place_.worst_cases.push_back(
            {side.constraint, random_start(s, place_.v, start, options_), true, true});
      }
    }
    for (const auto& found : side.maxima) {
      place_.worst_cases.push_back({side.constraint, found.v, true, held});
    }
  }
}

/// The worst cases that are active or nearly so at this x, with y free again.
void RobustSearch::release(const std::vector<SideScan>& scans, double nearly) {
  place_.worst_cases.clear();
  for (const SideScan& side : scans) {
    for (std::size_t k = 0; k < side.maxima.size(); ++k) {
      if (k == 0 || side.excess(k) > -nearly) place_.worst_cases.push_back(side.maxima[k]);
    }
  }
}

/// Scenarios that hold x but are not on the way up to one of the maxima: one of their own is near.
void RobustSearch::add_missed(const std::vector<RobustCopies::WorstCase>& active,
                              const std::vector<SideScan>& scans) {
  for (RobustCopies::WorstCase scenario : active) {
    scenario.held = false;
    const bool met = std::ranges::any_of(place_.worst_cases, [&](const auto& other) {
      return other.constraint == scenario.constraint &&
             (is_same(scenario, other, kSameBranch) || leads_to(scenario, other, scans));
    });
    if (!met) place_.worst_cases.push_back(std::move(scenario));
  }
}

/// Whether the constraint rises, or does not fall, all the way from one y to another at the x of
/// place_.v: they belong to one branch.
bool RobustSearch::leads_to(const RobustCopies::WorstCase& from, const RobustCopies::WorstCase& to,
                            const std::vector<SideScan>& scans) {
  constexpr int kPoints = 20;
  const SideScan* side = worst_side(scans, from.constraint);
  if (side == nullptr) return false;
  const ProblemStructure& s = model_.structure();
  const double sign = side->bound == s.constraint_upper[at(from.constraint)] ? 1.0 : -1.0;
  std::vector<double> v = place_.v, g(s.constraint_players.size());
  double highest = -std::numeric_limits<double>::infinity();
  for (int k = 0; k <= kPoints; ++k) {
    const double t = static_cast<double>(k) / kPoints;
    for (std::size_t i = 0; i < v.size(); ++i) {
      if (s.variable_players[i] == Player::Max) v[i] = (1.0 - t) * from.v[i] + t * to.v[i];
    }
    if (!model_.constraint_rows({&from.constraint, 1}, v, true, g)) return false;
    const double value = sign * g[at(from.constraint)];
    if (!(value >= highest - parameters::kTrace * side->range.size())) return false;
    highest = std::max(highest, value);
  }
  return true;
}

}  // namespace ipminmax
