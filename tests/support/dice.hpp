#pragma once

#include <cstdint>
#include <cstdlib>
#include <initializer_list>
#include <random>

namespace ipminmax::testing {

/// Random numbers that are equal on every platform.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : generator_(seed) {}
  [[nodiscard]] double uniform() { return static_cast<double>(generator_() >> 11) * 0x1p-53; }
  [[nodiscard]] double between(double low, double high) { return low + (high - low) * uniform(); }
  [[nodiscard]] int below(int n) { return static_cast<int>(uniform() * n); }
  [[nodiscard]] bool chance(double p) { return uniform() < p; }
  template <class T>
  [[nodiscard]] T one_of(std::initializer_list<T> values) {
    return *(values.begin() + below(static_cast<int>(values.size())));
  }

 private:
  std::mt19937_64 generator_;
};

/// A number given by the environment, for tests that repeat or go on by hand.
[[nodiscard]] inline std::uint64_t number_from(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

}  // namespace ipminmax::testing
