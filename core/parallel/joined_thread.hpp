#pragma once

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

}  // namespace ipminmax
