#include "core/global/robust_search.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <optional>
#include <utility>

#include "core/global/choice.hpp"
#include "core/global/places_over_y.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/compare.hpp"
#include "core/model/indices.hpp"
#include "core/model/initial_point.hpp"
#include "core/model/norms.hpp"
#include "core/model/sampling.hpp"
#include "core/model/structure_check.hpp"
#include "core/proof/enclosure.hpp"
#include "core/robust/epigraph.hpp"
#include "core/robust/row_over_y.hpp"
#include "core/search/one_start.hpp"
#include "core/search/outcome.hpp"
#include "core/search/starts.hpp"
#include "linalg/numbers.hpp"
#include "linalg/workers.hpp"

namespace ipminmax {
namespace {

using WorstCases = RobustCopies::WorstCases;

/// Rounds of solving and looking for worst cases.
constexpr Index kMostRounds = 30;
/// Rounds with held y after which copies go on, which meet many worst cases of a smooth row by
/// Newton's method, starts of y for each constraint in these, and iterations of a solve: x that few
/// y do not determine, as coefficients of a decision rule, may wander.
constexpr Index kCoarseRounds = 2;
constexpr Index kCoarseStarts = 2;
constexpr Index kCoarseIterations = 200;
/// Solving again: solves within which each side is searched fully, some in each. A full search
/// costs about ten times what following one maximum does: so both cost the same.
constexpr std::size_t kSolvesOfFullSearches = 10;
/// Violation, beside the range of a row, that held y may leave before copies go on.
constexpr double kCoarse = 1e-3;
/// Distance to the bound, beside the range of a row, up to which a maximum gets a copy after coarse
/// rounds, and where no y violates a constraint.
constexpr double kNearlyActive = 1e-2;
constexpr double kActive = 1e-5;
/// The same at a kink near which a search without copies has ended.
constexpr double kNearAKink = 0.3;
/// Distance, beside the range of each variable, up to which a maximum is that of a copy, which has
/// moved.
constexpr double kSameBranch = 0.05;
/// Scenarios of a constraint for each Min variable, and in all.
constexpr Index kScenariosPerX = 4;
constexpr Index kMostScenarios = 100;
/// Random starts that one scan over y may have.
constexpr Index kMostStartsOfAScan = 100;

/// One worst case at v of each constraint, of each side where it has two. A copy is needed where
/// something else reads the y, too.
WorstCases at_start(const ProblemStructure& s, const RobustScopes& scopes,
                    const SolverOptions& options, const std::vector<bool>& reads_y,
                    const std::vector<double>& v) {
  WorstCases chosen;
  std::vector<Index> readers(v.size(), 0);
  const std::vector<Index> rows = robust_constraints(s);
  for (const Index row : rows) {
    for (const Index i : scopes.all_of(row).variables) ++readers[at(i)];
  }

  for (const Index row : rows) {
    const RobustScope scope = scopes.all_of(row);
    const bool shared = std::ranges::any_of(
        scope.variables, [&](Index i) { return reads_y[at(i)] || readers[at(i)] > 1; });
    const bool copied = shared && options.minmax_robust_copies;
    const bool two_sided = s.constraint_lower[at(row)] > options.nlp_lower_bound_inf &&
                           s.constraint_upper[at(row)] < options.nlp_upper_bound_inf &&
                           s.constraint_lower[at(row)] < s.constraint_upper[at(row)] &&
                           options.minmax_robust_copies;
    chosen.push_back({row, v, copied, false, two_sided ? 1 : 0});
    if (two_sided) chosen.push_back({row, v, true, false, -1});
  }

  return chosen;
}

/// Worst cases of the last solve near their limits; or else the one nearest to its bound.
WorstCases at_known(const ProblemStructure& s, const std::vector<RobustWorstCase>& known,
                    const SolverOptions& options) {
  WorstCases chosen;
  std::optional<RobustCopies::WorstCase> nearest;
  double least = kInfinity;
  if (!options.minmax_robust_copies) return chosen;
  for (const RobustWorstCase& one : known) {
    if (one.constraint < 0 || at(one.constraint) >= s.constraint_players.size() ||
        one.v.size() != s.variable_players.size() || !all_finite(one.v))
      continue;
    const double above = s.constraint_upper[at(one.constraint)] - one.value;
    const double below = one.value - s.constraint_lower[at(one.constraint)];
    const int side = one.side != 0 ? one.side : above <= below ? 1 : -1;
    RobustCopies::WorstCase copy{one.constraint, one.v, true, false, side};
    const double distance = side > 0 ? above : below;
    if (one.active || (one.range > 0.0 && is_near_limit(distance, one.range))) {
      chosen.push_back(std::move(copy));
    } else if (!(distance >= least)) {
      least = distance;
      nearest = std::move(copy);
    }
  }

  if (chosen.empty() && nearest) chosen.push_back(std::move(*nearest));
  return chosen;
}

/// Of each side the highest worst case of the last solve, unless its full search is among the
/// oldest: then it is searched fully in this one.
std::vector<RobustWorstCase> worst_cases_to_follow(std::vector<RobustWorstCase> last,
                                                   const SolverOptions& options) {
  if (!may_look_longer(options) || options.minmax_worst_case_proof) return {};
  std::vector<RobustWorstCase> followed;
  for (RobustWorstCase& one : last) {
    if (!(one.range > 0.0)) continue;
    const auto known = std::ranges::find_if(followed, [&](const RobustWorstCase& other) {
      return other.constraint == one.constraint && other.side == one.side;
    });
    if (known == followed.end()) {
      followed.push_back(std::move(one));
    } else if (std::pair(one.active, one.side * one.value) >
               std::pair(known->active, known->side * known->value)) {
      *known = std::move(one);
    }
  }
  std::ranges::stable_sort(followed, {}, &RobustWorstCase::age);
  followed.resize(followed.size() - followed.size() / kSolvesOfFullSearches);
  std::erase_if(followed, [](const RobustWorstCase& one) {
    return one.age + 1 >= static_cast<Index>(kSolvesOfFullSearches);
  });
  return followed;
}

/// Of a constraint at v, as each Min variable moves by its size.
std::vector<double> rounded_gradient_in_x(Problem& model, Index constraint,
                                          const std::vector<double>& v,
                                          const VariableRanges& ranges) {
  constexpr double kDigits = 1e6;
  const ProblemStructure& s = model.structure();
  std::vector<double> jacobian(s.jacobian.size()), gradient;
  if (!model.jacobian_rows({&constraint, 1}, v, true, jacobian)) return {};
  for (const auto k : indices(jacobian)) {
    const auto [row, col] = s.jacobian[k];
    if (row == constraint && s.variable_players[at(col)] == Player::Min)
      gradient.push_back(std::round(kDigits * jacobian[k] * ranges.of(at(col))));
  }

  return gradient;
}

}  // namespace

std::vector<bool> read_by_objective(Problem& model, const std::vector<double>& start) {
  const ProblemStructure& s = model.structure();
  std::vector<bool> reads(start.size(), false);
  std::vector<double> gradient(start.size());
  for (const std::vector<double>& v : points_around(s, start)) {
    if (!all_finite(v) || !model.gradient(v, true, gradient)) continue;
    for (const auto i : indices(v)) {
      if (s.variable_players[i] == Player::Max && gradient[i] != 0.0) reads[i] = true;
    }
  }

  return reads;
}

namespace {

/// Times constr_viol_tol, in the units of the rows: a least violation that is none of rounding.
constexpr double kClearViolation = 10.0;

class RobustSearch {
 public:
  explicit RobustSearch(const RobustForm& form) : form_(form) {}

