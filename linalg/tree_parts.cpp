#include "linalg/tree_parts.hpp"

#include <algorithm>
#include <compare>
#include <functional>
#include <limits>
#include <numeric>
#include <utility>

#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// Cost over that of the longest part and the rest, below which parts are not worth it.
constexpr double kLeastGain = 1.15;
/// What is worth another look at the balance.
constexpr double kBetter = 0.98;
/// Nanoseconds that are worth threads, and one of them: to wake one takes 10 to 50 thousand.
constexpr double kWorthThreads = 1e6;
constexpr double kLeastPart = 2e5;
/// A tree that divides in two well enough: cost over that of the longer part and the rest. An order
/// that is to take the place of another has to do so that much better, with hardly more cost.
constexpr double kDividesWell = 1.6;
constexpr double kWorthAnotherOrder = 1.1;
constexpr double kHardlyMore = 1.01;
/// About that of either LDL'.
constexpr EliminationCost kUsualCost{.row = 4.0, .entry = 2.0, .update = 0.7};

/// A subtree that may become a part.
struct Subtree {
  double cost = 0.0;
  Index root = 0;
  /// The root decides where costs are the same.
  friend auto operator<=>(const Subtree&, const Subtree&) = default;
};

/// Subtrees over bins, the most expensive one first, each to where least is.
struct Balance {
  explicit Balance(Array<Subtree> all, std::size_t bins) : subtrees(std::move(all)) {
    std::ranges::sort(subtrees, std::greater<>());
    Array<double> load(bins, 0.0);
    bin.reserve(subtrees.size());
    for (const Subtree& subtree : subtrees) {
      const auto least = std::ranges::min_element(load);
      *least += subtree.cost;
      bin.push_back(static_cast<Index>(least - load.begin()));
    }
    longest = *std::ranges::max_element(load);
  }
  Array<Subtree> subtrees;
  Array<Index> bin;  ///< of each
  double longest = 0.0;
};

/// Cuts the tree from its roots on, always at the most expensive subtree, and keeps the best cut.
class Cutter {
 public:
  Cutter(const EliminationTree& tree, std::span<const double> row_costs);
  [[nodiscard]] double cost() const { return cost_; }
  [[nodiscard]] double best() const { return best_; }
  void cut(std::size_t bins);
  /// Per row its part; -1: the rest.
  [[nodiscard]] Array<Index> parts() const;

 private:
  void push(Index root) {
    heap_.push_back({subtree_[root], root});
    std::ranges::push_heap(heap_);
  }
  const EliminationTree& tree_;
  std::span<const double> row_costs_;
  Array<double> subtree_;  // cost of each row and its descendants
  Array<Index> child_, sibling_;
  Array<Subtree> heap_;
  double cost_ = 0.0;
  double best_ = 0.0;                               // of the longest bin and the rest
  std::vector<std::pair<Index, Index>> best_bins_;  // of roots
};

Cutter::Cutter(const EliminationTree& tree, std::span<const double> row_costs)
    : tree_(tree),
      row_costs_(row_costs),
      subtree_(row_costs.begin(), row_costs.end()),
      child_(row_costs.size(), -1),
      sibling_(row_costs.size(), -1) {
  for (Index j = 0; j < tree.dimension(); ++j) {
    const Index parent = tree.parent[j];
    cost_ += row_costs[at(j)];
    if (parent < 0) {
      push(j);
      continue;
    }
    subtree_[parent] += subtree_[j];
    sibling_[j] = std::exchange(child_[parent], j);
  }
  best_ = cost_;
}

void Cutter::cut(std::size_t bins) {
  double rest = 0.0;
  double tried = cost_ / kBetter;
  const auto share = [&] { return rest + (cost_ - rest) / static_cast<double>(bins); };
  while (!heap_.empty() && share() < kBetter * best_) {
    const Subtree largest = heap_.front();
    const double least = std::max(rest + largest.cost, share());
    if (least < kBetter * std::min(best_, tried)) {
      tried = least;
      const Balance balance(heap_, bins);
      if (rest + balance.longest < kBetter * best_) {
        best_ = rest + balance.longest;
        best_bins_.clear();
        for (std::size_t s = 0; s < balance.bin.size(); ++s) {
          best_bins_.emplace_back(balance.subtrees[s].root, balance.bin[s]);
        }
      }
    }
    std::ranges::pop_heap(heap_);
    heap_.pop_back();
    rest += row_costs_[at(largest.root)];
    for (Index j = child_[largest.root]; j >= 0; j = sibling_[j]) push(j);
  }
}

Array<Index> Cutter::parts() const {
  Array<Index> part(subtree_.size(), -1);
  for (const auto& [root, bin] : best_bins_) part[root] = bin;
  for (std::size_t j = part.size(); j-- > 0;) {
    const Index parent = tree_.parent[j];
    if (parent >= 0 && part[parent] >= 0) part[j] = part[parent];
  }
  return part;
}

/// The rows of P A P'.
Lists permuted_rows(const Lists& a, const Array<Index>& place) {
  return collect(a.size(), [&](auto&& add) {
    for (Index k = 0; k < a.size(); ++k) {
      for (const Index i : a[k]) {
        const auto [column, row] = std::minmax(place[k], place[i]);
        add(row, column);
      }
    }
  });
}

