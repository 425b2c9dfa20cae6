#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <set>

#include "linalg/inertia.hpp"

namespace ipminmax {

/// Numbers of starts to be made, handed out in ascending order to any number of threads.
class StartQueue {
 public:
  void put(Index first, Index last) {
    const std::lock_guard lock(mutex_);
    for (Index start = first; start <= last; ++start) waiting_.insert(start);
    changed_.notify_all();
  }
  /// Nothing is handed out any more.
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_all();
  }
  /// Waits for one; none: closed.
  [[nodiscard]] std::optional<Index> take() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return closed_ || !waiting_.empty(); });
    return first();
  }
  [[nodiscard]] std::optional<Index> take_if_any() {
    const std::lock_guard lock(mutex_);
    return first();
  }

 private:
  std::optional<Index> first() {
    if (closed_ || waiting_.empty()) return std::nullopt;
    return waiting_.extract(waiting_.begin()).value();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::set<Index> waiting_;
  bool closed_ = false;
};

}  // namespace ipminmax
