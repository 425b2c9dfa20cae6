#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <ctime>
#include <limits>
#include <mutex>
#include <optional>
#include <string_view>

#include "core/iteration.hpp"
#include "core/options.hpp"
#include "core/result.hpp"
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

/// Factorizations of K and K_yy that are kept for the second-order test where these are limited.
inline constexpr Index kKeptForTest = 2;

/// What all solves behind one call may use together: time, factorizations, memory, until the
/// listener says stop. Made where the call comes in and passed down; nothing below makes another.
/// For any number of threads.
class Budget : Uncopied {
 public:
  explicit Budget(const SolverOptions& options, MultistartObserver listener = {});

  /// Nothing more is begun, what runs ends. The first reason stays.
  void stop(Status why) noexcept;
  /// While an exception is handled that passes through: what other threads run ends, too.
  void stop_at_exception() noexcept;
  /// A stop, or a limit of time that is exceeded; stays.
  [[nodiscard]] std::optional<Status> interrupted() noexcept;
  /// The same, or no factorization is left for another solve (MaxIterations).
  [[nodiscard]] std::optional<Status> used_up() noexcept;

  /// Factorizations that are left; empty: any number.
  [[nodiscard]] std::optional<Index> factorizations_left() const;
  void spend(Index factorizations) { spent_ += factorizations; }

  /// Starts after this one are of no more use and end.
  void end_after(Index start) noexcept;

  /// Tells the listener and no one after he has said stop. False: stop.
  [[nodiscard]] bool tell(Index start, const IterationInfo& info);
  void tell(Index start, const Result& result);
  void say(Index start, std::string_view text);
  /// Tells in the name of a start, as long as this lives. among_others: end_after may end it.
  [[nodiscard]] SolveObserver observer_of(Index start, bool among_others = false);

  [[nodiscard]] const Stopwatch& stopwatch() const { return stopwatch_; }
  /// Of a solve that begins: the first one's is the budget's, for the CPU clock takes long to read.
  [[nodiscard]] Stopwatch stopwatch_of_solve() {
    return begun_.exchange(true) ? Stopwatch() : stopwatch_;
  }

 private:
  Stopwatch stopwatch_;
  std::atomic<bool> begun_ = false;
  double max_cpu_, max_wall_;
  Index allowed_;
  std::atomic<Index> spent_ = 0;
  std::atomic<int> stopped_ = -1;  ///< a Status, -1: none
  std::atomic<Index> last_start_ = std::numeric_limits<Index>::max();
  MultistartObserver listener_;
  std::mutex listening_;
};

/// What one solve may spend, and has: the budget as it sees it, and limits of its own. Long loops
/// of factorizations ask expired() in every round and give up; the solve then ends with exceeded().
class SolveLimit {
 public:
  explicit SolveLimit(Budget& budget, Index iterations = 0)
      : budget_(budget), stopwatch_(budget.stopwatch_of_solve()), iterations_(iterations) {}

  /// Whether a limit is exceeded; stays true.
  [[nodiscard]] bool expired() {
    if (!exceeded_) exceeded_ = budget_.interrupted();
    return exceeded_.has_value();
  }
  /// Another limit of the solve is exceeded: as if it were one of these.
  void exceed(Status status) {
    if (!exceeded_) exceeded_ = status;
  }
  /// The status that goes with the limit that expired() has seen exceeded, if any.
  [[nodiscard]] std::optional<Status> exceeded() const { return exceeded_; }
  /// Of this solve.
  [[nodiscard]] const Stopwatch& stopwatch() const { return stopwatch_; }

  Index iteration = 0;    ///< done, of all searches
  Index restoration = 0;  ///< iterations done, of restorations
  Index tests = 0;        ///< factorizations of K and K_yy done by second-order tests
  bool testing = false;   ///< a second-order test goes on
  Index factorizations = std::numeric_limits<Index>::max();  ///< allowed, restorations included

  /// The same at present: steps keep some for the test.
  [[nodiscard]] Index factorizations_now() const {
    const bool limited = factorizations < std::numeric_limits<Index>::max();
    return testing || !limited ? factorizations : std::max<Index>(0, factorizations - kKeptForTest);
  }
  [[nodiscard]] Index iterations_left() const { return iterations_ - iteration - restoration; }
  /// For a restoration: the step back counts, too.
  [[nodiscard]] Index left_to_restore() const { return std::max<Index>(0, iterations_left() - 1); }

 private:
  Budget& budget_;
  Stopwatch stopwatch_;
  Index iterations_;  ///< allowed, restorations included
  std::optional<Status> exceeded_;
};

}  // namespace ipminmax