/// All rows in the rest.
TreeParts undivided(std::size_t dimension) {
  TreeParts parts;
  parts.rows.resize(dimension);
  std::iota(parts.rows.begin(), parts.rows.end(), 0);
  return parts;
}

/// The lowest row whose subtree costs half of all.
Index middle_of(const EliminationTree& tree, std::span<const double> row_costs) {
  Array<double> subtree(row_costs.begin(), row_costs.end());
  const double all = std::accumulate(row_costs.begin(), row_costs.end(), 0.0);
  for (Index j = 0; j < tree.dimension(); ++j) {
    const Index parent = tree.parent[j];
    if (subtree[j] >= 0.5 * all) return j;
    if (parent >= 0) subtree[parent] += subtree[j];
  }
  return tree.dimension() - 1;  // of a forest of small trees
}

}  // namespace

Array<double> row_costs(const EliminationTree& tree, const FactorPattern& pattern,
                        const EliminationCost& cost) {
  Array<double> costs(at(tree.dimension()));
  Array<Index> before(costs.size(), 0);  // entries of each column so far
  for (std::size_t k = 0; k < costs.size(); ++k) {
    costs[k] = cost.row;
    for (Index r = pattern.row_starts[k]; r < pattern.row_starts[k + 1]; ++r) {
      costs[k] += cost.entry + cost.update * before[pattern.columns[r]]++;
    }
  }
  return costs;
}

std::span<const Index> TreeParts::part(int p) const {
  const std::size_t begin = at(starts[p]);
  return {rows.data() + begin, at(starts[p + 1]) - begin};
}

std::span<const Index> TreeParts::rest() const {
  return std::span(rows).subspan(at(starts.back()));
}

TreeParts split(const EliminationTree& tree, std::span<const double> row_costs, int most_parts,
                double least_part) {
  TreeParts parts = undivided(row_costs.size());
  parts.cost = parts.longest = std::accumulate(row_costs.begin(), row_costs.end(), 0.0);
  const auto bins = static_cast<std::size_t>(std::min(1.0 * most_parts, parts.cost / least_part));
  if (bins < 2) return parts;
  Cutter cutter(tree, row_costs);
  cutter.cut(bins);
  if (cutter.best() * kLeastGain > parts.cost) return parts;
  parts.longest = cutter.best();
  const Array<Index> part = cutter.parts();
  parts.starts.assign(bins + 1, 0);
  for (const Index p : part) {
    if (p >= 0) ++parts.starts[p + 1];
  }
  std::partial_sum(parts.starts.begin(), parts.starts.end(), parts.starts.begin());
  std::ranges::stable_sort(parts.rows, std::less<>(), [&](Index k) {
    return part[k] < 0 ? std::numeric_limits<Index>::max() : part[k];
  });
  return parts;
}

TreeParts parts_for_threads(const EliminationTree& tree, const FactorPattern& pattern,
                            const EliminationCost& cost, int threads) {
  const double dimension = tree.dimension();
  const double at_most =
      cost.row * dimension + tree.entries() * (cost.entry + cost.update * dimension);
  if (threads > 1 && at_most >= kWorthThreads) {
    const Array<double> costs = row_costs(tree, pattern, cost);
    const double all = std::accumulate(costs.begin(), costs.end(), 0.0);
    if (all >= kWorthThreads) return split(tree, costs, threads, kLeastPart);
  }
  return undivided(at(tree.dimension()));
}

bool is_worth_threads(Index dimension, double entries, double operations) {
  const double updates = 0.5 * (operations - 3.0 * entries);
  return kUsualCost.row * dimension + kUsualCost.entry * entries + kUsualCost.update * updates >=
         kWorthThreads;
}

Array<Index> order_for_two_parts(const Lists& a) {
  const EliminationTree tree = elimination_tree(a);
  Array<Index> place;
  TreeParts given;
  {
    const FactorPattern pattern = factor_pattern(a, tree);
    const Array<double> costs = row_costs(tree, pattern, kUsualCost);
    given = split(tree, costs, 2, kLeastPart);
    if (given.cost > kDividesWell * given.longest) return {};
    place = order_without_fill(tree, pattern, middle_of(tree, costs));
  }
  const Lists rows = permuted_rows(a, place);
  const EliminationTree other_tree = elimination_tree(rows);
  const TreeParts parts =
      split(other_tree, row_costs(other_tree, factor_pattern(rows, other_tree), kUsualCost), 2,
            kLeastPart);
  if (parts.cost > kHardlyMore * given.cost || parts.longest * kWorthAnotherOrder > given.longest) {
    return {};
  }
  // Subtrees without gaps, for the cache.
  const Array<Index> post = postorder(other_tree.parent);
  Array<Index> in_postorder(post.size());
  for (std::size_t k = 0; k < post.size(); ++k) in_postorder[post[k]] = static_cast<Index>(k);
  for (Index& k : place) k = in_postorder[k];
  return place;
}

}  // namespace ipminmax
