#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "core/global/choice.hpp"
#include "core/global/places_over_y.hpp"
#include "core/global/robust_search.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/compare.hpp"
#include "core/model/initial_point.hpp"
#include "core/model/norms.hpp"
#include "core/model/parameters.hpp"
#include "core/model/sampling.hpp"
#include "core/model/structure_check.hpp"
#include "core/search/one_start.hpp"
#include "core/search/outcome.hpp"
#include "core/search/random_starts.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// Multiplier, relative to the largest one, below which a worst case is inactive.
constexpr double kVanishing = 1e-5;

}  // namespace

std::vector<bool> read_by_objective(Problem& model, const std::vector<double>& start) {
  const ProblemStructure& s = model.structure();
  std::vector<bool> reads(start.size(), false);
  std::vector<double> v = start, gradient(start.size());
  std::mt19937_64 random(20220411);
  for (int probe = 0; probe < parameters::kEnough; ++probe) {
    for (std::size_t i = 0; probe > 0 && i < v.size(); ++i) {
      const double t = 2.0 * uniform(random) - 1.0;
      v[i] = std::clamp(start[i] + parameters::kLittle * t * std::max(1.0, std::abs(start[i])),
                        std::min(s.variable_lower[i], start[i]),
                        std::max(s.variable_upper[i], start[i]));
    }
    if (!all_finite(v) || !model.gradient(v, true, gradient)) continue;
    for (std::size_t i = 0; i < v.size(); ++i) {
      if (s.variable_players[i] == Player::Max && gradient[i] != 0.0) reads[i] = true;
    }
  }
  return reads;
}

RobustSearch::RobustSearch(RobustForm form, const SolverOptions& options, Index starts,
                           Budget& budget, Index start)
    : model_(form.solved),
      asked_(form.asked),
      units_(std::move(form.units)),
      witnesses_(form.witnesses),
      ranges_(form.solved.structure()),
      options_(options),
      starts_(starts),
      budget_(budget),
      start_(start),
      observer_(budget.observer_of(start)),
      scopes_(form.solved.structure()),
      violation_(kNaN) {}

Result RobustSearch::run(std::vector<double> start, const std::vector<RobustWorstCase>& known) {
  place_.moved = !start.empty();
  place_.v = std::move(start);
  if (!place_.moved) {
    auto own = model_start(model_);
    if (!own || !check_structure(model_.structure(), options_).empty()) {
      answer_ =
          solve_from_start(model_, options_, budget_, observer_, nullptr);  // says what is wrong
      cut(asked_.structure().variable_players.size(), asked_.structure().constraint_players.size(),
          answer_);
      return std::move(answer_);
    }
    place_.v = std::move(*own);
  }
  const Place first = place_;
  choose_copies();
  start_at_known(known);
  return solve_from(first);
}

/// The first worst case of a constraint begins at the first that is known, others that x rests on
/// become its copies. Two-sided constraints begin as always.
void RobustSearch::start_at_known(const std::vector<RobustWorstCase>& known) {
  bool all = !known.empty();
  std::vector<RobustCopies::WorstCase> chosen;
  for (const RobustCopies::WorstCase& one : place_.worst_cases) {
    chosen.push_back(one);
    bool first = true;
    for (const RobustWorstCase& other : known) {
      if (other.constraint != one.constraint || one.side != 0) continue;
      if (other.v.size() != place_.v.size() || !all_finite(other.v)) continue;
      if (first) {
        chosen.back().v = other.v;
      } else if (other.active && options_.minmax_robust_copies) {
        chosen.push_back({one.constraint, other.v});
      }
      first = false;
    }
    all = all && !first;
  }
  if (!all) return;
  place_.worst_cases = std::move(chosen);
  place_.near = true;
}

