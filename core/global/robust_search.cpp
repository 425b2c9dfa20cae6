#include "core/global/robust_search.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "core/global/audit.hpp"
#include "core/global/inner_problem.hpp"
#include "core/global/worst_case_search.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/indices.hpp"
#include "core/model/initial_point.hpp"
#include "core/model/norms.hpp"
#include "core/model/sampling.hpp"
#include "core/model/structure_check.hpp"
#include "core/robust/epigraph.hpp"
#include "core/search/one_start.hpp"
#include "core/search/outcome.hpp"
#include "core/search/starts.hpp"

namespace ipminmax {
namespace {

/// Rounds of solving and looking for worst cases.
constexpr Index kMostRounds = 30;
/// Rounds with held y after which copies go on, which meet many worst cases of a smooth row by
/// Newton's method, starts of y for each constraint in these, and iterations of a solve: x that few
/// y do not determine, as coefficients of a decision rule, may wander.
constexpr Index kCoarseRounds = 2;
constexpr Index kCoarseStarts = 2;
constexpr Index kCoarseIterations = 200;
/// Distance to the bound, beside the range of a row, up to which a maximum gets a copy after coarse
/// rounds, and where no y violates a constraint.
constexpr double kNearlyActive = 1e-2;
constexpr double kActive = 1e-5;
/// The same at a kink near which a search without copies has ended.
constexpr double kNearAKink = 0.3;
/// Times constr_viol_tol, in the units of the rows: a least violation that is none of rounding.
constexpr double kClearViolation = 10.0;

/// Violation, beside the range of a row, that held y may leave before copies go on.
constexpr double kCoarse = 1e-3;
/// Distance, beside the range of each variable, up to which a maximum is that of a copy, which has
/// moved.
constexpr double kSameBranch = 0.05;
/// Scenarios of a constraint for each Min variable, and in all.
constexpr Index kScenariosPerX = 4;
constexpr Index kMostScenarios = 100;

/// Of a constraint at v, as each Min variable moves by its size.
std::vector<double> rounded_gradient_in_x(RobustProgram& program, Index constraint,
                                          const std::vector<double>& v) {
  constexpr double kDigits = 1e6;
  const ProblemStructure& s = program.s;
  std::vector<double> jacobian(s.jacobian.size()), gradient;
  ++program.work.counts.jacobian;
  if (!program.solved.jacobian_rows({&constraint, 1}, v, true, jacobian)) return {};
  for (const auto k : indices(jacobian)) {
    const auto [row, col] = s.jacobian[k];
    if (row == constraint && s.variable_players[at(col)] == Player::Min)
      gradient.push_back(std::round(kDigits * jacobian[k] * program.ranges.of(at(col))));
  }
  return gradient;
}

/// One at v of each constraint, of each side where it has two. A copy is needed where something
/// else reads the y, too.
WorstCases worst_cases_at(const RobustProgram& program, const std::vector<double>& v) {
  const ProblemStructure& s = program.s;
  const SolverOptions& options = program.options;
  WorstCases chosen;
  std::vector<Index> readers(v.size(), 0);
  const std::vector<Index> rows = robust_constraints(s);
  for (const Index row : rows) {
    for (const Index i : program.scopes.all_of(row).variables) ++readers[at(i)];
  }
  for (const Index row : rows) {
    const bool shared = std::ranges::any_of(program.scopes.all_of(row).variables, [&](Index i) {
      return program.reads_y[at(i)] || readers[at(i)] > 1;
    });
    const double lower = s.constraint_lower[at(row)], upper = s.constraint_upper[at(row)];
    const bool two_sided = lower > options.nlp_lower_bound_inf &&
                           upper < options.nlp_upper_bound_inf && lower < upper &&
                           options.minmax_robust_copies;
    const bool copied = shared && options.minmax_robust_copies;
    chosen.push_back({row, v, copied, false, two_sided ? 1 : 0});
    if (two_sided) chosen.push_back({row, v, true, false, -1});
  }
  return chosen;
}

/// Those of the last solve near their limits; or else the one nearest to its bound.
WorstCases known_worst_cases(const RobustProgram& program,
                             const std::vector<RobustWorstCase>& last) {
  const ProblemStructure& s = program.asked_s;
  WorstCases chosen;
  std::optional<GivenWorstCase> nearest;
  double least = kInfinity;
  if (!program.options.minmax_robust_copies) return chosen;
  for (const RobustWorstCase& one : last) {
    if (one.constraint < 0 || at(one.constraint) >= s.constraint_players.size() ||
        one.v.size() != s.variable_players.size() || !all_finite(one.v))
      continue;
    const double above = s.constraint_upper[at(one.constraint)] - one.value;
    const double below = one.value - s.constraint_lower[at(one.constraint)];
    const int side = one.side != 0 ? one.side : above <= below ? 1 : -1;
    GivenWorstCase copy{one.constraint, one.v, true, false, side};
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

/// The maxima that are active or nearly so at their x, or the one nearest to it, free to move with
/// x. One is enough of a constraint's maxima that have one gradient in x, as on a face of y.
WorstCases active_maxima(RobustProgram& program, const MaximaOfRows& maxima, double nearly) {
  WorstCases active;
  const MaximaOverY* highest = nullptr;
  for (const MaximaOverY& row : maxima) {
    Points gradients;
    for (std::size_t k = 0; k < row.maxima.size() && row.excess(k) > -nearly; ++k) {
      const std::vector<double>& v = row.maxima[k].v;
      gradients.push_back(rounded_gradient_in_x(program, row.constraint, v));
      if (std::ranges::count(gradients, gradients.back()) == 1) active.push_back(row.at_y(v));
    }
    if (row.maxima.empty()) continue;
    if (highest == nullptr || row.excess(0) > highest->excess(0)) highest = &row;
  }
  if (active.empty() && highest != nullptr)
    active.push_back(highest->at_y(highest->maxima.front().v));
  return active;
}

/// The y where maximizations at the x of v begin and end, and random ones: fewer than there are x
/// would leave x unbounded. One that Max constraints restrain begins anywhere.
WorstCases many_scenarios(const RobustProgram& program, const MaximaOfRows& maxima,
                          const std::vector<double>& v) {
  const ProblemStructure& s = program.s;
  WorstCases taken;
  const auto of_min = static_cast<Index>(std::ranges::count(s.variable_players, Player::Min));
  const Index most = std::min<Index>(kScenariosPerX * of_min, kMostScenarios);
  for (const MaximaOverY& row : maxima) {
    const RobustScope scope = program.scopes.of(row.constraint);
    const auto take = [&](std::vector<double> at_y, bool held) {
      taken.push_back({row.constraint, std::move(at_y), true, held});
    };
    if (scope.constraints.empty()) {
      for (const auto& start : row.starts) take(start, true);
      for (Index start = program.starts; start < most; ++start)
        take(random_start(s, v, start, program.options), true);
    }
    const bool held = can_be_held(s, scope);
    for (const WorstCaseMaximum& found : row.maxima) take(found.v, held);
  }
  return taken;
}

/// Adds one more worst case of each side whose largest maximum exceeds the bound; with held y one
/// of each maximum that does, and each vertex where the dependent states diverge, so that x moves
/// to where they do not. One that a copy has left to its barrier, or that violates the row
/// slightly, is held where it is: y's own error is of second order there. Whether there were any.
/// vertices: that were added so far.
bool add_violated(const RobustProgram& program, const MaximaOfRows& maxima, double tolerance,
                  bool held, std::size_t& vertices, WorstCases& list) {
  const std::size_t before = list.size();
  for (const MaximaOverY& row : maxima) {
    const RobustScope scope = program.scopes.of(row.constraint);
    const bool can_hold = can_be_held(program.s, scope);
    for (std::size_t k = 0; k < row.maxima.size() && (k == 0 || held); ++k) {
      if (!row.violates(k, tolerance)) break;
      const std::vector<double>& v = row.maxima[k].v;
      // What a held one does not prevent is another one, however near; a copy has moved.
      const double same = held ? 0.0 : kSameBranch;
      const bool known = std::ranges::any_of(list, [&](const GivenWorstCase& other) {
        return other.is_of(row.constraint, row.side) && (!held || other.held) &&
               same_point(other.v, v, program.ranges, scope.variables, same);
      });
      if (known && (held || !can_hold)) continue;
      list.push_back(row.at_y(v, can_hold && (held || known || row.excess(k) < kCoarse)));
    }
    // More than there are vertices of three variables are the same ones again.
    for (const auto& vertex : row.infeasible_vertices) {
      if (!held || vertices >= (1U << kMostHeld)) break;
      ++vertices;
      list.push_back(row.at_y(vertex, can_hold));
    }
  }
  return list.size() > before;
}

/// Moves y into its bounds. Whether it then meets Max's constraints, but for its dependent states:
/// the y of a start is nothing that Max may choose otherwise.
bool move_to_max(RobustProgram& program, const RobustScope& scope, std::vector<double>& v) {
  const ProblemStructure& s = program.s;
  for (const Index i : scope.variables)
    v[at(i)] = std::clamp(v[at(i)], s.variable_lower[at(i)], s.variable_upper[at(i)]);
  if (scope.constraints.empty() || !scope.dependent.empty()) return true;
  std::vector<double> g(s.constraint_players.size());
  ++program.work.counts.constraints;
  if (!program.solved.constraint_rows(scope.constraints, v, true, g)) return false;
  return std::ranges::all_of(scope.constraints, [&](Index row) {
    return excess_of_row(s, at(row), g[at(row)]) <= program.options.constr_viol_tol;
  });
}

/// Moves y across the bounds that it is at, of variables or written as a row of one variable.
/// Whether there were any.
bool cross_bounds(RobustProgram& program, const RobustScope& scope, std::vector<double>& v) {
  constexpr double kAt = 16.0, kAcross = 2.0;  // relaxations of a bound
  const ProblemStructure& s = program.s;
  bool any = false;
  const auto cross = [&](double& y, double slope, double value, double lower, double upper) {
    for (const double bound : {lower, upper}) {
      const double relaxed = relaxation(bound, upper - lower, program.options);
      const double past = value - bound;
      if (lower == upper || !(std::abs(past) <= kAt * relaxed)) continue;
      y += (bound + (past > 0.0 ? -kAcross : kAcross) * relaxed - value) / slope;
      any = true;
    }
  };
  for (const Index i : scope.variables)
    cross(v[at(i)], 1.0, v[at(i)], s.variable_lower[at(i)], s.variable_upper[at(i)]);
  if (scope.constraints.empty()) return any;
  std::vector<double> g(s.constraint_players.size()), jacobian(s.jacobian.size());
  if (!program.solved.constraint_rows(scope.constraints, v, true, g) ||
      !program.solved.jacobian_rows(scope.constraints, v, false, jacobian))
    return any;
  ++program.work.counts.constraints;
  ++program.work.counts.jacobian;
  const auto entries = entries_of_rows(s);
  for (const Index row : scope.constraints) {
    if (entries[at(row)].size() != 1) continue;
    const std::size_t k = entries[at(row)].front();
    if (jacobian[k] != 0.0)
      cross(v[at(s.jacobian[k].col)], jacobian[k], g[at(row)], s.constraint_lower[at(row)],
            s.constraint_upper[at(row)]);
  }
  return any;
}

/// Whether the x of two points of n values is the same. A Min variable that is zero has no size of
/// its own: a step that is small beside the other variables counts by what it changes of the
/// constraints at these worst cases, whose units are their sizes.
bool is_same_x(RobustProgram& program, const WorstCases& worst_cases, const std::vector<double>& v,
               const std::vector<double>& other) {
  const ProblemStructure& s = program.s;
  const SolverOptions& options = program.options;
  std::vector<std::size_t> moved;
  double largest = 0.0;
  for (const std::size_t i : variables_of(s, Player::Min)) {
    largest = std::max(largest, program.ranges.of(i));
    if (std::abs(other[i] - v[i]) > options.minmax_distinct_tol * program.ranges.of(i))
      moved.push_back(i);
  }
  if (moved.empty()) return true;
  std::vector<double> jacobian(s.jacobian.size()), slopes(v.size(), 0.0);
  for (const GivenWorstCase& one : worst_cases) {
    ++program.work.counts.jacobian;
    if (!program.solved.jacobian(one.v, true, jacobian)) return false;
    for (const auto k : indices(jacobian)) {
      double& slope = slopes[at(s.jacobian[k].col)];
      slope = std::max(slope, std::abs(jacobian[k]));
    }
  }
  return std::ranges::none_of(moved, [&](std::size_t i) {
    const double step = std::abs(other[i] - v[i]);
    return slopes[i] * step > options.minmax_worst_case_tol || step > options.tol * largest;
  });
}

class RobustSearch {
 public:
  RobustSearch(RobustProgram& program, std::vector<double> start,
               const std::vector<RobustWorstCase>& known, bool at_kink)
      : program_(program) {
    place_.v = std::move(start);
    program.ranges.see(place_.v);
    program.reads_y = read_by_objective(program.solved, place_.v);
    program.scopes =
        RobustScopes(program.s, linear_entries(program.solved, place_.v, program.work.counts));
    place_.worst_cases = worst_cases_at(program, place_.v);
    first_ = place_;
    if (at_kink) {
      place_.near = true;
      release(over_y_.run(place_.v, program.starts, place_.worst_cases), kNearAKink);
    } else if (auto chosen = known_worst_cases(program, known); !chosen.empty()) {
      place_.near = true;
      place_.worst_cases = std::move(chosen);
      over_y_.follow(known);
    }
  }

  /// First against held y, then with y that move; at once with these if worst cases near x are
  /// known. If the y of the start leave x unbounded or admit no x, many held ones are tried, and
  /// last the y of the start move.
  void run() {
    const Place own = place_;
    bool found = own.near && rounds(Y::Moving);
    over_y_.follow_none();
    if (!found && program_.starts > 0 && !budget_.used_up()) {
      place_ = own;
      for (GivenWorstCase& one : place_.worst_cases) {
        const RobustScope scope = program_.scopes.of(one.constraint);
        if (can_be_held(program_.s, scope) && move_to_max(program_, scope, one.v))
          one.held = one.copied = true;
      }
      found = exchange();
      if (!found && !budget_.used_up()) {
        place_ = {first_.v, own.worst_cases};
        const MaximaOfRows maxima = over_y_.run(place_.v, program_.starts, place_.worst_cases);
        if (auto scenarios = many_scenarios(program_, maxima, place_.v); !scenarios.empty())
          place_.worst_cases = std::move(scenarios);
        found = exchange();
      }
    }
    if (!found && !budget_.used_up()) move_from_start();
  }

  /// From the start with y that move. restarts: a solve that fails restarts from random points, as
  /// a single one does.
  void move_from_start(bool restarts = false) {
    place_ = first_;
    restarts_ = restarts;
    static_cast<void>(rounds(Y::Moving));
  }

  Result take_answer() {
    if (program_.work.over_y.solves == 0)  // cut short before it began
      answer = without_point(budget_.interrupted().value_or(Status::MaxIterations), "");
    set_work(program_.work, answer);
    return std::move(answer);
  }

  Result answer;

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

  /// x against the y at hand, held, then the worst cases at the x that these give move with it. If
  /// they do not come to rest, held ones alone decide: x is a local minimum of fewer constraints
  /// than there are, and meets all of them. Whether there is an answer.
  bool exchange() {
    for (const Y y : {Y::HeldCoarsely, Y::Held}) {
      const auto maxima = rounds(y);
      if (!maxima) return false;
      const Place held = place_;
      const Result fixed = answer;
      const bool decided = y == Y::Held;
      release(*maxima, decided ? kActive : kNearlyActive);
      if (rounds(Y::Moving) && (!decided || !better(fixed, answer))) return true;
      if (decided) {
        answer = fixed;
        answer.over_y.finished = !budget_.interrupted();
      }
      if (decided || budget_.used_up()) return decided;
      place_ = held;
    }
    return false;
  }

  /// Solves with the worst cases at hand and adds violated ones until there are none. Returns the
  /// maxima at the last x; nothing: a solve failed, or maxima violate a constraint. Unless y are
  /// held coarsely the answer is that of the last solve.
  std::optional<MaximaOfRows> rounds(Y y) {
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
      MaximaOfRows maxima;
      if (program_.starts == 0) {
        report(solved, maxima, false);
        if (!is_certified(result)) leave_out_inactive(solved, maxima);
        return maxima;
      }
      maxima = over_y_.run(
          place_.v, coarse ? std::min(program_.starts, kCoarseStarts) : program_.starts, known);
      const std::size_t vertices = vertices_added_;
      const bool violated =
          add_violated(program_, maxima, tolerance, held, vertices_added_, place_.worst_cases);
      const bool goes_on = vertices_added_ > vertices ||
                           (violated && round < (coarse ? kCoarseRounds : kMostRounds));
      if (goes_on && !budget_.used_up()) continue;
      if (coarse && !budget_.used_up()) return maxima;
      const bool verified = !violated && !budget_.interrupted() &&
                            std::ranges::all_of(maxima, &MaximaOverY::is_complete);
      report(solved, maxima, verified);
      answer.over_y.better_known = violated;
      if (!verified) return {};
      if (!held && !is_certified(result)) leave_out_inactive(solved, maxima);
      return maxima;
    }
  }

  /// With the worst cases at hand, near an answer if there is one; if that fails also from_afar, on
  /// the way from where copies might become those of other maxima.
  Solved solve_worst_cases(bool from_afar, bool coarse = false) {
    auto copies = std::make_unique<RobustCopies>(program_.solved, place_.v, place_.worst_cases,
                                                 program_.scopes, program_.reads_y, budget_);
    SolveObserver observer = observer_;
    if (observer_.on_iteration) {
      observer.on_iteration = [&](const IterationInfo& info) {
        IterationInfo seen = info;
        seen.v = info.v.first(program_.asked_s.variable_players.size());
        seen.result = [&] { return in_asked_shape(program_, *copies, info.result()); };
        return observer_.on_iteration(seen);
      };
    }
    for (bool near = place_.near;; near = false) {
      // With a large mu maxima at different bounds are one.
      SolverOptions options = near ? staying_near(options_) : options_;
      options.warm_start_init_point = false;
      if (coarse) options.max_iter = std::min(options.max_iter, kCoarseIterations);
      // Where worst cases are looked for, that is where to begin anew.
      if (program_.starts > 0 && !restarts_) options = without_restarts(std::move(options));
      ++program_.work.over_y.solves;
      Result result = solve_from_start(*copies, options, budget_, observer, nullptr);
      add_work(result, program_.work);
      if (!near || !from_afar || is_success(result.status) || budget_.used_up())
        return {std::move(copies), std::move(result)};
    }
  }

  /// The worst cases that are active or nearly so at this x move with it.
  void release(const MaximaOfRows& maxima, double nearly) {
    auto active = active_maxima(program_, maxima, nearly);
    if (!active.empty()) place_.worst_cases = std::move(active);
  }

  /// The multiplier of an inactive copy is zero, and so is its curvature in the second-order test;
  /// two copies that have met share one. If the test is undecided, inactive copies are held and met
  /// ones left out, in case that this decides it.
  void leave_out_inactive(const Solved& solved, const MaximaOfRows& maxima) {
    WorstCases kept;
    bool any = false;
    for (const auto k : indices(place_.worst_cases)) {
      GivenWorstCase one = place_.worst_cases[k];
      const RobustCopies::Part& part = solved.copies->worst_cases()[k];
      const RobustScope& scope = part.scope;
      const bool met = std::ranges::any_of(kept, [&](const GivenWorstCase& other) {
        return other.is_of(one.constraint, one.side) &&
               same_point(other.v, one.v, program_.ranges, scope.variables,
                          options_.minmax_distinct_tol);
      });
      const bool active = solved.copies->is_active(solved.result, part);
      const bool holds = !active && !one.held && can_be_held(program_.s, scope);
      if (holds) one.held = one.copied = true;
      any = any || met || holds;
      if (!met) kept.push_back(std::move(one));
    }
    if (!any) return;
    place_.worst_cases = std::move(kept);
    if (!budget_.used_up()) {
      const Solved without = solve_worst_cases(false);
      // The maxima that are reported are those of the x before.
      if (is_certified(without.result) &&
          is_same_x(program_, place_.worst_cases, place_.v, without.result.v))
        return report(without, maxima, !maxima.empty());
    }
    if (budget_.interrupted()) answer.over_y.finished = false;
  }

  /// The answer from now on. With starts of y it is finished once no y violates it.
  void report(const Solved& solved, const MaximaOfRows& maxima, bool verified) {
    const auto& [copies, result] = solved;
    answer = answer_of(program_, *copies, result, maxima, place_.v, verified);
    if (verified && is_certified(result) && !is_same_across_bounds(solved)) {
      answer.over_y.open =
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
      GivenWorstCase& one = place_.worst_cases[k];
      const RobustCopies::Part& part = copies->worst_cases()[k];
      if (one.held && copies->is_active(result, part))
        any = cross_bounds(program_, part.scope, one.v) || any;
    }
    bool same = true;
    if (any && !budget_.used_up()) {
      const Result across = solve_worst_cases(false).result;
      same = is_success(across.status) && is_same_x(program_, place_.worst_cases, own.v, across.v);
    }
    place_ = own;
    return same;
  }

  RobustProgram& program_;
  const SolverOptions& options_ = program_.options;
  Budget& budget_ = program_.budget;
  SolveObserver observer_ = budget_.observer_of(program_.start);
  WorstCaseSearch over_y_{program_};
  Place first_, place_;             ///< they differ by what is known of worst cases
  std::size_t vertices_added_ = 0;  ///< to the worst cases
  bool restarts_ = false;           ///< solves that fail begin anew
};

/// After a search that failed: minimizes the largest violation of the robust constraints over y.
/// Where that stays above the tolerance they cannot be met here.
void name_infeasible(RobustProgram& program, std::vector<double> start, Result& answer) {
  const bool failed = search_failed(answer.status) || answer.over_y.better_known;
  if (!failed || program.budget.used_up()) return;
  const ProblemStructure& s = program.asked_s;
  if (!answer.v.empty() && all_finite(answer.v)) start = answer.v;
  start.resize(s.variable_players.size());
  if (!all_finite(start)) return;
  InRowUnits rows(program.asked, start);
  Epigraph problem(rows);
  if (!problem.relaxes_any()) return;
  start.push_back(1.0);
  SolverOptions options = program.options;
  options.minmax_worst_case_proof = false;  // what is seen is enough
  RobustProgram relaxed{problem,        program.asked, rows.units(),   options,
                        program.budget, program.start, program.starts, program.witnesses};
  RobustSearch search(relaxed, std::move(start), {}, false);
  search.run();
  Result least = search.take_answer();
  add_work(least, program.work);
  if (!is_success(least.status) || least.over_y.better_known || !least.over_y.finished) return;
  double largest = 0.0, violation = 0.0;
  const RobustWorstCase* worst = nullptr;
  for (RobustWorstCase& found : least.worst_cases) {
    std::vector<double> g(s.constraint_players.size());
    if (!program.asked.constraints(found.v, true, g)) return;
    const auto row = at(found.constraint);
    found.value = g[row];  // was that of the relaxed row
    const double own = excess_of_row(s, row, g[row]);
    const double beside = own * rows.units().factor[row];
    if (beside <= largest) continue;
    largest = beside;
    violation = own;
    worst = &found;
  }
  if (worst == nullptr || !(largest > kClearViolation * options.constr_viol_tol)) return;
  least.message =
      "robust constraints cannot be met near this x: the least worst-case violation is " +
      number_text(violation, 6) + ", of " + constraint_name(s, worst->constraint) + " at " +
      describe_y(s, worst->constraint, worst->v);
  least.status = Status::LocallyInfeasible;
  least.certificate = {};
  least.certificate.kind = PointKind::InfeasiblePoint;
  least.over_y.largest_violation = violation;
  for (const auto row : indices(least.constraints)) {
    const double own = excess_of_row(s, row, least.constraints[row]);
    least.error.primal = std::max(least.error.primal, own);
  }
  answer = std::move(least);
}

}  // namespace

std::vector<bool> read_by_objective(Problem& model, const std::vector<double>& start) {
  const ProblemStructure& s = model.structure();
  std::vector<bool> reads(start.size(), false);
  std::vector<double> gradient(start.size());
  for (const auto& v : points_around(s, start)) {
    if (!all_finite(v) || !model.gradient(v, true, gradient)) continue;
    for (const std::size_t i : variables_of(s, Player::Max)) {
      if (gradient[i] != 0.0) reads[i] = true;
    }
  }
  return reads;
}

Result search_worst_cases(RobustProgram program, std::vector<double> start,
                          const std::vector<RobustWorstCase>& known, bool at_kink) {
  Budget& budget = program.budget;
  if (start.empty()) {
    auto own = model_start(program.solved);
    if (!own || !check_structure(program.s, program.options).empty()) {
      Result why = solve_from_start(program.solved, program.options, budget,
                                    budget.observer_of(program.start), nullptr);
      cut(program.asked_s, why);
      return why;
    }
    start = std::move(*own);
  }
  RobustSearch search(program, start, known, at_kink);
  search.run();
  name_infeasible(program, std::move(start), search.answer);
  if (program.starts > 0 && search_failed(search.answer.status) &&
      search.answer.status != Status::LocallyInfeasible && !budget.used_up())
    search.move_from_start(true);
  return search.take_answer();
}

}  // namespace ipminmax
