#pragma once

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <random>
#include <set>
#include <vector>

#include "linalg/elimination_tree.hpp"

namespace ipminmax::test {

inline std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Rows of a lower triangle.
struct Rows {
  Array<Index> starts{0}, columns;
  [[nodiscard]] Lists view() const { return {starts, columns}; }
};

/// Entries left of the diagonal in random order, some rows with their diagonal.
inline Rows random_rows(Index dimension, double density, unsigned seed) {
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
inline std::vector<std::set<Index>> eliminate(const Lists& a) {
  std::vector<std::set<Index>> below(at(a.size()));
  for (Index k = 0; k < a.size(); ++k) {
    for (const Index i : a[k]) {
      if (i < k) below[at(i)].insert(k);
    }
  }
  for (auto& column : below) {
    if (column.empty()) continue;
    below[at(*column.begin())].insert(std::next(column.begin()), column.end());
  }
  return below;
}

}  // namespace ipminmax::test