  Result run(std::vector<double> start, const std::vector<RobustWorstCase>& known, bool at_kink) {
    if (start.empty()) {
      auto own = model_start(form_.solved);
      if (!own || !check_structure(s_, options_).empty()) {
        answer_ =
            solve_from_start(form_.solved, options_, budget_, observer_, nullptr);  // says why
        cut(asked_, answer_);
        return std::move(answer_);
      }
      start = std::move(*own);
    }
    place_.v = std::move(start);
    ranges_.see(place_.v);
    reads_y_ = read_by_objective(form_.solved, place_.v);
    scopes_ = RobustScopes(s_, linear_entries(form_.solved, place_.v, work_.counts));
    place_.worst_cases = at_start(s_, scopes_, options_, reads_y_, place_.v);
    const Place first = place_;
    if (at_kink) {
      place_.near = true;
      release(scan(starts_, first.worst_cases), kNearAKink);
    } else if (auto chosen = at_known(asked_, known, options_); !chosen.empty()) {
      place_.near = true;
      place_.worst_cases = std::move(chosen);
      followed_ = worst_cases_to_follow(known, options_);
    }
    return solve_from(first);
  }

 private:
  /// Where the next solve begins.
  struct Place {
    std::vector<double> v;
    WorstCases worst_cases{};
    bool near = false;  ///< v is the answer of a solve
  };

  /// The problem of a list of worst cases, and its answer.
  struct Solved {
    std::unique_ptr<RobustCopies> copies;
    Result result;
  };

