// Panels of L: L D L' is the matrix, whatever its tree looks like.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <span>
#include <vector>

#include "linalg/numbers.hpp"
#include "linalg/supernodal_factor.hpp"

namespace ipminmax {
namespace {

/// A matrix, dense.
using Dense = std::vector<std::vector<double>>;

struct Entries {
  Array<double> values;  // those of the rows, then the diagonal
  Array<Index> places, diagonal_places;
};

/// The rows, relabelled so that a postorder of the elimination tree eliminates them.
Lists in_postorder(const Lists& a) {
  const Array<Index> post = postorder(elimination_tree(a).parent);
  Array<Index> place(post.size());
  for (std::size_t k = 0; k < post.size(); ++k) place[post[k]] = static_cast<Index>(k);
  return collect(a.size(), [&](auto&& add) {
    for (Index i = 0; i < a.size(); ++i) {
      for (const Index j : a[i]) {
        const auto [column, row] = std::minmax(place[i], place[j]);
        add(row, column);
      }
    }
  });
}

Entries random_entries(const Lists& a, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  Entries entries;
  for (std::size_t p = 0; p < a.items.size(); ++p) {
    entries.places.push_back(static_cast<Index>(p));
    entries.values.push_back(uniform(random));
  }
  for (Index i = 0; i < a.size(); ++i) {
    entries.diagonal_places.push_back(static_cast<Index>(entries.values.size()));
    entries.values.push_back((i % 3 == 0 ? -1.0 : 1.0) * (a.size() + uniform(random)));
  }
  return entries;
}

/// A + diag(weights) - L D L', over the size of A; lower triangles.
double error_of(const Lists& a, const Entries& entries, std::span<const double> weights,
                const SupernodalFactor& factor) {
  const std::size_t n = at(a.size());
  Dense error(n, std::vector<double>(n, 0.0)), l = error;
  double size = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const Index k = static_cast<Index>(i);
    for (Index p = a.starts[k]; p < a.starts[k + 1]; ++p) {
      error[i][at(a.items[p])] += entries.values[at(entries.places[p])];
    }
    error[i][i] = entries.values[at(entries.diagonal_places[k])] + weights[i];
    size = std::max(size, std::abs(error[i][i]));
    l[i][i] = 1.0;
  }
  for (std::size_t j = 0; j < n; ++j) {
    factor.for_each_of_column(j, [&](std::size_t i, double value) {
      EXPECT_GT(i, j);
      l[i][j] += value;
    });
  }
  double largest = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      for (std::size_t k = 0; k <= j; ++k) error[i][j] -= l[i][k] * factor.pivots()[k] * l[j][k];
      largest = std::max(largest, std::abs(error[i][j]));
    }
  }
  return size > 0.0 ? largest / size : 0.0;
}

/// Rows i with columns j < i where is_entry(i, j).
template <class IsEntry>
Lists rows_with(Index n, IsEntry&& is_entry) {
  return collect(n, [&](auto&& add) {
    for (Index i = 0; i < n; ++i) {
      for (Index j = 0; j < i; ++j) {
        if (is_entry(i, j)) add(i, j);
      }
    }
  });
}

std::vector<Lists> patterns() {
  std::vector<Lists> all{
      rows_with(0, [](Index, Index) { return true; }),
      rows_with(1, [](Index, Index) { return true; }),
      rows_with(7, [](Index, Index) { return false; }),                  // a forest of leaves
      rows_with(41, [](Index, Index) { return true; }),                  // one panel
      rows_with(60, [](Index i, Index j) { return i - j <= 3; }),        // a chain
      rows_with(60, [](Index i, Index) { return i == 59; }),             // an arrow
      rows_with(66, [](Index i, Index j) { return i / 11 == j / 11; }),  // trees side by side
      rows_with(81, [](Index i, Index j) { return i - j == 9 || (i - j == 1 && i % 9 > 0); }),
  };
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0.0, 1.0);
  for (const Index n : {5, 23, 60, 90}) {
    for (const double entries_a_row : {0.7, 1.5, 4.0}) {
      std::vector<bool> drawn(at(n * n));
      for (auto&& entry : drawn) entry = uniform(random) * n < entries_a_row;
      all.push_back(rows_with(n, [&](Index i, Index j) { return drawn[at(i * n + j)]; }));
    }
  }
  return all;
}

/// check(rows, entries, factor, seed) for random entries of each pattern.
template <class Check>
void for_each_pattern(Check&& check) {
  unsigned seed = 0;
  for (const Lists& pattern : patterns()) {
    const Lists a = in_postorder(pattern);
    const Entries entries = random_entries(a, ++seed);
    SupernodalFactor factor(a, entries.places, entries.diagonal_places, elimination_tree(a), 1);
    check(a, entries, factor, seed);
  }
}

TEST(SupernodalFactor, TimesItsTransposeIsTheMatrix) {
  for_each_pattern([](const Lists& a, const Entries& entries, auto& factor, unsigned seed) {
    const std::size_t n = at(a.size());
    const std::vector<double> weights(n, 1.0), gamma_weights(n, 2.0);
    for (int pass = 0; pass < 2; ++pass) {
      ASSERT_TRUE(factor.factorize(entries.values, gamma_weights, 0.5));
      EXPECT_LE(error_of(a, entries, weights, factor), 1e-15 * static_cast<double>(n + 1)) << seed;
    }
  });
}

TEST(SupernodalFactor, SolvesWithAllItsEntries) {
  for_each_pattern([](const Lists& a, const Entries& entries, auto& factor, unsigned seed) {
    const std::size_t n = at(a.size());
    ASSERT_TRUE(factor.factorize(entries.values, std::vector<double>(n, 0.0), 0.0));
    std::vector<double> x(n), b(n, 0.0);
    for (std::size_t i = 0; i < n; ++i) x[i] = std::cos(static_cast<double>(i));
    for (std::size_t i = 0; i < n; ++i) {
      const Index k = static_cast<Index>(i);
      b[i] += entries.values[at(entries.diagonal_places[k])] * x[i];
      for (Index p = a.starts[k]; p < a.starts[k + 1]; ++p) {
        const std::size_t j = at(a.items[p]);
        b[i] += entries.values[at(p)] * x[j];
        b[j] += entries.values[at(p)] * x[i];
      }
    }
    factor.solve(b);
    for (std::size_t i = 0; i < n; ++i) EXPECT_NEAR(b[i], x[i], 1e-12) << seed;
  });
}

TEST(SupernodalFactor, SaysThatAPivotIsNoNumberOrZeroAndGoesOn) {
  const Lists a = rows_with(41, [](Index i, Index j) { return i - j <= 6; });
  const Entries entries = random_entries(a, 5);
  SupernodalFactor factor(a, entries.places, entries.diagonal_places, elimination_tree(a), 1);
  const std::vector<double> weights(41, 0.0);
  for (const double wrong : {std::numeric_limits<double>::quiet_NaN(), kInfinity}) {
    for (const Index row : {0, 20, 40}) {
      Array<double> values = entries.values;
      values[entries.diagonal_places[row]] = wrong;
      EXPECT_FALSE(factor.factorize(values, weights, 0.0));
    }
  }
  EXPECT_FALSE(factor.factorize(std::vector<double>(entries.values.size(), 0.0), weights, 0.0));
  ASSERT_TRUE(factor.factorize(entries.values, weights, 0.0));
  EXPECT_LE(error_of(a, entries, weights, factor), 1e-14);
}

}  // namespace
}  // namespace ipminmax
