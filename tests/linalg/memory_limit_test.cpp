// Limits of memory are kept before MUMPS and BLAS are called, which end the process or try for ever
// where they cannot allocate; and a fork finds the lock of these libraries free.
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <optional>
#include <random>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include "linalg/lapack_solver.hpp"
#include "linalg/library_lock.hpp"
#include "linalg/make_solver.hpp"
#include "linalg/memory_limit.hpp"
#include "linalg/mumps_solver.hpp"
#include "test_matrices.hpp"

namespace ipminmax {
namespace {

double mapped_bytes() {
  double pages = 0.0;
  std::FILE* file = std::fopen("/proc/self/statm", "r");
  const int read = std::fscanf(file, "%lf", &pages);
  std::fclose(file);
  return read == 1 ? pages * static_cast<double>(sysconf(_SC_PAGESIZE)) : 0.0;
}

void limit_address_space(double further_bytes) {
  const auto bytes = static_cast<rlim_t>(mapped_bytes() + further_bytes);
  const rlimit limit{bytes, bytes};
  setrlimit(RLIMIT_AS, &limit);
}

/// Laplacian of a cube with side^3 unknowns, lower triangle.
SymmetricMatrix cube(Index side) {
  test::MatrixBuilder builder(side * side * side);
  const auto at = [&](Index i, Index j, Index k) { return (i * side + j) * side + k; };
  for (Index i = 0; i < side; ++i) {
    for (Index j = 0; j < side; ++j) {
      for (Index k = 0; k < side; ++k) {
        builder.add(at(i, j, k), at(i, j, k), 6.5);
        if (i > 0) builder.add(at(i, j, k), at(i - 1, j, k), -1.0);
        if (j > 0) builder.add(at(i, j, k), at(i, j - 1, k), -1.0);
        if (k > 0) builder.add(at(i, j, k), at(i, j, k - 1), -1.0);
      }
    }
  }
  return builder.build();
}

/// Random sparse, with a diagonal that makes no pivots and is not zero.
SymmetricMatrix delaying() {
  constexpr Index kDimension = 1500;
  std::mt19937 random(3);
  test::MatrixBuilder builder(kDimension);
  for (Index i = 0; i < kDimension; ++i) {
    builder.add(i, i, 1e-9);
    for (int k = 0; k < 3 && i > 0; ++k) {
      builder.add(i, static_cast<Index>(random() % static_cast<unsigned>(i)),
                  1.0 + 0.1 * static_cast<double>(random() % 10));
    }
  }
  return builder.build();
}

FactorizationStatus factorize(const SymmetricMatrix& matrix, double max_memory) {
  SymmetricSolverOptions options;
  options.ordering = Ordering::Amd;
  options.max_memory = max_memory;
  MumpsSolver solver(options);
  if (!solver.analyze(matrix, {}).ok) return FactorizationStatus::OutOfMemory;
  return solver.factorize(matrix).status;
}

/// Without the reservation OpenBLAS tries for ever. First, because a process that has called BLAS
/// has its buffer.
TEST(MemoryLimit, OfTheAddressSpaceIsKeptByLapack) {
  EXPECT_EXIT(
      {
        alarm(20);
        limit_address_space(1e7);
        LapackSolver solver;
        std::_Exit(solver.analyze(cube(3), {}).ok ? 1 : 0);
      },
      testing::ExitedWithCode(0), "");
  EXPECT_EXIT(
      {
        alarm(20);
        limit_address_space(1e9);
        LapackSolver solver;
        const SymmetricMatrix matrix = cube(3);
        const bool ok = solver.analyze(matrix, {}).ok &&
                        solver.factorize(matrix).status == FactorizationStatus::Ok;
        std::_Exit(ok ? 0 : 1);
      },
      testing::ExitedWithCode(0), "");
}

TEST(AvailableMemory, IsTheLeastOfTheLimits) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(available_memory(1.0), 0.0);
  EXPECT_LE(available_memory(1e12), 1e12);
  EXPECT_GT(available_memory(1e12), 0.0);
  EXPECT_EXIT(
      {
        limit_address_space(1e8);
        const double left = available_memory(kInfinity);
        std::_Exit(left > 0.5e8 && left <= 1.001e8 ? 0 : 1);
      },
      testing::ExitedWithCode(0), "");
}

/// Folders as the kernel mounts them.
class ControlGroups : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "groups_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    root_ = pattern;
  }
  void TearDown() override { std::filesystem::remove_all(root_); }
  void put(const std::string& name, const std::string& text) const {
    const std::filesystem::path file = root_ / name;
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file) << text;
  }
  [[nodiscard]] double left(const std::string& groups) const {
    put("groups", groups);
    return left_in_control_groups((root_ / "groups").string(), root_.string());
  }

  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::filesystem::path root_;
};