  /// How y is treated in rounds of solving and looking for worst cases.
  enum class Y {
    HeldCoarsely,  ///< few rounds, which bring x near
    Held,          ///< until no y violates a constraint
    Moving,        ///< it moves with x, until no other y violates a constraint
  };

  /// First against held y, then with y that move; at once with these if worst cases near x are
  /// known. If the y of the start leave x unbounded or admit no x, many held ones are tried, and
  /// last the y of the start move. place_ and first differ by what is known of worst cases.
  Result solve_from(const Place& first) {
    const Place own = place_;
    bool found = own.near && rounds(Y::Moving);
    followed_.clear();
    if (!found && starts_ > 0 && !budget_.used_up()) {
      place_ = own;
      for (RobustCopies::WorstCase& one : place_.worst_cases) {
        const RobustScope scope = scopes_.of(one.constraint);
        if (can_be_held(s_, scope) && move_to_max(scope, one.v)) one.held = one.copied = true;
      }
      found = exchange();
      if (!found && !budget_.used_up()) {
        place_ = {first.v, own.worst_cases};
        if (auto scenarios = many_scenarios(); !scenarios.empty())
          place_.worst_cases = std::move(scenarios);
        found = exchange();
      }
    }
    if (!found && !budget_.used_up()) {
      place_ = first;
      static_cast<void>(rounds(Y::Moving));
    }
    if (names_infeasible_) name_infeasible(first.v);
    if (names_infeasible_ && starts_ > 0 && search_failed(answer_.status) &&
        answer_.status != Status::LocallyInfeasible && !budget_.used_up()) {
      place_ = first;  // last: from random starts, as a single solve does
      restarts_ = true;
      static_cast<void>(rounds(Y::Moving));
    }
    if (work_.over_y.solves == 0)  // cut short before it began
      answer_ = without_point(budget_.interrupted().value_or(Status::MaxIterations), "");
    set_work(work_, answer_);
    return std::move(answer_);
  }

  /// x against the y at hand, held, then the worst cases at the x that these give move with it. If
  /// they do not come to rest, held ones alone decide: x is a local minimum of fewer constraints
  /// than there are, and meets all of them. Whether there is an answer.
  bool exchange() {
    for (const Y y : {Y::HeldCoarsely, Y::Held}) {
      const auto scans = rounds(y);
      if (!scans) return false;
      const Place held = place_;
      const Result fixed = answer_;
      const bool decided = y == Y::Held;
      release(*scans, decided ? kActive : kNearlyActive);
      if (rounds(Y::Moving) && (!decided || !better(fixed, answer_))) return true;
      if (decided) {
        answer_ = fixed;
        answer_.over_y.finished = !budget_.interrupted();
      }
      if (decided || budget_.used_up()) return decided;
      place_ = held;
    }
    return false;
  }

  /// Solves with the worst cases at hand and adds violated ones until there are none. Returns the
  /// maxima at the last x; nothing: a solve failed, or maxima violate a constraint. Unless y are
  /// held coarsely the answer is that of the last solve.
  std::optional<Scans> rounds(Y y) {
    const bool held = y != Y::Moving, coarse = y == Y::HeldCoarsely;
    const double tolerance = coarse ? kCoarse : options_.minmax_worst_case_tol;
    for (Index round = 1;; ++round) {
      const Solved solved = solve_worst_cases(held || restarts_, coarse);
      const auto& [copies, result] = solved;
      if (!is_success(result.status)) {
        report(solved, {}, false);
        return {};
      }
      std::copy_n(result.v.begin(), place_.v.size(), place_.v.begin());
      place_.near = true;
      WorstCases known;  // held y near which maxima are: those that hold x
      for (const auto k : indices(place_.worst_cases)) {
        const RobustCopies::Part& part = copies->worst_cases()[k];
        place_.worst_cases[k].v = copies->model_point(result.v, part);
        if (!held || copies->is_active(result, part)) known.push_back(place_.worst_cases[k]);
      }
      Scans scans;
      if (starts_ == 0) {
        report(solved, scans, false);
        if (!is_certified(result)) settle(solved, scans);
        return scans;
      }
      scans = scan(coarse ? std::min(starts_, kCoarseStarts) : starts_, known);
      const std::size_t corners = corners_added_;
      const bool violated = add_violated(scans, tolerance, held);
      const bool goes_on =
          corners_added_ > corners || (violated && round < (coarse ? kCoarseRounds : kMostRounds));
      if (goes_on && !budget_.used_up()) continue;
      if (coarse && !budget_.used_up()) return scans;
      const bool verified = !violated && !budget_.interrupted() &&
                            std::ranges::all_of(scans, &MaximaOverY::is_complete);
      report(solved, scans, verified);
      answer_.over_y.better_known = violated;
      if (!verified) return {};
      if (!held && !is_certified(result)) settle(solved, scans);
      return scans;
    }
  }

