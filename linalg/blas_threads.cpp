#include <dlfcn.h>
#include <pthread.h>

#include <mutex>

#include "linalg/blas_threads.hpp"

namespace ipminmax {
namespace {

std::mutex mutex;
int holders = 0;  // under the mutex
int threads = 1;  // before the first of them

/// When the library is loaded, also where nothing makes a LibraryLock.
[[maybe_unused]] const bool registered = (hold_blas_threads_over_forks(), true);

/// OpenBLAS's own functions, null with another BLAS. Looked up, for the library may come with LAPACK or
/// MUMPS only.
struct OpenBlas {
  int (*get)() = reinterpret_cast<int (*)()>(dlsym(RTLD_DEFAULT, "openblas_get_num_threads"));
  void (*set)(int) = reinterpret_cast<void (*)(int)>(dlsym(RTLD_DEFAULT,
                                                           "openblas_set_num_threads"));
};
const OpenBlas& openblas() {
  const std::lock_guard lock(mutex);  // a child must not find the look-up for ever under way
  static const OpenBlas functions;
  return functions;
}

}  // namespace

void hold_blas_threads_over_forks() {
  [[maybe_unused]] static const int once =
      pthread_atfork([] { mutex.lock(); }, [] { mutex.unlock(); }, [] { mutex.unlock(); });
}

int blas_threads() {
  const OpenBlas& blas = openblas();
  return blas.get != nullptr ? blas.get() : 1;
}

SequentialBlas::SequentialBlas(double operations) {
  const OpenBlas& blas = openblas();
  holds_ = operations <= kOperationsWorthThreads && blas.get != nullptr && blas.set != nullptr;
  if (!holds_) return;
  const std::lock_guard lock(mutex);
  if (holders++ > 0) return;
  threads = blas.get();
  if (threads > 1) blas.set(1);
}

SequentialBlas::~SequentialBlas() {
  if (!holds_) return;
  const OpenBlas& blas = openblas();
  const std::lock_guard lock(mutex);
  if (--holders == 0 && threads > 1) blas.set(threads);
}

}  // namespace ipminmax
