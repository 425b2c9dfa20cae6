#include "linalg/elimination_tree.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <new>
#include <numeric>
#include <utility>

#include "linalg/numbers.hpp"

namespace ipminmax {

namespace {

/// Liu's tree, with path compression.
Array<Index> parents(const Lists& a) {
  Array<Index> parent(a.size(), -1), ancestor(a.size(), -1);
  for (Index k = 0; k < a.size(); ++k) {
    for (Index i : a[k]) {
      while (i != -1 && i < k) {
        const Index next = std::exchange(ancestor[i], k);
        if (next == -1) parent[i] = k;
        i = next;
      }
    }
  }
  return parent;
}

}  // namespace

/// Without forming L: each entry of A adds one to the column where its row subtree starts and takes
/// one away where two of its branches meet (Gilbert, Ng and Peyton 1994).
Array<Index> column_lengths(const Lists& a, Array<Index>& parent) {
  parent = parents(a);
  const Lists after = collect(a.size(), [&](auto&& add) {
    for (Index k = 0; k < a.size(); ++k) {
      for (const Index i : a[k]) {
        if (i < k) add(i, k);
      }
    }
  });
  const std::size_t n = parent.size();
  const Array<Index> post = postorder(parent);
  Array<Index> first(n, -1);  // postorder number of the first descendant
  Array<Index> count(n, 0);
  for (std::size_t k = 0; k < n; ++k) {
    Index j = post[k];
    count[j] = first[j] == -1 ? 1 : 0;  // a leaf of the tree
    for (; j != -1 && first[j] == -1; j = parent[j]) {
      first[j] = static_cast<Index>(k);
    }
  }

  Array<Index> max_first(n, -1);      // of row i: largest first[] of its leaves so far
  Array<Index> previous_leaf(n, -1);  // of row i
  Array<Index> ancestor(n);           // disjoint sets: root of the part already visited
  std::iota(ancestor.begin(), ancestor.end(), 0);
  for (const Index j : post) {
    const Index up = parent[j];
    if (up != -1) --count[up];
    for (const Index i : after[j]) {
      if (first[j] <= max_first[i]) continue;  // j is no leaf of row subtree i
      max_first[i] = first[j];
      ++count[j];
      const Index leaf = previous_leaf[i];
      previous_leaf[i] = j;
      if (leaf == -1) continue;
      Index meet = leaf;
      while (meet != ancestor[meet]) meet = ancestor[meet];
      for (Index s = leaf; s != meet;) {
        const Index next = ancestor[s];
        ancestor[s] = meet;
        s = next;
      }
      --count[meet];
    }
    if (up != -1) ancestor[j] = up;
  }
  for (std::size_t j = 0; j < n; ++j) {  // parent[j] > j
    if (parent[j] != -1) count[parent[j]] += count[j];
  }
  for (Index& length : count) --length;  // the diagonal
  return count;
}

EliminationTree elimination_tree(const Lists& a) {
  EliminationTree tree;
  std::int64_t entries = 0;
  for (const Index length : column_lengths(a, tree.parent)) {
    entries += length;
    if (entries > std::numeric_limits<Index>::max()) throw std::bad_alloc();
    tree.column_starts.push_back(static_cast<Index>(entries));
  }
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

}  // namespace ipminmax
