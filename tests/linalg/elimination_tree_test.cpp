// The elimination tree and the pattern of L, beside an elimination of the pattern row by row.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <vector>

#include "linalg/elimination_tree.hpp"

namespace ipminmax {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Rows of a lower triangle; what LowerRows points to.
struct Rows {
  std::vector<Index> starts{0}, columns;
  [[nodiscard]] LowerRows view() const { return {starts, columns}; }
};

/// Entries left of the diagonal in random order, some rows with their diagonal.
Rows random_rows(Index dimension, double density, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  Rows a;
  for (Index k = 0; k < dimension; ++k) {
    const auto first = static_cast<std::ptrdiff_t>(a.columns.size());
    for (Index j = 0; j < k; ++j) {
      if (uniform(random) < density) a.columns.push_back(j);
    }
    if (uniform(random) < 0.5) a.columns.push_back(k);
    std::shuffle(a.columns.begin() + first, a.columns.end(), random);
    a.starts.push_back(static_cast<Index>(a.columns.size()));
  }
  return a;
}

/// Rows of each column of L below the diagonal, by eliminating one column after the other.
std::vector<std::set<Index>> eliminate(const LowerRows& a) {
  std::vector<std::set<Index>> below(at(a.dimension()));
  for (Index k = 0; k < a.dimension(); ++k) {
    for (Index p = a.starts[at(k)]; p < a.starts[at(k) + 1]; ++p) {
      if (a.columns[at(p)] < k) below[at(a.columns[at(p)])].insert(k);
    }
  }
  for (auto& column : below) {
    if (column.empty()) continue;
    below[at(*column.begin())].insert(std::next(column.begin()), column.end());
  }
  return below;
}

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

TEST(EliminationTree, OfNothingIsEmpty) {
  const Rows none;
  const EliminationTree tree = elimination_tree(none.view());
  EXPECT_EQ(tree.entries(), 0);
  EXPECT_EQ(factor_pattern(none.view(), tree).row_starts, std::vector<Index>{0});
}

}  // namespace
}  // namespace ipminmax
