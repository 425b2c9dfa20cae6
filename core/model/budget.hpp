#pragma once

#include <atomic>
#include <limits>
#include <mutex>
#include <optional>
#include <string_view>

#include "core/iteration.hpp"
#include "core/model/timer.hpp"
#include "core/options.hpp"
#include "core/result.hpp"
#include "linalg/uncopied.hpp"

namespace ipminmax {

/// What all solves behind one call may use together: time, factorizations, the patience of the
/// listener, memory. Made where the call comes in and passed down; nothing below makes another.
/// For any number of threads.
class Budget : Uncopied {
 public:
  explicit Budget(const SolverOptions& options, MultistartObserver listener = {});

  /// Nothing more is begun, what runs ends. The first reason stays.
  void stop(Status why) noexcept;
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

/// The budget as one solve sees it, which a limit of its own may end, too. Long loops of
/// factorizations ask expired() in every round and give up; the solve then ends with exceeded().
class TimeLimit {
 public:
  explicit TimeLimit(Budget& budget) : budget_(budget), stopwatch_(budget.stopwatch_of_solve()) {}

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

 private:
  Budget& budget_;
  Stopwatch stopwatch_;
  std::optional<Status> exceeded_;
};

}  // namespace ipminmax
