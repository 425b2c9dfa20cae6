// What leaves through the doors, Ipopt's interface and C, is the core's result, which is true of
// its own point: random small problems with random options, models that fail, stops by the user.
//
// By hand: IPMINMAX_RUNS=20000 IPMINMAX_SEED=7 adapter_truthful_doors_slow_test

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>

#include <gtest/gtest.h>

#include <problems/random_game.hpp>
#include <support/dice.hpp>
#include <support/doors.hpp>
#include <support/judge_truth.hpp>

namespace ipminmax::testing {
namespace {

using Ipopt::SmartPtr;

/// Answers as the game says.
std::function<bool()> until_stop(const RandomGame& game) {
  return [calls = 0, &game]() mutable { return calls++ < game.stop_at; };
}

/// The core's result, after a comparison with what finalize_solution was given.
Result through_tnlp(const RandomGame& game, Problem& problem) {
  const SmartPtr<MinMaxApplication> application = application_with(game.options);
  const SmartPtr<DoorTnlp> model = new DoorTnlp(problem, until_stop(game));
  static_cast<void>(application->OptimizeTNLP(split(model, problem.structure())));
  Result result = application->LastResult();
  const IpoptAnswer& told = model->answer();
  if (!result.v.empty()) {
    EXPECT_TRUE(same(told.v, result.v) && same(told.lambda, result.lambda) &&
                same(told.z_lower, result.z_lower) && same(told.z_upper, result.z_upper) &&
                same(told.constraints, result.constraints) &&
                same(told.objective, result.objective));
  } else if (!told.v.empty()) {  // undefined at the start
    EXPECT_TRUE(std::isnan(told.objective));
    for (const auto* values : {&told.lambda, &told.z_lower, &told.z_upper, &told.constraints}) {
      for (const double value : *values) EXPECT_TRUE(std::isnan(value));
    }
  }
  return result;
}

/// Expects the arrays, errors and kind that C gives to be those of the result.
void expect_same_in_c(const RandomGame& game, Problem& problem, const Result& result) {
  CDoor door(problem, game.options, until_stop(game));
  ASSERT_NE(door.get(), nullptr) << IpminmaxMessage(nullptr);
  const CDoor::Answer c = door.solve(game.start);
  EXPECT_EQ(std::string(IpminmaxStatusName(door.get())), name_of(result.status));
  if (result.v.empty()) return;
  EXPECT_TRUE(same(c.x, result.v) && same(c.g, result.constraints) && same(c.f, result.objective) &&
              same(c.lambda, result.lambda) && same(c.z_lower, result.z_lower) &&
              same(c.z_upper, result.z_upper));
  IpminmaxStatistics statistics{};
  ASSERT_EQ(IpminmaxGetStatistics(door.get(), &statistics), 1);
  EXPECT_TRUE(same(statistics.primal_error, result.error.primal) &&
              same(statistics.dual_error_min, result.error.dual_min) &&
              same(statistics.dual_error_max, result.error.dual_max) &&
              same(statistics.complementarity_error, result.error.complementarity) &&
              same(statistics.error, result.error.total));
  IpminmaxCertificate certificate{};
  ASSERT_EQ(IpminmaxGetCertificate(door.get(), &certificate), 1);
  EXPECT_EQ(static_cast<int>(certificate.point_kind), static_cast<int>(result.certificate.kind));
}

TEST(TruthfulDoors, OfRandomGames) {
  const std::uint64_t runs = number_from("IPMINMAX_RUNS", 1500);
  const std::uint64_t first = number_from("IPMINMAX_SEED", 100001);
  for (std::uint64_t seed = first; seed < first + runs && !HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RandomGame game = random_game(seed);
    game.options.max_cpu_time = SolverOptions{}.max_cpu_time;  // the same end twice
    AutodiffProblem model(game.model, game.start);
    FailingProblem problem(model, game), again(model, game);
    const Result result = through_tnlp(game, problem);
    EXPECT_EQ(TruthJudge(model, game.options, result, game.fails_from > 0).untruths(), "")
        << name_of(result.status);
    EXPECT_EQ(problem.calls_not_finite(), 0);
    expect_same_in_c(game, again, result);
  }
}

}  // namespace
}  // namespace ipminmax::testing
