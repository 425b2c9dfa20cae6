// The minimizations without second derivatives: differences lose next to nothing, and certify no
// more than is true.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include <gtest/gtest.h>

#include <regression/hock_schittkowski.hpp>
#include <regression/not_minima.hpp>
#include <support/judge_result.hpp>
#include <support/without_hessian.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

TEST(FiniteDifferences, SolveHockSchittkowskiAsExactHessiansDo) {
  int certified = 0, lost = 0;
  for (const MinimizationProblem& known : hock_schittkowski()) {
    AutodiffProblem problem(known.model, known.start);
    const Result exact = solve(problem, SolverOptions{});
    WithoutHessian blind(problem);
    const Result found = solve(blind, SolverOptions{});
    const DenseOptimality judged = judge(problem, found);
    const bool is_certified = found.certificate.kind == PointKind::LocalMinmax;
    if (is_certified) {
      // The point itself may miss tight first-order tolerances; its curvature must be right.
      EXPECT_NE(judged.verdict, Verdict::NotLocalMinmax) << known.name << ": " << judged;
    }
    if (exact.certificate.kind != PointKind::LocalMinmax) continue;
    ++certified;
    if (is_certified && std::abs(found.objective - exact.objective) <=
                            1e-6 * std::max(1.0, std::abs(exact.objective))) {
      continue;
    }
    ++lost;
    std::printf("%s: %s, error %.1e\n", known.name.c_str(),
                std::string(name_of(found.status)).c_str(), found.certificate.hessian_error);
  }
  EXPECT_GE(certified, 140);
  EXPECT_LE(lost, 3);
}

TEST(FiniteDifferences, CertifyNoSaddle) {
  for (const NotMinimum& known : not_minima()) {
    AutodiffProblem problem(known.model, known.start);
    WithoutHessian blind(problem);
    const Result result = solve(blind, SolverOptions{});
    if (result.v.empty() || distance(result.v, known.point) > 1e-4) continue;
    EXPECT_NE(result.status, Status::Solved) << known.name;
    if (known.second_order) {
      EXPECT_FALSE(is_success(result.status)) << known.name << name_of(result.status);
    }
  }
}

}  // namespace
}  // namespace ipminmax::testing
