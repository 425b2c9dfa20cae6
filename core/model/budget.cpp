#include "core/model/budget.hpp"

#include <unistd.h>

#include <algorithm>
#include <new>
#include <utility>

#include "core/model/structure_check.hpp"

namespace ipminmax {
namespace {

/// Whether watch.cpu() is more than so many seconds. That clock takes as long as some
/// factorizations of a tiny system: it is read once the wall clock on all processors allows for so
/// many.
bool cpu_exceeds(const Stopwatch& watch, double seconds) noexcept {
  static const double processors = static_cast<double>(std::max(1L, sysconf(_SC_NPROCESSORS_CONF)));
  constexpr double kTick = 0.1;  // by which the two clocks may differ
  return processors * (watch.wall() + kTick) > seconds && watch.cpu() > seconds;
}

}  // namespace

Budget::Budget(const SolverOptions& options, MultistartObserver listener)
    : max_cpu_(options.max_cpu_time),
      max_wall_(options.max_wall_time),
      allowed_(options.minmax_max_factorizations),
      listener_(std::move(listener)) {}

void Budget::stop(Status why) noexcept {
  int none = -1;
  stopped_.compare_exchange_strong(none, static_cast<int>(why));
}

void Budget::stop_at_exception() noexcept {
  try {
    throw;
  } catch (const std::bad_alloc&) {
    stop(Status::OutOfMemory);
  } catch (...) {
    stop(Status::UserStop);
  }
}

std::optional<Status> Budget::interrupted() noexcept {
  // Only the clocks with a limit are read.
  if (stopped_ < 0 && max_cpu_ < kUnbounded && cpu_exceeds(stopwatch_, max_cpu_))
    stop(Status::MaxCpuTime);
  if (stopped_ < 0 && max_wall_ < kUnbounded && stopwatch_.wall() > max_wall_) {
    stop(Status::MaxWallTime);
  }
  const int why = stopped_;
  return why < 0 ? std::nullopt : std::optional(static_cast<Status>(why));
}

std::optional<Status> Budget::used_up() noexcept {
  if (const auto why = interrupted()) return why;
  // With no more than a solve keeps for its test it makes no step.
  if (allowed_ > 0 && allowed_ - spent_ <= kKeptForTest) stop(Status::MaxIterations);
  return interrupted();
}

std::optional<Index> Budget::factorizations_left() const {
  if (allowed_ <= 0) return std::nullopt;
  return std::max<Index>(0, allowed_ - spent_);
}

void Budget::end_after(Index start) noexcept {
  Index last = last_start_;
  while (start < last && !last_start_.compare_exchange_weak(last, start)) {
  }
}

bool Budget::tell(Index start, const IterationInfo& info) {
  const auto ended = [&] { return stopped_ >= 0 || start > last_start_; };
  if (!listener_.on_iteration) return !ended();
  const std::lock_guard lock(listening_);
  if (ended()) return false;
  try {
    if (listener_.on_iteration(start, info)) return true;
  } catch (...) {
    stop_at_exception();
    throw;
  }
  stop(Status::UserStop);
  return false;
}

void Budget::tell(Index start, const Result& result) {
  if (!listener_.on_result) return;
  const std::lock_guard lock(listening_);
  listener_.on_result(start, result);
}

void Budget::say(Index start, std::string_view text) {
  if (!listener_.message) return;
  const std::lock_guard lock(listening_);
  listener_.message(start, text);
}

SolveObserver Budget::observer_of(Index start, bool among_others) {
  SolveObserver observer;
  // Two words each: no std::function allocates for them.
  if (listener_.on_iteration || among_others) {
    observer.on_iteration = [this, start](const IterationInfo& info) { return tell(start, info); };
  }
  if (listener_.message) {
    observer.message = [this, start](std::string_view text) { say(start, text); };
  }
  return observer;
}

}  // namespace ipminmax
