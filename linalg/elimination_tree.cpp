#include "linalg/elimination_tree.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <new>
#include <numeric>

#include "linalg/numbers.hpp"

namespace ipminmax {

EliminationTree elimination_tree(const Lists& a) {
  const Index n = a.size();
  EliminationTree tree;
  tree.parent.assign(at(n), -1);
  tree.column_starts.assign(at(n) + 1, 0);
  Array<Index> mark(n, -1);
  std::int64_t entries = 0;
  for (Index k = 0; k < n; ++k) {
    mark[k] = k;
    for (const Index column : a[k]) {
      for (Index i = column; mark[i] != k; i = tree.parent[i]) {
        if (tree.parent[i] < 0) tree.parent[i] = k;
        ++tree.column_starts[i + 1];
        ++entries;
        mark[i] = k;
      }
    }
    if (entries > std::numeric_limits<Index>::max()) throw std::bad_alloc();
  }
  std::partial_sum(tree.column_starts.begin(), tree.column_starts.end(),
                   tree.column_starts.begin());
  return tree;
}

FactorPattern factor_pattern(const Lists& a, const EliminationTree& tree) {
  const Index n = a.size();
  FactorPattern pattern;
  pattern.rows.resize(at(tree.entries()));
  pattern.columns.reserve(at(tree.entries()));
  pattern.row_starts.reserve(at(n) + 1);
  pattern.row_starts.push_back(0);
  Array<Index> next(tree.column_starts.begin(), tree.column_starts.end() - 1);
  Array<Index> mark(n, -1), stack(at(n));
  for (Index k = 0; k < n; ++k) {
    std::size_t first = stack.size();
    mark[k] = k;
    for (const Index column : a[k]) {
      std::size_t length = 0;  // a path towards the root, kept in front
      for (Index i = column; mark[i] != k; i = tree.parent[i]) {
        stack[length++] = i;
        mark[i] = k;
      }
      while (length > 0) stack[--first] = stack[--length];
    }
    for (std::size_t r = first; r < stack.size(); ++r) {
      pattern.columns.push_back(stack[r]);
      pattern.rows[next[stack[r]]++] = k;
    }
    pattern.row_starts.push_back(static_cast<Index>(pattern.columns.size()));
  }
  return pattern;
}

Array<Index> postorder(std::span<const Index> parent) {
  const Index n = static_cast<Index>(parent.size());
  Array<Index> first_child(parent.size(), -1);
  Array<Index> sibling(parent.size(), -1);
  for (Index j = n - 1; j >= 0; --j) {
    const Index p = parent[at(j)];
    if (p == -1) continue;
    sibling[j] = first_child[p];
    first_child[p] = j;
  }
  Array<Index> post;
  post.reserve(parent.size());
  Array<Index> stack;
  for (Index root = 0; root < n; ++root) {
    if (parent[at(root)] != -1) continue;
    stack.push_back(root);
    while (!stack.empty()) {
      const Index node = stack.back();
      const Index child = first_child[node];
      if (child == -1) {
        post.push_back(node);
        stack.pop_back();
      } else {
        first_child[node] = sibling[child];
        stack.push_back(child);
      }
    }
  }
  return post;
}

Array<Index> order_without_fill(const EliminationTree& tree, const FactorPattern& pattern,
                                Index last) {
  const Index n = tree.dimension();
  Array<Index> place(n, -1);
  Array<Index> weight(n, 0);             // neighbors that have their place
  Array<Index> first(n + 1, -1);         // of the rows of each weight without one,
  Array<Index> before(n), after(at(n));  // a list
  const auto link = [&](Index i) {
    Index& head = first[weight[i]];
    before[i] = -1;
    after[i] = head;
    if (head >= 0) before[head] = i;
    head = i;
  };
  const auto unlink = [&](Index i) {
    const Index b = before[i], a = after[i];
    (b >= 0 ? after[b] : first[weight[i]]) = a;
    if (a >= 0) before[a] = b;
  };
  for (Index i = n; i-- > 0;) {
    if (i != last) link(i);
  }
  if (n > 0) link(last);
  Index heaviest = 0;
  for (Index next = n; next-- > 0;) {
    while (first[heaviest] < 0) --heaviest;
    const Index k = first[heaviest];
    unlink(k);
    place[k] = next;
    const auto raise = [&](Index i) {
      if (place[i] >= 0) return;
      unlink(i);
      heaviest = std::max(heaviest, ++weight[i]);
      link(i);
    };
    for (Index p = tree.column_starts[k]; p < tree.column_starts[k + 1]; ++p) {
      raise(pattern.rows[p]);
    }
    for (Index r = pattern.row_starts[k]; r < pattern.row_starts[k + 1]; ++r) {
      raise(pattern.columns[r]);
    }
  }
  return place;
}

}  // namespace ipminmax
