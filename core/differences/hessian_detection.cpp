#include "core/differences/hessian_detection.hpp"

#include <algorithm>
#include <functional>
#include <numeric>
#include <utility>

#include "core/model/compare.hpp"
#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/model/parameters.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

bool FirstDerivativeSource::evaluate(std::span<const double> v, FirstDerivatives& derivatives,
                                     bool want_gradient, bool want_jacobian) {
  const ProblemStructure& structure = model_.structure();
  derivatives.gradient.resize(v.size());
  derivatives.jacobian.resize(structure.jacobian.size());
  if (!all_finite(v)) return false;  // no model is asked there
  bool new_v = true;
  if (want_gradient) {
    ++gradients_;
    if (!model_.gradient(v, new_v, derivatives.gradient) || !all_finite(derivatives.gradient)) {
      return false;
    }
    new_v = false;
  }
  if (!want_jacobian || structure.constraint_lower.empty()) return true;
  ++jacobians_;
  return model_.jacobian(v, new_v, derivatives.jacobian) && all_finite(derivatives.jacobian);
}

namespace {

using Neighbours = std::vector<std::vector<Index>>;

Neighbours neighbours_of(std::span<const Triplet> pattern, Index variables) {
  Neighbours neighbours(at(variables));
  for (const auto& [row, col] : pattern) {
    if (row == col) continue;
    neighbours[at(row)].push_back(col);
    neighbours[at(col)].push_back(row);
  }
  return neighbours;
}

/// Colours 0, 1, ..., greedily from the variable with most neighbours on.
std::vector<Index> restricted_star_colors(const Neighbours& neighbours) {
  const std::size_t n = neighbours.size();
  std::vector<Index> order(n);
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](Index a, Index b) {
    return neighbours[at(a)].size() > neighbours[at(b)].size();
  });

  std::vector<Index> color(n, -1);
  std::vector<std::vector<Index>> around(n);  // colours of each variable's neighbours, each once
  std::vector<Index> forbidden_for;           // per colour, the last variable that must not have it
  for (const Index v : order) {
    const auto forbid = [&](Index c) { forbidden_for[at(c)] = v; };
    for (const Index w : neighbours[at(v)]) {
      if (color[at(w)] >= 0) forbid(color[at(w)]);
      // A second neighbour of w in a colour must be above w's; w without colour may get any later.
      for (const Index c : around[at(w)]) {
        if (color[at(w)] < 0 || c < color[at(w)]) forbid(c);
      }
    }
    const auto free = std::find_if(forbidden_for.begin(), forbidden_for.end(),
                                   [&](Index last) { return last != v; });
    const auto chosen = static_cast<Index>(free - forbidden_for.begin());
    if (free == forbidden_for.end()) forbidden_for.push_back(-1);
    color[at(v)] = chosen;
    for (const Index w : neighbours[at(v)]) {
      auto& colors = around[at(w)];
      if (std::find(colors.begin(), colors.end(), chosen) == colors.end()) colors.push_back(chosen);
    }
  }
  return color;
}

}  // namespace

HessianColoring color_hessian(std::span<const Triplet> pattern, Index variables) {
  const std::vector<Index> color = restricted_star_colors(neighbours_of(pattern, variables));
  HessianColoring result;
  if (variables > 0) result.groups.resize(at(*std::max_element(color.begin(), color.end()) + 1));
  for (const auto k : indices(pattern)) {
    auto [row, col] = pattern[k];
    // In the row of the higher colour no other neighbour has the lower one.
    if (color[at(row)] < color[at(col)]) std::swap(row, col);
    result.groups[at(color[at(col)])].entries.push_back({row, col, static_cast<Index>(k)});
  }
  std::erase_if(result.groups, [](const auto& group) { return group.entries.empty(); });
  for (auto& group : result.groups) {
    for (const auto& entry : group.entries) group.variables.push_back(entry.col);
    sort_each_once(group.variables);
  }
  return result;
}

namespace {

/// Base points of the search.
constexpr int kRounds = 2;
/// Of a row that is given all pairs of its nonlinear variables.
constexpr std::size_t kMostVariablesOfPairs = 16;

class Detector {
 public:
  Detector(const ProblemStructure& structure, FirstDerivativeSource& source, PointSampler& sampler,
           std::span<const Index> variables, Index most_evaluations)
      : structure_(structure),
        source_(source),
        last_gradient_(source.gradients() + most_evaluations),
        sampler_(sampler),
        variables_(variables),
        wanted_(structure.variable_lower.size(), false),
        wide_(structure.constraint_lower.size(), false),
        pairs_of_(structure.variable_lower.size()) {
    for (const Index i : variables) wanted_[at(i)] = true;
  }

  std::vector<Triplet> run() {
    std::vector<Point> points(2 * kRounds);
    for (Point& point : points) {
      if (!sampler_.sample_defined(source_, point.v, point.derivatives)) return {};
    }
    add_constraint_blocks(points);
    for (std::size_t round = 0; round < kRounds; ++round) {
      if (!may_evaluate()) break;  // what is left of the first one has been taken as dense
      base_ = std::move(points[2 * round]);
      other_ = std::move(points[2 * round + 1].v);
      add_coupled_pairs(round == 0);
    }
    return pattern();
  }

