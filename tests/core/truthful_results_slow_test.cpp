// Every result describes its own point, whatever the status: random small problems with random
// options, models that fail, stops by the user, several starts.
//
// By hand, any number of runs from any seed, with a table of the statuses seen:
//   IPMINMAX_RUNS=20000 IPMINMAX_SEED=7 core_truthful_results_slow_test

#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

#include <gtest/gtest.h>

#include <problems/random_game.hpp>
#include <support/dice.hpp>
#include <support/judge_truth.hpp>

#include "core/multistart.hpp"
#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

Result run(const RandomGame& game, FailingProblem& problem, std::uint64_t seed) {
  int calls = 0;
  const auto goes_on = [&](const IterationInfo&) { return calls++ < game.stop_at; };
  if (seed % 20 != 0) return solve(problem, game.options, goes_on);
  SolverOptions options = game.options;
  options.minmax_starts = 3;
  MultistartObserver observer;
  observer.on_iteration = [&](Index, const IterationInfo& info) { return goes_on(info); };
  return multistart(problem, options, observer).best;
}

TEST(TruthfulResults, OfRandomGames) {
  const std::uint64_t runs = number_from("IPMINMAX_RUNS", 4000);
  const std::uint64_t first = number_from("IPMINMAX_SEED", 1);
  std::map<std::string, int> statuses;
  std::uint64_t untrue = 0;
  for (std::uint64_t seed = first; seed < first + runs; ++seed) {
    const RandomGame game = random_game(seed);
    AutodiffProblem model(game.model, game.start);
    FailingProblem problem(model, game);
    const Result result = run(game, problem, seed);
    ++statuses[std::string(name_of(result.status))];
    std::string untruths = TruthJudge(model, game.options, result, game.fails_from > 0).untruths();
    if (problem.calls_not_finite() > 0) untruths += "the model was asked at a point not finite; ";
    if (untruths.empty()) continue;
    ++untrue;
    ADD_FAILURE() << "seed " << seed << ", " << name_of(result.status) << " (" << result.message
                  << "), " << name_of(result.certificate.kind) << ": " << untruths;
  }
  for (const auto& [status, count] : statuses) std::printf("%7d %s\n", count, status.c_str());
  std::printf("%7llu of %llu untrue\n", static_cast<unsigned long long>(untrue),
              static_cast<unsigned long long>(runs));
  if (runs >= 4000) {
    EXPECT_GE(statuses.size(), 12U);
  }
}

}  // namespace
}  // namespace ipminmax::testing
