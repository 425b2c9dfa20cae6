#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <utility>

#include "core/model/norms.hpp"
#include "core/model/sampling.hpp"
#include "core/multistart.hpp"
#include "core/search/outcome.hpp"
#include "core/search/random_starts.hpp"
#include "core/search/robust_search.hpp"

namespace ipminmax {
namespace {

/// Rounds of solving and looking for worst cases.
constexpr Index kMostRounds = 30;
/// Points at which the gradient of f tells which Max variables f reads, and how far they lie from
/// the start, relative to max(1, |v|).
constexpr int kProbes = 3;
constexpr double kProbeRadius = 0.1;
/// Excess over its bound, relative to its range, from which a constraint asks for another scenario.
constexpr double kScenarioTol = 1e-3;
/// Distance to its bound, on that scale, within which a maximum becomes a worst case of its own.
constexpr double kNearlyActive = 1e-2;
/// Multiplier, relative to the largest one, below which a worst case is inactive.
constexpr double kVanishing = 1e-5;
/// The same for a scenario from which maximizations begin.
constexpr double kActiveScenario = 1e-3;
/// Distance, relative to max(1, |v|), up to which a maximum is that of a scenario.
constexpr double kSameBranch = 0.05;
/// First barrier parameter, and distance to bounds, of a solve that goes on from an answer: with a
/// large one maxima at different bounds are one.
constexpr double kMuNear = 1e-4;
/// The same where that fails: maxima next to a bound with little slope need it smaller still.
constexpr double kMuNearer = 1e-7;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Options of a solve that begins near its solution.
SolverOptions near(const SolverOptions& options, double mu) {
  SolverOptions near = options;
  near.mu_init = std::min(options.mu_init, mu);
  for (double* push :
       {&near.bound_push, &near.bound_frac, &near.slack_bound_push, &near.slack_bound_frac}) {
    *push = std::min(*push, mu);
  }
  near.bound_mult_init_method = BoundMultiplierInit::MuBased;
  return near;
}

/// Which Max variables f reads, from its gradient around the start.
std::vector<bool> read_by_objective(Problem& model, const std::vector<double>& start) {
  const ProblemStructure& s = model.structure();
  std::vector<bool> reads(start.size(), false);
  std::vector<double> v = start, gradient(start.size());
  std::mt19937_64 random(20220411);
  for (int probe = 0; probe < kProbes; ++probe) {
    for (std::size_t i = 0; probe > 0 && i < v.size(); ++i) {
      const double t = 2.0 * uniform(random) - 1.0;
      v[i] = std::clamp(start[i] + kProbeRadius * t * std::max(1.0, std::abs(start[i])),
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

/// Whether Y, as far as a robust constraint's scope goes, depends on x: then no fixed y is in it
/// for every x.
bool moves_with_x(const ProblemStructure& s, const RobustScope& scope) {
  return std::ranges::any_of(s.jacobian, [&](Triplet entry) {
    return s.variable_players[at(entry.col)] == Player::Min &&
           std::ranges::binary_search(scope.constraints, entry.row);
  });
}

/// The side of a constraint that is violated most, or nearest to it; null: no maximum was found.
const SideScan* worst_side(const std::vector<SideScan>& scans, Index constraint) {
  const SideScan* worst = nullptr;
  for (const SideScan& side : scans) {
    if (side.constraint != constraint || side.maxima.empty()) continue;
    if (worst == nullptr || side.excess(0) > worst->excess(0)) worst = &side;
  }
  return worst;
}

bool is_certified(const Result& result) {
  return result.certificate.kind == PointKind::LocalMinmax;
}

/// Whether the row of the k-th worst case holds x where it is: its multiplier exceeds its distance
/// to the bound.
bool is_active(const RobustCopies& copies, const Result& result, std::size_t k) {
  const std::size_t row = at(copies.row(k));
  const ProblemStructure& s = copies.structure();
  const double distance = std::min(std::abs(s.constraint_upper[row] - result.constraints[row]),
                                   std::abs(result.constraints[row] - s.constraint_lower[row]));
  return std::abs(result.lambda[row]) > distance;
}

/// Copies become what they copy in what the certificate is about; what the solved form has behind
/// the asked model's n variables and m constraints is left out.
void name_originals(const RobustCopies& copies, Index n, Index m, Certificate& certificate) {
  const auto replace = [](std::vector<Index>& indices, Index size, const auto& original) {
    std::vector<Index> kept;
    for (const Index i : indices) {
      const Index own = original(i);
      if (own < size && std::ranges::find(kept, own) == kept.end()) kept.push_back(own);
    }
    indices = std::move(kept);
  };
  const auto variable = [&](Index i) { return copies.model_variable(i); };
  for (CertificateReason& reason : certificate.reasons) {
    replace(reason.variables, n, variable);
    replace(reason.constraints, m, [&](Index j) { return copies.model_row(j); });
  }
  Index& least = certificate.least_curvature_variable;
  if (least >= 0) least = variable(least) < n ? variable(least) : -1;
}

/// Cuts what the solved form has behind the asked model's variables and constraints.
void cut(const ProblemStructure& asked, Result& result) {
  const std::size_t n = asked.variable_players.size();
  const std::size_t m = asked.constraint_players.size();
  for (auto* values : {&result.v, &result.z_lower, &result.z_upper}) values->resize(n);
  for (auto* values : {&result.lambda, &result.constraints}) values->resize(m);
}

}  // namespace

RobustSearch::RobustSearch(RobustForm form, const SolverOptions& options, int starts,
                           const SolveObserver& observer, TimeLimit& limit)
    : model_(form.solved),
      asked_(form.asked),
      options_(options),
      starts_(starts),
      observer_(observer),
      limit_(limit),
      violation_(kNaN) {}

RobustResult RobustSearch::run(std::vector<double> start) {
  moved_ = !start.empty();
  start_ = std::move(start);
  if (!moved_) {
    start_.assign(model_.structure().variable_players.size(), 0.0);
    StartingPoint own{
        .v = start_, .needs_multipliers = false, .lambda = {}, .z_lower = {}, .z_upper = {}};
    if (!model_.starting_point(own)) {
      answer_.result = solve(model_, options_, observer_);  // says what is wrong
      cut(asked_.structure(), answer_.result);
      return std::move(answer_);
    }
  }
  const std::vector<double> first_start = start_;
  const bool moved = moved_;
  choose_copies();
  if (solve_rounds() || starts_ == 0 || stopped_from_outside(answer_.result.status)) {
    return finish();
  }
  // One branch of y alone may leave x unbounded, or end: scenarios first, then the worst cases at
  // the x that they give.
  start_ = first_start;
  moved_ = moved;
  near_ = false;
  if (exchange()) static_cast<void>(solve_rounds());
  return finish();
}

RobustResult RobustSearch::run_from_maxima(std::vector<double> start) {
  moved_ = true;
  start_ = std::move(start);
  const std::vector<double> first_start = start_;
  choose_copies();
  std::vector<RobustCopies::WorstCase> own = std::move(worst_cases_);
  release(scan(own));
  for (const auto& first : own) {
    if (std::ranges::find(worst_cases_, first.constraint, &RobustCopies::WorstCase::constraint) ==
        worst_cases_.end()) {
      worst_cases_.push_back(first);
    }
  }
  if (solve_rounds() || stopped_from_outside(answer_.result.status)) return finish();
  start_ = first_start;
  near_ = false;
  if (exchange()) static_cast<void>(solve_rounds());
  return finish();
}

/// Solves with the worst cases at hand and adds violated ones until there are none. Whether the
/// answer, that of the last solve or of the last that was checked over y, is a success.
bool RobustSearch::solve_rounds() {
  verified_ = false;
  for (Index round = 0;; ++round) {
    Solved solved = solve_worst_cases();
    const bool violates = may_hold_idle(solved.result) && hold_idle(solved);
    if (!is_success(solved.result.status)) {
      if (!verified_) report(*solved.copies, solved.result);
      return verified_;
    }
    keep_point(*solved.copies, solved.result);
    const auto& [copies, result] = solved;
    if (starts_ == 0) {
      report(*copies, result);
      if (!violates) return true;
      answer_.result.status = Status::NoLocalMinmaxFound;
      answer_.result.message =
          "a worst case over y that violates a robust constraint was found and not met; "
          "minmax_worst_case_starts N looks for more of them";
      return false;
    }
    if (!look_further(*copies, result, round)) return is_success(answer_.result.status);
  }
}

/// With the worst cases at hand.
RobustSearch::Solved RobustSearch::solve_worst_cases() {
  auto copies = std::make_unique<RobustCopies>(model_, worst_cases_, reads_y_);
  if (moved_) copies->start_at(start_);
  Result result = solve_once(*copies);
  return {std::move(copies), std::move(result)};
}

/// A copy whose row is inactive has a multiplier of zero, so neither it nor what Max's rows tie to
/// it has curvature. The row is maximized alone; where the maximum keeps the bound, the copy is
/// held there for the certificate, else it goes on from there. Whether the answer is left violating
/// a row.
bool RobustSearch::hold_idle(Solved& solved) {
  const std::vector<std::size_t> idle = idle_worst_cases(solved);
  if (idle.empty()) return false;
  const bool failed = !is_success(solved.result.status);
  const std::vector<double> own_start = start_;
  const bool was_near = near_, had_moved = moved_;
  const std::vector<RobustCopies::WorstCase> unsettled = worst_cases_;
  keep_point(*solved.copies, solved.result);
  const std::vector<RobustCopies::WorstCase> before = worst_cases_;
  std::vector<RobustCopies::WorstCase> own;
  for (const std::size_t k : idle) own.push_back(before[k]);
  const std::vector<SideScan> scans = scan(own);
  bool violated = false;
  for (const std::size_t k : idle) {
    RobustCopies::WorstCase& worst_case = worst_cases_[k];
    const SideScan* side = worst_side(scans, worst_case.constraint);
    if (side == nullptr) continue;
    const bool holds = side->excess(0) <= options_.minmax_worst_case_tol;
    // Where others stand for the same constraint, they may be the largest one.
    const bool alone = std::ranges::count(before, worst_case.constraint,
                                          &RobustCopies::WorstCase::constraint) == 1;
    if (alone) worst_case.v = side->maxima[0].v;
    violated = violated || (alone && !holds);
    worst_case.held = holds || !alone;
    worst_case.copied = worst_case.copied || worst_case.held;
  }
  Solved settled = solve_worst_cases();
  bool better =
      is_success(settled.result.status) && (failed || violated || is_certified(settled.result));
  for (const std::size_t k : idle) {
    // A y that is held does not follow x into Y(x).
    if (better && worst_cases_[k].held && is_active(*settled.copies, settled.result, k)) {
      better = false;
    }
  }
  if (better) {
    solved = std::move(settled);
    keep_point(*solved.copies, solved.result);
  } else {
    worst_cases_ = failed ? unsettled : before;
    if (failed) start_ = own_start, near_ = was_near, moved_ = had_moved;
  }
  for (const std::size_t k : idle) {  // the next solve looks for them anew
    worst_cases_[k].held = before[k].held;
    worst_cases_[k].copied = before[k].copied;
  }
  if (!better || !is_violated(scans)) return is_violated(scans);
  // The copies that went on from there may have left it.
  std::vector<RobustCopies::WorstCase> found;
  for (const SideScan& side : scans) {
    if (!side.maxima.empty()) found.push_back({side.constraint, side.maxima[0].v});
  }
  return is_violated(scan(found));
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
  for (std::size_t k = 0; k < worst_cases_.size(); ++k) {
    if (is_active(*solved.copies, solved.result, k)) {
      any_active = true;
    } else if (!worst_cases_[k].held && (worst_cases_[k].copied || options_.minmax_robust_copies)) {
      idle.push_back(k);
    }
  }
  // A search that failed where nothing holds x has not come near.
  if (!any_active && !is_success(solved.result.status)) idle.clear();
  return idle;
}

/// Checks a success over all of y. Whether another solve is to follow.
bool RobustSearch::look_further(const RobustCopies& copies, const Result& result, Index round) {
  const std::vector<SideScan> scans = scan(worst_cases_);
  const std::vector<RobustCopies::WorstCase> solved = worst_cases_;
  if (add_violated(scans, options_.minmax_worst_case_tol, false)) {
    if (round < kMostRounds) return true;
    if (verified_) return false;
    worst_cases_ = solved;
    report(copies, result);
    answer_.result.status = Status::NoLocalMinmaxFound;
    answer_.result.message =
        "worst cases over y that violate a robust constraint were found in every round";
    return false;
  }
  const bool first = !std::exchange(verified_, true);
  if (first || better(result, answer_.result)) report(copies, result);
  // Checked over all of y, worst cases far from active only blur the certificate.
  return first && drop_inactive(copies, result);
}

/// Solves with scenarios of y, the worst of them added in each round, until none violates much.
bool RobustSearch::exchange() {
  take_scenarios();
  for (Index round = 0; round < kMostRounds; ++round) {
    Solved solved = solve_worst_cases();
    if (!is_success(solved.result.status) && may_hold_idle(solved.result)) {
      static_cast<void>(hold_idle(solved));
    }
    const auto& [copies, result] = solved;
    if (!is_success(result.status)) return false;
    keep_point(*copies, result);
    const std::vector<RobustCopies::WorstCase> active = active_scenarios(*copies, result);
    const std::vector<SideScan> scans = scan(active);
    if (!add_violated(scans, kScenarioTol, true)) {
      release(scans);
      add_missed(active, scans);
      return true;
    }
  }
  return false;
}

/// The scenarios that hold x where it is: local maxima are near them.
std::vector<RobustCopies::WorstCase> RobustSearch::active_scenarios(const RobustCopies& copies,
                                                                    const Result& result) const {
  double largest = 0.0;
  for (std::size_t k = 0; k < worst_cases_.size(); ++k) {
    largest = std::max(largest, std::abs(result.lambda[at(copies.row(k))]));
  }
  std::vector<RobustCopies::WorstCase> active;
  for (std::size_t k = 0; k < worst_cases_.size(); ++k) {
    if (std::abs(result.lambda[at(copies.row(k))]) > kActiveScenario * largest) {
      active.push_back(worst_cases_[k]);
    }
  }
  return active;
}

/// The y where maximizations at this x begin and end. One that Max constraints restrain begins
/// anywhere.
void RobustSearch::take_scenarios() {
  const ProblemStructure& s = model_.structure();
  const std::vector<SideScan> scans = scan(worst_cases_);
  worst_cases_.clear();
  for (const SideScan& side : scans) {
    const RobustScope scope = robust_scope(s, side.constraint);
    const bool held = !moves_with_x(s, scope);
    if (scope.constraints.empty()) {
      for (const auto& v : side.starts) worst_cases_.push_back({side.constraint, v, true, true});
    }
    for (const auto& found : side.maxima) {
      worst_cases_.push_back({side.constraint, found.v, true, held});
    }
  }
}

/// The worst cases that are active or nearly so at this x, with y free again.
void RobustSearch::release(const std::vector<SideScan>& scans) {
  worst_cases_.clear();
  for (const SideScan& side : scans) {
    for (std::size_t k = 0; k < side.maxima.size(); ++k) {
      if (k == 0 || side.excess(k) > -kNearlyActive) worst_cases_.push_back(side.maxima[k]);
    }
  }
}

/// Scenarios that hold x but are not on the way up to one of the maxima: one of their own is near.
void RobustSearch::add_missed(const std::vector<RobustCopies::WorstCase>& active,
                              const std::vector<SideScan>& scans) {
  for (RobustCopies::WorstCase scenario : active) {
    scenario.held = false;
    const bool met = std::ranges::any_of(worst_cases_, [&](const auto& other) {
      return other.constraint == scenario.constraint &&
             (same_point(scenario.v, other.v, kSameBranch) || leads_to(scenario, other, scans));
    });
    if (!met) worst_cases_.push_back(std::move(scenario));
  }
}

/// Whether the constraint rises, or does not fall, all the way from one y to another at the x of
/// start_: they belong to one branch.
bool RobustSearch::leads_to(const RobustCopies::WorstCase& from, const RobustCopies::WorstCase& to,
                            const std::vector<SideScan>& scans) {
  constexpr int kPoints = 20;
  constexpr double kDip = 1e-3;  // relative to the range of values seen
  const SideScan* side = worst_side(scans, from.constraint);
  if (side == nullptr) return false;
  const ProblemStructure& s = model_.structure();
  const double sign = side->bound == s.constraint_upper[at(from.constraint)] ? 1.0 : -1.0;
  std::vector<double> v = start_, g(s.constraint_players.size());
  double highest = -std::numeric_limits<double>::infinity();
  for (int k = 0; k <= kPoints; ++k) {
    const double t = static_cast<double>(k) / kPoints;
    for (std::size_t i = 0; i < v.size(); ++i) {
      if (s.variable_players[i] == Player::Max) v[i] = (1.0 - t) * from.v[i] + t * to.v[i];
    }
    if (!model_.constraints(v, true, g)) return false;
    const double value = sign * g[at(from.constraint)];
    if (!(value >= highest - kDip * side->scale)) return false;
    highest = std::max(highest, value);
  }
  return true;
}

void RobustSearch::choose_copies() {
  const ProblemStructure& s = model_.structure();
  reads_y_ = read_by_objective(model_, start_);
  std::vector<Index> readers(start_.size(), 0);
  const std::vector<Index> rows = robust_constraints(s);
  for (const Index row : rows) {
    for (const Index i : robust_scope(s, row).variables) ++readers[at(i)];
  }
  for (const Index row : rows) {
    const RobustScope scope = robust_scope(s, row);
    const bool shared = std::ranges::any_of(
        scope.variables, [&](Index i) { return reads_y_[at(i)] || readers[at(i)] > 1; });
    worst_cases_.push_back({row, start_, shared && options_.minmax_robust_copies});
  }
}

Result RobustSearch::solve_once(RobustCopies& copies) {
  SolverOptions options = options_;
  options.warm_start_init_point = false;
  // Where worst cases are looked for, that is where to begin anew.
  if (starts_ > 0) options.minmax_max_restarts = 0;
  SolveObserver observer = observer_;
  if (observer_.on_iteration) {
    observer.on_iteration = [&](const IterationInfo& info) {
      IterationInfo seen = info;
      seen.v = info.v.first(asked_.structure().variable_players.size());
      seen.result = [&] { return in_asked_shape(copies, info.result()); };
      return observer_.on_iteration(seen);
    };
  }
  const auto solve_with = [&](SolverOptions own) {
    limit_.pass_on(own);
    ++answer_.solves;
    Result result = solve(copies, own, observer);
    add_work(result, work_);
    return result;
  };
  for (const double mu : {kMuNear, kMuNearer}) {
    if (!near_) break;
    Result result = solve_with(near(options, mu));
    if (is_success(result.status) || stopped_from_outside(result.status)) return result;
  }
  return solve_with(options);
}

/// The next solve goes on from here.
void RobustSearch::keep_point(const RobustCopies& copies, const Result& result) {
  start_.assign(result.v.begin(), result.v.begin() + static_cast<std::ptrdiff_t>(start_.size()));
  moved_ = near_ = true;
  for (std::size_t k = 0; k < worst_cases_.size(); ++k) {
    worst_cases_[k].v = copies.model_point(result.v, k);
  }
}

/// One more worst case of each side whose largest maximum exceeds the bound, unless it is known;
/// scenarios (held): one of each maximum that does. Whether there were any.
bool RobustSearch::add_violated(const std::vector<SideScan>& scans, double tolerance, bool held) {
  bool any = false;
  for (const SideScan& side : scans) {
    const bool fixed = held && !moves_with_x(model_.structure(),
                                             robust_scope(model_.structure(), side.constraint));
    for (std::size_t k = 0; k < side.maxima.size() && (k == 0 || held); ++k) {
      if (!(side.excess(k) > tolerance)) break;
      const bool known = std::ranges::any_of(worst_cases_, [&](const auto& other) {
        return other.constraint == side.constraint &&
               same_point(side.maxima[k].v, other.v, options_.minmax_distinct_tol);
      });
      if (known) continue;
      worst_cases_.push_back({side.constraint, side.maxima[k].v, true, fixed});
      any = true;
    }
  }
  return any;
}

/// Drops worst cases whose multiplier vanishes or that have met another one; each constraint keeps
/// at least one. Whether there were any.
bool RobustSearch::drop_inactive(const RobustCopies& copies, const Result& result) {
  double largest = 0.0;
  for (std::size_t k = 0; k < worst_cases_.size(); ++k) {
    largest = std::max(largest, std::abs(result.lambda[at(copies.row(k))]));
  }
  std::vector<RobustCopies::WorstCase> kept;
  for (std::size_t k = 0; k < worst_cases_.size(); ++k) {
    const auto& worst_case = worst_cases_[k];
    const bool active = std::abs(result.lambda[at(copies.row(k))]) > kVanishing * largest;
    const bool met = std::ranges::any_of(kept, [&](const auto& other) {
      return other.constraint == worst_case.constraint &&
             same_point(worst_case.v, other.v, options_.minmax_distinct_tol);
    });
    if ((active && !met) || !worst_case.copied) kept.push_back(worst_case);
  }
  for (const auto& worst_case : worst_cases_) {
    if (std::ranges::find(kept, worst_case.constraint, &RobustCopies::WorstCase::constraint) ==
        kept.end()) {
      kept.push_back(worst_case);
    }
  }
  const bool fewer = kept.size() < worst_cases_.size();
  worst_cases_ = std::move(kept);
  return fewer;
}

/// At the x of start_; maximizations begin at the given worst cases, too.
std::vector<SideScan> RobustSearch::scan(const std::vector<RobustCopies::WorstCase>& given) {
  SolverOptions options = options_;
  limit_.pass_on(options);
  std::vector<SideScan> scans =
      scan_worst_cases(model_, start_, options, starts_, given, answer_.maximizations, work_);
  violation_ = 0.0;
  for (const SideScan& side : scans) {
    if (!side.maxima.empty()) violation_ = std::max(violation_, side.values[0] - side.bound);
  }
  return scans;
}

void RobustSearch::report(const RobustCopies& copies, const Result& result) {
  answer_.worst_cases = list_worst_cases(copies, result);
  answer_.result = in_asked_shape(copies, result);
  answer_.largest_violation = violation_;
}

Result RobustSearch::in_asked_shape(const RobustCopies& copies, const Result& result) const {
  const std::size_t n = start_.size();
  Result own = result;
  name_originals(copies, static_cast<Index>(asked_.structure().variable_players.size()),
                 static_cast<Index>(asked_.structure().constraint_players.size()), own.certificate);
  if (result.v.size() < n) return own;
  own.lambda.resize(model_.structure().constraint_players.size());
  std::vector<double> largest(n, -1.0);
  for (std::size_t k = 0; k < worst_cases_.size(); ++k) {
    const Index row = copies.row(k);
    const auto constraint = at(worst_cases_[k].constraint);
    const double multiplier = result.lambda[at(row)];
    if (at(row) != constraint) own.lambda[constraint] += multiplier;
    for (std::size_t i = 0; i < n; ++i) {
      const auto copy = at(copies.variable(k, static_cast<Index>(i)));
      const bool unread =
          copies.structure().variable_lower[i] == copies.structure().variable_upper[i];
      if (copy == i || !unread || !(std::abs(multiplier) > largest[i])) continue;
      largest[i] = std::abs(multiplier);
      own.v[i] = result.v[copy];
      own.z_lower[i] = result.z_lower[copy];
      own.z_upper[i] = result.z_upper[copy];
    }
  }
  cut(asked_.structure(), own);
  std::ranges::fill(own.constraints, kNaN);
  if (!all_finite(own.v)) return own;
  double f = 0.0;
  if (asked_.objective(own.v, true, f)) own.objective = f;
  if (!own.constraints.empty()) {
    static_cast<void>(asked_.constraints(own.v, false, own.constraints));
  }
  return own;
}

std::vector<RobustWorstCase> RobustSearch::list_worst_cases(const RobustCopies& copies,
                                                            const Result& result) const {
  std::vector<RobustWorstCase> list;
  if (result.v.size() < start_.size()) return list;
  const std::size_t n = asked_.structure().variable_players.size();
  const std::size_t m = asked_.structure().constraint_players.size();
  for (std::size_t k = 0; k < worst_cases_.size(); ++k) {
    const auto row = at(copies.row(k));
    const bool known = row < result.constraints.size();
    RobustWorstCase found{.constraint = worst_cases_[k].constraint,
                          .v = copies.model_point(result.v, k),
                          .value = known ? result.constraints[row] : kNaN,
                          .multiplier = result.lambda[row],
                          .active = known && is_active(copies, result, k)};
    if (at(found.constraint) == m) found.value += found.v.back();  // f - t
    found.v.resize(n);
    list.push_back(std::move(found));
  }
  std::ranges::stable_sort(list, {}, &RobustWorstCase::constraint);
  return list;
}

/// The work of all solves and maximizations.
RobustResult RobustSearch::finish() {
  Result& result = answer_.result;
  result.iterations = work_.iterations;
  result.factorizations = work_.factorizations;
  result.counts = work_.counts;
  result.timing = work_.timing;
  result.seconds = result.timing.total = limit_.stopwatch().wall();
  result.cpu_seconds = limit_.stopwatch().cpu();
  return std::move(answer_);
}

}  // namespace ipminmax
