#pragma once

#include <array>
#include <cstdlib>
#include <mutex>

namespace ipminmax {

/// Held around every call of MUMPS and METIS. Both keep process-wide state: MUMPS is not
/// thread-safe, and METIS and PORD draw from rand(). The lock lends them a freshly seeded
/// generator, so that orderings are reproducible, and gives the caller's generator back.
class LibraryLock {
 public:
  LibraryLock() : lock_(mutex()) { previous_ = initstate(kSeed, state_.data(), state_.size()); }
  ~LibraryLock() { setstate(previous_); }
  LibraryLock(const LibraryLock&) = delete;
  LibraryLock& operator=(const LibraryLock&) = delete;

 private:
  static constexpr unsigned kSeed = 1;
  static std::mutex& mutex() {
    static std::mutex process_wide;
    return process_wide;
  }

  std::lock_guard<std::mutex> lock_;
  std::array<char, 128> state_{};
  char* previous_ = nullptr;
};

}  // namespace ipminmax