/// x against scenarios, then the worst cases at the x that these give move with it. The y of the
/// start may leave x unbounded, or no x may stand up to it: then more scenarios are taken, and last
/// the y of the start moves from there.
Result RobustSearch::solve_from(const Place& first) {
  const Place own = place_;
  bool found = false;
  if (starts_ > 0) {
    for (RobustCopies::WorstCase& one : place_.worst_cases) {
      if (can_be_held(model_.structure(), scopes_.of(one.constraint))) one.held = one.copied = true;
    }
    found = exchange_from();
    if (!found && !budget_.used_up() && verified_.empty()) {
      place_ = {first.v, own.worst_cases, first.moved, false};
      take_scenarios();
      found = exchange_from();
    }
  }
  if (!found && !budget_.used_up()) {
    place_ = own;
    static_cast<void>(solve_rounds());
  }
  if (names_infeasible_) name_infeasible(first.v);
  if (names_infeasible_ && starts_ > 0 && search_failed(answer_.status) &&
      answer_.status != Status::LocallyInfeasible && !budget_.used_up()) {
    begin_anew(first);
  }
  return finish();
}

/// Last: from random starts, as a single solve does.
void RobustSearch::begin_anew(const Place& first) {
  place_ = {first.v, {}, first.moved, false};
  choose_copies();
  restarts_ = true;
  static_cast<void>(solve_rounds());
}

Result RobustSearch::run_from_maxima(std::vector<double> start) {
  place_.moved = true;
  place_.v = std::move(start);
  const Place first = place_;
  choose_copies();
  place_.near = true;  // the answer of a solve, whose valley is not to be left
  std::vector<RobustCopies::WorstCase> own = std::move(place_.worst_cases);
  release(scan(starts_, own), kNearlyActive);
  for (const auto& one : own) {
    if (std::ranges::find(place_.worst_cases, one.constraint,
                          &RobustCopies::WorstCase::constraint) == place_.worst_cases.end()) {
      place_.worst_cases.push_back(one);
    }
  }
  return solve_from(first);
}

/// Solves with the worst cases at hand and adds violated ones until there are none. Whether the
/// answer, that of the last solve or of the last that was checked over y, is a success.
bool RobustSearch::solve_rounds() {
  verified_.clear();
  for (Index round = 0;; ++round) {
    violation_ = kNaN;  // of the next x nothing is known yet
    work_.over_y.functions = 0;
    work_.over_y.proofs.clear();
    Solved solved = solve_worst_cases();
    if (!is_success(solved.result.status)) {
      if (verified_.empty()) report(*solved.copies, solved.result);
      return !verified_.empty();
    }
    keep_point(*solved.copies, solved.result);
    const auto& [copies, result] = solved;
    if (starts_ == 0) {
      report(*copies, result);
      if (!is_certified(result)) hold_inactive(*copies, result);
      return true;
    }
    if (!look_further(*copies, result, round)) return !verified_.empty();
  }
}

/// A copy on which x does not rest has no multiplier and so no curvature in the second-order test.
/// Where that is undecided such copies are held, if this decides it.
void RobustSearch::hold_inactive(const RobustCopies& copies, const Result& result) {
  bool any = false;
  for (std::size_t k = 0; k < place_.worst_cases.size(); ++k) {
    RobustCopies::WorstCase& one = place_.worst_cases[k];
    if (copies.is_active(result, k) || !can_be_held(model_.structure(), scopes_.of(one.constraint)))
      continue;
    one.held = one.copied = any = true;
  }
  if (!any || budget_.used_up()) return;
  const Solved settled = solve_once(true);
  if (is_certified(settled.result)) report(*settled.copies, settled.result);
}

/// With the worst cases at hand, near an answer if there is one.
RobustSearch::Solved RobustSearch::solve_worst_cases() {
  if (place_.near) {
    Solved solved = solve_once(true);
    if (is_success(solved.result.status) || budget_.used_up()) return solved;
  }
  return solve_once(false);
}

/// Checks a success over all of y. Whether another solve is to follow.
bool RobustSearch::look_further(const RobustCopies& copies, const Result& result, Index round) {
  const std::vector<RobustCopies::WorstCase> known = place_.worst_cases;
  std::vector<SideScan> scans = scan(starts_, known);
  if (wants_last_look(scans)) scans = scan(starts_, known, &scans);
  const std::vector<RobustCopies::WorstCase> solved = place_.worst_cases;
  if (add_violated(scans, options_.minmax_worst_case_tol, false)) {
    if (round < kMostRounds && !budget_.used_up()) return true;
    if (!verified_.empty()) return false;
    place_.worst_cases = solved;
    report(copies, result);
    answer_.over_y.better_known = true;
    return false;
  }
  if (budget_.interrupted() || !std::ranges::all_of(scans, &SideScan::settled)) {
    if (verified_.empty()) report(copies, result);
    return false;
  }
  const bool first = verified_.empty();
  if (first || better(result, answer_)) {
    verified_ = place_.v;
    report(copies, result);
    tell_what_is_open(scans);
  }
  // Checked over all of y, worst cases far from active only blur the certificate.
  return first && !budget_.used_up() && drop_inactive(copies, result);
}

