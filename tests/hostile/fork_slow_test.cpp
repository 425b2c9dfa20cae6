// Children that are forked while other threads solve can solve as well, and get the same bits.
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include <problems/random_game.hpp>
#include <support/sanitizer.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

Result solve_game(std::uint64_t seed) {
  const RandomGame game = tame_game(seed);
  AutodiffProblem model(game.model, game.start);
  SolverOptions options = game.options;
  options.linear_solver = seed % 2 == 0 ? LinearSolver::Mumps : LinearSolver::Auto;
  return solve(model, options);
}

TEST(Fork, WhileOtherThreadsSolve) {
  if (IPMINMAX_UNDER_SANITIZER) GTEST_SKIP() << "whose allocator a fork may leave locked";
  alarm(120);  // a deadlock of this process
  constexpr std::uint64_t kGames = 20;
  std::vector<Result> expected;
  for (std::uint64_t seed = 0; seed < kGames; ++seed) expected.push_back(solve_game(seed));
  std::atomic<bool> done{false};
  std::atomic<int> different{0};
  const auto work = [&](std::uint64_t first) {
    for (std::uint64_t seed = first; !done; ++seed) {
      if (solve_game(seed % kGames).objective != expected[seed % kGames].objective &&
          !std::isnan(expected[seed % kGames].objective)) {
        ++different;
      }
    }
  };
  std::thread one(work, 0), two(work, 7);
  for (std::uint64_t k = 0; k < 40; ++k) {
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      alarm(20);
      const std::uint64_t seed = k % kGames;
      const Result result = solve_game(seed);
      std::_Exit(result.status == expected[seed].status && result.v == expected[seed].v ? 0 : 1);
    }
    int status = -1;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status)) << "fork " << k << ": signal " << WTERMSIG(status);
    EXPECT_EQ(WEXITSTATUS(status), 0) << "fork " << k;
  }
  done = true;
  one.join();
  two.join();
  EXPECT_EQ(different, 0);
  alarm(0);
}

}  // namespace
}  // namespace ipminmax::testing
