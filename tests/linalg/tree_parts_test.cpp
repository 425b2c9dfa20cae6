// Subtrees for threads: every node once, balanced.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "linalg/tree_parts.hpp"
#include "lower_rows.hpp"

namespace ipminmax {
namespace {

using test::at;
using test::random_rows;
using test::Rows;

/// What a thread is worth, in nanoseconds.
constexpr double kPart = 2e5;

/// The most expensive set and the rest. Every node is there once, in sets that hold the descendants
/// of their nodes and share none.
double longest_of(const TreeParts& parts, std::span<const Index> parent,
                  const std::vector<double>& costs) {
  const auto n = costs.size();
  std::vector<int> part(n, -2);
  double longest = 0.0, rest = 0.0;
  for (int p = 0; p < parts.count(); ++p) {
    double sum = 0.0;
    EXPECT_TRUE(std::ranges::is_sorted(parts.part(p)));
    for (const Index k : parts.part(p)) {
      EXPECT_EQ(std::exchange(part[at(k)], p), -2);
      sum += costs[at(k)];
    }
    longest = std::max(longest, sum);
  }
  EXPECT_TRUE(std::ranges::is_sorted(parts.rest()));
  for (const Index k : parts.rest()) {
    EXPECT_EQ(std::exchange(part[at(k)], -1), -2);
    rest += costs[at(k)];
  }
  EXPECT_EQ(std::ranges::count(part, -2), 0);
  for (std::size_t k = 0; k < n; ++k) {
    if (parent[k] < 0) continue;
    const int above = part[at(parent[k])];
    EXPECT_TRUE(above == -1 || above == part[k]) << k;
  }
  return longest + rest;
}

TEST(PartsForThreads, AreSubtreesThatAreIndependent) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const Rows a = random_rows(static_cast<Index>(10 * seed), 1.2 / (10.0 * seed), seed);
    const EliminationTree tree = elimination_tree(a.view());
    std::vector<double> costs;
    for (Index k = 0; k < tree.dimension(); ++k) {
      const double below = tree.column_starts[at(k) + 1] - tree.column_starts[at(k)];
      costs.push_back(kPart * (1.0 + below * below));
    }
    for (const int threads : {1, 2, 3, 8, 1000000}) {
      const TreeParts parts = parts_for_threads(tree.parent, costs, threads);
      EXPECT_LE(longest_of(parts, tree.parent, costs),
                std::accumulate(costs.begin(), costs.end(), 0.0) * (1.0 + 1e-12));
      EXPECT_LE(parts.count(), threads == 1 ? 0 : threads);
      EXPECT_EQ(parts.nodes, parts_for_threads(tree.parent, costs, threads).nodes);
    }
  }
}

/// Parents of a complete binary tree, children before parents, of the given height.
std::vector<Index> binary_tree(int height) {
  std::vector<Index> parent;
  const Index n = (1 << height) - 1;  // by levels, leaves first
  for (Index k = 0, first = 0, width = (n + 1) / 2; k < n; ++k) {
    if (k == first + width) {
      first += width;
      width /= 2;
    }
    parent.push_back(k + 1 == n ? -1 : first + width + (k - first) / 2);
  }
  return parent;
}

TEST(PartsForThreads, DivideABinaryTreeInHalvesAndAPathNotAtAll) {
  const std::vector<Index> tree = binary_tree(10);
  const std::vector<double> costs(tree.size(), kPart);
  EXPECT_EQ(longest_of(parts_for_threads(tree, costs, 2), tree, costs), 512.0 * kPart);
  EXPECT_EQ(longest_of(parts_for_threads(tree, costs, 4), tree, costs), 258.0 * kPart);
  std::vector<Index> path(tree.size());
  std::iota(path.begin(), path.end(), 1);
  path.back() = -1;
  const TreeParts whole = parts_for_threads(path, costs, 2);
  EXPECT_EQ(whole.count(), 0);
  EXPECT_EQ(whole.rest().size(), costs.size());
}

TEST(PartsForThreads, AreForLargeFactorizationsAlone) {
  const std::vector<Index> tree = binary_tree(10);
  for (const bool large : {false, true}) {
    const std::vector<double> costs(tree.size(), large ? 1000.0 : 100.0);
    EXPECT_EQ(parts_for_threads(tree, costs, 1).count(), 0);
    const TreeParts parts = parts_for_threads(tree, costs, 2);
    EXPECT_EQ(parts.count(), large ? 2 : 0);
    EXPECT_EQ(parts.nodes.size(), tree.size());
  }
}

}  // namespace
}  // namespace ipminmax