/// Where nothing violates an answer that was not checked before, unless starts are counted or a
/// proof follows.
bool RobustSearch::wants_last_look(const std::vector<SideScan>& scans) const {
  const auto holds = [&](const SideScan& side) {
    return side.settled &&
           (side.maxima.empty() || !side.violates(0, options_.minmax_worst_case_tol));
  };
  return starts_ > 0 && may_look_longer(options_) && !options_.minmax_worst_case_proof &&
         verified_.empty() && !budget_.used_up() && std::ranges::all_of(scans, holds);
}

void RobustSearch::choose_copies() {
  const ProblemStructure& s = model_.structure();
  reads_y_ = read_by_objective(model_, place_.v);
  std::vector<Index> readers(place_.v.size(), 0);
  const std::vector<Index> rows = robust_constraints(s);
  for (const Index row : rows) {
    for (const Index i : scopes_.of(row).variables) ++readers[at(i)];
  }
  for (const Index row : rows) {
    const RobustScope scope = scopes_.of(row);
    const bool shared = std::ranges::any_of(
        scope.variables, [&](Index i) { return reads_y_[at(i)] || readers[at(i)] > 1; });
    const bool copied = shared && options_.minmax_robust_copies;
    const bool two_sided = s.constraint_lower[at(row)] > options_.nlp_lower_bound_inf &&
                           s.constraint_upper[at(row)] < options_.nlp_upper_bound_inf &&
                           s.constraint_lower[at(row)] < s.constraint_upper[at(row)] &&
                           options_.minmax_robust_copies;
    place_.worst_cases.push_back({row, place_.v, copied, false, two_sided ? 1 : 0});
    if (two_sided) place_.worst_cases.push_back({row, place_.v, true, false, -1});
  }
}

/// near: the start is not to be forgotten.
RobustSearch::Solved RobustSearch::solve_once(bool near) {
  auto copies = std::make_unique<RobustCopies>(model_, place_.worst_cases, reads_y_, budget_);
  if (place_.moved) copies->start_at(place_.v);
  // With a large mu maxima at different bounds are one.
  SolverOptions options = near ? staying_near(options_, parameters::kSlight) : options_;
  options.warm_start_init_point = false;
  // Where worst cases are looked for, that is where to begin anew.
  if (starts_ > 0 && !restarts_) options.minmax_max_restarts = 0;
  SolveObserver observer = observer_;
  if (observer_.on_iteration) {
    observer.on_iteration = [&](const IterationInfo& info) {
      IterationInfo seen = info;
      seen.v = info.v.first(asked_.structure().variable_players.size());
      seen.result = [&] { return in_asked_shape(*copies, info.result()); };
      return observer_.on_iteration(seen);
    };
  }
  ++work_.over_y.solves;
  Result result = solve_from_start(*copies, options, budget_, observer, nullptr);
  add_work(result, work_);
  return {std::move(copies), std::move(result)};
}

/// The next solve goes on from here.
void RobustSearch::keep_point(const RobustCopies& copies, const Result& result) {
  place_.v.assign(result.v.begin(),
                  result.v.begin() + static_cast<std::ptrdiff_t>(place_.v.size()));
  place_.moved = place_.near = true;
  for (std::size_t k = 0; k < place_.worst_cases.size(); ++k) {
    place_.worst_cases[k].v = copies.model_point(result.v, k);
  }
}