  /// With the worst cases at hand, near an answer if there is one; if that fails also from_afar, on
  /// the way from where copies might become those of other maxima.
  Solved solve_worst_cases(bool from_afar, bool coarse = false) {
    auto copies = std::make_unique<RobustCopies>(form_.solved, place_.v, place_.worst_cases,
                                                 scopes_, reads_y_, budget_);
    SolveObserver observer = observer_;
    if (observer_.on_iteration) {
      observer.on_iteration = [&](const IterationInfo& info) {
        IterationInfo seen = info;
        seen.v = info.v.first(asked_.variable_players.size());
        seen.result = [&] { return in_asked_shape(form_, *copies, info.result()); };
        return observer_.on_iteration(seen);
      };
    }
    for (bool near = place_.near;; near = false) {
      // With a large mu maxima at different bounds are one.
      SolverOptions options = near ? staying_near(options_) : options_;
      options.warm_start_init_point = false;
      if (coarse) options.max_iter = std::min(options.max_iter, kCoarseIterations);
      // Where worst cases are looked for, that is where to begin anew.
      if (starts_ > 0 && !restarts_) options.minmax_max_restarts = 0;
      ++work_.over_y.solves;
      Result result = solve_from_start(*copies, options, budget_, observer, nullptr);
      add_work(result, work_);
      if (!near || !from_afar || is_success(result.status) || budget_.used_up())
        return {std::move(copies), std::move(result)};
    }
  }

  /// What the search over y of one side uses, which no other thread does.
  struct Desk {
    Problem& form;  ///< the solved one, or a clone of it
    Result& work;
    Witnesses& witnesses;
  };

  [[nodiscard]] std::vector<RobustBound> bounded_sides() const {
    std::vector<RobustBound> sides;
    for (const Index row : robust_constraints(s_)) {
      const double lower = s_.constraint_lower[at(row)], upper = s_.constraint_upper[at(row)];
      const auto add = [&](int side, double bound) {
        sides.push_back({row, side, bound, bound + relaxation(bound, upper - lower, options_)});
      };
      if (upper < options_.nlp_upper_bound_inf) add(1, upper);
      if (lower > options_.nlp_lower_bound_inf) add(-1, -lower);
    }
    return sides;
  }

  /// Maximizes each bounded side of each robust constraint over all of y at the x of place_.v, from
  /// so many starts of y for each side and from the known worst cases.
  Scans scan(Index starts, const WorstCases& known) {
    ranges_.see(place_.v);
    const std::vector<RobustBound> sides = bounded_sides();
    Scans scans(sides.size());
    const auto scan_one = [&](std::size_t k, const Desk& desk) {
      scans[k] = scan_side(sides[k], starts, known, desk);
      static_cast<RobustBound&>(scans[k]) = sides[k];
    };
    if (have_clones(std::min(at(options_.minmax_threads), sides.size()))) {
      scan_on_threads(sides.size(), scan_one);
    } else {
      for (const auto k : indices(sides)) scan_one(k, {form_.solved, work_, form_.witnesses});
    }
    ++scans_;
    for (const MaximaOverY& side : scans) {
      for (const WorstCaseMaximum& maximum : side.maxima) ranges_.see(maximum.v);
    }
    return scans;
  }

  /// Whether there is a clone of the form for each of several threads. Factorizations are counted
  /// when a solve has ended: only one at a time keeps to their number.
  [[nodiscard]] bool have_clones(std::size_t threads) {
    if (threads < 2 || budget_.factorizations_left()) return false;
    while (clones_.size() < threads) {
      auto clone = form_.solved.clone();
      if (!clone) return false;
      clones_.push_back(std::move(clone));
    }
    return true;
  }

  /// What the sides leave is put together in their order.
  template <class ScanOne>
  void scan_on_threads(std::size_t sides, const ScanOne& scan_one) {
    std::vector<Result> work(sides);
    std::deque<Witnesses> witnesses;
    while (witnesses.size() < sides) witnesses.emplace_back(asked_);
    share_tasks(workers_, clones_.size(), sides, [&](std::size_t k, std::size_t thread) {
      scan_one(k, {*clones_[thread], work[k], witnesses[k]});
    });
    for (const auto k : indices(work)) {
      add_work(work[k], work_);
      form_.witnesses.add(witnesses[k]);
    }
  }

