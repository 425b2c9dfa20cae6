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
  Cutter(std::span<const Index> parent, std::span<const double> costs);
  [[nodiscard]] double best() const { return best_; }
  void cut(std::size_t bins);
  /// Per node its part; -1: the rest.
  [[nodiscard]] Array<Index> parts() const;

 private:
  void push(Index root) {
    heap_.push_back({subtree_[root], root});
    std::ranges::push_heap(heap_);
  }
  std::span<const Index> parent_;
  std::span<const double> costs_;
  Array<double> subtree_;  // cost of each node and its descendants
  Array<Index> child_, sibling_;
  Array<Subtree> heap_;
  double cost_ = 0.0;
  double best_ = 0.0;                               // of the longest bin and the rest
  std::vector<std::pair<Index, Index>> best_bins_;  // of roots
};

Cutter::Cutter(std::span<const Index> parent, std::span<const double> costs)
    : parent_(parent),
      costs_(costs),
      subtree_(costs.begin(), costs.end()),
      child_(costs.size(), -1),
      sibling_(costs.size(), -1) {
  for (std::size_t j = 0; j < costs.size(); ++j) {
    cost_ += costs[j];
    if (parent[j] < 0) {
      push(static_cast<Index>(j));
      continue;
    }
    subtree_[parent[j]] += subtree_[j];
    sibling_[j] = std::exchange(child_[parent[j]], static_cast<Index>(j));
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
    rest += costs_[at(largest.root)];
    for (Index j = child_[largest.root]; j >= 0; j = sibling_[j]) push(j);
  }
}

Array<Index> Cutter::parts() const {
  Array<Index> part(subtree_.size(), -1);
  for (const auto& [root, bin] : best_bins_) part[root] = bin;
  for (std::size_t j = part.size(); j-- > 0;) {
    const Index parent = parent_[j];
    if (parent >= 0 && part[parent] >= 0) part[j] = part[parent];
  }
  return part;
}

}  // namespace

std::span<const Index> TreeParts::part(int p) const {
  const std::size_t begin = at(starts[p]);
  return {nodes.data() + begin, at(starts[p + 1]) - begin};
}

std::span<const Index> TreeParts::rest() const {
  return std::span(nodes).subspan(at(starts.back()));
}

TreeParts parts_for_threads(std::span<const Index> parent, std::span<const double> costs,
                            int threads) {
  TreeParts parts;
  parts.nodes.resize(costs.size());
  std::iota(parts.nodes.begin(), parts.nodes.end(), 0);
  const double all = std::accumulate(costs.begin(), costs.end(), 0.0);
  const auto bins = static_cast<std::size_t>(std::min(1.0 * threads, all / kLeastPart));
  if (bins < 2 || all < kWorthThreads) return parts;
  Cutter cutter(parent, costs);
  cutter.cut(bins);
  if (cutter.best() * kLeastGain > all) return parts;
  const Array<Index> part = cutter.parts();
  parts.starts.assign(bins + 1, 0);
  for (const Index p : part) {
    if (p >= 0) ++parts.starts[p + 1];
  }
  std::partial_sum(parts.starts.begin(), parts.starts.end(), parts.starts.begin());
  std::ranges::stable_sort(parts.nodes, std::less<>(), [&](Index k) {
    return part[k] < 0 ? std::numeric_limits<Index>::max() : part[k];
  });
  return parts;
}

}  // namespace ipminmax
