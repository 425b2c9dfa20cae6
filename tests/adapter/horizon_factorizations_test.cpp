// What the pursuit costs as its horizon is refined, in factorizations: of the iterations, of the
// certificate.
#include <gtest/gtest.h>

#include <memory>

#include "../../examples/chauffeur_tnlp.hpp"
#include "adapter/tnlp_problem.hpp"
#include "core/solver.hpp"

namespace ipminmax {
namespace {

Result solve_refined(int horizon) {
  const chauffeur::Control guess{0.2 / horizon, 0.04 / horizon, 0.02 / horizon};
  TnlpProblem problem(new chauffeur::ChauffeurTNLP(chauffeur::refined(horizon), {}, guess));
  EXPECT_EQ(problem.load(), "");
  SolverOptions options;
  options.tol = 1e-6;
  return solve(problem, options);
}

TEST(RefinedHorizon, TakesFewFactorizationsPerIteration) {
  for (const int horizon : {20, 50, 100, 200, 300, 500, 1000}) {
    const Result r = solve_refined(horizon);
    EXPECT_EQ(r.certificate.kind, PointKind::LocalMinmax) << horizon;
    EXPECT_LE(r.factorizations, 4 * r.iterations) << horizon;
    EXPECT_LE(r.factorizations, 50) << horizon;
  }
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
