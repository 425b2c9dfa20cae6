#include "core/global/robust_program.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "core/formulas/interval.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/compare.hpp"
#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/proof/enclosure.hpp"
#include "core/search/random_starts.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

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

/// Copies become what they copy in what the certificate is about; what the solved form has behind
/// the asked model's variables and constraints is left out.
void name_originals(const RobustCopies& copies, const ProblemStructure& asked,
                    Certificate& certificate) {
  const auto replace = [](std::vector<Index>& indices, const std::vector<Index>& originals,
                          std::size_t size) {
    std::vector<Index> kept;
    for (const Index i : indices) {
      const Index own = originals[at(i)];
      if (at(own) < size && std::ranges::find(kept, own) == kept.end()) kept.push_back(own);
    }
    indices = std::move(kept);
  };
  const std::size_t n = asked.variable_players.size();
  for (CertificateReason& reason : certificate.reasons) {
    replace(reason.variables, copies.model_variables(), n);
    replace(reason.constraints, copies.model_rows(), asked.constraint_players.size());
  }
  Index& least = certificate.least_curvature_variable;
  if (least >= 0) least = copies.model_variables()[at(least)];
  if (least >= static_cast<Index>(n)) least = -1;
}

/// Worst cases of f whose values differ by less, beside the range of f, are as high.
constexpr double kSameHeight = 1e-9;

/// A proof of f - t, where f is treated as a robust constraint, becomes one of f.
void turn_to_objective(double t, WorstCaseProof& proof) {
  proof.constraint = -1;
  if (!proof.v.empty()) proof.v.pop_back();
  if (proof.empty) return;
  if (!proof.complete) {
    proof.message = "of f less its worst case " + proof.message;
    return;
  }
  const Interval shifted = Interval(proof.seen, proof.proved) + Interval(t);
  proof.seen = shifted.lower();
  proof.proved = shifted.upper();
  describe(-1, 1.0, proof);
}

/// The worst case with the largest f where f is treated as a robust constraint, among equal ones
/// that with the largest multiplier: its y is the answer to x. Null: f is not.
const RobustCopies::Part* highest_branch(Index row_of_f, const RobustCopies& copies,
                                         const Result& result) {
  const RobustCopies::Part* best = nullptr;
  double highest = -kInfinity, multiplier = 0.0;
  for (const RobustCopies::Part& part : copies.worst_cases()) {
    const auto row = at(part.row);
    if (part.worst_case.constraint != row_of_f || row >= result.constraints.size()) continue;
    const double f = result.constraints[row];  // f - t, in units in which its range is about 1
    const double own = std::abs(result.lambda[row]);
    if (f > highest + kSameHeight || (f > highest - kSameHeight && own > multiplier)) {
      best = &part;
      highest = f;
      multiplier = own;
    }
  }
  return best;
}

/// Multipliers in the units of the model.
void take_units_back(const RowUnits& units, Result& result) {
  for (const auto j : indices(result.lambda))
    result.lambda[j] = units.multiplier(j, result.lambda[j]);
  for (auto* z : {&result.z_lower, &result.z_upper}) {
    for (double& value : *z) value /= units.objective;
  }
}

/// The worst cases of a result of copies, then the highest maximum of each constraint without one.
std::vector<RobustWorstCase> list_worst_cases(const RobustProgram& program,
                                              const RobustCopies& copies, const Result& result,
                                              const MaximaOfRows& maxima) {
  std::vector<RobustWorstCase> list;
  if (result.v.size() < program.s.variable_players.size()) return list;
  const std::size_t n = program.asked_s.variable_players.size();
  const std::size_t m = program.asked_s.constraint_players.size();
  for (const RobustCopies::Part& part : copies.worst_cases()) {
    const auto row = at(part.row);
    const bool defined = row < result.constraints.size();
    RobustWorstCase found{.constraint = part.worst_case.constraint,
                          .v = copies.model_point(result.v, part),
                          .value = kNaN,
                          .multiplier = result.lambda[row],
                          .active = defined && copies.is_active(result, part),
                          .side = part.worst_case.side};
    const std::size_t constraint = at(found.constraint);
    if (found.side == 0) found.side = program.s.constraint_upper[constraint] < kUnbounded ? 1 : -1;
    const auto searched =
        std::ranges::find_if(maxima, [&](const MaximaOverY& one) { return one.is_of(found); });
    if (searched != maxima.end()) {
      found.range = searched->spread;
      found.age = searched->age;
    }
    found.multiplier = program.units.multiplier(constraint, found.multiplier);
    if (defined) found.value = program.units.value(constraint, 1.0, result.constraints[row]);
    if (constraint == m) found.value += found.v.back();  // f - t
    found.v.resize(n);
    const auto known = std::ranges::find_if(list, [&](const RobustWorstCase& other) {
      return other.constraint == found.constraint &&
             same_point(found.v, other.v, program.ranges, part.scope.variables,
                        program.options.minmax_distinct_tol);
    });
    if (known == list.end()) {
      list.push_back(std::move(found));
    } else {  // two copies have met
      known->multiplier += found.multiplier;
      known->active = known->active || found.active;
    }
  }
  for (const MaximaOverY& row : maxima) {
    const auto is_listed = [&](const RobustWorstCase& found) { return row.is_of(found); };
    if (row.maxima.empty() || at(row.constraint) == m || std::ranges::any_of(list, is_listed))
      continue;
    const auto& [v, value, certified, times] = row.maxima.front();
    list.push_back({.constraint = row.constraint,
                    .v = v,
                    .value = program.units.value(at(row.constraint), 1.0, row.side * value),
                    .side = row.side,
                    .range = row.spread,
                    .age = row.age});
    list.back().v.resize(n);
  }
  std::ranges::stable_sort(list, {}, &RobustWorstCase::constraint);
  return list;
}

