#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <problems/small_problems.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

TEST(SuperlinearTail, ShowsWhereStrictComplementarityHolds) {
  int solved = 0;
  for (const SmallProblem& known : small_problems()) {
    if (known.expectation != Expectation::Local && known.expectation != Expectation::Global)
      continue;
    AutodiffProblem problem(known.model);
    for (const std::vector<double>& start : known.starts) {
      problem.set_start(start);
      std::vector<double> errors;
      const Result result = solve(problem, SolverOptions{}, [&](const IterationInfo& info) {
        errors.push_back(info.error.total);
        return true;
      });
      const Certificate& found = result.certificate;
      const bool strict = found.weakly_active_min + found.weakly_active_max == 0;
      if (found.kind != PointKind::LocalMinmax || !strict || errors.size() < 4) continue;
      ++solved;
      std::printf("%-18s", known.name.c_str());
      for (const double error : errors) std::printf(" %5.1f", std::log10(std::max(error, 1e-16)));
      std::printf("\n");
      // The error ends below the 1.3th power of that of two iterations before, one step of which
      // may be spent on a smaller barrier parameter.
      const double last = errors.back();
      const double before = errors[errors.size() - 3];
      EXPECT_LE(last, std::max(std::pow(std::min(before, 1.0), 1.3), 1e-8)) << known.name;
      EXPECT_LE(last, 1e-2 * before) << known.name;
    }
  }
  EXPECT_GE(solved, 20);
}

TEST(FreezeNeighbourhood, TakesOneFactorizationPerIterationAndTestsBothMatricesAtTheEnd) {
  Index frozen = 0, certified = 0;
  for (const SmallProblem& known : small_problems()) {
    AutodiffProblem problem(known.model);
    for (const std::vector<double>& start : known.starts) {
      problem.set_start(start);
      Index full = 0, inner = 0;  // told before the certificate
      bool after_full_newton_step = false;
      const Result result = solve(problem, SolverOptions{}, [&](const IterationInfo& info) {
        full += info.factorizations_full;
        inner += info.factorizations_inner;
        if (info.iteration > 0 && info.step_kind == 'n' && info.factorizations_inner == 0) {
          ++frozen;
          EXPECT_TRUE(after_full_newton_step) << known.name;
          EXPECT_EQ(info.factorizations_full, 1) << known.name;
          EXPECT_EQ(info.alpha_primal, 1.0) << known.name;
          EXPECT_EQ(info.delta_x, 0.0) << known.name;
          EXPECT_EQ(info.delta_y, 0.0) << known.name;
        }
        after_full_newton_step = info.step_kind == 'n' && info.alpha_primal == 1.0;
        return true;
      });
      if (result.certificate.kind != PointKind::LocalMinmax) continue;
      ++certified;
      EXPECT_GT(result.counts.factorizations_full, full) << known.name;
      EXPECT_GT(result.counts.factorizations_inner, inner) << known.name;
    }
  }
  EXPECT_GE(frozen, 20);
  EXPECT_GE(certified, 30);
}

}  // namespace
}  // namespace ipminmax::testing