 private:
  struct Point {
    std::vector<double> v;
    FirstDerivatives derivatives;
  };
  /// Variables variables_[begin, end) and the rows they may act on.
  struct Group {
    std::size_t begin = 0, end = 0;
    std::vector<Index> rows;
  };

  void add_pair(Index i, Index j) { pairs_of_[at(std::max(i, j))].push_back(std::min(i, j)); }

  void add_constraint_blocks(const std::vector<Point>& points) {
    std::vector<std::vector<Index>> nonlinear(wide_.size());
    for (const auto k : indices(structure_.jacobian)) {
      const auto [row, col] = structure_.jacobian[k];
      const double value = points.front().derivatives.jacobian[k];
      const bool varies = std::any_of(points.begin(), points.end(), [&](const Point& point) {
        return point.derivatives.jacobian[k] != value;
      });
      if (varies && wanted_[at(col)]) nonlinear[at(row)].push_back(col);
    }
    for (const auto row : indices(nonlinear)) {
      wide_[row] = nonlinear[row].size() > kMostVariablesOfPairs;
      if (wide_[row]) continue;
      for (const Index i : nonlinear[row]) {
        for (const Index j : nonlinear[row]) {
          if (i >= j) add_pair(i, j);
        }
      }
    }
  }

  /// Rows whose derivatives change when the groups' variables move to other_, or part
  /// of the way; false: no such point is defined.
  bool changed_rows(const std::vector<const Group*>& groups, std::vector<bool>& changed) {
    trial_ = base_.v;
    for (const double fraction : {1.0, 0.1, 1e-2, 1e-4}) {
      for (const Group* group : groups) {
        for (std::size_t k = group->begin; k < group->end; ++k) {
          const std::size_t i = at(variables_[k]);
          trial_[i] = base_.v[i] + fraction * (other_[i] - base_.v[i]);
        }
      }
      if (!source_.evaluate(trial_, moved_)) continue;
      changed.assign(trial_.size(), false);
      for (const auto i : indices(trial_)) {
        changed[i] = moved_.gradient[i] != base_.derivatives.gradient[i];
      }
      for (const auto k : indices(structure_.jacobian)) {
        const auto [row, col] = structure_.jacobian[k];
        if (wide_[at(row)] && moved_.jacobian[k] != base_.derivatives.jacobian[k]) {
          changed[at(col)] = true;
        }
      }
      return true;
    }
    return false;
  }

  /// Keeps of each group's rows those that change. The groups have no row in common.
  void narrow(std::vector<Group*>& groups) {
    std::vector<bool> changed;
    if (!changed_rows({groups.begin(), groups.end()}, changed)) return;
    for (Group* group : groups) {
      std::erase_if(group->rows, [&](Index i) { return !changed[at(i)]; });
    }
  }

  /// decides: pairs that are not looked at count as coupled.
  void add_coupled_pairs(bool decides) {
    if (variables_.empty()) return;
    Group all{0, variables_.size(), {variables_.begin(), variables_.end()}};
    std::vector<Group*> one{&all};
    narrow(one);
    std::vector<Group> groups;
    groups.push_back(std::move(all));
    std::vector<Index> dense;
    while (!groups.empty()) {
      groups = halves(groups);
      take_out_dense_rows(groups, dense);
      const auto alone = static_cast<Index>(dense.size());  // what is left for
      for (auto& batch : disjoint_batches(groups)) {
        if (!may_evaluate(alone)) break;
        narrow(batch);
      }
      if (!may_evaluate(alone)) {
        if (decides) take_as_dense(groups);
        break;
      }
      for (Group& group : groups) {
        if (group.end - group.begin > 1) continue;
        for (const Index i : group.rows) add_pair(i, variables_[group.begin]);
        group.rows.clear();
      }
      std::erase_if(groups, [](const Group& group) { return group.rows.empty(); });
    }
    std::sort(dense.begin(), dense.end());
    for (const auto k : indices(variables_)) {
      if (!std::binary_search(dense.begin(), dense.end(), variables_[k])) continue;
      Group alone{k, k + 1, {variables_.begin(), variables_.end()}};
      std::vector<Group*> batch{&alone};
      if (!may_evaluate() && !decides) return;
      if (may_evaluate()) narrow(batch);
      for (const Index i : alone.rows) add_pair(i, variables_[k]);
    }
  }

  /// So that so many evaluations are left.
  [[nodiscard]] bool may_evaluate(Index reserved = 0) const {
    return source_.gradients() + reserved < last_gradient_;
  }

  /// What has not been resolved counts as coupled.
  void take_as_dense(const std::vector<Group>& groups) {
    for (const Group& group : groups) {
      for (std::size_t k = group.begin; k < group.end; ++k) {
        for (const Index i : group.rows) add_pair(i, variables_[k]);
      }
    }
  }

