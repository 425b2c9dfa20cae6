#pragma once

#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

#include <support/sanitizer.hpp>

/// Counts allocations of the whole process, of shared libraries too, by taking glibc's place. For
/// one source file of an executable.
#define IPMINMAX_COUNTS_ALLOCATIONS (!IPMINMAX_UNDER_SANITIZER)

namespace ipminmax::testing {

struct AllocationCounter {
  std::atomic<bool> on{false};
  std::atomic<int> all{0};           ///< malloc and its kin; operator new and Eigen end up there
  std::atomic<int> operator_new{0};  ///< of them; Fortran and C libraries have none

  void start() {
    all = operator_new = 0;
    on = true;
  }
  void stop() { on = false; }
  void count(std::atomic<int>& counter) {
    if (on.load(std::memory_order_relaxed)) counter.fetch_add(1, std::memory_order_relaxed);
  }
};

inline AllocationCounter allocation_counter;

}  // namespace ipminmax::testing

#if IPMINMAX_COUNTS_ALLOCATIONS
// The names called are glibc's own for its allocator.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  ipminmax::testing::allocation_counter.count(ipminmax::testing::allocation_counter.all);
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  ipminmax::testing::allocation_counter.count(ipminmax::testing::allocation_counter.all);
  return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) {
  ipminmax::testing::allocation_counter.count(ipminmax::testing::allocation_counter.all);
  return __libc_realloc(old, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  ipminmax::testing::allocation_counter.count(ipminmax::testing::allocation_counter.all);
  return __libc_memalign(alignment, size);
}
}

// Not inlined, or the compiler sees malloc on one side and delete on the other.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ipminmax::testing::allocation_counter.count(ipminmax::testing::allocation_counter.operator_new);
  if (void* memory = std::malloc(size > 0 ? size : 1)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
#endif