/// What was seen over y at the x of v.
SearchOverY search_over_y(const RobustProgram& program, const MaximaOfRows& maxima,
                          const std::vector<double>& v, bool verified) {
  const ProblemStructure& s = program.asked_s;
  SearchOverY seen{.asked = program.starts,
                   .functions = static_cast<Index>(maxima.size()),
                   .finished = verified,
                   .largest_violation = maxima.empty() ? kNaN : 0.0};
  for (const MaximaOverY& row : maxima) {
    const bool of_objective = at(row.constraint) == s.constraint_players.size();
    seen.asked = std::min(seen.asked, row.made);  // fewer where all agree far from the limit
    seen.age = std::max(seen.age, row.age);
    if (!row.maxima.empty()) {
      seen.largest_violation =
          std::max(seen.largest_violation,
                   (row.maxima[0].value - row.bound) / program.units.factor[at(row.constraint)]);
    }
    if (row.proof) {
      seen.proofs.push_back(*row.proof);
      if (of_objective) turn_to_objective(v.back(), seen.proofs.back());
      seen.finished = seen.finished && row.proof->complete;
    }
    // A search that still found other maxima, or that does not know one of few corners.
    const bool is_open = verified && row.may_be_higher();
    if (!seen.open.empty() || !(row.unbounded || is_open)) continue;
    seen.open = of_objective ? "f" : constraint_name(s, row.constraint);
    if (row.unbounded) {
      seen.open += " grows without bound over y at this x";
      continue;
    }
    seen.open += row.infeasible_vertices.empty()
                     ? " has many maxima over y: " + std::to_string(row.maxima.size()) +
                           " found, a higher one is to be expected"
                     : " has no value at a corner of y, where the dependent states diverge: " +
                           describe_y(program.s, row.constraint, row.infeasible_vertices.front());
    if (!of_objective) seen.open_constraint = row.constraint;
  }
  return seen;
}

}  // namespace

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

bool add_violated(const RobustProgram& program, const MaximaOfRows& maxima, double tolerance,
                  bool held, std::size_t& vertices, WorstCases& list) {
  const std::size_t before = list.size();
  const auto add = [&](GivenWorstCase one, bool holds) {
    one.held = holds;
    list.push_back(std::move(one));
  };
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
      add(row.at_y(v), can_hold && (held || known || row.excess(k) < kCoarse));
    }
    // More than there are vertices of three variables are the same ones again.
    for (const auto& vertex : row.infeasible_vertices) {
      if (!held || vertices >= (1U << kMostHeld)) break;
      ++vertices;
      add(row.at_y(vertex), can_hold);
    }
  }
  return list.size() > before;
}

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

Result in_asked_shape(const RobustProgram& program, const RobustCopies& copies,
                      const Result& result) {
  const std::size_t n = program.s.variable_players.size();
  const ProblemStructure& asked = program.asked_s;
  const ProblemStructure& s = copies.structure();
  Result own = result;
  name_originals(copies, asked, own.certificate);
  if (result.v.size() < n) return own;
  own.lambda.resize(program.s.constraint_players.size());
  std::vector<double> largest(n, -1.0);
  const RobustCopies::Part* of_objective =
      highest_branch(static_cast<Index>(asked.constraint_players.size()), copies, result);
  for (const RobustCopies::Part& part : copies.worst_cases()) {
    const GivenWorstCase& one = part.worst_case;
    const double multiplier = result.lambda[at(part.row)];
    if (part.row != one.constraint) own.lambda[at(one.constraint)] += multiplier;
    const double weight = &part == of_objective ? kInfinity : std::abs(multiplier);
    const std::vector<double> point = copies.model_point(result.v, part);
    std::vector<bool> left_behind(n, false);  // by the copy, which does without
    if (!part.scope.follows.empty()) {
      for (const Index i : part.scope.irrelevant) left_behind[at(i)] = true;
      for (const auto& [equation, i] : part.scope.follows) left_behind[at(i)] = true;
    }
    for (std::size_t i = 0; i < n; ++i) {
      const auto copy = at(part.column[i]);
      const bool is_unread = s.variable_lower[i] == s.variable_upper[i];
      // Else a lower branch of f may read it.
      const bool is_free = is_unread || (copy != i && &part == of_objective);
      if (!is_free || (copy == i && !left_behind[i]) || !(weight > largest[i])) continue;
      largest[i] = weight;
      own.v[i] = point[i];
      if (copy == i) continue;
      // No bound of the model's holds the y of a scenario.
      own.z_lower[i] = one.held ? 0.0 : result.z_lower[copy];
      own.z_upper[i] = one.held ? 0.0 : result.z_upper[copy];
    }
  }
  take_units_back(program.units, own);
  cut(asked, own);
  std::ranges::fill(own.constraints, kNaN);
  if (!all_finite(own.v)) return own;
  double f = 0.0;
  own.objective = program.asked.objective(own.v, true, f) ? f : kNaN;
  if (!own.constraints.empty())
    static_cast<void>(program.asked.constraints(own.v, false, own.constraints));
  return own;
}

Result answer_of(const RobustProgram& program, const RobustCopies& copies, const Result& result,
                 const MaximaOfRows& maxima, const std::vector<double>& v, bool verified) {
  Result answer = in_asked_shape(program, copies, result);
  answer.worst_cases = list_worst_cases(program, copies, result, maxima);
  answer.over_y = search_over_y(program, maxima, v, verified || program.starts == 0);
  return answer;
}

}  // namespace ipminmax
