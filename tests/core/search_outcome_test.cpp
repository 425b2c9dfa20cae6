#include <optional>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>

#include "core/model/canonical_problem.hpp"
#include "core/parallel/ranks.hpp"
#include "core/search/first_order_test.hpp"
#include "core/search/outcome.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Model;

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

/// Points of x^2 with errors of a size.
class FirstOrderTestTest : public ::testing::Test {
 protected:
  [[nodiscard]] static Model model() {
    Model model;
    model.objective(square(model.variable(Player::Min, "x")));
    return model;
  }
  [[nodiscard]] const Point& point(double error, double objective = 1.0) {
    if (!canonical_) {
      canonical_.emplace(problem_, options, counts_, timing_);
      EXPECT_EQ(canonical_->build(), "");
      point_ = unevaluated_point(*canonical_, canonical_->starting_point());
      point_.dual.setZero(canonical_->variables());
    }
    point_.error = error_of(error);
    point_.evaluation.f = objective;
    return point_;
  }
  [[nodiscard]] const Point& acceptable(double objective = 1.0) {
    return point(0.5 * options.acceptable_tol, objective);
  }
  [[nodiscard]] FirstOrderTest test() {
    static_cast<void>(point(1.0));
    return FirstOrderTest(*canonical_, options);
  }

  SolverOptions options;

 private:
  AutodiffProblem problem_{model(), {1.0}};
  Counts counts_;
  Timing timing_;
  std::optional<CanonicalProblem> canonical_;
  Point point_;
};

TEST_F(FirstOrderTestTest, AcceptablePointsCountInARow) {
  options.acceptable_iter = 3;
  FirstOrderTest first_order = test();
  EXPECT_FALSE(first_order.passed(acceptable()));
  EXPECT_FALSE(first_order.passed(acceptable()));
  EXPECT_FALSE(first_order.passed(point(1.0)));
  for (int k = 0; k < 2; ++k) EXPECT_FALSE(first_order.passed(acceptable()));
  EXPECT_EQ(first_order.passed(acceptable()), Status::SolvedToAcceptableLevel);
  first_order.begin_anew();
  EXPECT_FALSE(first_order.passed(acceptable()));
  EXPECT_EQ(first_order.passed(point(0.5 * options.tol)), Status::Solved);
}

TEST_F(FirstOrderTestTest, AcceptablePointsDoNotCountWhileTheObjectiveChanges) {
  options.acceptable_iter = 1;
  options.acceptable_obj_change_tol = 1e-3;
  FirstOrderTest first_order = test();
  EXPECT_FALSE(first_order.passed(acceptable(5.0)));
  EXPECT_FALSE(first_order.passed(acceptable(6.0)));
  EXPECT_EQ(first_order.passed(acceptable(6.0)), Status::SolvedToAcceptableLevel);
  options.acceptable_iter = 0;
  EXPECT_FALSE(test().passed(acceptable(0.0)));
}

}  // namespace
}  // namespace ipminmax
