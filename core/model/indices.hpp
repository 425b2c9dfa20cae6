#pragma once

#include <cstddef>
#include <numeric>
#include <vector>

#include "linalg/inertia.hpp"

// What loops over positions run over.
namespace ipminmax {

/// The numbers first, first + 1, ..., last - 1.
template <class Number>
struct Numbers {
  struct Iterator {
    Number i;
    Number operator*() const { return i; }
    Iterator& operator++() {
      ++i;
      return *this;
    }
    bool operator==(const Iterator&) const = default;
  };
  Number first, last;
  [[nodiscard]] Iterator begin() const { return {first}; }
  [[nodiscard]] Iterator end() const { return {last}; }
};

/// The positions in an array.
template <class Array>
[[nodiscard]] Numbers<std::size_t> indices(const Array& array) {
  return {0, array.size()};
}

/// 0, 1, ..., count - 1.
[[nodiscard]] inline std::vector<Index> numbers_below(std::size_t count) {
  std::vector<Index> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 0);
  return numbers;
}

}  // namespace ipminmax
