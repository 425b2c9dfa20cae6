// mu_strategy adaptive against monotone on all minimizations.

#include <cmath>
#include <cstdio>
#include <string>

#include <gtest/gtest.h>

#include <regression/hock_schittkowski.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

struct Strategy {
  std::string name;
  BarrierOracle oracle;
  AdaptiveGlobalization globalization;
};

SolverOptions options_of(const Strategy& strategy) {
  SolverOptions options;
  options.mu_strategy = BarrierStrategy::Adaptive;
  options.mu_oracle = strategy.oracle;
  options.adaptive_mu_globalization = strategy.globalization;
  return options;
}

class AdaptiveBarrierRule : public ::testing::TestWithParam<Strategy> {};

TEST_P(AdaptiveBarrierRule, SolvesWhatTheMonotoneRuleSolves) {
  const SolverOptions adaptive = options_of(GetParam());
  int solved_monotone = 0, solved = 0, lost = 0, compared = 0;
  double log_iterations = 0.0;
  for (const MinimizationProblem& known : hock_schittkowski()) {
    AutodiffProblem problem(known.model, known.start);
    const Result monotone = solve(problem, SolverOptions{});
    const Result ours = solve(problem, adaptive);
    solved_monotone += is_success(monotone.status);
    solved += is_success(ours.status);
    if (is_success(monotone.status) && !is_success(ours.status)) {
      ++lost;
      std::printf("%-20s %s: %s\n", known.name.c_str(), std::string(name_of(ours.status)).c_str(),
                  ours.message.c_str());
    }
    if (!is_success(monotone.status) || !is_success(ours.status)) continue;
    const bool same = std::abs(ours.objective - monotone.objective) <=
                      1e-5 * std::max(1.0, std::abs(monotone.objective));
    EXPECT_TRUE(same || known.several_minima || known.degenerate)
        << known.name << ": " << ours.objective << " instead of " << monotone.objective;
    if (!same) continue;
    ++compared;
    log_iterations += std::log((1.0 + static_cast<double>(ours.iterations)) /
                               (1.0 + static_cast<double>(monotone.iterations)));
  }
  const double mean = std::exp(log_iterations / compared);
  std::printf(
      "%s: %zu problems, solved by monotone %d, adaptive %d; iterations %.3f of monotone's "
      "over %d\n",
      GetParam().name.c_str(), hock_schittkowski().size(), solved_monotone, solved, mean, compared);
  EXPECT_LE(lost, GetParam().name == "loqo" ? 1 : 0);  // hs116: steps too small
}

INSTANTIATE_TEST_SUITE_P(
    Regression, AdaptiveBarrierRule,
    ::testing::Values(Strategy{"quality_function", BarrierOracle::QualityFunction,
                               AdaptiveGlobalization::KktError},
                      Strategy{"probing", BarrierOracle::Probing, AdaptiveGlobalization::KktError},
                      Strategy{"loqo", BarrierOracle::Loqo, AdaptiveGlobalization::KktError},
                      Strategy{"filter", BarrierOracle::QualityFunction,
                               AdaptiveGlobalization::ObjectiveFilter},
                      Strategy{"never_monotone", BarrierOracle::QualityFunction,
                               AdaptiveGlobalization::NeverMonotone}),
    [](const auto& instance) { return instance.param.name; });

}  // namespace
}  // namespace ipminmax::testing
