// factorize and solve_in_place allocate nothing after the first call.
#include <gtest/gtest.h>

#include <vector>

#include <support/count_allocations.hpp>

#include "linalg/make_solver.hpp"
#include "test_matrices.hpp"

namespace ipminmax {
namespace {

using testing::allocation_counter;

int allocations_in_the_loop(LinearSolver kind, const test::KktMatrix& kkt,
                            const SymmetricSolverOptions& options = {}) {
  const auto solver = make_symmetric_solver(kind, options);
  EXPECT_TRUE(solver->analyze(kkt.matrix, kkt.signs).ok);
  std::vector<double> rhs(3 * static_cast<std::size_t>(kkt.matrix.dimension()), 1.0);
  bool ok = true;
  for (int pass = 0; pass < 3; ++pass) {
    if (pass > 0) allocation_counter.start();
    ok = ok && solver->factorize(kkt.matrix).status == FactorizationStatus::Ok;
    solver->solve_in_place(rhs, 3);
    allocation_counter.stop();
    if (pass > 0 && allocation_counter.all > 0) break;
  }
  EXPECT_TRUE(ok);
  return allocation_counter.all;
}

TEST(Allocation, TheCounterCounts) {
  if (!IPMINMAX_COUNTS_ALLOCATIONS) GTEST_SKIP() << "allocator replaced by a sanitizer";
  allocation_counter.start();
  auto* values = new std::vector<double>(1000);
  allocation_counter.stop();
  EXPECT_EQ(allocation_counter.all, 2);
  EXPECT_EQ(allocation_counter.operator_new, 2);
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

TEST(Allocation, NoneInTheLoopOnTwoThreads) {
  const test::KktMatrix grid = test::grid_kkt(60, 1);
  for (const LinearSolver kind : {LinearSolver::Ldlt, LinearSolver::Auto}) {
    EXPECT_EQ(allocations_in_the_loop(kind, grid, {.ordering = Ordering::Metis, .threads = 2}), 0);
  }
}

}  // namespace
}  // namespace ipminmax
