#include <dlfcn.h>
#include <pthread.h>

#include <chrono>
#include <mutex>
#include <thread>

#include "linalg/blas_threads.hpp"

namespace ipminmax {
namespace {

std::mutex blas_entry;  // held over a fork: no call of BLAS begins
std::mutex blas_mutex;
int calls = 0;    // under way, under the mutex
int holders = 0;  // of them: of those that want one thread
int threads = 1;  // before the first of them
thread_local int own_calls = 0;

/// OpenBLAS's threads end before a fork, also in the middle of their work, and a child would find
/// its lock of buffers as another thread held it. So a fork waits for the calls of other threads.
void before_fork() {
  blas_entry.lock();
  blas_mutex.lock();
  while (calls > own_calls) {
    blas_mutex.unlock();
    std::this_thread::sleep_for(std::chrono::microseconds(20));
    blas_mutex.lock();
  }
}
void after_fork() {
  blas_mutex.unlock();
  blas_entry.unlock();
}

/// When the library is loaded, also where nothing makes a LibraryLock.
[[maybe_unused]] const bool registered = (hold_blas_threads_over_forks(), true);

/// OpenBLAS's own functions, null with another BLAS. Looked up, for the library may come with
/// LAPACK or MUMPS only.
struct OpenBlas {
  int (*get)() = reinterpret_cast<int (*)()>(dlsym(RTLD_DEFAULT, "openblas_get_num_threads"));
  void (*set)(int) = reinterpret_cast<void (*)(int)>(dlsym(RTLD_DEFAULT,
                                                           "openblas_set_num_threads"));
};
const OpenBlas& openblas() {
  const std::lock_guard lock(blas_mutex);  // a child must not find the look-up for ever under way
  static const OpenBlas functions;
  return functions;
}

}  // namespace

void hold_blas_threads_over_forks() {
  [[maybe_unused]] static const int once = pthread_atfork(before_fork, after_fork, after_fork);
}

int blas_threads() {
  const OpenBlas& blas = openblas();
  return blas.get != nullptr ? blas.get() : 1;
}

SequentialBlas::SequentialBlas(double operations) {
  const OpenBlas& blas = openblas();
  holds_ = operations <= kOperationsWorthThreads && blas.get != nullptr && blas.set != nullptr;
  std::unique_lock begins(blas_entry, std::defer_lock);
  if (own_calls++ == 0) begins.lock();
  const std::lock_guard lock(blas_mutex);
  ++calls;
  if (!holds_ || holders++ > 0) return;
  threads = blas.get();
  if (threads > 1) blas.set(1);
}

SequentialBlas::~SequentialBlas() {
  const OpenBlas& blas = openblas();
  const std::lock_guard lock(blas_mutex);
  --calls;
  --own_calls;
  if (holds_ && --holders == 0 && threads > 1) blas.set(threads);
}

}  // namespace ipminmax
