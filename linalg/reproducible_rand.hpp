#pragma once

#include <array>
#include <cstdlib>

#include "linalg/uncopied.hpp"

namespace ipminmax {

/// Lends METIS and PORD a freshly seeded rand(), so that orderings are reproducible, and gives the
/// caller's generator back. To be used under a LibraryLock.
class ReproducibleRand : Uncopied {
 public:
  ReproducibleRand() : previous_(initstate(kSeed, state_.data(), state_.size())) {}
  ~ReproducibleRand() { setstate(previous_); }

 private:
  static constexpr unsigned kSeed = 1;
  std::array<char, 128> state_{};
  char* previous_;
};

}  // namespace ipminmax
