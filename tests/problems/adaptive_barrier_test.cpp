// mu_strategy adaptive against monotone on the small minmax problems.

#include <cstdio>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include <problems/small_problems.hpp>
#include <support/judge_result.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

struct Tally {
  int runs = 0, certified = 0;
  long iterations = 0;
};

Tally run_all(const SolverOptions& options) {
  Tally tally;
  for (const SmallProblem& known : small_problems()) {
    for (const auto& start : known.starts) {
      AutodiffProblem problem(known.model, start);
      const Result result = solve(problem, options);
      ++tally.runs;
      tally.iterations += result.iterations;
      if (result.status != Status::Solved) continue;
      ++tally.certified;
      const DenseOptimality found = judge(problem, result);
      EXPECT_NE(found.verdict, Verdict::NotLocalMinmax) << known.name << ": " << found;
    }
  }
  return tally;
}

TEST(AdaptiveBarrierRule, CertifiesMinmaxPointsAsOftenAsTheMonotoneRule) {
  const Tally monotone = run_all({});
  std::printf("monotone: certified %d of %d, %ld iterations\n", monotone.certified, monotone.runs,
              monotone.iterations);
  for (const auto& [name, oracle] :
       {std::pair("quality-function", BarrierOracle::QualityFunction),
        std::pair("probing", BarrierOracle::Probing), std::pair("loqo", BarrierOracle::Loqo)}) {
    SolverOptions options;
    options.mu_strategy = BarrierStrategy::Adaptive;
    options.mu_oracle = oracle;
    const Tally adaptive = run_all(options);
    std::printf("%s: certified %d of %d, %ld iterations\n", name, adaptive.certified, adaptive.runs,
                adaptive.iterations);
    EXPECT_GE(adaptive.certified, monotone.certified - 2) << name;
  }
}

TEST(AdaptiveBarrierRule, RefusesTheObjectiveFilterForMinmax) {
  SolverOptions options;
  options.mu_strategy = BarrierStrategy::Adaptive;
  options.adaptive_mu_globalization = AdaptiveGlobalization::ObjectiveFilter;
  const SmallProblem& known = small_problems().front();
  AutodiffProblem problem(known.model, known.starts.front());
  const Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::InvalidOption);
  EXPECT_NE(result.message.find("obj-constr-filter"), std::string::npos) << result.message;
}

}  // namespace
}  // namespace ipminmax::testing