  MaximaOverY scan_side(const RobustBound& of, Index starts, const WorstCases& known,
                        const Desk& desk) {
    RobustScope scope = scopes_.of(of.constraint);
    MaximaOverY scan = scan_in(scope, of, starts, known, desk);
    if (!scan.completed) {  // where a trajectory that goes on diverges y is not Max's
      scope = scopes_.all_of(of.constraint);
      scan = scan_in(scope, of, starts, known, desk);
    }
    if (scope.idle.empty() || !scope.follows.empty() || starts == 0) return scan;
    // What is idle may decide which y have a solution of the equations at all.
    scope.idle.clear();
    MaximaOverY other = scan_in(scope, of, starts, known, desk);
    return other.is_higher(other.highest(), scan.highest()) ? other : scan;
  }

  /// If x rested on the worst case that is followed, the side is searched from `starts` starts
  /// alone. Else, if this maximum is far from the limit when it has moved with x, the side is not
  /// searched further.
  MaximaOverY scan_in(const RobustScope& scope, const RobustBound& of, Index starts,
                      const WorstCases& known, const Desk& desk) {
    MaximaOverY scan;
    if (budget_.used_up()) return scan;
    const auto& [row, side, bound, accepted] = of;
    const double factor = form_.units.factor[at(row)];
    Points given;
    for (const RobustCopies::WorstCase& other : known) {
      if (other.is_of(row, side)) given.push_back(other.v);
    }
    const auto last = std::ranges::find_if(followed_, [&](const RobustWorstCase& one) {
      return of.is_of(one) && one.v.size() == place_.v.size();
    });
    const bool is_followed = last != followed_.end(), was_active = is_followed && last->active;
    SolverOptions options = options_;
    if (&desk.form != &form_.solved) options.minmax_threads = 1;  // beside other sides
    MaximizationContext context{.options = options,
                                .budget = budget_,
                                .start = form_.start,
                                .told = asked_,
                                .work = desk.work,
                                // None looks from where a scan before it did.
                                .drawn = std::max(kMostStartsOfAScan, starts_) * scans_,
                                .witnesses = &desk.witnesses,
                                .size = form_.units.size[at(row)],
                                .sizes = &ranges_};
    if (!scope.follows.empty())
      context.complete = [&](auto& v) { return complete(desk.form, scope.follows, v); };
    if (is_followed && !was_active) {
      std::vector<double> v = place_.v;
      for (const Index i : scope.variables) v[at(i)] = last->v[at(i)];
      for (const auto& [equation, i] : scope.follows) v[at(i)] = last->v[at(i)];
      RowOverY problem(desk.form, row, side, std::move(v), scope);
      context.options = staying_near(options);
      context.options.minmax_max_restarts = 0;
      scan = maximize_over_y(problem, 1, {}, context);
      if (scan.is_complete()) {
        const double below = bound - scan.maxima.front().value;
        scan.spread = last->range;
        scan.age = last->age + 1;
        if (!is_near_limit(below / factor, last->range)) return scan;
        given.push_back(scan.maxima.front().v);
      }
      context.options = options;
    }
    RowOverY problem(desk.form, row, side, place_.v, scope);
    if (was_active) context.options.minmax_worst_case_starts = starts;  // and no more
    scan = maximize_over_y(problem, starts, given, context,
                           starts > 0 ? std::optional(accepted) : std::nullopt);
    if (!scan.may_be_higher()) scan.spread = (scan.range.most - scan.range.least) / factor;
    if (was_active) {
      scan.spread = std::max(scan.spread, last->range);
      scan.age = last->age + 1;
    }
    if (scan.proof) {
      for (double* value : {&scan.proof->seen, &scan.proof->proved})
        *value = form_.units.value(at(row), side, *value);
      describe(row, side, *scan.proof);
    }
    return scan;
  }

