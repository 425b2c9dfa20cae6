#pragma once

#include <algorithm>
#include <condition_variable>
#include <map>
#include <mutex>
#include <optional>

#include "linalg/inertia.hpp"

namespace ipminmax {

/// Numbers of starts to be made, handed out in ascending order to any number of threads.
class StartQueue {
 public:
  void put(Index first, Index last) {
    const std::lock_guard lock(mutex_);
    if (last < first) return;
    // Ranges that overlap become one.
    for (auto range = waiting_.begin(); range != waiting_.end();) {
      if (range->second < first || range->first > last) {
        ++range;
        continue;
      }
      first = std::min(first, range->first);
      last = std::max(last, range->second);
      range = waiting_.erase(range);
    }
    waiting_.emplace(first, last);
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
    const auto [start, last] = *waiting_.begin();
    waiting_.erase(waiting_.begin());
    if (start < last) waiting_.emplace(start + 1, last);
    return start;
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<Index, Index>
      waiting_;  ///< last of each range by its first, however many starts there are
  bool closed_ = false;
};

}  // namespace ipminmax
