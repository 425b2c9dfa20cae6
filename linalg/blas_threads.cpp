#include <pthread.h>

#include <mutex>

#include "linalg/blas_threads.hpp"

extern "C" int openblas_get_num_threads() __attribute__((weak));
extern "C" void openblas_set_num_threads(int) __attribute__((weak));

namespace ipminmax {
namespace {

std::mutex mutex;
int holders = 0;  // under the mutex
int threads = 1;  // before the first of them

/// No child is forked while another thread is inside.
[[maybe_unused]] const int registered =
    pthread_atfork([] { mutex.lock(); }, [] { mutex.unlock(); }, [] { mutex.unlock(); });

}  // namespace

SequentialBlas::SequentialBlas(double operations)
    : holds_(operations <= kOperationsWorthThreads && openblas_get_num_threads != nullptr &&
             openblas_set_num_threads != nullptr) {
  if (!holds_) return;
  const std::lock_guard lock(mutex);
  if (holders++ > 0) return;
  threads = openblas_get_num_threads();
  if (threads > 1) openblas_set_num_threads(1);
}

SequentialBlas::~SequentialBlas() {
  if (!holds_) return;
  const std::lock_guard lock(mutex);
  if (--holders == 0 && threads > 1) openblas_set_num_threads(threads);
}

}  // namespace ipminmax
