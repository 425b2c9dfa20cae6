#include "core/global/worst_case_search.hpp"

#include <deque>
#include <utility>

#include "core/global/inner_problem.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/indices.hpp"
#include "core/proof/enclosure.hpp"
#include "core/robust/row_over_y.hpp"
#include "core/search/starts.hpp"

namespace ipminmax {
namespace {

/// Solving again: solves within which each side is searched fully, some in each. A full search
/// costs about ten times what following one maximum does: so both cost the same.
constexpr std::size_t kSolvesOfFullSearches = 10;
/// Random starts that one search may have.
constexpr Index kMostStartsOfASearch = 100;

std::vector<RobustBound> bounded_sides(const ProblemStructure& s, const SolverOptions& options) {
  std::vector<RobustBound> sides;
  for (const Index row : robust_constraints(s)) {
    const double lower = s.constraint_lower[at(row)], upper = s.constraint_upper[at(row)];
    const auto add = [&](int side, double bound) {
      sides.push_back({row, side, bound, bound + relaxation(bound, upper - lower, options)});
    };
    if (upper < options.nlp_upper_bound_inf) add(1, upper);
    if (lower > options.nlp_lower_bound_inf) add(-1, -lower);
  }
  return sides;
}

}  // namespace

void WorstCaseSearch::follow(std::vector<RobustWorstCase> last) {
  if (!may_look_longer(program_.options) || program_.options.minmax_worst_case_proof) return;
  for (RobustWorstCase& one : last) {
    if (!(one.range > 0.0)) continue;
    const auto known = std::ranges::find_if(followed_, [&](const RobustWorstCase& other) {
      return other.constraint == one.constraint && other.side == one.side;
    });
    if (known == followed_.end()) {
      followed_.push_back(std::move(one));
    } else if (std::pair(one.active, one.side * one.value) >
               std::pair(known->active, known->side * known->value)) {
      *known = std::move(one);
    }
  }
  std::ranges::stable_sort(followed_, {}, &RobustWorstCase::age);
  followed_.resize(followed_.size() - followed_.size() / kSolvesOfFullSearches);
  std::erase_if(followed_, [](const RobustWorstCase& one) {
    return one.age + 1 >= static_cast<Index>(kSolvesOfFullSearches);
  });
}

/// What the sides leave on threads is put together in their order.
MaximaOfRows WorstCaseSearch::run(const std::vector<double>& v, Index starts,
                                  const WorstCases& known) {
  program_.ranges.see(v);
  const std::vector<RobustBound> sides = bounded_sides(program_.s, program_.options);
  MaximaOfRows found(sides.size());
  const auto maximize_side = [&](std::size_t k, Problem& form, Result& work, Witnesses& seen) {
    found[k] = maximize({sides[k], v, starts, known, form, work, seen});
    static_cast<RobustBound&>(found[k]) = sides[k];
  };
  if (have_clones(std::min(at(program_.options.minmax_threads), sides.size()))) {
    std::vector<Result> work(sides.size());
    std::deque<Witnesses> witnesses;
    while (witnesses.size() < sides.size()) witnesses.emplace_back(program_.asked_s);
    share_tasks(workers_, clones_.size(), sides.size(), [&](std::size_t k, std::size_t thread) {
      try {
        maximize_side(k, *clones_[thread], work[k], witnesses[k]);
      } catch (...) {
        program_.budget.stop_at_exception();
        throw;
      }
    });
    for (const auto k : indices(work)) {
      add_work(work[k], program_.work);
      program_.witnesses.add(witnesses[k]);
    }
  } else {
    for (const auto k : indices(sides))
      maximize_side(k, program_.solved, program_.work, program_.witnesses);
  }
  ++searches_;
  for (const MaximaOverY& side : found) {
    for (const WorstCaseMaximum& maximum : side.maxima) program_.ranges.see(maximum.v);
  }
  return found;
}

/// Whether there is a clone of the form for each of several threads. Factorizations are counted
/// when a solve has ended: only one at a time keeps to their number.
bool WorstCaseSearch::have_clones(std::size_t threads) {
  if (threads < 2 || program_.budget.factorizations_left()) return false;
  while (clones_.size() < threads) {
    auto clone = program_.solved.clone();
    if (!clone) return false;
    clones_.push_back(std::move(clone));
  }
  return true;
}

MaximaOverY WorstCaseSearch::maximize(const Side& side) const {
  RobustScope scope = program_.scopes.of(side.bound.constraint);
  MaximaOverY found = maximize_in(scope, side);
  if (!found.completed) {  // where a trajectory that goes on diverges y is not Max's
    scope = program_.scopes.all_of(side.bound.constraint);
    found = maximize_in(scope, side);
  }
  if (scope.irrelevant.empty() || !scope.follows.empty() || side.starts == 0) return found;
  // What cannot change the row may decide which y have a solution of the equations at all.
  scope.irrelevant.clear();
  MaximaOverY other = maximize_in(scope, side);
  return other.is_higher(other.highest(), found.highest()) ? other : found;
}

/// If x rested on the worst case that is followed, the side is searched from `starts` starts alone.
/// Else, if this maximum is far from the limit when it has moved with x, the side is not searched
/// further.
MaximaOverY WorstCaseSearch::maximize_in(const RobustScope& scope, const Side& of) const {
  MaximaOverY found;
  if (program_.budget.used_up()) return found;
  const auto& [row, side, bound, accepted] = of.bound;
  const RowUnits& units = program_.units;
  const double factor = units.factor[at(row)];
  Points given;
  for (const GivenWorstCase& other : of.known) {
    if (other.is_of(row, side)) given.push_back(other.v);
  }
  const auto last = std::ranges::find_if(followed_, [&](const RobustWorstCase& one) {
    return of.bound.is_of(one) && one.v.size() == of.v.size();
  });
  const bool is_followed = last != followed_.end(), was_active = is_followed && last->active;
  SolverOptions options = program_.options;
  if (&of.form != &program_.solved) options.minmax_threads = 1;  // beside other sides
  MaximizationContext context{.options = options,
                              .budget = program_.budget,
                              .start = program_.start,
                              .told = program_.asked_s,
                              .work = of.work,
                              // None begins where a search before it did.
                              .drawn = std::max(kMostStartsOfASearch, program_.starts) * searches_,
                              .witnesses = &of.witnesses,
                              .size = units.size[at(row)],
                              .sizes = &program_.ranges};
  if (!scope.follows.empty())
    context.complete = [&](auto& v) { return complete(of.form, scope.follows, v); };
  if (is_followed && !was_active) {
    std::vector<double> v = of.v;
    for (const Index i : scope.variables) v[at(i)] = last->v[at(i)];
    for (const auto& [equation, i] : scope.follows) v[at(i)] = last->v[at(i)];
    RowOverY problem(of.form, row, side, std::move(v), scope);
    context.options = without_restarts(staying_near(options));
    found = maximize_over_y(problem, 1, {}, context);
    if (found.is_complete()) {
      const double below = bound - found.maxima.front().value;
      found.spread = last->range;
      found.age = last->age + 1;
      if (!is_near_limit(below / factor, last->range)) return found;
      given.push_back(found.maxima.front().v);
    }
    context.options = options;
  }
  RowOverY problem(of.form, row, side, of.v, scope);
  if (was_active) context.options.minmax_worst_case_starts = of.starts;  // and no more
  found = maximize_over_y(problem, of.starts, given, context,
                          of.starts > 0 ? std::optional(accepted) : std::nullopt);
  if (!found.may_be_higher()) found.spread = (found.range.most - found.range.least) / factor;
  if (was_active) {
    found.spread = std::max(found.spread, last->range);
    found.age = last->age + 1;
  }
  if (found.proof) {
    for (double* value : {&found.proof->seen, &found.proof->proved})
      *value = units.value(at(row), side, *value);
    describe(row, side, *found.proof);
  }
  return found;
}

}  // namespace ipminmax