TEST_F(ControlGroups, OfVersionTwo) {
  EXPECT_EQ(left("0::/a/b\n"), kInfinity);
  put("a/b/memory.max", "1000\n");
  EXPECT_EQ(left("0::/a/b\n"), kInfinity);  // no word of what is used
  put("a/b/memory.current", "400\n");
  EXPECT_EQ(left("0::/a/b\n"), 600.0);
  put("a/b/memory.stat", "anon 300\nfile 100\ninactive_file 50\nactive_file 20\n");
  EXPECT_EQ(left("0::/a/b\n"), 650.0);
  EXPECT_EQ(left("0::/a/b/\n"), 650.0);
  EXPECT_EQ(left("0::/a\n"), kInfinity);
  put("a/memory.max", "max\n");  // no limit
  put("a/memory.current", "5000\n");
  EXPECT_EQ(left("0::/a/b\n"), 650.0);
  put("a/memory.max", "5100\n");  // less than the group's own
  EXPECT_EQ(left("0::/a/b\n"), 100.0);
  put("memory.max", "5000\n");  // of the container: beyond its limit
  put("memory.current", "5010\n");
  EXPECT_EQ(left("0::/a/b\n"), -10.0);
  EXPECT_EQ(left("0::/not/mounted/here\n"), -10.0);
  EXPECT_EQ(left("0::/\n"), -10.0);
  EXPECT_EQ(left(""), kInfinity);
}

TEST_F(ControlGroups, OfVersionOne) {
  put("memory/a/memory.limit_in_bytes", "1000\n");
  put("memory/a/memory.usage_in_bytes", "900\n");
  put("memory/a/memory.stat", "inactive_file 1\ntotal_inactive_file 30\n");
  put("memory/memory.limit_in_bytes", "9223372036854771712\n");  // its "no limit"
  put("memory/memory.usage_in_bytes", "900\n");
  EXPECT_EQ(left("4:cpu,cpuacct:/a\n3:memory:/a\n0::/a\n"), 130.0);
  EXPECT_EQ(left("3:hugetlb,memory,misc:/a\n"), 130.0);
  EXPECT_EQ(left("4:cpu,cpuacct:/a\nno row\n"), kInfinity);
  EXPECT_GT(left("3:memory:/b\n"), 1e18);
}

TEST(MemoryLimit, OfTheOptionIsKeptByMumps) {
  const SymmetricMatrix matrix = cube(30);
  EXPECT_EQ(factorize(matrix, 1e26), FactorizationStatus::Ok);
  EXPECT_EQ(factorize(matrix, 2e6), FactorizationStatus::OutOfMemory);
  EXPECT_EQ(factorize(cube(3), 2e6), FactorizationStatus::Ok);  // nothing to speak of
}

/// With a diagonal of nearly zero many pivots are delayed: the workspace of the estimate is too
/// small, several times. Whoever has no time left is asked before each further attempt.
TEST(MemoryLimit, FurtherAttemptsOfMumpsCanBeStopped) {
  for (const LinearSolver kind : {LinearSolver::Mumps, LinearSolver::Auto}) {
    SymmetricSolverOptions options;
    options.ordering = Ordering::Amd;
    options.mumps_memory_percent = 0;
    const auto solver = make_symmetric_solver(kind, options);
    const SymmetricMatrix matrix = delaying();
    ASSERT_TRUE(solver->analyze(matrix, {}).ok);
    int asked = 0;
    solver->stop_when([&] { return ++asked == 2; });
    EXPECT_EQ(solver->factorize(matrix).status, FactorizationStatus::Failed);
    EXPECT_EQ(asked, 2);
    solver->stop_when({});
    EXPECT_EQ(solver->factorize(matrix).status, FactorizationStatus::Ok);
  }
}

/// Without the estimate MUMPS ends the process.
TEST(MemoryLimit, OfTheAddressSpaceIsKeptByMumps) {
  const SymmetricMatrix matrix = cube(30);
  EXPECT_EXIT(
      {
        alarm(60);
        if (!blas_has_memory()) std::_Exit(2);
        limit_address_space(4e7);
        std::_Exit(factorize(matrix, 1e26) == FactorizationStatus::OutOfMemory ? 0 : 1);
      },
      testing::ExitedWithCode(0), "");
}

/// A child is forked while another thread holds the lock, and while its own thread does.
TEST(LibraryLock, IsFreeInAForkedChild) {
  std::atomic<bool> done{false};
  std::thread busy([&] {
    while (!done) {
      {
        const LibraryLock lock;
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
      std::this_thread::yield();
    }
  });
  for (int k = 0; k < 20; ++k) {
    std::optional<LibraryLock> held;
    if (k % 4 == 3) held.emplace();
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      alarm(10);
      { const LibraryLock again; }
      held.reset();
      std::thread other([] { const LibraryLock of_another_thread; });
      other.join();
      std::_Exit(0);
    }
    held.reset();
    int status = -1;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status)) << "fork " << k << ": signal " << WTERMSIG(status);
  }
  done = true;
  busy.join();
}

}  // namespace
}  // namespace ipminmax
