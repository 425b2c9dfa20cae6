// Subtrees for threads: every row once, balanced, and orders that divide a chain.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "linalg/ordering.hpp"
#include "linalg/tree_parts.hpp"
#include "lower_rows.hpp"
#include "test_matrices.hpp"

namespace ipminmax {
namespace {

using test::at;
using test::eliminate;
using test::random_rows;
using test::Rows;

TEST(RowCosts, CountEntriesAndUpdates) {
  const Rows a = random_rows(40, 0.1, 7);
  const EliminationTree tree = elimination_tree(a.view());
  const std::vector<std::set<Index>> below = eliminate(a.view());
  const std::vector<double> costs =
      row_costs(tree, factor_pattern(a.view(), tree), {.row = 1e6, .entry = 1e3, .update = 1.0});
  for (Index k = 0; k < tree.dimension(); ++k) {
    double expected = 1e6;
    for (const auto& column : below) {
      if (!column.contains(k)) continue;
      expected += 1e3;
      for (const Index row : column) expected += row < k ? 1.0 : 0.0;
    }
    EXPECT_EQ(costs[at(k)], expected);
  }
}

/// Every row once, in sets that hold the descendants of their rows and share none.
void expect_parts_of(const TreeParts& parts, const EliminationTree& tree,
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
    if (tree.parent[k] < 0) continue;
    const int above = part[at(tree.parent[k])];
    EXPECT_TRUE(above == -1 || above == part[k]) << k;
  }
  EXPECT_NEAR(parts.longest, longest + rest, 1e-12 * parts.cost);
}

TEST(Split, BalancesSubtreesThatAreIndependent) {
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const Rows a = random_rows(static_cast<Index>(10 * seed), 1.2 / (10.0 * seed), seed);
    const EliminationTree tree = elimination_tree(a.view());
    const std::vector<double> costs =
        row_costs(tree, factor_pattern(a.view(), tree), {.row = 1.0, .entry = 1.0, .update = 1.0});
    for (const int threads : {1, 2, 3, 8, 1000000}) {
      const TreeParts parts = split(tree, costs, threads, 1.0);
      expect_parts_of(parts, tree, costs);
      EXPECT_LE(parts.count(), threads == 1 ? 0 : threads);
      EXPECT_NEAR(parts.cost, std::accumulate(costs.begin(), costs.end(), 0.0), 1e-9);
      EXPECT_EQ(parts.rows, split(tree, costs, threads, 1.0).rows);
    }
  }
}

/// A complete binary tree, children before parents, of the given height.
EliminationTree binary_tree(int height) {
  EliminationTree tree;
  const Index n = (1 << height) - 1;  // rows by levels, leaves first
  for (Index k = 0, first = 0, width = (n + 1) / 2; k < n; ++k) {
    if (k == first + width) {
      first += width;
      width /= 2;
    }
    tree.parent.push_back(k + 1 == n ? -1 : first + width + (k - first) / 2);
  }
  return tree;
}

TEST(Split, DividesABinaryTreeInHalvesAndAPathNotAtAll) {
  const EliminationTree tree = binary_tree(10);
  const std::vector<double> ones(tree.parent.size(), 1.0);
  EXPECT_EQ(split(tree, ones, 2, 1.0).longest, 512.0);
  EXPECT_EQ(split(tree, ones, 4, 1.0).longest, 258.0);
  EXPECT_EQ(split(tree, ones, 2, 600.0).count(), 0);  // a part would be too small
  EliminationTree path = tree;
  for (Index k = 0; k < path.dimension(); ++k) path.parent[at(k)] = k + 1;
  path.parent.back() = -1;
  const TreeParts whole = split(path, ones, 2, 1.0);
  EXPECT_EQ(whole.count(), 0);
  EXPECT_EQ(whole.rest().size(), ones.size());
  EXPECT_EQ(whole.longest, whole.cost);
}

TEST(PartsForThreads, AreForLargeFactorizationsAlone) {
  for (const bool large : {false, true}) {
    const EliminationTree tree = [] {
      EliminationTree forest = binary_tree(10);
      forest.column_starts.assign(forest.parent.size() + 1, 0);
      return forest;
    }();
    FactorPattern pattern;
    pattern.row_starts.assign(tree.parent.size() + 1, 0);
    const EliminationCost cost{.row = large ? 1000.0 : 100.0};
    EXPECT_EQ(parts_for_threads(tree, pattern, cost, 1).count(), 0);
    const TreeParts parts = parts_for_threads(tree, pattern, cost, 2);
    EXPECT_EQ(parts.count(), large ? 2 : 0);
    EXPECT_EQ(parts.rows.size(), tree.parent.size());
  }
}

/// Each row is coupled with the two before it.
Rows chain(Index dimension) {
  Rows a;
  for (Index k = 0; k < dimension; ++k) {
    for (Index j = std::max(0, k - 2); j <= k; ++j) a.columns.push_back(j);
    a.starts.push_back(static_cast<Index>(a.columns.size()));
  }
  return a;
}

TEST(OrderForTwoParts, EliminatesAChainFromBothEnds) {
  const Rows a = chain(50000);
  const EliminationTree tree = elimination_tree(a.view());
  const std::vector<Index> place = order_for_two_parts(a.view());
  ASSERT_EQ(place.size(), 50000u);
  Rows other;
  std::vector<std::set<Index>> rows(place.size());
  for (Index k = 0; k < 50000; ++k) {
    for (Index j = std::max(0, k - 2); j <= k; ++j) {
      rows[at(std::max(place[at(k)], place[at(j)]))].insert(std::min(place[at(k)], place[at(j)]));
    }
  }
  for (const std::set<Index>& row : rows) {
    other.columns.insert(other.columns.end(), row.begin(), row.end());
    other.starts.push_back(static_cast<Index>(other.columns.size()));
  }
  const EliminationTree other_tree = elimination_tree(other.view());
  EXPECT_LE(other_tree.entries(), tree.entries());
  const TreeParts parts = split(
      other_tree, row_costs(other_tree, factor_pattern(other.view(), other_tree), {1.0, 1.0, 1.0}),
      2, 1.0);
  EXPECT_EQ(parts.count(), 2);
  EXPECT_GT(parts.cost, 1.99 * parts.longest);
  EXPECT_TRUE(order_for_two_parts(other.view()).empty());  // it divides well
}

TEST(OrderForTwoParts, LeavesTreesAloneThatCannotDivide) {
  Rows full;
  for (Index k = 0; k < 400; ++k) {
    for (Index j = 0; j < k; ++j) full.columns.push_back(j);
    full.starts.push_back(static_cast<Index>(full.columns.size()));
  }
  EXPECT_TRUE(order_for_two_parts(full.view()).empty());
}

TEST(ChosenOrdering, DividesLongChainsWithNoMoreOperationsAndShortOnesNotAtAll) {
  for (const Index steps : {200, 6000}) {
    const SymmetricMatrix matrix = test::chauffeur_kkt(steps, 1).matrix;
    const std::vector<Index> amd = fill_reducing_ordering(matrix, Ordering::Amd);
    const FactorSize size = predict_factor_size(matrix, amd);
    for (const Ordering ordering : {Ordering::Best, Ordering::Amd}) {
      const OrderingChoice choice = choose_ordering(matrix, ordering);
      EXPECT_EQ(choice.ordering, Ordering::Amd);
      EXPECT_LE(choice.size.flops, size.flops);
      EXPECT_EQ(choice.new_index == amd, steps == 200);
    }
  }
}

}  // namespace
}  // namespace ipminmax
