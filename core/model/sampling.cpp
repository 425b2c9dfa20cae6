#include "core/model/sampling.hpp"

#include <cmath>

#include "core/model/indices.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

ProblemStructure with_bounds_of_rows(Problem& model, std::vector<double> v, Counts& counts) {
  ProblemStructure s = model.structure();
  std::vector<int> entries(s.constraint_players.size());
  for (const Triplet& entry : s.jacobian) ++entries[at(entry.row)];
  const bool any = std::ranges::any_of(entries, [](int count) { return count == 1; });
  if (!any || v.size() != s.variable_players.size()) return s;
  std::vector<double> g(entries.size()), slope(s.jacobian.size()), elsewhere(slope.size());
  ++counts.constraints;
  ++counts.jacobian;
  if (!model.constraints(v, true, g) || !model.jacobian(v, false, slope)) return s;
  std::vector<double> moved = v;
  for (double& value : moved) value += std::max(1.0, std::abs(value));
  ++counts.jacobian;
  if (!model.jacobian(moved, true, elsewhere)) return s;
  for (const auto k : indices(slope)) {
    const std::size_t j = at(s.jacobian[k].row), i = at(s.jacobian[k].col);
    if (entries[j] != 1 || slope[k] == 0.0 || slope[k] != elsewhere[k]) continue;
    double lower = v[i] + (s.constraint_lower[j] - g[j]) / slope[k];
    double upper = v[i] + (s.constraint_upper[j] - g[j]) / slope[k];
    if (slope[k] < 0.0) std::swap(lower, upper);
    s.variable_lower[i] = std::max(s.variable_lower[i], std::min(lower, s.variable_upper[i]));
    s.variable_upper[i] = std::min(s.variable_upper[i], std::max(upper, s.variable_lower[i]));
  }
  return s;
}

std::vector<std::vector<double>> points_around(const ProblemStructure& s,
                                               const std::vector<double>& v) {
  constexpr double kReach = 0.1;  // of a variable's size
  std::vector<std::vector<double>> points(3, v);
  std::mt19937_64 random(20220411);
  for (std::size_t probe = 1; probe < points.size(); ++probe) {
    for (const auto i : indices(v)) {
      const double t = 2.0 * uniform(random) - 1.0;
      points[probe][i] =
          std::clamp(v[i] + kReach * t * std::max(1.0, std::abs(v[i])),
                     std::min(s.variable_lower[i], v[i]), std::max(s.variable_upper[i], v[i]));
    }
  }
  return points;
}

}  // namespace ipminmax
