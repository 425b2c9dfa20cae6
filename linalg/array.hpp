#pragma once

#include <algorithm>
#include <numeric>
#include <span>
#include <vector>

#include "linalg/numbers.hpp"

namespace ipminmax {

/// A vector whose places are numbered by an Index.
template <class T>
struct Array : std::vector<T> {
  using std::vector<T>::vector;
  using std::vector<T>::operator[];
  explicit Array(Index size, const T& value = {}) : std::vector<T>(at(size), value) {}
  [[nodiscard]] decltype(auto) operator[](Index i) { return (*this)[at(i)]; }
  [[nodiscard]] decltype(auto) operator[](Index i) const { return (*this)[at(i)]; }
};

/// Sorts, and leaves each value once.
template <class Values>
void sort_each_once(Values& values) {
  std::ranges::sort(values);
  values.erase(std::unique(values.begin(), values.end()), values.end());
}

/// Compressed lists of indices: list k is items[starts[k]], ..., items[starts[k + 1] - 1].
struct Lists {
  Array<Index> starts{0};
  Array<Index> items;

  [[nodiscard]] Index size() const { return static_cast<Index>(starts.size()) - 1; }
  [[nodiscard]] std::span<const Index> operator[](Index k) const {
    return std::span(items).subspan(at(starts[k]), at(starts[k + 1] - starts[k]));
  }
};

/// Lists of each pair (k, item) that for_each_pair(visit) hands to visit(k, item), in two passes.
template <class ForEachPair>
[[nodiscard]] Lists collect(Index count, ForEachPair&& for_each_pair) {
  Lists lists;
  lists.starts.assign(at(count) + 1, 0);
  for_each_pair([&](Index k, Index) { ++lists.starts[k + 1]; });
  std::partial_sum(lists.starts.begin(), lists.starts.end(), lists.starts.begin());
  lists.items.resize(at(lists.starts.back()));
  Array<Index> next(lists.starts.begin(), lists.starts.end() - 1);
  for_each_pair([&](Index k, Index item) { lists.items[next[k]++] = item; });
  return lists;
}

}  // namespace ipminmax
