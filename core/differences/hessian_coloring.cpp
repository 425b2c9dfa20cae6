#include <algorithm>
#include <numeric>

#include "core/differences/hessian_coloring.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
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
  for (std::size_t k = 0; k < pattern.size(); ++k) {
    auto [row, col] = pattern[k];
    // In the row of the higher colour no other neighbour has the lower one.
    if (color[at(row)] < color[at(col)]) std::swap(row, col);
    result.groups[at(color[at(col)])].entries.push_back({row, col, static_cast<Index>(k)});
  }
  std::erase_if(result.groups, [](const auto& group) { return group.entries.empty(); });
  for (auto& group : result.groups) {
    for (const auto& entry : group.entries) group.variables.push_back(entry.col);
    std::sort(group.variables.begin(), group.variables.end());
    group.variables.erase(std::unique(group.variables.begin(), group.variables.end()),
                          group.variables.end());
  }
  return result;
}

}  // namespace ipminmax
