// What the pursuit costs as its horizon is refined, in factorizations: of the iterations, of the
// certificate.
#include <gtest/gtest.h>

#include <memory>

#include "../../examples/chauffeur_tnlp.hpp"
#include "adapter/ipopt/tnlp_problem.hpp"
#include "core/solver.hpp"

namespace ipminmax {
namespace {

chauffeur::Parameters slower_steering(int horizon) {
  chauffeur::Parameters parameters = chauffeur::refined(horizon);
  parameters.u_max *= 0.5;
  parameters.d_max *= 2.0;
  return parameters;
}

Result solve_refined(int horizon, const chauffeur::Parameters& parameters) {
  const chauffeur::Control guess{0.2 / horizon, 0.04 / horizon, 0.02 / horizon};
  TnlpProblem problem(new chauffeur::ChauffeurTNLP(parameters, {}, guess));
  EXPECT_EQ(problem.load(), "");
  SolverOptions options;
  options.tol = 1e-6;
  return solve(problem, options);
}

Result solve_refined(int horizon) { return solve_refined(horizon, chauffeur::refined(horizon)); }

TEST(RefinedHorizon, TakesFewFactorizationsPerIteration) {
  for (const int horizon : {20, 50, 100, 200, 300, 500, 1000}) {
    const Result r = solve_refined(horizon);
    EXPECT_EQ(r.certificate.kind, PointKind::LocalMinmax) << horizon;
    EXPECT_LE(r.factorizations, 4 * r.iterations) << horizon;
    EXPECT_LE(r.factorizations, 50) << horizon;
  }
}

TEST(RefinedHorizon, TakesNoMoreWhereTheBoundsAreAsSmallAsTolerances) {
  // The evader's bound 1.44 / T^2 is less than 1e-7. Fewer iterations than above, of more each.
  const auto expect_few = [](const Result& r, int horizon) {
    EXPECT_EQ(r.certificate.kind, PointKind::LocalMinmax) << horizon;
    EXPECT_LE(r.factorizations, 80) << horizon;
  };
  expect_few(solve_refined(4000), 4000);
  expect_few(solve_refined(4000, slower_steering(4000)), 4000);
  expect_few(solve_refined(10000), 10000);
}

TEST(RefinedHorizon, IsCertifiedWithFewFactorizationsMore) {
  // Where controls switch, bounds are nearly weakly active.
  for (const int horizon : {50, 100, 300, 1000}) {
    const Result r = solve_refined(horizon);
    const auto& test = r.counts.factorizations_for(FactorizationCause::Certificate);
    EXPECT_EQ(r.certificate.kind, PointKind::LocalMinmax) << horizon;
    EXPECT_LE(test.full + test.inner, 6) << horizon;
    EXPECT_LE(r.error.total, 1e-6) << horizon;
  }
}

}  // namespace
}  // namespace ipminmax
