#include "core/search/other_answers.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>

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
    if (std::isnan(g[j])) return std::numeric_limits<double>::infinity();
    largest = std::max({largest, s.constraint_lower[j] - g[j], g[j] - s.constraint_upper[j]});
  }
  return largest;
}

}  // namespace

std::vector<double> min_part(const ProblemStructure& structure, const std::vector<double>& v) {
  return part(structure, v, Player::Min);
}

double clear_difference(double least, double largest, double seen, double tol) {
  constexpr double kShare = 1e-6;
  const double size = std::max(1.0, std::abs(largest));
  return std::max(kShare, tol) * std::max(largest - least, std::min(seen, size));
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
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  if (!(worst - here > clear_difference(least, most, kUnknown, others.tol))) return;
  result.worst_case = {};
  result.worst_case.value = worst;
  result.worst_case.y = part(s, found, Player::Max);
  result.worst_case.v = std::move(found);
  result.worst_case.higher = true;
}

}  // namespace ipminmax
