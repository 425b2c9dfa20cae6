#include "core/global/choice.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <utility>

#include "core/model/norms.hpp"
#include "core/model/parameters.hpp"
#include "core/worst_case.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

std::vector<double> part(const ProblemStructure& structure, const std::vector<double>& v,
                         Player player) {
  std::vector<double> values;
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (structure.variable_players[i] == player) values.push_back(v[i]);
  }
  return values;
}

/// Largest violation of Max's constraints; infinity where one is undefined.
double violation_of_max(const ProblemStructure& s, std::span<const double> g) {
  double largest = 0.0;
  for (std::size_t j = 0; j < g.size(); ++j) {
    if (s.constraint_players[j] != Player::Max) continue;
    if (std::isnan(g[j])) return kInfinity;
    largest = std::max({largest, s.constraint_lower[j] - g[j], g[j] - s.constraint_upper[j]});
  }
  return largest;
}

std::vector<double> min_part(const ProblemStructure& structure, const std::vector<double>& v) {
  return part(structure, v, Player::Min);
}

}  // namespace

Rank rank_of(const Result& result) {
  // NaN would break the order.
  const auto number = [](double value) { return std::isnan(value) ? kInfinity : value; };
  const Certificate& found = result.certificate;
  // With a negative factor Min maximizes.
  const double objective = result.objective_scale < 0.0 ? -result.objective : result.objective;
  if (result.v.empty()) return {7, 0, 0.0};
  if (found.kind == PointKind::LocalMinmax) return {1, 0, number(objective)};
  if (found.second_order == SecondOrder::Violated) return {5, 0, number(result.error.total)};
  if (is_success(result.status)) {
    return {2, found.inner == found.inner_expected ? 0 : 1, number(objective)};
  }
  if (found.kind == PointKind::InfeasiblePoint) return {6, 0, number(result.error.primal)};
  if (found.second_order == SecondOrder::Satisfied) {
    if (result.worst_case.higher) return {3, 0, number(result.worst_case.value)};
    return {3, 1, number(result.over_y.largest_violation)};
  }
  return {4, 0, number(result.error.total)};
}

bool better(const Result& a, const Result& b) { return rank_of(a) < rank_of(b); }

void add_distinct(const ProblemStructure& structure, bool by_x, double tol, Index start,
                  Result&& result, std::vector<DistinctPoint>& points) {
  const auto place = [&](const std::vector<double>& v) {
    return by_x ? min_part(structure, v) : v;
  };
  const std::vector<double> own = place(result.v);
  const auto known = std::ranges::find_if(points, [&](const DistinctPoint& point) {
    return same_point(own, place(point.result.v), tol);
  });
  if (known == points.end()) {
    points.push_back({std::move(result), start, 1});
    return;
  }
  ++known->found;
  // The higher of two y at the same x is the worst case there.
  const double f = known->result.objective;
  if (by_x && result.objective - f > clear_difference(f, result.objective, kInfinity, 0.0)) {
    known->result = std::move(result);
    known->first_start = start;
  }
}

double clear_difference(double least, double largest, double seen, double tol) {
  const double size = std::max(1.0, std::abs(largest));
  return std::max(parameters::kHardly, tol) * std::max(largest - least, std::min(seen, size));
}

double uncertain_difference(Problem& problem, const std::vector<double>& a,
                            const std::vector<double>& b, double tol) {
  const ProblemStructure& s = problem.structure();
  std::vector<double> at_a(a.size()), at_b(a.size());
  if (!problem.gradient(a, true, at_a) || !problem.gradient(b, true, at_b)) return 0.0;
  double change = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (s.variable_players[i] != Player::Min || s.variable_lower[i] == s.variable_upper[i])
      continue;
    change += std::abs(at_a[i] - at_b[i]) * tol * std::max(1.0, std::abs(a[i]));
  }
  return std::isfinite(change) ? change : 0.0;
}

void compare_with(const OtherAnswers& others, Problem& problem, Result& result, Counts& counts) {
  const ProblemStructure& s = problem.structure();
  const double here = result.objective;
  if (result.v.size() != s.variable_players.size() || !std::isfinite(here)) return;
  double least = here, most = here, worst = here;
  const auto see = [&](double f) {
    least = std::min(least, f);
    most = std::max(most, f);
  };
  for (const double f : others.objectives) {
    if (std::isfinite(f)) see(f);
  }
  std::vector<double> v, g(s.constraint_players.size()), found;
  for (const std::vector<double>& other : others.points) {
    v = result.v;
    for (std::size_t i = 0; i < v.size(); ++i) {
      if (s.variable_players[i] == Player::Max) v[i] = other[i];
    }
    if (v == result.v) continue;
    double f = 0.0;
    ++counts.objective;
    if (!problem.objective(v, true, f) || !std::isfinite(f)) continue;
    see(f);
    if (f <= worst) continue;
    if (!g.empty()) {
      ++counts.constraints;
      if (!problem.constraints(v, false, g)) continue;
      if (violation_of_max(s, g) > others.constr_viol_tol) continue;
    }
    worst = f;
    found = v;
  }
  if (!(worst - here > clear_difference(least, most, kInfinity, others.tol))) return;
  counts.gradient += 2;
  if (!(worst - here > uncertain_difference(problem, result.v, found, others.tol))) return;
  result.worst_case = {};
  result.worst_case.value = worst;
  result.worst_case.y = part(s, found, Player::Max);
  result.worst_case.v = std::move(found);
  result.worst_case.higher = true;
}

namespace {

/// Why a point that passed its own test is no answer to what was asked.
std::string incomplete(const Result& result) {
  const SearchOverY& y = result.over_y;
  if (y.better_known) {
    return result.worst_case.higher ? describe_worst_case(result)
                                    : "a robust constraint is violated there";
  }
  const auto open = std::ranges::find(y.proofs, false, &WorstCaseProof::complete);
  if (open != y.proofs.end()) return open->message;
  if (!y.finished) return "the search over y was not finished";
  const SearchOverX& x = result.over_x;
  return std::to_string(x.made) + " of " + std::to_string(x.asked) + " starts were made";
}

}  // namespace

void settle(std::optional<Status> why, Result& result) {
  const SearchOverY& y = result.over_y;
  const bool stopped = why == Status::UserStop || why == Status::OutOfMemory;
  const bool unfinished = !y.finished || result.over_x.made < result.over_x.asked;
  const bool cut = why && (stopped || unfinished);
  const bool unmet = is_success(result.status) && (unfinished || y.better_known);
  if (cut ? result.status != *why : unmet) {
    result.status = cut ? *why : Status::WorstCaseNotMet;
    result.message = std::string(name_of(result.status));
    if (unfinished || unmet) result.message += ": " + incomplete(result);
  }
  if (is_success(result.status) || result.certificate.kind != PointKind::LocalMinmax) return;
  result.certificate.kind = PointKind::FirstOrderPoint;
  result.certificate.reasons.insert(
      result.certificate.reasons.begin(),
      {.kind = CertificateReason::Kind::Search,
       .player = y.better_known || !y.finished ? Player::Max : Player::Min,
       .text = "a strict local minmax by itself, but not the answer: " + result.message,
       .variables = {},
       .constraints = {}});
}

}  // namespace ipminmax
