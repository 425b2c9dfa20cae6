#pragma once

#include <atomic>
#include <exception>
#include <thread>

namespace ipminmax {

/// A thread that is joined when it goes out of scope: std::jthread, which libc++ has from 20 on,
/// without its stop token.
struct JoinedThread : std::thread {
  using std::thread::thread;
  JoinedThread(JoinedThread&&) = default;
  ~JoinedThread() {
    if (joinable()) join();
  }
};

/// Calls work() in another thread, and meanwhile() in this one until that has ended. Returns the
/// exception of work; null: it has thrown none.
template <class Work, class Meanwhile>
[[nodiscard]] std::exception_ptr run_beside(const Work& work, const Meanwhile& meanwhile) {
  std::exception_ptr failure;
  std::atomic<bool> done = false;
  JoinedThread thread([&] {
    try {
      work();
    } catch (...) {
      failure = std::current_exception();
    }
    done = true;
  });
  while (!done) meanwhile();
  thread.join();
  return failure;
}

}  // namespace ipminmax
