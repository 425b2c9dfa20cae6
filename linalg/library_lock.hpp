#pragma once

#include <array>
#include <cstdlib>
#include <mutex>

namespace ipminmax {

/// Held around every call of MUMPS and METIS: MUMPS is not thread-safe, and both draw from rand().
/// A thread may hold it several times: Ipopt's whole solve is such a call, and its model may solve.
class LibraryLock {
 public:
  LibraryLock() : lock_(mutex()) {}

 private:
  static std::recursive_mutex& mutex() {
    static std::recursive_mutex process_wide;
    return process_wide;
  }
  std::lock_guard<std::recursive_mutex> lock_;
};

/// Lends METIS and PORD a freshly seeded rand(), so that orderings are reproducible, and gives the
/// caller's generator back. To be used under a LibraryLock.
class ReproducibleRand {
 public:
  ReproducibleRand() : previous_(initstate(kSeed, state_.data(), state_.size())) {}
  ~ReproducibleRand() { setstate(previous_); }
  ReproducibleRand(const ReproducibleRand&) = delete;
  ReproducibleRand& operator=(const ReproducibleRand&) = delete;

 private:
  static constexpr unsigned kSeed = 1;
  std::array<char, 128> state_{};
  char* previous_;
};

}  // namespace ipminmax
