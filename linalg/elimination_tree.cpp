#include "linalg/elimination_tree.hpp"

#include <cstdint>
#include <limits>
#include <new>
#include <numeric>

namespace ipminmax {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

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

}  // namespace ipminmax
