// factorize and solve_in_place allocate nothing after the first call.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <vector>

#include <ipminmax/linalg/symmetric_solver.hpp>

#include "test_matrices.hpp"

namespace {

std::atomic<bool> counting{false};
std::atomic<int> allocations{0};

[[maybe_unused]] void count_one() {
  if (counting.load(std::memory_order_relaxed)) allocations.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace

// A sanitizer has an allocator of its own.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define IPMINMAX_COUNTS_ALLOCATIONS 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define IPMINMAX_COUNTS_ALLOCATIONS 0
#endif
#endif
#ifndef IPMINMAX_COUNTS_ALLOCATIONS
#define IPMINMAX_COUNTS_ALLOCATIONS 1
#endif

#if IPMINMAX_COUNTS_ALLOCATIONS
// operator new and Eigen end up here; the names called are glibc's own for its allocator.
extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* old, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
  count_one();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  count_one();
  return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) {
  count_one();
  return __libc_realloc(old, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  count_one();
  return __libc_memalign(alignment, size);
}
}
#endif

namespace ipminmax {
namespace {

int allocations_in_the_loop(LinearSolver kind, const test::KktMatrix& kkt) {
  const auto solver = make_symmetric_solver(kind, {});
  EXPECT_TRUE(solver->analyze(kkt.matrix, kkt.signs).ok);
  std::vector<double> rhs(3 * static_cast<std::size_t>(kkt.matrix.dimension()), 1.0);
  bool ok = true;
  for (int pass = 0; pass < 3; ++pass) {
    allocations = 0;
    counting = pass > 0;
    ok = ok && solver->factorize(kkt.matrix).status == FactorizationStatus::Ok;
    solver->solve_in_place(rhs, 3);
    counting = false;
    if (allocations > 0) break;
  }
  EXPECT_TRUE(ok);
  return allocations;
}

TEST(Allocation, TheCounterCounts) {
  if (!IPMINMAX_COUNTS_ALLOCATIONS) GTEST_SKIP() << "allocator replaced by a sanitizer";
  allocations = 0;
  counting = true;
  auto* values = new std::vector<double>(1000);
  counting = false;
  EXPECT_EQ(allocations, 2);
  delete values;
}

TEST(Allocation, NoneInTheLoop) {
  const test::KktMatrix chain = test::chauffeur_kkt(20, 1);
  const test::KktMatrix tiny = test::random_kkt({{4, 4, 2, 2}, 0.7, 0.0}, 1);
  EXPECT_EQ(allocations_in_the_loop(LinearSolver::Ldlt, chain), 0);
  EXPECT_EQ(allocations_in_the_loop(LinearSolver::Auto, chain), 0);
  EXPECT_EQ(allocations_in_the_loop(LinearSolver::Lapack, tiny), 0);
  EXPECT_EQ(allocations_in_the_loop(LinearSolver::Auto, tiny), 0);
}

}  // namespace
}  // namespace ipminmax
