#pragma once

#include <chrono>
#include <ctime>

#include "linalg/uncopied.hpp"

namespace ipminmax {

/// Adds the wall time of its life to a total; null: reads no clock.
class ScopedTimer : Uncopied {
 public:
  explicit ScopedTimer(double& total) : ScopedTimer(&total) {}
  explicit ScopedTimer(double* total) : total_(total) {
    if (total_ != nullptr) start_ = Clock::now();
  }
  ~ScopedTimer() {
    if (total_ != nullptr) *total_ += std::chrono::duration<double>(Clock::now() - start_).count();
  }

 private:
  using Clock = std::chrono::steady_clock;
  double* total_;
  Clock::time_point start_;
};

/// Wall and CPU seconds since construction.
class Stopwatch {
 public:
  [[nodiscard]] double wall() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - wall_start_).count();
  }
  [[nodiscard]] double cpu() const {
    return static_cast<double>(std::clock() - cpu_start_) / CLOCKS_PER_SEC;
  }

 private:
  std::chrono::steady_clock::time_point wall_start_ = std::chrono::steady_clock::now();
  std::clock_t cpu_start_ = std::clock();
};

}  // namespace ipminmax
