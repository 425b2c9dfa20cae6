// Minimizations solved by Ipopt and by this solver. A solved point may not be worse than Ipopt's
// unless it is another local minimum; what dense linear algebra refutes may not be called solved.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include <gtest/gtest.h>

#include <regression/effort_table.hpp>
#include <regression/hock_schittkowski.hpp>
#include <support/judge_result.hpp>

#include "adapter/ipopt/cross_check.hpp"
#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

CrossCheck cross_check(const MinimizationProblem& known) {
  AutodiffProblem problem(known.model, known.start);
  return cross_check_with_ipopt(problem);
}

// A logarithm is undefined at the model's own start, which the bounds push back inside.
TEST(StartOutsideTheBounds, IsSolvedAsByIpopt) {
  MinimizationProblem known = hock_schittkowski("hs112");
  known.start[0] = -0.05;
  EXPECT_EQ(cross_check(known).verdict, CrossCheckVerdict::SameSolution);
}

// The gradient of an eighth power meets the tolerances far from the minimum, and Newton's steps
// lead outward to it, but ever shorter.
TEST(HighPower, IsNoRunToInfinity) {
  const MinimizationProblem& known = hock_schittkowski("hs213");
  AutodiffProblem problem(known.model, perturbed_start(known, 6));
  const CrossCheck check = cross_check_with_ipopt(problem);
  EXPECT_EQ(check.ours.status, Status::SolvedDegenerate);
  EXPECT_TRUE(check.ipopt.solved());
}

// Whether or not the point is moved back into its bounds at the end.
TEST(ReportedObjective, IsThatOfTheReturnedPoint) {
  int moved = 0;
  for (const MinimizationProblem& known : hock_schittkowski()) {
    AutodiffProblem problem(known.model, known.start);
    SolverOptions options;
    const Result relaxed = solve(problem, options);
    options.honor_original_bounds = true;
    const Result honored = solve(problem, options);
    moved += relaxed.v != honored.v;
    for (const Result& result : {relaxed, honored}) {
      double f = 0.0;
      ASSERT_TRUE(problem.objective(result.v, true, f)) << known.name;
      EXPECT_EQ(result.objective, f) << known.name;
    }
  }
  EXPECT_GE(moved, 10);
}

/// What a solve to tol 1e-8 leaves in the units of the model: bounds and rows are relaxed by 1e-8
/// of their size, and the stopping test sees the objective divided by its largest slope at the
/// start over 100.
DenseTolerances tolerances_for(Problem& problem, const std::vector<double>& start) {
  double size = 50.0;
  const ProblemStructure& structure = problem.structure();
  for (const auto* bounds : {&structure.variable_lower, &structure.variable_upper,
                             &structure.constraint_lower, &structure.constraint_upper}) {
    for (const double bound : *bounds) {
      if (std::abs(bound) < 1e19) size = std::max(size, std::abs(bound));
    }
  }
  std::vector<double> gradient(start.size());
  if (problem.gradient(start, true, gradient)) {
    for (const double slope : gradient) size = std::max(size, std::abs(slope) / 100.0);
  }
  return {.first_order = 2e-8 * size, .curvature = 1e-5};
}

class HockSchittkowski : public ::testing::TestWithParam<std::size_t> {
 protected:
  const MinimizationProblem& known_ = hock_schittkowski()[GetParam()];
  CrossCheck check_ = cross_check(known_);
  const Result& ours_ = check_.ours;
  const IpoptAnswer& ipopt_ = check_.ipopt;

  void expect_sound();
  void expect_solved_where_ipopt_solves();
  void expect_not_worse();
  void expect_best_known_objective();
  void expect_multipliers_where_points_agree();
};

void HockSchittkowski::expect_sound() {
  AutodiffProblem problem(known_.model, known_.start);
  const DenseOptimality found = judge(problem, ours_, tolerances_for(problem, known_.start));
  EXPECT_TRUE(is_sound(ours_, found) ||
              (ours_.status == Status::SolvedDegenerate && known_.degenerate))
      << name_of(ours_.status) << ", kind " << name_of(ours_.certificate.kind) << " at "
      << ::testing::PrintToString(ours_.v) << ", but found " << found;
}

