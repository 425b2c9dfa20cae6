#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/model/norms.hpp"
#include "core/search/robust_search.hpp"

// The answer of a search for worst cases, in the shape of the model.
namespace ipminmax {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

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

}  // namespace

void cut(const ProblemStructure& asked, Result& result) {
  const std::size_t n = asked.variable_players.size();
  const std::size_t m = asked.constraint_players.size();
  for (auto* values : {&result.v, &result.z_lower, &result.z_upper}) values->resize(n);
  for (auto* values : {&result.lambda, &result.constraints}) values->resize(m);
}

Result RobustSearch::in_asked_shape(const RobustCopies& copies, const Result& result) const {
  const std::size_t n = place_.v.size();
  Result own = result;
  name_originals(copies, static_cast<Index>(asked_.structure().variable_players.size()),
                 static_cast<Index>(asked_.structure().constraint_players.size()), own.certificate);
  if (result.v.size() < n) return own;
  own.lambda.resize(model_.structure().constraint_players.size());
  std::vector<double> largest(n, -1.0);
  for (std::size_t k = 0; k < place_.worst_cases.size(); ++k) {
    const Index row = copies.row(k);
    const auto constraint = at(place_.worst_cases[k].constraint);
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
  if (result.v.size() < place_.v.size()) return list;
  const std::size_t n = asked_.structure().variable_players.size();
  const std::size_t m = asked_.structure().constraint_players.size();
  for (std::size_t k = 0; k < place_.worst_cases.size(); ++k) {
    const auto row = at(copies.row(k));
    const bool known = row < result.constraints.size();
    RobustWorstCase found{.constraint = place_.worst_cases[k].constraint,
                          .v = copies.model_point(result.v, k),
                          .value = known ? result.constraints[row] : kNaN,
                          .multiplier = result.lambda[row],
                          .active = known && copies.is_active(result, k)};
    if (at(found.constraint) == m) found.value += found.v.back();  // f - t
    found.v.resize(n);
    list.push_back(std::move(found));
  }
  std::ranges::stable_sort(list, {}, &RobustWorstCase::constraint);
  return list;
}

void RobustSearch::report(const RobustCopies& copies, const Result& result) {
  answer_.worst_cases = list_worst_cases(copies, result);
  answer_.result = in_asked_shape(copies, result);
  answer_.largest_violation = violation_;
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
