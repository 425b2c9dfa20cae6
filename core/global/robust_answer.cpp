#include "core/global/robust_search.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "core/global/choice.hpp"
#include "core/interval.hpp"
#include "core/model/compare.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/multistart.hpp"
#include "core/proof/enclosure.hpp"
#include "linalg/numbers.hpp"

// The answer of a search for worst cases, in the shape of the model.

namespace ipminmax {

namespace {

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

/// Worst cases of f whose values differ by less, beside the range of f, are as high.
constexpr double kSameHeight = 1e-9;

/// A proof of f - t, where f is treated as a robust constraint, becomes one of f.
void turn_to_objective(double t, WorstCaseProof& proof) {
  proof.constraint = -1;
  if (!proof.v.empty()) proof.v.pop_back();
  if (!proof.complete || proof.empty) {
    proof.message = "of f less its worst case " + proof.message;
    return;
  }
  const Interval shifted = Interval(proof.seen, proof.proved) + Interval(t);
  proof.seen = shifted.lower();
  proof.proved = shifted.upper();
  describe(-1, 1.0, proof);
}

}  // namespace

/// The worst case with the largest f where f is treated as a robust constraint, among equal ones
/// that with the largest multiplier: its y is the answer to x. Empty: f is not.
std::optional<std::size_t> RobustSearch::highest_branch(const RobustCopies& copies,
                                                        const Result& result) const {
  const auto row_of_f = static_cast<Index>(asked_.structure().constraint_players.size());
  std::optional<std::size_t> best;
  double highest = -kInfinity, multiplier = 0.0;
  for (std::size_t k = 0; k < place_.worst_cases.size(); ++k) {
    const auto row = at(copies.row(k));
    if (place_.worst_cases[k].constraint != row_of_f || row >= result.constraints.size()) continue;
    const double f = result.constraints[row];  // f - t, in units in which its range is about 1
    const double own = std::abs(result.lambda[row]);
    if (f > highest + kSameHeight || (f > highest - kSameHeight && own > multiplier)) {
      best = k;
      highest = f;
      multiplier = own;
    }
  }
  return best;
}

Result RobustSearch::in_asked_shape(const RobustCopies& copies, const Result& result) const {
  const std::size_t n = place_.v.size();
  Result own = result;
  name_originals(copies, static_cast<Index>(asked_.structure().variable_players.size()),
                 static_cast<Index>(asked_.structure().constraint_players.size()), own.certificate);
  if (result.v.size() < n) return own;
  own.lambda.resize(model_.structure().constraint_players.size());
  std::vector<double> largest(n, -1.0);
  const auto of_objective = highest_branch(copies, result);
  for (std::size_t k = 0; k < place_.worst_cases.size(); ++k) {
    const Index row = copies.row(k);
    const auto constraint = at(place_.worst_cases[k].constraint);
    const double multiplier = result.lambda[at(row)];
    if (at(row) != constraint) own.lambda[constraint] += multiplier;
    const double weight = k == of_objective ? kInfinity : std::abs(multiplier);
    for (std::size_t i = 0; i < n; ++i) {
      const auto copy = at(copies.variable(k, static_cast<Index>(i)));
      const bool free =
          copies.structure().variable_lower[i] == copies.structure().variable_upper[i] ||
          k == of_objective;  // read by nothing, or by a lower branch of f
      if (copy == i || !free || !(weight > largest[i])) continue;
      largest[i] = weight;
      own.v[i] = result.v[copy];
      // No bound of the model's holds the y of a scenario.
      const bool held = place_.worst_cases[k].held;
      own.z_lower[i] = held ? 0.0 : result.z_lower[copy];
      own.z_upper[i] = held ? 0.0 : result.z_upper[copy];
    }
  }
  take_units_back(own);
  cut(asked_.structure().variable_players.size(), asked_.structure().constraint_players.size(),
      own);
  std::ranges::fill(own.constraints, kNaN);
  if (!all_finite(own.v)) return own;
  double f = 0.0;
  if (asked_.objective(own.v, true, f)) own.objective = f;
  if (!own.constraints.empty()) {
    static_cast<void>(asked_.constraints(own.v, false, own.constraints));
  }
  return own;
}

/// Multipliers and errors in the units of the model.
void RobustSearch::take_units_back(Result& result) const {
  if (units_.are_own()) return;
  for (std::size_t j = 0; j < result.lambda.size(); ++j)
    result.lambda[j] = units_.multiplier(j, result.lambda[j]);
  for (auto* z : {&result.z_lower, &result.z_upper}) {
    for (double& value : *z) value /= units_.objective;
  }
  for (double* error :
       {&result.error.dual_min, &result.error.dual_max, &result.error.complementarity}) {
    *error /= units_.objective;
  }
}

std::vector<RobustWorstCase> RobustSearch::list_worst_cases(const RobustCopies& copies,
                                                            const Result& result) const {
  std::vector<RobustWorstCase> list;
  if (result.v.size() < place_.v.size()) return list;
  const std::size_t n = asked_.structure().variable_players.size();
  const std::size_t m = asked_.structure().constraint_players.size();
  for (std::size_t k = 0; k < place_.worst_cases.size(); ++k) {
    const auto row = at(copies.row(k));
    const bool defined = row < result.constraints.size();
    RobustWorstCase found{.constraint = place_.worst_cases[k].constraint,
                          .v = copies.model_point(result.v, k),
                          .value = kNaN,
                          .multiplier = result.lambda[row],
                          .active = defined && copies.is_active(result, k)};
    const std::size_t constraint = at(found.constraint);
    found.multiplier = units_.multiplier(constraint, found.multiplier);
    if (defined) found.value = units_.value(constraint, 1.0, result.constraints[row]);
    if (constraint == m) found.value += found.v.back();  // f - t
    const std::vector<Index> variables = scopes_.of(found.constraint).variables;
    found.v.resize(n);
    const auto known = std::ranges::find_if(list, [&](const RobustWorstCase& other) {
      return other.constraint == found.constraint &&
             same_point(found.v, other.v, ranges_, variables, options_.minmax_distinct_tol);
    });
    if (known == list.end()) {
      list.push_back(std::move(found));
    } else {  // two copies have met
      known->multiplier += found.multiplier;
      known->active = known->active || found.active;
    }
  }
  for (const RobustWorstCase& seen : highest_) {
    if (std::ranges::find(list, seen.constraint, &RobustWorstCase::constraint) == list.end())
      list.push_back(seen);
  }
  std::ranges::stable_sort(list, {}, &RobustWorstCase::constraint);
  return list;
}

/// The answer from now on. With starts of y it is finished once it is verified.
void RobustSearch::report(const RobustCopies& copies, const Result& result) {
  answer_ = in_asked_shape(copies, result);
  answer_.worst_cases = list_worst_cases(copies, result);
  std::vector<WorstCaseProof> proofs = work_.over_y.proofs;
  for (WorstCaseProof& proof : proofs) {
    if (at(proof.constraint) == asked_.structure().constraint_players.size()) {
      turn_to_objective(place_.v.back(), proof);
    }
  }
  answer_.over_y = {
      .asked = starts_,
      .functions = work_.over_y.functions,
      .finished = starts_ == 0 ||
                  (!verified_.empty() && std::ranges::all_of(proofs, &WorstCaseProof::complete)),
      .largest_violation = violation_,
      .proofs = std::move(proofs)};
}

/// Where a scan was ended while it still found other maxima, or does not know one of few corners, a
/// higher one may violate the answer.
void RobustSearch::tell_what_is_open(const std::vector<SideScan>& scans) {
  const auto open = std::ranges::find_if(scans, &SideScan::may_be_higher);
  if (open == scans.end()) return;
  const ProblemStructure& s = asked_.structure();
  const bool of_objective = at(open->constraint) == s.constraint_players.size();
  const std::string row = of_objective ? "f" : constraint_name(s, open->constraint);
  answer_.over_y.open =
      row + (open->valueless_corners.empty()
                 ? " has many maxima over y: " + std::to_string(open->maxima.size()) +
                       " found, a higher one is to be expected"
                 : " has no value at a corner of y, what follows diverges: " +
                       describe_y(model_.structure(), open->constraint,
                                  open->valueless_corners.front().v));
  if (!of_objective) answer_.over_y.open_constraint = open->constraint;
}

/// With the work of all solves and maximizations.
Result RobustSearch::finish() {
  answer_.iterations = work_.iterations;
  answer_.factorizations = work_.factorizations;
  answer_.counts = work_.counts;
  answer_.timing = work_.timing;
  answer_.over_y.maximizations = work_.over_y.maximizations;
  answer_.over_y.solves = work_.over_y.solves;
  return std::move(answer_);
}

}  // namespace ipminmax
