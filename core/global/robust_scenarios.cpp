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
/// Starts of y for each constraint, besides the scenarios that hold x, as long as x is far away.
constexpr Index kCoarseStarts = 2;
/// Rounds after which copies go on, which meet many worst cases of a smooth row by Newton's method.
constexpr Index kCoarseRounds = 2;

}  // namespace

/// x against the scenarios at hand, then the worst cases at the x that these give move with it.
/// Where they do not come to rest, scenarios alone decide: x is a local minimum of fewer constraints
/// than there are, and meets all of them. Whether there is an answer.
bool RobustSearch::exchange_from() {
  for (const double tolerance : {kCoarse, options_.minmax_worst_case_tol}) {
    const bool is_last = tolerance < kCoarse;
    const auto scans = exchange(tolerance, is_last);
    if (!scans) return false;
    const Place scenarios = place_;
    const Result fixed = answer_;
    release(*scans, is_last ? kActive : kNearlyActive);
    if (!is_last) add_missed(active_, *scans);
    const bool moved = solve_rounds() && (!is_last || !better(fixed, answer_));
    if (!moved && is_last) answer_ = fixed;
    if (moved || is_last) return true;
    if (budget_.used_up()) return false;
    place_ = scenarios;
  }
  return false;
}

/// Solves with scenarios of y, the worst of them added in each round, until none violates a row by
/// more than tolerance of its range, or for so many rounds as bring x near where that is all that is
/// wanted. decides: the answer is then that of the last solve. Returns the maxima at its x, or
/// nothing where a solve failed.
std::optional<std::vector<SideScan>> RobustSearch::exchange(double tolerance, bool decides) {
  const Index rounds = decides ? kMostRounds : kCoarseRounds;
  for (Index round = 1;; ++round) {
    const auto [copies, result] = solve_worst_cases();
    if (!is_success(result.status) || budget_.used_up()) {
      if (verified_.empty()) report(*copies, result);
      return {};
    }
    keep_point(*copies, result);
    active_ = active_scenarios(*copies, result);
    std::vector<SideScan> scans =
        scan(decides ? starts_ : std::min(starts_, kCoarseStarts), active_);
    const std::vector<RobustCopies::WorstCase> solved = place_.worst_cases;
    const bool violated = add_violated(scans, tolerance, true);
    const bool more = add_corners(scans) || (violated && round < rounds);
    if (more && !budget_.used_up()) continue;
    const bool settled = std::ranges::all_of(scans, &SideScan::settled);
    if (budget_.used_up() || (decides && (violated || !settled))) {
      place_.worst_cases = solved;
      if (verified_.empty()) report(*copies, result);
      return {};
    }
    if (decides) {
      verified_ = place_.v;
      report(*copies, result);
      tell_what_is_open(scans);
    }
    return scans;
  }
}

/// Corners of y where what follows y diverges become scenarios, so that x moves to where it does not.
/// More than there are corners of three variables are the same ones again. Whether there were any.
bool RobustSearch::add_corners(const std::vector<SideScan>& scans) {
  bool any = false;
  for (const SideScan& side : scans) {
    for (RobustCopies::WorstCase corner : side.valueless_corners) {
      if (corners_added_ >= (1U << kMostHeld)) return any;
      corner.held = can_be_held(model_.structure(), scopes_.of(corner.constraint));
      place_.worst_cases.push_back(std::move(corner));
      ++corners_added_;
      any = true;
    }
  }
  return any;
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
  const std::vector<SideScan> scans = scan(starts_, place_.worst_cases);
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

/// The worst cases that are active or nearly so at this x, with y free again. Of maxima of a
/// constraint that have one gradient in x, as on a face of y, one is enough.
void RobustSearch::release(const std::vector<SideScan>& scans, double nearly) {
  place_.worst_cases.clear();
  const SideScan* highest = nullptr;
  for (const SideScan& side : scans) {
    std::vector<std::vector<double>> gradients;
    for (std::size_t k = 0; k < side.maxima.size(); ++k) {
      if (side.excess(k) <= -nearly) continue;
      std::vector<double> gradient = gradient_in_x(side.maxima[k]);
      if (std::ranges::find(gradients, gradient) != gradients.end()) continue;
      gradients.push_back(std::move(gradient));
      place_.worst_cases.push_back(side.maxima[k]);
    }
    const bool higher = highest == nullptr || side.excess(0) > highest->excess(0);
    if (!side.maxima.empty() && higher) highest = &side;
  }
  if (place_.worst_cases.empty() && highest != nullptr)
    place_.worst_cases.push_back(highest->maxima.front());
}

/// Of a constraint at a worst case, rounded.
std::vector<double> RobustSearch::gradient_in_x(const RobustCopies::WorstCase& one) {
  constexpr double kDigits = 1e6;
  const ProblemStructure& s = model_.structure();
  std::vector<double> jacobian(s.jacobian.size()), gradient;
  ++work_.counts.jacobian;
  if (!model_.jacobian(one.v, true, jacobian)) return {};
  for (std::size_t k = 0; k < jacobian.size(); ++k) {
    const auto [row, col] = s.jacobian[k];
    if (row == one.constraint && s.variable_players[at(col)] == Player::Min)
      gradient.push_back(std::round(kDigits * jacobian[k] * ranges_.of(at(col))));
  }
  return gradient;
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