void HockSchittkowski::expect_solved_where_ipopt_solves() {
  if (ipopt_.solved() && !known_.degenerate) {
    EXPECT_TRUE(is_success(ours_.status)) << ours_.message;
  }
}

void HockSchittkowski::expect_not_worse() {
  if (check_.verdict == CrossCheckVerdict::OursBetter) {
    std::printf("%s: better than Ipopt, %.8g < %.8g\n", known_.name.c_str(), ours_.objective,
                ipopt_.objective);
  }
  if (check_.verdict != CrossCheckVerdict::IpoptBetter) return;
  EXPECT_TRUE(known_.several_minima || known_.degenerate)
      << ours_.objective << " > " << ipopt_.objective;
  EXPECT_GT(check_.difference.point, 1e-4) << ours_.objective << " > " << ipopt_.objective;
  std::printf("%s: another local minimum, %.8g > %.8g\n", known_.name.c_str(), ours_.objective,
              ipopt_.objective);
}

void HockSchittkowski::expect_best_known_objective() {
  if (!is_success(ours_.status)) return;
  // Bounds and rows are relaxed by 1e-8, which multipliers magnify.
  double multipliers = 1.0;
  for (const auto* vector : {&ours_.lambda, &ours_.z_lower, &ours_.z_upper}) {
    for (const double value : *vector) multipliers += std::abs(value);
  }
  if (known_.degenerate) return;
  EXPECT_GE(ours_.objective,
            known_.objective - 1e-6 * std::max(multipliers, std::abs(known_.objective)));
  if (!known_.several_minima) {
    EXPECT_LE(ours_.objective,
              known_.objective + 1e-6 * std::max(multipliers, std::abs(known_.objective)));
  }
}

void HockSchittkowski::expect_multipliers_where_points_agree() {
  if (!ipopt_.solved() || ours_.status != Status::Solved || known_.degenerate ||
      check_.difference.point > 1e-6) {
    return;
  }
  for (const CertificateReason& reason : ours_.certificate.reasons) {
    if (reason.kind == CertificateReason::Kind::FlatDirection) return;  // one of many points
  }
  constexpr double kTolerance = 1e-4;
  EXPECT_LE(check_.difference.lambda, kTolerance) << check_.report();
  EXPECT_LE(check_.difference.z_lower, kTolerance) << check_.report();
  EXPECT_LE(check_.difference.z_upper, kTolerance) << check_.report();
}

TEST_P(HockSchittkowski, AnswerIsThatOfIpopt) {
  expect_sound();
  expect_solved_where_ipopt_solves();
  expect_not_worse();
  expect_best_known_objective();
  expect_multipliers_where_points_agree();
}

INSTANTIATE_TEST_SUITE_P(CrossCheck, HockSchittkowski,
                         ::testing::Range<std::size_t>(0, hock_schittkowski().size()),
                         [](const auto& instance) {
                           return hock_schittkowski()[instance.param].name;
                         });

// All that Ipopt solves, for no more work.
TEST(CrossCheckTable, EffortIsThatOfIpopt) {
  EffortTable table;
  EffortTable::print_header();
  for (const MinimizationProblem& known : hock_schittkowski()) {
    const CrossCheck check = cross_check(known);
    table.add(known.name, check.ipopt, check.ours);
  }
  table.print_summary();
  EXPECT_GE(table.ours_solved, table.ipopt_solved);
  EXPECT_EQ(table.both_solved, table.ipopt_solved);
  EXPECT_LE(table.ipopt_better, table.ours_better);
  EXPECT_LE(table.iterations.mean(), 1.1);
  EXPECT_LE(table.evaluations.mean(), 1.1);
  EXPECT_LE(table.factorizations.mean(), 1.3);
}

}  // namespace
}  // namespace ipminmax::testing
