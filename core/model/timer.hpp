#pragma once

#include <algorithm>
#include <chrono>
#include <ctime>
#include <limits>
#include <optional>

#include "core/options.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// Adds the wall time of its life to a total.
class ScopedTimer {
 public:
  explicit ScopedTimer(double& total) : total_(total), start_(Clock::now()) {}
  ~ScopedTimer() { total_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
  ScopedTimer(const ScopedTimer&) = delete;
  ScopedTimer& operator=(const ScopedTimer&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  double& total_;
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

/// The time limits of a solve, which begins with its construction. Long loops of factorizations ask
/// expired() in every round and give up; the solve then ends with exceeded().
class TimeLimit {
 public:
  explicit TimeLimit(const SolverOptions& options)
      : max_cpu_(options.max_cpu_time), max_wall_(options.max_wall_time) {}

  /// Whether a limit is exceeded; stays true.
  [[nodiscard]] bool expired() {
    // Clocks cost more than a factorization of a tiny system: only those with a limit are read.
    constexpr double kNone = 1e19;
    if (!exceeded_ && max_cpu_ < kNone && stopwatch_.cpu() > max_cpu_) {
      exceeded_ = Status::MaxCpuTime;
    }
    if (!exceeded_ && max_wall_ < kNone && stopwatch_.wall() > max_wall_) {
      exceeded_ = Status::MaxWallTime;
    }
    return exceeded_.has_value();
  }
  /// Another limit of the solve is exceeded: as if it were one of these.
  void exceed(Status status) {
    if (!exceeded_) exceeded_ = status;
  }
  /// The status that goes with the limit that expired() has seen exceeded, if any.
  [[nodiscard]] std::optional<Status> exceeded() const { return exceeded_; }

  /// Leaves a solve inside this one what remains of its time.
  void pass_on(SolverOptions& options) const {
    constexpr double kLeast = std::numeric_limits<double>::min();  // limits are positive
    options.max_cpu_time = std::max(max_cpu_ - stopwatch_.cpu(), kLeast);
    options.max_wall_time = std::max(max_wall_ - stopwatch_.wall(), kLeast);
  }
  [[nodiscard]] const Stopwatch& stopwatch() const { return stopwatch_; }

 private:
  Stopwatch stopwatch_;
  double max_cpu_, max_wall_;
  std::optional<Status> exceeded_;
};

}  // namespace ipminmax
