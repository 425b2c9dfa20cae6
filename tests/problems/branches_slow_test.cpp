// Families whose worst case has kinks at the best x: wherever one of four ways finds a certified
// point, minmax_epigraph_at_kinks does so in 95 % of the runs, and what it certifies holds.
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include <problems/branching_problems.hpp>

#include "core/robust.hpp"
#include "core/worst_case.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::branching_problem;
using testing::BranchingFamily;
using testing::BranchingProblem;

bool certified(const Result& result) { return result.certificate.kind == PointKind::LocalMinmax; }

/// The largest f(x, y) found over y, also from the worst cases of the answer: random starts miss
/// some.
double worst_case(Problem& problem, const std::vector<double>& v, const RobustResult& answer) {
  std::vector<std::vector<double>> given;
  for (const RobustWorstCase& known : answer.worst_cases) given.push_back(known.v);
  return check_worst_case(problem, v, {}, 20, given).found.value;
}

/// x of a certified kink against points around it: the worst case grows in every direction.
void expect_minimum(Problem& problem, const RobustResult& answer) {
  constexpr double kRadius = 1e-2;
  const double here = worst_case(problem, answer.result.v, answer);
  EXPECT_NEAR(here, answer.result.objective, 1e-6 * std::max(1.0, std::abs(here)));
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  const ProblemStructure& s = problem.structure();
  for (int direction = 0; direction < 10; ++direction) {
    std::vector<double> v = answer.result.v;
    for (std::size_t i = 0; i < v.size(); ++i) {
      if (s.variable_players[i] != Player::Min) continue;
      v[i] = std::clamp(v[i] + kRadius * normal(random), s.variable_lower[i], s.variable_upper[i]);
    }
    EXPECT_GE(worst_case(problem, v, answer), here - 1e-8) << "direction " << direction;
  }
}

void expect_nearly_as_good_as_all(BranchingFamily family, std::uint64_t first, int problems,
                                  int starts) {
  int any = 0, ours = 0, plain = 0, as_branches = 0;
  for (int k = 0; k < problems; ++k) {
    const BranchingProblem p = branching_problem(family, starts, first + static_cast<unsigned>(k));
    for (const std::vector<double>& start : p.starts) {
      SCOPED_TRACE(p.name);
      AutodiffProblem problem(p.model, start);
      SolverOptions options, algorithm_one, epigraph;
      options.minmax_epigraph_at_kinks = true;
      algorithm_one.minmax_globalization = Globalization::None;
      epigraph.minmax_epigraph = true;
      epigraph.minmax_worst_case_starts = 10;
      const RobustResult answer = solve_robust(problem, options);
      const bool found = certified(answer.result);
      if (found && answer.branches == 0) ++plain;
      if (found && answer.branches > 1) {
        // Each tenth is looked at closely.
        if (as_branches++ % 10 == 0) expect_minimum(problem, answer);
      }
      ours += found ? 1 : 0;
      any += found || certified(solve(problem, {}, SolveObserver{})) ||
                     certified(solve(problem, algorithm_one, SolveObserver{})) ||
                     certified(solve_robust(problem, epigraph).result)
                 ? 1
                 : 0;
    }
  }
  std::printf(
      "%d runs, certified by any of four ways: %d; minmax_epigraph_at_kinks: %d, of these %d "
      "at once, %d as branches\n",
      problems * starts, any, ours, plain, as_branches);
  EXPECT_GE(ours, 0.95 * any);
  EXPECT_GE(any, 0.8 * problems * starts) << "the families have such points";
}

TEST(BranchingFamilies, ResponsesToAnUncertainY) {
  expect_nearly_as_good_as_all(BranchingFamily::Response, 1001, 40, 3);
}

TEST(BranchingFamilies, Networks) {
  expect_nearly_as_good_as_all(BranchingFamily::Network, 2001, 10, 2);
}

}  // namespace
}  // namespace ipminmax
