#include "core/global/choice.hpp"

#include <cmath>
#include <cstddef>

#include "core/robust/robust_scope.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
std::vector<double> max_part(const ProblemStructure& structure, const std::vector<double>& v) {
  std::vector<double> values;
  for (const std::size_t i : variables_of(structure, Player::Max)) values.push_back(v[i]);
  return values;
}

bool stands(const Result& result) {
  const SearchOverY& y = result.over_y;
  return y.finished && !y.better_known && result.over_x.made >= result.over_x.asked;
}

Rank rank_of(const Result& result) {
  // NaN would break the order.
  const auto number = [](double value) { return std::isnan(value) ? kInfinity : value; };
  const Certificate& found = result.certificate;
  // With a negative factor Min maximizes.
  const double objective = result.objective_scale < 0.0 ? -result.objective : result.objective;
  if (result.v.empty()) return {7, 0, 0.0};
  if (found.kind == PointKind::LocalMinmax && stands(result)) return {1, 0, number(objective)};
  if (found.second_order == SecondOrder::Violated) return {5, 0, number(result.error.total)};
  if (is_success(result.status) && stands(result)) {
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

}  // namespace ipminmax