  static std::vector<Group> halves(const std::vector<Group>& groups) {
    std::vector<Group> result;
    for (const Group& group : groups) {
      const std::size_t middle = group.begin + (group.end - group.begin) / 2;
      if (middle > group.begin) result.push_back({group.begin, middle, group.rows});
      if (group.end > middle) result.push_back({middle, group.end, group.rows});
    }
    return result;
  }

  /// Groups that act on one row are moved one after the other, on every level that is left, unless
  /// the row is taken out and its variable moved alone, once: as many rows as that pays for.
  void take_out_dense_rows(std::vector<Group>& groups, std::vector<Index>& dense) const {
    std::vector<std::size_t> count(wanted_.size(), 0);
    std::size_t levels = 1, largest = 1;
    for (const Group& group : groups) {
      for (const Index i : group.rows) ++count[at(i)];
      largest = std::max(largest, group.end - group.begin);
    }
    for (; largest > 1; largest = (largest + 1) / 2) ++levels;
    std::vector<std::size_t> sorted;
    for (const Index i : variables_) sorted.push_back(count[at(i)]);
    std::ranges::sort(sorted, std::greater<>());
    std::size_t best = levels * sorted.front(), most = sorted.front();
    for (const auto k : indices(sorted)) {
      const std::size_t left = k + 1 < sorted.size() ? sorted[k + 1] : 0;
      if (left == sorted[k] || k + 1 + levels * left >= best) continue;
      best = k + 1 + levels * left;
      most = left;
    }
    for (const Index i : variables_) {
      if (count[at(i)] > most) dense.push_back(i);
    }
    for (Group& group : groups) {
      std::erase_if(group.rows, [&](Index i) { return count[at(i)] > most; });
    }
  }

  std::vector<std::vector<Group*>> disjoint_batches(std::vector<Group>& groups) const {
    std::vector<std::vector<Group*>> batches;
    std::vector<std::vector<std::size_t>> taken(wanted_.size());  // batches of each row
    std::vector<std::size_t> refused_by;                          // per batch, the last group
    for (const auto g : indices(groups)) {
      for (const Index i : groups[g].rows) {
        for (const std::size_t batch : taken[at(i)]) refused_by[batch] = g;
      }
      std::size_t batch = 0;
      while (batch < batches.size() && refused_by[batch] == g) ++batch;
      if (batch == batches.size()) {
        batches.emplace_back();
        refused_by.push_back(groups.size());
      }
      batches[batch].push_back(&groups[g]);
      for (const Index i : groups[g].rows) taken[at(i)].push_back(batch);
    }
    return batches;
  }

  std::vector<Triplet> pattern() {
    std::vector<Triplet> result;
    for (const auto i : indices(pairs_of_)) {
      auto& partners = pairs_of_[i];
      sort_each_once(partners);
      for (const Index j : partners) result.push_back({static_cast<Index>(i), j});
    }
    return result;
  }

  const ProblemStructure& structure_;
  FirstDerivativeSource& source_;
  Index last_gradient_;  ///< evaluations, of all that the source has made
  PointSampler& sampler_;
  std::span<const Index> variables_;
  std::vector<bool> wanted_;                  ///< n, whether in variables_
  std::vector<bool> wide_;                    ///< m, nonlinear in more than kMostVariablesOfPairs
  std::vector<std::vector<Index>> pairs_of_;  ///< smaller partners of each variable
  Point base_;
  std::vector<double> other_, trial_;
  FirstDerivatives moved_;
};

}  // namespace

PointSampler::PointSampler(const ProblemStructure& structure, std::span<const double> start)
    : structure_(structure), start_(start.begin(), start.end()) {
  for (const auto i : indices(start_)) {
    start_[i] = std::clamp(start_[i], structure.variable_lower[i], structure.variable_upper[i]);
  }
}

std::vector<double> PointSampler::sample(double radius) {
  std::uniform_real_distribution<double> fraction(0.05, 0.95);
  std::vector<double> point = start_;
  for (const auto i : indices(point)) {
    double lower = structure_.variable_lower[i], upper = structure_.variable_upper[i];
    const double reach = radius * length_of(start_[i], start_[i], lower, upper);
    lower = std::max(lower, start_[i] - reach);
    upper = std::min(upper, start_[i] + reach);
    const double t = fraction(random_);
    if (lower < upper) point[i] = lower + t * (upper - lower);
  }
  return point;
}

bool PointSampler::sample_defined(FirstDerivativeSource& source, std::vector<double>& point,
                                  FirstDerivatives& derivatives) {
  double radius = 0.5;
  for (int k = 0; k < parameters::kHalvings; ++k, radius *= 0.5) {
    point = sample(radius);
    if (source.evaluate(point, derivatives)) return true;
  }
  return false;
}

std::vector<Triplet> detect_hessian_pattern(const ProblemStructure& structure,
                                            FirstDerivativeSource& source, PointSampler& sampler,
                                            std::span<const Index> variables,
                                            Index most_evaluations) {
  return Detector(structure, source, sampler, variables, most_evaluations).run();
}

}  // namespace ipminmax
