#include "linalg/elimination_tree.hpp"

#include <algorithm>
#include <compare>
#include <cstdint>
#include <functional>
#include <limits>
#include <new>
#include <numeric>
#include <utility>

namespace ipminmax {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Cost over that of the longest part and the rest, below which parts are not worth it.
constexpr double kLeastGain = 1.15;
/// What is worth another look at the balance.
constexpr double kBetter = 0.98;
/// Nanoseconds that are worth threads, and one of them: to wake one takes 10 to 50 thousand.
constexpr double kWorthThreads = 5e5;
constexpr double kLeastPart = 2e5;

/// A subtree that may become a part.
struct Subtree {
  double cost = 0.0;
  Index root = 0;
  /// The root decides where costs are the same.
  friend auto operator<=>(const Subtree&, const Subtree&) = default;
};

/// Subtrees over bins, the most expensive one first, each to where least is.
struct Balance {
  explicit Balance(std::vector<Subtree> all, std::size_t bins) : subtrees(std::move(all)) {
    std::ranges::sort(subtrees, std::greater<>());
    std::vector<double> load(bins, 0.0);
    bin.reserve(subtrees.size());
    for (const Subtree& subtree : subtrees) {
      const auto least = std::ranges::min_element(load);
      *least += subtree.cost;
      bin.push_back(static_cast<Index>(least - load.begin()));
    }
    longest = *std::ranges::max_element(load);
  }
  std::vector<Subtree> subtrees;
  std::vector<Index> bin;  ///< of each
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
  [[nodiscard]] std::vector<Index> parts() const;

 private:
  void push(Index root) {
    heap_.push_back({subtree_[at(root)], root});
    std::ranges::push_heap(heap_);
  }
  const EliminationTree& tree_;
  std::span<const double> row_costs_;
  std::vector<double> subtree_;  // cost of each row and its descendants
  std::vector<Index> child_, sibling_;
  std::vector<Subtree> heap_;
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
    const Index parent = tree.parent[at(j)];
    cost_ += row_costs[at(j)];
    if (parent < 0) {
      push(j);
      continue;
    }
    subtree_[at(parent)] += subtree_[at(j)];
    sibling_[at(j)] = std::exchange(child_[at(parent)], j);
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
    for (Index j = child_[at(largest.root)]; j >= 0; j = sibling_[at(j)]) push(j);
  }
}

std::vector<Index> Cutter::parts() const {
  std::vector<Index> part(subtree_.size(), -1);
  for (const auto& [root, bin] : best_bins_) part[at(root)] = bin;
  for (std::size_t j = part.size(); j-- > 0;) {
    const Index parent = tree_.parent[j];
    if (parent >= 0 && part[at(parent)] >= 0) part[j] = part[at(parent)];
  }
  return part;
}

}  // namespace

EliminationTree elimination_tree(const LowerRows& a) {
  const Index n = a.dimension();
  EliminationTree tree;
  tree.parent.assign(at(n), -1);
  tree.column_starts.assign(at(n) + 1, 0);
  std::vector<Index> mark(at(n), -1);
  std::int64_t entries = 0;
  for (Index k = 0; k < n; ++k) {
    mark[at(k)] = k;
    for (Index p = a.starts[at(k)]; p < a.starts[at(k) + 1]; ++p) {
      for (Index i = a.columns[at(p)]; mark[at(i)] != k; i = tree.parent[at(i)]) {
        if (tree.parent[at(i)] < 0) tree.parent[at(i)] = k;
        ++tree.column_starts[at(i) + 1];
        ++entries;
        mark[at(i)] = k;
      }
    }
    if (entries > std::numeric_limits<Index>::max()) throw std::bad_alloc();
  }
  std::partial_sum(tree.column_starts.begin(), tree.column_starts.end(),
                   tree.column_starts.begin());
  return tree;
}

