// Factors and solutions have the same bits for any number of BLAS threads; forks wait for calls of
// BLAS.
#include <dlfcn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include <atomic>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <thread>
#include <vector>

#include "linalg/blas_threads.hpp"
#include "linalg/lapack_solver.hpp"
#include "linalg/mumps_solver.hpp"
#include "test_matrices.hpp"

namespace ipminmax {
namespace {

/// OpenBLAS's, null with another BLAS.
void (*const set_threads)(int) = reinterpret_cast<void (*)(int)>(dlsym(RTLD_DEFAULT,
                                                                       "openblas_set_num_threads"));

/// Dense, symmetric, indefinite.
SymmetricMatrix dense_matrix(Index n) {
  test::MatrixBuilder builder(n);
  for (Index j = 0; j < n; ++j) {
    for (Index i = j; i < n; ++i) {
      const double diagonal = i == j ? (i % 3 == 0 ? -20.0 : 20.0) : 0.0;
      builder.add(i, j, diagonal + std::sin(1.0 + i * 7.0 + j * 13.0));
    }
  }
  return builder.build();
}

std::vector<std::uint64_t> bits_of_solution(SymmetricSolver& solver, const SymmetricMatrix& matrix,
                                            int threads) {
  set_threads(threads);
  EXPECT_TRUE(solver.analyze(matrix, {}).ok);
  EXPECT_EQ(solver.factorize(matrix).status, FactorizationStatus::Ok);
  std::vector<double> x(static_cast<std::size_t>(matrix.dimension()));
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::cos(static_cast<double>(i));
  solver.solve_in_place(x);
  EXPECT_EQ(blas_threads(), threads) << "comes back";
  std::vector<std::uint64_t> bits;
  for (const double value : x) bits.push_back(std::bit_cast<std::uint64_t>(value));
  return bits;
}

class BlasThreads : public ::testing::Test {
 protected:
  void SetUp() override {
    if (set_threads == nullptr) GTEST_SKIP() << "no OpenBLAS";
    before_ = blas_threads();
  }
  void TearDown() override {
    if (set_threads != nullptr) set_threads(before_);
  }
  int before_ = 1;
};

TEST_F(BlasThreads, DoNotChangeWhatMumpsSays) {
  const SymmetricMatrix matrix = dense_matrix(400);
  SymmetricSolverOptions options;
  options.ordering = Ordering::Amd;
  MumpsSolver one(options), two(options), four(options);
  const auto expected = bits_of_solution(one, matrix, 1);
  EXPECT_EQ(bits_of_solution(two, matrix, 2), expected);
  EXPECT_EQ(bits_of_solution(four, matrix, 4), expected);
}

TEST_F(BlasThreads, DoNotChangeWhatLapackSays) {
  const SymmetricMatrix matrix = dense_matrix(400);
  LapackSolver one, four;
  const auto expected = bits_of_solution(one, matrix, 1);
  EXPECT_EQ(bits_of_solution(four, matrix, 4), expected);
}

TEST_F(BlasThreads, AreOneWhileAnyHolderLives) {
  set_threads(3);
  {
    const SequentialBlas outer(1.0);
    EXPECT_EQ(blas_threads(), 1);
    { const SequentialBlas inner(1.0); }
    EXPECT_EQ(blas_threads(), 1);
  }
  EXPECT_EQ(blas_threads(), 3);
  const SequentialBlas large(1e12);
  EXPECT_EQ(blas_threads(), 3);
}

bool factorizes(const SymmetricMatrix& matrix) {
  LapackSolver solver;
  return solver.analyze(matrix, {}).ok &&
         solver.factorize(matrix).status == FactorizationStatus::Ok;
}

/// OpenBLAS's own handler ends its threads before a fork, whatever they are at.
TEST_F(BlasThreads, AreNotEndedByAForkInTheMiddle) {
  alarm(100);  // a deadlock of this process
  set_threads(2);
  const SymmetricMatrix matrix = dense_matrix(1450);
  ASSERT_GT(std::pow(1450.0, 3) / 3.0, kOperationsWorthThreads);
  std::atomic<bool> done{false};
  std::atomic<int> failures{0};
  std::thread worker([&] {
    while (!done) failures += factorizes(matrix) ? 0 : 1;
  });
  int lost = 0;
  for (int k = 0; k < 2; ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    const pid_t child = fork();
    if (child == 0) {
      alarm(60);
      std::_Exit(factorizes(matrix) ? 0 : 1);
    }
    int status = -1;
    lost += waitpid(child, &status, 0) == child && status == 0 ? 0 : 1;
  }
  done = true;
  worker.join();
  EXPECT_EQ(lost, 0);
  EXPECT_EQ(failures, 0);
  alarm(0);
}

}  // namespace
}  // namespace ipminmax