  /// One more worst case of each side whose largest maximum exceeds the bound; with held y one of
  /// each maximum that does, and each corner where what follows y diverges, so that x moves to
  /// where it does not. One that a copy has left to its barrier, or that violates the row slightly,
  /// is held where it is: y's own error is of second order there. Whether there were any.
  bool add_violated(const Scans& scans, double tolerance, bool held) {
    bool any = false;
    const auto add = [&](RobustCopies::WorstCase one, bool holds) {
      one.held = holds;
      place_.worst_cases.push_back(std::move(one));
      any = true;
    };
    for (const MaximaOverY& side : scans) {
      const RobustScope scope = scopes_.of(side.constraint);
      const bool can_hold = can_be_held(s_, scope);
      for (std::size_t k = 0; k < side.maxima.size() && (k == 0 || held); ++k) {
        if (!side.violates(k, tolerance)) break;
        const std::vector<double>& v = side.maxima[k].v;
        // What a held one does not prevent is another one, however near; a copy has moved.
        const double same = held ? 0.0 : kSameBranch;
        const auto is_known = [&](const RobustCopies::WorstCase& other) {
          return other.is_of(side.constraint, side.side) && (!held || other.held) &&
                 same_point(other.v, v, ranges_, scope.variables, same);
        };
        const bool known = std::ranges::any_of(place_.worst_cases, is_known);
        if (known && (held || !can_hold)) continue;
        add(side.at_y(v), can_hold && (held || known || side.excess(k) < kCoarse));
      }
      // More than there are corners of three variables are the same ones again.
      for (const auto& corner : side.valueless_corners) {
        if (!held || corners_added_ >= (1U << kMostHeld)) break;
        ++corners_added_;
        add(side.at_y(corner), can_hold);
      }
    }
    return any;
  }

  /// The y where maximizations at this x begin and end, and random ones: fewer than there are x
  /// would leave x unbounded. One that Max constraints restrain begins anywhere.
  WorstCases many_scenarios() {
    WorstCases taken;
    const auto of_min = static_cast<Index>(std::ranges::count(s_.variable_players, Player::Min));
    for (const MaximaOverY& side : scan(starts_, place_.worst_cases)) {
      const RobustScope scope = scopes_.of(side.constraint);
      if (scope.constraints.empty()) {
        for (const auto& v : side.starts) taken.push_back({side.constraint, v, true, true});
        for (Index start = starts_;
             start < std::min<Index>(kScenariosPerX * of_min, kMostScenarios); ++start) {
          taken.push_back(
              {side.constraint, random_start(s_, place_.v, start, options_), true, true});
        }
      }
      const bool held = can_be_held(s_, scope);
      for (const WorstCaseMaximum& found : side.maxima)
        taken.push_back({side.constraint, found.v, true, held});
    }
    return taken;
  }

  /// The worst cases that are active or nearly so at this x, or the one nearest to it, with y free
  /// again. One is enough of a constraint's maxima that have one gradient in x, as on a face of y.
  void release(const Scans& scans, double nearly) {
    WorstCases released;
    const MaximaOverY* highest = nullptr;
    for (const MaximaOverY& side : scans) {
      Points gradients;
      for (std::size_t k = 0; k < side.maxima.size() && side.excess(k) > -nearly; ++k) {
        const std::vector<double>& v = side.maxima[k].v;
        gradients.push_back(rounded_gradient_in_x(form_.solved, side.constraint, v, ranges_));
        ++work_.counts.jacobian;
        if (std::ranges::count(gradients, gradients.back()) == 1) released.push_back(side.at_y(v));
      }
      if (side.maxima.empty()) continue;
      if (highest == nullptr || side.excess(0) > highest->excess(0)) highest = &side;
    }
    if (released.empty() && highest != nullptr)
      released.push_back(highest->at_y(highest->maxima.front().v));
    if (!released.empty()) place_.worst_cases = std::move(released);
  }

  /// The multiplier of an inactive copy is zero, and so is its curvature in the second-order test;
  /// two copies that have met share one. If the test is undecided, inactive copies are held and met
  /// ones left out, in case that this decides it.
  void settle(const Solved& solved, const Scans& scans) {
    WorstCases kept;
    bool any = false;
    for (const auto k : indices(place_.worst_cases)) {
      RobustCopies::WorstCase one = place_.worst_cases[k];
      const RobustCopies::Part& part = solved.copies->worst_cases()[k];
      const RobustScope& scope = part.scope;
      const bool met = std::ranges::any_of(kept, [&](const RobustCopies::WorstCase& other) {
        return other.is_of(one.constraint, one.side) &&
               same_point(other.v, one.v, ranges_, scope.variables, options_.minmax_distinct_tol);
      });
      const bool active = solved.copies->is_active(solved.result, part);
      const bool holds = !active && !one.held && can_be_held(s_, scope);
      if (holds) one.held = one.copied = true;
      any = any || met || holds;
      if (!met) kept.push_back(std::move(one));
    }
    if (!any) return;
    place_.worst_cases = std::move(kept);
    if (!budget_.used_up()) {
      const Solved settled = solve_worst_cases(false);
      // The maxima that are reported are those of the x before.
      if (is_certified(settled.result) && is_same_x(place_.v, settled.result.v))
        return report(settled, scans, !scans.empty());
    }
    if (budget_.interrupted()) answer_.over_y.finished = false;
  }

