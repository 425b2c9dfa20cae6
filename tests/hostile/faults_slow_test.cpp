// A fault of the model at every call: a function fails, gives NaN or infinity, throws, throws
// bad_alloc, or the user stops. Whatever is answered is true, exceptions arrive as documented,
// nothing is left behind for the next solve. Through the core, Ipopt's interface and C.
//
// By hand: IPMINMAX_RUNS=200 IPMINMAX_SEED=7 hostile_faults_slow_test

#include <cstdio>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include <hostile/disturbed_problem.hpp>
#include <problems/random_game.hpp>
#include <support/dice.hpp>
#include <support/doors.hpp>
#include <support/judge_truth.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

using Ipopt::SmartPtr;

constexpr int kPlaces = 60;  // of faults, the first ones all

bool throws(Fault fault) { return fault == Fault::Throws || fault == Fault::ThrowsNumber; }

class HostileFaults {
 public:
  explicit HostileFaults(std::uint64_t seed)
      : game_(tame_game(seed)), model_(game_.model, game_.start) {
    DisturbedProblem problem(model_, Disturbance::None, 1);
    reference_ = solve(problem, game_.options);
    calls_ = problem.calls();
  }

  void run() {
    application_ = application_with(game_.options);
    for (int f = 0; f < kFaults; ++f) {
      for (const bool lasting : {false, true}) {
        for (int at = 1; at <= calls_; at += at < 40 ? 1 : 1 + calls_ / kPlaces) {
          SCOPED_TRACE("fault " + std::to_string(f) + " at call " + std::to_string(at) +
                       (lasting ? " and later" : ""));
          const auto fault = static_cast<Fault>(f);
          by_core(fault, at, lasting);
          if (at % 3 == 0) by_tnlp(fault, at, lasting);
          if (at % 3 == 1) by_c(fault, at, lasting);
          if (::testing::Test::HasFailure()) return;
        }
      }
    }
  }
  [[nodiscard]] int solves() const { return solves_; }

 private:
  void expect_true(Fault fault, DisturbedProblem& problem, const Result& result) {
    ++solves_;
    EXPECT_EQ(problem.calls_not_finite(), 0);
    EXPECT_EQ(TruthJudge(model_, game_.options, result, true).untruths(), "")
        << name_of(result.status);
    if (fault == Fault::ThrowsBadAlloc) {
      EXPECT_EQ(result.status, Status::OutOfMemory);
      // A game that is undefined at its start may have begun elsewhere.
      EXPECT_TRUE(result.message.starts_with("out of memory")) << result.message;
    }
  }

  void by_core(Fault fault, int at, bool lasting) {
    SCOPED_TRACE("core");
    DisturbedProblem problem(model_, Disturbance::None, 1);
    problem.commit(fault, at, lasting);
    bool thrown = false;
    try {
      const Result result =
          solve(problem, game_.options, [&](const IterationInfo&) { return problem.goes_on(); });
      expect_true(fault, problem, result);
    } catch (const std::runtime_error&) {
      thrown = fault == Fault::Throws;
    } catch (int) {
      thrown = fault == Fault::ThrowsNumber;
    }
    EXPECT_EQ(thrown, throws(fault));
  }

  void by_tnlp(Fault fault, int at, bool lasting) {
    SCOPED_TRACE("TNLP");
    DisturbedProblem problem(model_, Disturbance::None, 1);
    problem.commit(fault, at, lasting);
    const SmartPtr<DoorTnlp> model = new DoorTnlp(problem, [&] { return problem.goes_on(); });
    const SmartPtr<Ipopt::TNLP> game = split(model, model_.structure());
    const auto status = application_->OptimizeTNLP(game);
    EXPECT_EQ(model->finalized(), 1);
    if (throws(fault)) {
      EXPECT_EQ(status, Ipopt::NonIpopt_Exception_Thrown);
    } else {
      expect_true(fault, problem, application_->LastResult());
    }
    if (fault == Fault::ThrowsBadAlloc) {
      EXPECT_EQ(status, Ipopt::Insufficient_Memory);
    }
    DisturbedProblem clean(model_, Disturbance::None, 1);
    const SmartPtr<DoorTnlp> again = new DoorTnlp(clean, [] { return true; });
    static_cast<void>(application_->OptimizeTNLP(split(again, model_.structure())));
    expect_reference(application_->LastResult().status, application_->LastResult().v);
  }

  void by_c(Fault fault, int at, bool lasting) {
    SCOPED_TRACE("C");
    DisturbedProblem problem(model_, Disturbance::None, 1);
    problem.commit(fault, at, lasting);
    CDoor door(problem, game_.options, [&] { return problem.goes_on(); });
    ASSERT_NE(door.get(), nullptr) << IpminmaxMessage(nullptr);
    const auto status = door.solve(game_.start).status;
    ++solves_;
    if (throws(fault)) {
      EXPECT_EQ(status, IPMINMAX_NONIPOPT_EXCEPTION_THROWN);
    }
    if (fault == Fault::ThrowsBadAlloc) {
      EXPECT_EQ(status, IPMINMAX_INSUFFICIENT_MEMORY);
    }
    EXPECT_EQ(problem.calls_not_finite(), 0);
    problem.commit(fault, 0, false);
    problem.go_on();
    const CDoor::Answer again = door.solve(game_.start);
    if (!reference_.v.empty()) {
      EXPECT_EQ(again.x, reference_.v);
    }
  }

  void expect_reference(Status status, const std::vector<double>& v) const {
    EXPECT_EQ(status, reference_.status);
    EXPECT_EQ(v, reference_.v);
  }

  RandomGame game_;
  AutodiffProblem model_;
  Result reference_;
  int calls_ = 0, solves_ = 0;
  SmartPtr<MinMaxApplication> application_;
};

TEST(HostileFaults, AtEveryCall) {
  const std::uint64_t runs = number_from("IPMINMAX_RUNS", 8);
  const std::uint64_t first = number_from("IPMINMAX_SEED", 1);
  int solves = 0;
  for (std::uint64_t seed = first; seed < first + runs && !::testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    HostileFaults faults(seed);
    faults.run();
    solves += faults.solves();
  }
  std::printf("%d solves\n", solves);
}

}  // namespace
}  // namespace ipminmax::testing
