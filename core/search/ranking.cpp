#include "core/search/ranking.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/search/other_answers.hpp"

namespace ipminmax {

Rank rank_of(const Result& result) {
  // NaN would break the order.
  const auto number = [](double value) {
    return std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
  };
  const Certificate& found = result.certificate;
  // With a negative factor Min maximizes.
  const double objective = result.objective_scale < 0.0 ? -result.objective : result.objective;
  if (result.v.empty()) return {6, 0, 0.0};
  if (found.kind == PointKind::LocalMinmax) return {1, 0, number(objective)};
  if (found.second_order == SecondOrder::Violated) return {4, 0, number(result.error.total)};
  if (is_success(result.status)) {
    return {2, found.inner == found.inner_expected ? 0 : 1, number(objective)};
  }
  if (found.kind == PointKind::InfeasiblePoint) return {5, 0, number(result.error.primal)};
  return {3, 0, number(result.error.total)};
}

bool better(const Result& a, const Result& b) { return rank_of(a) < rank_of(b); }

bool same_point(std::span<const double> a, std::span<const double> b, double tol) {
  double distance = 0.0;
  double size = 1.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    distance = std::max(distance, std::abs(a[i] - b[i]));
    size = std::max(size, std::abs(b[i]));
  }
  return distance <= tol * size;
}

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
  } else {
    ++known->found;
  }
}

}  // namespace ipminmax
