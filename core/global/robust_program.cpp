#include "core/global/robust_program.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/formulas/interval.hpp"
#include "core/model/compare.hpp"
#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/proof/enclosure.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

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
