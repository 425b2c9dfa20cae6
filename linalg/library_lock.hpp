#pragma once

#include <pthread.h>

#include <array>
#include <mutex>
#include <new>

#include "linalg/blas_threads.hpp"
#include "linalg/uncopied.hpp"

namespace ipminmax {

/// Held around every call of MUMPS and METIS: MUMPS is not thread-safe, and both draw from rand().
/// A thread may hold it several times: Ipopt's whole solve is such a call, and its model may solve.
/// A fork waits for it, so that the child finds it as free as its own thread left it.
class LibraryLock : Uncopied {
 public:
  LibraryLock() {
    mutex().lock();
    ++depth();
  }
  ~LibraryLock() {
    --depth();
    mutex().unlock();
  }
  /// Whether this thread holds it: threads that it waits for would wait for it.
  [[nodiscard]] static bool is_held() { return depth() > 0; }

 private:
  using Mutex = std::recursive_mutex;

  static Mutex& mutex() {
    static Mutex& process_wide = []() -> Mutex& {
      hold_blas_threads_over_forks();  // before ours: its lock is taken inside this one
      pthread_atfork([] { LibraryLock::mutex().lock(); }, [] { LibraryLock::mutex().unlock(); },
                     after_fork);
      return *new (storage()) Mutex;
    }();
    return process_wide;
  }
  /// Made when the library is loaded: a fork while another thread is inside the first call would
  /// leave the child with a mutex that is for ever about to be made.
  inline static const bool made_ = (static_cast<void>(mutex()), true);
  static void* storage() {
    alignas(Mutex) static std::array<unsigned char, sizeof(Mutex)> bytes;
    return bytes.data();
  }
  /// How often this thread holds it.
  static int& depth() {
    static thread_local int times = 0;
    return times;
  }
  /// In the child. The thread has a new id there, under which it cannot unlock the parent's mutex.
  static void after_fork() {
    auto* fresh = new (storage()) Mutex;
    for (int i = 0; i < depth(); ++i) fresh->lock();
  }
};

}  // namespace ipminmax
