// The elimination tree and the pattern of L, beside an elimination of the pattern row by row.
#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <numeric>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "linalg/elimination_tree.hpp"
#include "lower_rows.hpp"

namespace ipminmax {
namespace {

using test::at;
using test::eliminate;
using test::random_rows;
using test::Rows;

TEST(EliminationTree, IsThatOfTheEliminatedPattern) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    const Rows a = random_rows(static_cast<Index>(seed * 3), 2.0 / (seed * 3.0), seed);
    const std::vector<std::set<Index>> below = eliminate(a.view());
    const EliminationTree tree = elimination_tree(a.view());
    ASSERT_EQ(tree.parent.size(), below.size());
    for (std::size_t j = 0; j < below.size(); ++j) {
      EXPECT_EQ(tree.parent[j], below[j].empty() ? -1 : *below[j].begin());
      EXPECT_EQ(at(tree.column_starts[j + 1] - tree.column_starts[j]), below[j].size());
    }
  }
}

TEST(FactorPattern, HasTheEntriesByColumnsAndByRowsInAnOrderOfElimination) {
  for (unsigned seed = 1; seed <= 30; ++seed) {
    const Rows a = random_rows(static_cast<Index>(seed * 3), 2.0 / (seed * 3.0), seed);
    const std::vector<std::set<Index>> below = eliminate(a.view());
    const EliminationTree tree = elimination_tree(a.view());
    const FactorPattern pattern = factor_pattern(a.view(), tree);
    for (std::size_t j = 0; j < below.size(); ++j) {
      const std::vector<Index> rows(pattern.rows.begin() + tree.column_starts[j],
                                    pattern.rows.begin() + tree.column_starts[j + 1]);
      EXPECT_EQ(rows, std::vector<Index>(below[j].begin(), below[j].end()));
    }
    for (Index k = 0; k < tree.dimension(); ++k) {
      std::set<Index> seen;
      for (Index r = pattern.row_starts[at(k)]; r < pattern.row_starts[at(k) + 1]; ++r) {
        const Index i = pattern.columns[at(r)];
        EXPECT_TRUE(below[at(i)].contains(k));
        // None of those before needs what this one changes.
        for (const Index row : below[at(i)]) EXPECT_FALSE(seen.contains(row));
        EXPECT_TRUE(seen.insert(i).second);
      }
    }
    EXPECT_EQ(pattern.columns.size(), pattern.rows.size());
  }
}

TEST(Postorder, HasChildrenBeforeParentsWithoutGaps) {
  const Rows a = random_rows(60, 0.03, 1);
  const EliminationTree tree = elimination_tree(a.view());
  const std::vector<Index> post = postorder(tree.parent);
  std::vector<Index> place(post.size(), -1), size(post.size(), 1), first(post.size());
  for (std::size_t k = 0; k < post.size(); ++k) place[at(post[k])] = static_cast<Index>(k);
  for (std::size_t k = 0; k < post.size(); ++k) {
    const std::size_t j = at(post[k]);
    ASSERT_GE(place[j], 0);
    if (size[j] == 1) first[j] = place[j];
    EXPECT_EQ(first[j] + size[j] - 1, place[j]);
    if (tree.parent[j] < 0) continue;
    const std::size_t up = at(tree.parent[j]);
    EXPECT_GT(place[up], place[j]);
    first[up] = size[up] == 1 ? first[j] : std::min(first[up], first[j]);
    size[up] += size[j];
  }
}

TEST(EliminationTree, OfNothingIsEmpty) {
  const Rows none;
  const EliminationTree tree = elimination_tree(none.view());
  EXPECT_EQ(tree.entries(), 0);
  const FactorPattern pattern = factor_pattern(none.view(), tree);
  EXPECT_EQ(pattern.row_starts, std::vector<Index>{0});
  EXPECT_EQ(pattern.rows.size(), 0u);
  EXPECT_TRUE(postorder(tree.parent).empty());
}

}  // namespace
}  // namespace ipminmax
