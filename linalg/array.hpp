#pragma once

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

}  // namespace ipminmax
