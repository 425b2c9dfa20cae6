// A solve that starts at a certified solution ends there.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <problems/random_multimodal.hpp>
#include <problems/scalable_problems.hpp>
#include <problems/small_problems.hpp>
#include <regression/hock_schittkowski.hpp>
#include <support/forwarding_problem.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

/// Of the point's size: where the curvature is little, points as far as this meet the tolerances.
constexpr double kNear = 1e-3;

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0.0, size = 1.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    largest = std::max(largest, std::abs(a[i] - b[i]));
    size = std::max(size, std::abs(a[i]));
  }
  return largest / size;
}

struct Tally {
  int solutions = 0;
  int left = 0;           ///< started with v alone
  int left_with_all = 0;  ///< with multipliers, too
  int lost = 0;           ///< stayed, but not certified any more
};

void start_again(const std::string& name, Problem& problem, Tally& tally) {
  const Result first = solve(problem, SolverOptions{});
  if (first.certificate.kind != PointKind::LocalMinmax) return;
  ++tally.solutions;
  for (const bool warm : {false, true}) {
    SolverOptions options;
    options.warm_start_init_point = warm;
    StartedProblem again(problem, first);
    const Result second = solve(again, options);
    const double moved = distance(first.v, second.v);
    const bool stayed = moved <= kNear;
    const bool certified = second.certificate.kind == PointKind::LocalMinmax;
    if (!stayed) ++(warm ? tally.left_with_all : tally.left);
    if (stayed && !certified) ++tally.lost;
    if (stayed && certified) continue;
    std::printf("  %-28s %s: moved %.1e, f %.9g -> %.9g, %s, %s, %d iterations\n", name.c_str(),
                warm ? "all" : "v  ", moved, first.objective, second.objective,
                std::string(name_of(second.status)).c_str(),
                std::string(name_of(second.certificate.second_order)).c_str(), second.iterations);
  }
}

/// most_left: from v alone, where the start is pushed off its bounds.
void expect(const char* name, const Tally& t, int least, int most_left = 0, int most_lost = 0) {
  std::printf(
      "%s: %d solutions, left from v alone %d, from v and multipliers %d, not certified %d\n", name,
      t.solutions, t.left, t.left_with_all, t.lost);
  EXPECT_GE(t.solutions, least);
  EXPECT_EQ(t.left_with_all, 0);
  EXPECT_LE(t.left, most_left);
  EXPECT_LE(t.lost, most_lost);
}

TEST(WarmStart, StaysAtSolutionsOfSmallGames) {
  Tally tally;
  for (const SmallProblem& known : small_problems()) {
    AutodiffProblem problem(known.model, known.starts.front());
    start_again(known.name, problem, tally);
  }
  expect("small games", tally, 30);
}

TEST(WarmStart, StaysAtSolutionsOfMultimodalGames) {
  Tally tally;
  for (const MultimodalKind kind :
       {MultimodalKind::Free, MultimodalKind::Box, MultimodalKind::Constrained}) {
    for (std::uint64_t seed = 1; seed <= 40; ++seed) {
      const MultimodalProblem game = random_multimodal(kind, 2, 1, seed);
      AutodiffProblem problem(game.model, game.starts.front());
      start_again(
          "multimodal " + std::to_string(static_cast<int>(kind)) + " " + std::to_string(seed),
          problem, tally);
    }
  }
  expect("multimodal games", tally, 100, 2);
}

TEST(WarmStart, StaysAtSolutionsOfMinimizations) {
  Tally tally;
  for (const MinimizationProblem& known : hock_schittkowski()) {
    AutodiffProblem problem(known.model, known.start);
    start_again(known.name, problem, tally);
  }
  expect("minimizations", tally, 140, 0, 2);  // hs221, a cusp between relaxed bounds, from both
}

TEST(WarmStart, StaysAtSolutionsOfFamilies) {
  Tally tally;
  for (ScalableProblem& family : small_scalable_problems())
    start_again(family.name, *family.problem, tally);
  expect("families", tally, 10);
}

}  // namespace
}  // namespace ipminmax::testing