  /// The answer from now on. With starts of y it is finished once no y violates it.
  void report(const Solved& solved, const Scans& scans, bool verified) {
    const auto& [copies, result] = solved;
    answer_ = in_asked_shape(form_, *copies, result);
    answer_.worst_cases = list_worst_cases(form_, *copies, result, scans, ranges_);
    answer_.over_y = search_over_y(form_, scans, place_.v, verified || starts_ == 0);
    if (verified && is_certified(result) && !is_same_across_bounds(solved)) {
      answer_.over_y.open =
          "x is decided by how far y is from its bounds, within what bound_relax_factor allows";
    }
  }

  /// Whether x stays where it is as active worst cases that are held at bounds of y go to the other
  /// side of these. A distance to a bound that is within its relaxation decides nothing.
  bool is_same_across_bounds(const Solved& solved) {
    const auto& [copies, result] = solved;
    const Place own = place_;
    bool any = false;
    for (const auto k : indices(place_.worst_cases)) {
      RobustCopies::WorstCase& one = place_.worst_cases[k];
      const RobustCopies::Part& part = copies->worst_cases()[k];
      if (one.held && copies->is_active(result, part)) any = cross_bounds(part.scope, one.v) || any;
    }
    bool same = true;
    if (any && !budget_.used_up()) {
      const Result across = solve_worst_cases(false).result;
      same = is_success(across.status) && is_same_x(own.v, across.v);
    }
    place_ = own;
    return same;
  }

  /// Moves y across the bounds that it is at, of variables or written as a row of one variable.
  bool cross_bounds(const RobustScope& scope, std::vector<double>& v) {
    constexpr double kAt = 16.0, kAcross = 2.0;  // relaxations of a bound
    bool any = false;
    const auto cross = [&](double& y, double slope, double value, double lower, double upper) {
      for (const double bound : {lower, upper}) {
        const double relaxed = relaxation(bound, upper - lower, options_), past = value - bound;
        if (lower == upper || !(std::abs(past) <= kAt * relaxed)) continue;
        y += (bound + (past > 0.0 ? -kAcross : kAcross) * relaxed - value) / slope;
        any = true;
      }
    };
    for (const Index i : scope.variables)
      cross(v[at(i)], 1.0, v[at(i)], s_.variable_lower[at(i)], s_.variable_upper[at(i)]);
    if (scope.constraints.empty()) return any;
    std::vector<double> g(s_.constraint_players.size()), jacobian(s_.jacobian.size());
    if (!form_.solved.constraint_rows(scope.constraints, v, true, g) ||
        !form_.solved.jacobian_rows(scope.constraints, v, false, jacobian))
      return any;
    ++work_.counts.constraints;
    ++work_.counts.jacobian;
    const auto entries = entries_of_rows(s_);
    for (const Index row : scope.constraints) {
      if (entries[at(row)].size() != 1) continue;
      const std::size_t k = entries[at(row)].front();
      if (jacobian[k] != 0.0)
        cross(v[at(s_.jacobian[k].col)], jacobian[k], g[at(row)], s_.constraint_lower[at(row)],
              s_.constraint_upper[at(row)]);
    }
    return any;
  }

  /// Moves y into its bounds. Whether it then meets Max's constraints, but for what follows from
  /// it: the y of a start is nothing that Max may choose otherwise.
  bool move_to_max(const RobustScope& scope, std::vector<double>& v) {
    for (const Index i : scope.variables)
      v[at(i)] = std::clamp(v[at(i)], s_.variable_lower[at(i)], s_.variable_upper[at(i)]);
    if (scope.constraints.empty() || !scope.followers.empty()) return true;
    std::vector<double> g(s_.constraint_players.size());
    ++work_.counts.constraints;
    if (!form_.solved.constraint_rows(scope.constraints, v, true, g)) return false;
    return std::ranges::all_of(scope.constraints, [&](Index row) {
      return excess_of_row(s_, at(row), g[at(row)]) <= options_.constr_viol_tol;
    });
  }

