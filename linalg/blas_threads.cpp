#include <dlfcn.h>
#include <pthread.h>

#include <mutex>

#include "linalg/blas_threads.hpp"

namespace ipminmax {
namespace {

std::mutex mutex;
int holders = 0;  // under the mutex
int threads = 1;  // before the first of them

/// No child is forked while another thread is inside.
[[maybe_unused]] const int registered =
    pthread_atfork([] { mutex.lock(); }, [] { mutex.unlock(); }, [] { mutex.unlock(); });

/// OpenBLAS's own functions, null with another BLAS. Looked up, for the library may come with LAPACK or
/// MUMPS only.
struct OpenBlas {
  int (*get)() = reinterpret_cast<int (*)()>(dlsym(RTLD_DEFAULT, "openblas_get_num_threads"));
  void (*set)(int) = reinterpret_cast<void (*)(int)>(dlsym(RTLD_DEFAULT,
                                                           "openblas_set_num_threads"));
};
const OpenBlas& openblas() {
  static const OpenBlas functions;
  return functions;
}

}  // namespace

int blas_threads() { return openblas().get != nullptr ? openblas().get() : 1; }

SequentialBlas::SequentialBlas(double operations)
    : holds_(operations <= kOperationsWorthThreads && openblas().get != nullptr &&
             openblas().set != nullptr) {
  if (!holds_) return;
  const std::lock_guard lock(mutex);
  if (holders++ > 0) return;
  threads = openblas().get();
  if (threads > 1) openblas().set(1);
}

SequentialBlas::~SequentialBlas() {
  if (!holds_) return;
  const std::lock_guard lock(mutex);
  if (--holders == 0 && threads > 1) openblas().set(threads);
}

}  // namespace ipminmax