FactorPattern factor_pattern(const LowerRows& a, const EliminationTree& tree) {
  const Index n = a.dimension();
  FactorPattern pattern;
  pattern.rows.resize(at(tree.entries()));
  pattern.columns.reserve(at(tree.entries()));
  pattern.row_starts.reserve(at(n) + 1);
  pattern.row_starts.push_back(0);
  std::vector<Index> next(tree.column_starts.begin(), tree.column_starts.end() - 1);
  std::vector<Index> mark(at(n), -1), stack(at(n));
  for (Index k = 0; k < n; ++k) {
    std::size_t first = stack.size();
    mark[at(k)] = k;
    for (Index p = a.starts[at(k)]; p < a.starts[at(k) + 1]; ++p) {
      std::size_t length = 0;  // a path towards the root, kept in front
      for (Index i = a.columns[at(p)]; mark[at(i)] != k; i = tree.parent[at(i)]) {
        stack[length++] = i;
        mark[at(i)] = k;
      }
      while (length > 0) stack[--first] = stack[--length];
    }
    for (std::size_t r = first; r < stack.size(); ++r) {
      pattern.columns.push_back(stack[r]);
      pattern.rows[at(next[at(stack[r])]++)] = k;
    }
    pattern.row_starts.push_back(static_cast<Index>(pattern.columns.size()));
  }
  return pattern;
}

std::vector<double> row_costs(const EliminationTree& tree, const FactorPattern& pattern,
                              const EliminationCost& cost) {
  std::vector<double> costs(at(tree.dimension()));
  std::vector<Index> before(costs.size(), 0);  // entries of each column so far
  for (std::size_t k = 0; k < costs.size(); ++k) {
    costs[k] = cost.row;
    for (Index r = pattern.row_starts[k]; r < pattern.row_starts[k + 1]; ++r) {
      costs[k] += cost.entry + cost.update * before[at(pattern.columns[at(r)])]++;
    }
  }
  return costs;
}

std::span<const Index> TreeParts::part(int p) const {
  const std::size_t begin = at(starts[at(p)]);
  return {rows.data() + begin, at(starts[at(p) + 1]) - begin};
}

std::span<const Index> TreeParts::rest() const {
  return std::span(rows).subspan(at(starts.back()));
}

TreeParts split(const EliminationTree& tree, std::span<const double> row_costs, int most_parts,
                double least_part) {
  TreeParts parts;
  parts.rows.resize(row_costs.size());
  std::iota(parts.rows.begin(), parts.rows.end(), 0);
  parts.cost = parts.longest = std::accumulate(row_costs.begin(), row_costs.end(), 0.0);
  const double bins = std::min(static_cast<double>(most_parts), parts.cost / least_part);
  if (bins < 2.0) return parts;
  Cutter cutter(tree, row_costs);
  cutter.cut(static_cast<std::size_t>(bins));
  if (cutter.best() * kLeastGain > parts.cost) return parts;
  parts.longest = cutter.best();
  const std::vector<Index> part = cutter.parts();
  parts.starts.assign(static_cast<std::size_t>(bins) + 1, 0);
  for (const Index p : part) {
    if (p >= 0) ++parts.starts[at(p) + 1];
  }
  std::partial_sum(parts.starts.begin(), parts.starts.end(), parts.starts.begin());
  std::ranges::stable_sort(parts.rows, std::less<>(), [&](Index k) {
    return part[at(k)] < 0 ? std::numeric_limits<Index>::max() : part[at(k)];
  });
  return parts;
}

TreeParts parts_for_threads(const EliminationTree& tree, const FactorPattern& pattern,
                            const EliminationCost& cost, int threads) {
  const double dimension = tree.dimension();
  const double at_most =
      cost.row * dimension + tree.entries() * (cost.entry + cost.update * dimension);
  if (threads > 1 && at_most >= kWorthThreads) {
    const std::vector<double> costs = row_costs(tree, pattern, cost);
    const double all = std::accumulate(costs.begin(), costs.end(), 0.0);
    if (all >= kWorthThreads) return split(tree, costs, threads, kLeastPart);
  }
  TreeParts none;
  none.rows.resize(at(tree.dimension()));
  std::iota(none.rows.begin(), none.rows.end(), 0);
  return none;
}

}  // namespace ipminmax
