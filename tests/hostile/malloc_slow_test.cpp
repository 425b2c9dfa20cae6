// One allocation after the other fails, and all after it: those of malloc, so METIS's too, where
// the answer is "out of memory" and the next solve is as if nothing had been; and those of MUMPS,
// Fortran and BLAS, which may end the process, but never give a wrong answer.
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

#include <gtest/gtest.h>

#include <problems/scalable_problems.hpp>
#include <support/failing_malloc.hpp>
#include <support/judge_truth.hpp>
#include <support/sanitizer.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

struct Solve {
  const char* name;
  ScalableProblem (*make)(int size);
  int size;
  LinearSolver linear_solver;
  Ordering ordering;
};

class MallocFails : public ::testing::TestWithParam<Solve> {
 protected:
  void SetUp() override {
    if (IPMINMAX_UNDER_SANITIZER) GTEST_SKIP() << "allocator replaced by a sanitizer";
    options_.linear_solver = GetParam().linear_solver;
    options_.minmax_ordering = GetParam().ordering;
    expected_ = solve(*problem_.problem, options_);  // fills the tables of a process
  }
  [[nodiscard]] Result solve_again() const { return solve(*problem_.problem, options_); }
  [[nodiscard]] bool is_expected(const Result& result) const {
    return result.status == expected_.status && result.v == expected_.v;
  }
  long count(Allocator whose) const {
    failing_malloc.count(whose);
    static_cast<void>(solve_again());
    return failing_malloc.disarm();
  }

  ScalableProblem problem_ = GetParam().make(GetParam().size);
  SolverOptions options_;
  Result expected_;
};

TEST_P(MallocFails, OfOurOwnAnywhere) {
  ASSERT_TRUE(is_success(expected_.status));
  const long calls = count(Allocator::Own);
  ASSERT_GT(calls, 100);
  long refused = 0, solves = 0;
  for (const bool lasting : {false, true}) {
    for (long k = 1; k <= calls; k += lasting ? 7 : 1, ++solves) {
      SCOPED_TRACE("allocation " + std::to_string(k) + (lasting ? " and later" : ""));
      failing_malloc.arm(Allocator::Own, k, lasting);
      const Result result = solve_again();
      failing_malloc.disarm();
      if (result.status == Status::OutOfMemory) {
        ++refused;
      } else {  // where less memory does
        ASSERT_TRUE(is_expected(result)) << name_of(result.status) << ": " << result.message;
      }
      ASSERT_TRUE(is_expected(solve_again()));
    }
  }
  std::printf("%ld allocations, out of memory after %ld of %ld\n", calls, refused, solves);
  EXPECT_GT(refused, solves / 2);
}

/// In children, which these libraries may end.
TEST_P(MallocFails, OfMumpsAndBlasGivesNoWrongAnswer) {
  ASSERT_TRUE(is_success(expected_.status));
  const long calls = count(Allocator::Other);
  if (GetParam().linear_solver == LinearSolver::Ldlt) {
    EXPECT_EQ(calls, 0);
    return;
  }
  constexpr int kAnswered = 0, kRefused = 100, kWrong = 101;
  std::map<std::string, int> outcomes;
  constexpr long kChildren = 60;
  for (long k = 1; k <= calls; k += 1 + calls / kChildren) {
    std::fflush(nullptr);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      alarm(20);
      if (std::freopen("/dev/null", "w", stderr) == nullptr) std::_Exit(kWrong);
      failing_malloc.arm(Allocator::Other, k, false);
      const Result result = solve_again();
      failing_malloc.disarm();
      if (is_expected(result)) std::_Exit(kAnswered);
      if (result.status == Status::OutOfMemory) std::_Exit(kRefused);
      // MUMPS goes on in less memory, in another order.
      const std::string untruths = TruthJudge(*problem_.problem, options_, result, true).untruths();
      if (untruths.empty()) std::_Exit(kAnswered);
      std::printf("allocation %ld: %s, but %s\n", k, result.message.c_str(), untruths.c_str());
      std::fflush(nullptr);
      std::_Exit(kWrong);
    }
    int status = -1;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_FALSE(WIFEXITED(status) && WEXITSTATUS(status) == kWrong) << "allocation " << k;
    EXPECT_FALSE(WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) << "allocation " << k;
    ++outcomes[WIFSIGNALED(status)                ? "signal " + std::to_string(WTERMSIG(status))
               : WEXITSTATUS(status) == kAnswered ? "answered"
               : WEXITSTATUS(status) == kRefused  ? "out of memory"
                                                  : "exit " + std::to_string(WEXITSTATUS(status))];
  }
  std::printf("%ld allocations:", calls);
  for (const auto& [outcome, times] : outcomes) std::printf(" %s %d,", outcome.c_str(), times);
  std::printf("\n");
}

INSTANTIATE_TEST_SUITE_P(
    Of, MallocFails,
    ::testing::Values(Solve{"Metis", f03_quad_box, 20, LinearSolver::Mumps, Ordering::Metis},
                      Solve{"Pord", f16_lq_game, 30, LinearSolver::Mumps, Ordering::Pord},
                      Solve{"Ldlt", f16_lq_game, 10, LinearSolver::Ldlt, Ordering::Metis}),
    [](const auto& of) { return of.param.name; });

}  // namespace
}  // namespace ipminmax::testing