  /// A Min variable that is zero has no size of its own: a step that is small beside the other
  /// variables counts by what it changes of the constraints, whose units are their sizes.
  bool is_same_x(const std::vector<double>& v, const std::vector<double>& other) {
    std::vector<std::size_t> moved;
    double largest = 0.0;
    for (const auto i : indices(v)) {
      if (s_.variable_players[i] != Player::Min) continue;
      largest = std::max(largest, ranges_.of(i));
      if (std::abs(other[i] - v[i]) > options_.minmax_distinct_tol * ranges_.of(i))
        moved.push_back(i);
    }
    if (moved.empty()) return true;
    std::vector<double> jacobian(s_.jacobian.size()), slopes(v.size(), 0.0);
    for (const RobustCopies::WorstCase& one : place_.worst_cases) {
      ++work_.counts.jacobian;
      if (!form_.solved.jacobian(one.v, true, jacobian)) return false;
      for (const auto k : indices(jacobian)) {
        double& slope = slopes[at(s_.jacobian[k].col)];
        slope = std::max(slope, std::abs(jacobian[k]));
      }
    }
    return std::ranges::none_of(moved, [&](std::size_t i) {
      const double step = std::abs(other[i] - v[i]);
      return slopes[i] * step > options_.minmax_worst_case_tol || step > options_.tol * largest;
    });
  }

  /// After a search that failed: minimizes the largest violation of the robust constraints over y.
  /// Where that stays above the tolerance they cannot be met here.
  void name_infeasible(std::vector<double> start) {
    const bool failed = search_failed(answer_.status) || answer_.over_y.better_known;
    if (!failed || budget_.used_up()) return;
    if (!answer_.v.empty() && all_finite(answer_.v)) start = answer_.v;
    start.resize(asked_.variable_players.size());
    if (!all_finite(start)) return;
    InRowUnits rows(form_.asked, start);
    Epigraph problem(rows);
    if (!problem.relaxes_any()) return;
    start.push_back(1.0);
    SolverOptions options = options_;
    options.minmax_worst_case_proof = false;  // what is seen is enough
    RobustForm relaxed{problem, form_.asked, rows.units(), options,
                       budget_, form_.start, starts_,      form_.witnesses};
    RobustSearch search(relaxed);
    search.names_infeasible_ = false;
    Result least = search.run(std::move(start), {}, false);
    add_work(least, work_);
    if (!is_success(least.status) || least.over_y.better_known || !least.over_y.finished) return;
    double largest = 0.0, violation = 0.0;
    const RobustWorstCase* worst = nullptr;
    for (RobustWorstCase& found : least.worst_cases) {
      std::vector<double> g(asked_.constraint_players.size());
      if (!form_.asked.constraints(found.v, true, g)) return;
      const auto row = at(found.constraint);
      found.value = g[row];  // was that of the relaxed row
      const double own = excess_of_row(asked_, row, g[row]);
      const double beside = own * rows.units().factor[row];
      if (beside <= largest) continue;
      largest = beside;
      violation = own;
      worst = &found;
    }
    if (worst == nullptr || !(largest > kClearViolation * options_.constr_viol_tol)) return;
    least.message =
        "robust constraints cannot be met near this x: the least worst-case violation is " +
        number_text(violation, 6) + ", of " + constraint_name(asked_, worst->constraint) + " at " +
        describe_y(asked_, worst->constraint, worst->v);
    least.status = Status::LocallyInfeasible;
    least.certificate = {};
    least.certificate.kind = PointKind::InfeasiblePoint;
    least.over_y.largest_violation = violation;
    for (const auto row : indices(least.constraints)) {
      const double own = excess_of_row(asked_, row, least.constraints[row]);
      least.error.primal = std::max(least.error.primal, own);
    }
    answer_ = std::move(least);
  }

  const RobustForm& form_;
  const SolverOptions& options_ = form_.options;
  Budget& budget_ = form_.budget;
  const Index starts_ = form_.starts;
  SolveObserver observer_ = budget_.observer_of(form_.start);
  const ProblemStructure& s_ = form_.solved.structure();
  const ProblemStructure& asked_ = form_.asked.structure();
  VariableRanges ranges_{s_};
  RobustScopes scopes_{s_};
  std::vector<RobustWorstCase> followed_;  ///< of the last solve, from which alone searches begin
  Place place_;
  std::size_t corners_added_ = 0;  ///< to the scenarios
  std::vector<bool> reads_y_;
  bool names_infeasible_ = true;
  bool restarts_ = false;                         ///< searches that fail begin anew
  Index scans_ = 0;                               ///< made
  std::vector<std::unique_ptr<Problem>> clones_;  ///< of the solved form, one for each thread
  Workers workers_;
  Result answer_;
  Result work_;  ///< of all solves and maximizations
};

}  // namespace

Result search_worst_cases(const RobustForm& form, std::vector<double> start,
                          const std::vector<RobustWorstCase>& known, bool at_kink) {
  return RobustSearch(form).run(std::move(start), known, at_kink);
}

}  // namespace ipminmax
