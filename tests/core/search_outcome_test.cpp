#include <gtest/gtest.h>

#include "core/global/result_bytes.hpp"
#include "core/search/first_order_test.hpp"
#include "core/search/outcome.hpp"

namespace ipminmax {
namespace {

SearchOutcome outcome(Status status, double mu = 1.0) {
  SearchOutcome result;
  result.status = status;
  result.mu = mu;
  return result;
}

TEST(BetterOutcome, ASolutionBeatsEverythingBefore) {
  for (const Status earlier : {Status::NoLocalMinmaxFound, Status::SolvedDegenerate}) {
    EXPECT_EQ(better(outcome(earlier), outcome(Status::Solved)).status, Status::Solved);
  }
}

TEST(BetterOutcome, OfTwoFailuresTheFirstCounts) {
  EXPECT_EQ(better(outcome(Status::LocallyInfeasible, 1.0), outcome(Status::TinyStep, 2.0)).mu,
            1.0);
}

TEST(BetterOutcome, AStopByALimitHidesEarlierFailuresButNoSolution) {
  for (const Status stop : {Status::MaxIterations, Status::MaxWallTime, Status::OutOfMemory}) {
    EXPECT_EQ(better(outcome(Status::TinyStep), outcome(stop)).status, stop);
    EXPECT_EQ(better(outcome(Status::SolvedDegenerate), outcome(stop)).status,
              Status::SolvedDegenerate);
  }
}

TEST(BetterOutcome, TheUserWhoStopsGetsTheIterateThatWasTold) {
  EXPECT_EQ(better(outcome(Status::SolvedDegenerate), outcome(Status::UserStop)).status,
            Status::UserStop);
}

TEST(ResultBytes, KeepWhatTheOtherNumbersMean) {
  Result sent;
  sent.objective_scale = -2.0;
  sent.fixed_variables_relaxed = true;
  sent.over_y.largest_violation = 0.5;
  sent.over_y.proofs.resize(2);
  sent.over_y.proofs[1].proved = 3.0;
  sent.over_y.proofs[1].v = {1.0, 2.0};
  sent.over_y.proofs[1].interrupted = Status::MaxWallTime;
  sent.over_y.proofs[1].message = "not proved";
  const Result received = result_from(to_bytes(sent));
  EXPECT_EQ(received.over_y.largest_violation, 0.5);
  ASSERT_EQ(received.over_y.proofs.size(), 2U);
  EXPECT_EQ(received.over_y.proofs[1].proved, 3.0);
  EXPECT_EQ(received.over_y.proofs[1].v, sent.over_y.proofs[1].v);
  EXPECT_EQ(received.over_y.proofs[1].interrupted, Status::MaxWallTime);
  EXPECT_EQ(received.over_y.proofs[1].message, "not proved");
  EXPECT_EQ(received.objective_scale, -2.0);
  EXPECT_TRUE(received.fixed_variables_relaxed);
}

KktError error_of(double total) {
  return {.primal = total,
          .dual_min = total,
          .dual_max = total,
          .complementarity = total,
          .total = total};
}

TEST(FirstOrderTestTest, AcceptablePointsCountInARow) {
  SolverOptions options;
  options.acceptable_iter = 3;
  FirstOrderTest test(options);
  const KktError acceptable = error_of(0.5 * options.acceptable_tol);
  const KktError large = error_of(1.0);
  EXPECT_FALSE(test.claim(acceptable, 1.0));
  EXPECT_FALSE(test.claim(acceptable, 1.0));
  EXPECT_FALSE(test.claim(large, 1.0));
  for (int k = 0; k < 2; ++k) EXPECT_FALSE(test.claim(acceptable, 1.0));
  EXPECT_EQ(test.claim(acceptable, 1.0), Status::SolvedToAcceptableLevel);
  test.begin_anew();
  EXPECT_FALSE(test.claim(acceptable, 1.0));
  EXPECT_EQ(test.claim(error_of(0.5 * options.tol), 1.0), Status::Solved);
}

TEST(FirstOrderTestTest, AcceptablePointsDoNotCountWhileTheObjectiveChanges) {
  SolverOptions options;
  options.acceptable_iter = 1;
  options.acceptable_obj_change_tol = 1e-3;
  FirstOrderTest test(options);
  const KktError acceptable = error_of(0.5 * options.acceptable_tol);
  EXPECT_FALSE(test.claim(acceptable, 5.0));
  EXPECT_FALSE(test.claim(acceptable, 6.0));
  EXPECT_EQ(test.claim(acceptable, 6.0), Status::SolvedToAcceptableLevel);
  options.acceptable_iter = 0;
  EXPECT_FALSE(FirstOrderTest(options).claim(acceptable, 0.0));
}

}  // namespace
}  // namespace ipminmax