/// One more worst case of each side whose largest maximum exceeds the bound; scenarios (held): one
/// of each maximum that does. One that a copy has left to its barrier, or that violates the row
/// slightly, is held where it is: y's own error is of second order there. Whether there were any.
bool RobustSearch::add_violated(const std::vector<SideScan>& scans, double tolerance, bool held) {
  bool any = false;
  for (const SideScan& side : scans) {
    const bool can_hold = can_be_held(model_.structure(), scopes_.of(side.constraint));
    for (std::size_t k = 0; k < side.maxima.size() && (k == 0 || held); ++k) {
      if (!side.violates(k, tolerance)) break;
      const auto is_known = [&](const RobustCopies::WorstCase& other) {
        return other.is_of_same(side.maxima[k]) && (!held || other.held) &&
               is_same(other, side.maxima[k], held ? options_.minmax_distinct_tol : kSameBranch);
      };
      const bool known = std::ranges::any_of(place_.worst_cases, is_known);
      if (known && (held || !can_hold)) continue;
      place_.worst_cases.push_back(side.maxima[k]);
      const bool slightly = side.excess(k) < kCoarse;
      place_.worst_cases.back().held = can_hold && (held || known || slightly);
      any = true;
    }
  }
  return any;
}

/// Whether two worst cases of one constraint have the same y, each variable to tol of its range.
bool RobustSearch::is_same(const RobustCopies::WorstCase& a, const RobustCopies::WorstCase& b,
                           double tol) const {
  return same_point(a.v, b.v, ranges_, scopes_.of(a.constraint).variables, tol);
}

/// Drops worst cases whose multiplier vanishes or that have met another one, but for one. Whether
/// there were any.
bool RobustSearch::drop_inactive(const RobustCopies& copies, const Result& result) {
  double largest = 0.0;
  for (std::size_t k = 0; k < place_.worst_cases.size(); ++k) {
    largest = std::max(largest, std::abs(result.lambda[at(copies.row(k))]));
  }
  std::vector<RobustCopies::WorstCase> kept;
  for (std::size_t k = 0; k < place_.worst_cases.size(); ++k) {
    const auto& worst_case = place_.worst_cases[k];
    const bool active = std::abs(result.lambda[at(copies.row(k))]) > kVanishing * largest;
    const bool met = std::ranges::any_of(kept, [&](const auto& other) {
      return other.is_of_same(worst_case) &&
             is_same(worst_case, other, options_.minmax_distinct_tol);
    });
    if ((active && !met) || !worst_case.copied) kept.push_back(worst_case);
  }
  if (kept.empty()) kept.push_back(place_.worst_cases.front());
  const bool fewer = kept.size() < place_.worst_cases.size();
  place_.worst_cases = std::move(kept);
  return fewer;
}

/// At the x of place_.v; maximizations begin at the known worst cases, too. before: of this x, for
/// the last look.
std::vector<SideScan> RobustSearch::scan(Index starts,
                                         const std::vector<RobustCopies::WorstCase>& known,
                                         const std::vector<SideScan>* before) {
  MaximizationContext context{options_, budget_, start_, asked_.structure(), work_, work_.over_y};
  context.before = before;
  context.witnesses = &witnesses_;
  ranges_.see(place_.v);
  context.sizes = &ranges_;
  // None looks from where a scan before it did.
  context.drawn = std::max(Index{parameters::kPlenty}, starts_) * scans_++;
  std::vector<SideScan> scans =
      scan_robust_constraints(model_, place_.v, starts, known, scopes_, units_, context);
  violation_ = 0.0;
  for (const SideScan& side : scans) {
    for (const RobustCopies::WorstCase& maximum : side.maxima) ranges_.see(maximum.v);
    if (side.maxima.empty()) continue;
    violation_ =
        std::max(violation_, (side.values[0] - side.bound) / units_.factor[at(side.constraint)]);
  }
  const std::size_t n = asked_.structure().variable_players.size();
  highest_.clear();
  for (const Index row : robust_constraints(asked_.structure())) {
    const SideScan* side = worst_side(scans, row);
    if (side == nullptr) continue;
    const double sign = side->maxima.front().side < 0 ? -1.0 : 1.0;
    highest_.push_back({.constraint = row,
                        .v = side->maxima.front().v,
                        .value = units_.value(at(row), 1.0, sign * side->values.front())});
    highest_.back().v.resize(n);
  }
  return scans;
}

}  // namespace ipminmax
