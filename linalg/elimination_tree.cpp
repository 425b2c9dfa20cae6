#include "linalg/elimination_tree.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <new>
#include <numeric>

#include "linalg/numbers.hpp"

namespace ipminmax {

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

std::vector<Index> postorder(std::span<const Index> parent) {
  const Index n = static_cast<Index>(parent.size());
  std::vector<Index> first_child(parent.size(), -1);
  std::vector<Index> sibling(parent.size(), -1);
  for (Index j = n - 1; j >= 0; --j) {
    const Index p = parent[at(j)];
    if (p == -1) continue;
    sibling[at(j)] = first_child[at(p)];
    first_child[at(p)] = j;
  }
  std::vector<Index> post;
  post.reserve(parent.size());
  std::vector<Index> stack;
  for (Index root = 0; root < n; ++root) {
    if (parent[at(root)] != -1) continue;
    stack.push_back(root);
    while (!stack.empty()) {
      const Index node = stack.back();
      const Index child = first_child[at(node)];
      if (child == -1) {
        post.push_back(node);
        stack.pop_back();
      } else {
        first_child[at(node)] = sibling[at(child)];
        stack.push_back(child);
      }
    }
  }
  return post;
}

std::vector<Index> order_without_fill(const EliminationTree& tree, const FactorPattern& pattern,
                                      Index last) {
  const Index n = tree.dimension();
  std::vector<Index> place(at(n), -1);
  std::vector<Index> weight(at(n), 0);             // neighbors that have their place
  std::vector<Index> first(at(n) + 1, -1);         // of the rows of each weight without one,
  std::vector<Index> before(at(n)), after(at(n));  // a list
  const auto link = [&](Index i) {
    Index& head = first[at(weight[at(i)])];
    before[at(i)] = -1;
    after[at(i)] = head;
    if (head >= 0) before[at(head)] = i;
    head = i;
  };
  const auto unlink = [&](Index i) {
    const Index b = before[at(i)], a = after[at(i)];
    (b >= 0 ? after[at(b)] : first[at(weight[at(i)])]) = a;
    if (a >= 0) before[at(a)] = b;
  };
  for (Index i = n; i-- > 0;) {
    if (i != last) link(i);
  }
  if (n > 0) link(last);
  Index heaviest = 0;
  for (Index next = n; next-- > 0;) {
    while (first[at(heaviest)] < 0) --heaviest;
    const Index k = first[at(heaviest)];
    unlink(k);
    place[at(k)] = next;
    const auto raise = [&](Index i) {
      if (place[at(i)] >= 0) return;
      unlink(i);
      heaviest = std::max(heaviest, ++weight[at(i)]);
      link(i);
    };
    for (Index p = tree.column_starts[at(k)]; p < tree.column_starts[at(k) + 1]; ++p) {
      raise(pattern.rows[at(p)]);
    }
    for (Index r = pattern.row_starts[at(k)]; r < pattern.row_starts[at(k) + 1]; ++r) {
      raise(pattern.columns[at(r)]);
    }
  }
  return place;
}

}  // namespace ipminmax
