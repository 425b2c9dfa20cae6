#include "core/robust/row_units.hpp"

#include <algorithm>
#include <random>

#include "core/model/compare.hpp"
#include "core/model/initial_point.hpp"
#include "core/model/sampling.hpp"

namespace ipminmax {
namespace {

/// Sizes of rows beside which tolerances near 1e-8 are small enough, and not too small.
constexpr double kLeastOrdinarySize = 1.0 / 16;
constexpr double kMostOrdinarySize = 1024.0;
/// A bound may be that many times the size of its row: its relaxation is relative to it.
constexpr double kMostOfBound = 16.0;
/// Points of y at which a row is looked at, besides the given one.
constexpr int kSamples = 6;

double finite_bound(const ProblemStructure& s, std::size_t j) {
  if (s.constraint_upper[j] < kUnbounded) return s.constraint_upper[j];
  return s.constraint_lower[j] > -kUnbounded ? s.constraint_lower[j] : 0.0;
}

/// The constraints and their Jacobian at one point; without entries where they are undefined.
struct Values {
  std::vector<double> g, jacobian;
};

/// How far each row is from its bound at v, and by how much each Min variable can change it there:
/// far away in a wide box of y a row may be anything.
std::vector<double> sizes_near(const ProblemStructure& s, const std::vector<double>& v,
                               const Values& here) {
  VariableRanges ranges(s);
  ranges.see(v);
  std::vector<double> sizes =
      changes_by_min(s, here.jacobian, [&](std::size_t i) { return ranges.of(i); });
  if (here.jacobian.empty()) return sizes;
  for (const auto j : indices(sizes)) sizes[j] += std::abs(here.g[j] - finite_bound(s, j));
  return sizes;
}

/// Largest absolute derivative of each row, besides that of the epigraph's t, the last variable:
/// the only size that is known of a function of y without bounds.
std::vector<double> largest_slopes(const ProblemStructure& s, const Values& here,
                                   Index epigraph_row) {
  std::vector<double> slopes(s.constraint_players.size(), 0.0);
  const auto last = static_cast<Index>(s.variable_players.size()) - 1;
  for (const auto k : indices(here.jacobian)) {
    const auto [row, col] = s.jacobian[k];
    if (row != epigraph_row || col != last)
      slopes[at(row)] = std::max(slopes[at(row)], std::abs(here.jacobian[k]));
  }
  return slopes;
}

/// Of variables in a box: its width where that is out of proportion; in a wide one at most what
/// brings a robust row to its bound.
std::vector<double> units_of_boxes(const ProblemStructure& s, const Values& here) {
  std::vector<double> reach(s.variable_players.size(), kUnbounded);
  for (const auto k : indices(here.jacobian)) {
    const auto [row, col] = s.jacobian[k];
    if (s.constraint_players[at(row)] == Player::Max) continue;
    const double distance = std::abs(here.g[at(row)] - finite_bound(s, at(row)));
    if (distance > 0.0 && here.jacobian[k] != 0.0)
      reach[at(col)] = std::min(reach[at(col)], distance / std::abs(here.jacobian[k]));
  }
  std::vector<double> units(reach.size(), 1.0);
  for (const auto i : indices(units)) {
    const double width = s.variable_upper[i] - s.variable_lower[i];
    if (!(width > 0.0) || width >= kUnbounded) continue;
    const double size = width < 1.0 ? width : std::min(width, std::max(1.0, reach[i]));
    if (size < kLeastOrdinarySize || size > kMostOrdinarySize)
      units[i] = std::exp2(std::round(std::log2(size)));
  }
  if (std::ranges::all_of(units, [](double unit) { return unit == 1.0; })) units.clear();
  return units;
}

}  // namespace

RowUnits units_of_rows(Problem& model, const std::vector<double>& given, Index epigraph_row) {
  const std::size_t m = model.structure().constraint_players.size();
  RowUnits units{.factor = std::vector<double>(m, 1.0),
                 .offset = std::vector<double>(m),
                 .size = std::vector<double>(m)};
  const auto start = given.empty() ? model_start(model) : std::optional(given);
  if (!start) return units;
  const std::vector<double>& v = *start;
  Counts counts;
  const ProblemStructure s = with_bounds_of_rows(model, v, counts);
  std::vector<ValueRange> seen(m);
  std::vector<double> point = v, g(m);
  Values here{g, std::vector<double>(s.jacobian.size())};
  if (!model.constraints(v, true, here.g) || !model.jacobian(v, false, here.jacobian))
    here.jacobian.clear();
  const std::vector<double> near = sizes_near(model.structure(), v, here);
  const std::vector<double> slopes = largest_slopes(model.structure(), here, epigraph_row);
  std::mt19937_64 random(20220411);
  for (int k = 0; k <= kSamples; ++k) {
    for (const std::size_t i : variables_of(s, Player::Max)) {
      const SampledRange box{s.variable_lower[i], s.variable_upper[i]};
      if (k > 0 && box.lower > -kUnbounded && box.upper < kUnbounded) point[i] = box.draw(random);
    }
    if (!model.constraints(point, true, g)) continue;
    for (std::size_t j = 0; j < m; ++j) seen[j].see(g[j]);
    if (k > 0) continue;
    for (const Index row : robust_constraints(s)) seen[at(row)].see(finite_bound(s, at(row)));
  }

  for (const Index row : robust_constraints(s)) {
    const std::size_t j = at(row);
    double size = seen[j].size() > 0.0 ? seen[j].size() : slopes[j];
    if (near[j] > 0.0) size = std::min(size, near[j]);
    if (!(size > 0.0) || !std::isfinite(size)) continue;
    if (size < kLeastOrdinarySize || size > kMostOrdinarySize)
      units.factor[j] = std::exp2(-std::round(std::log2(size)));
    const double bound = finite_bound(s, j);
    if (std::abs(bound) > kMostOfBound * size) units.offset[j] = bound;
    units.size[j] = units.factor[j] * size;
    if (row == epigraph_row) units.objective = units.factor[j];
  }
  units.variables = units_of_boxes(s, here);
  if (units.objective < 1.0) {  // t, so that its own derivative is not small
    units.variables.resize(v.size(), 1.0);
    units.variables.back() = 1.0 / units.objective;
  }
  return units;
}

}  // namespace ipminmax
