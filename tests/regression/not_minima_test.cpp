// Starts from which Ipopt calls a saddle or a maximum solved, and models without an answer.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

#include <gtest/gtest.h>

#include <regression/not_minima.hpp>
#include <regression/problem_tnlp.hpp>
#include <support/judge_result.hpp>

#include "adapter/ipopt/status.hpp"
#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

SolverOptions options_with(Globalization globalization) {
  SolverOptions options;
  options.minmax_globalization = globalization;
  return options;
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) largest = std::max(largest, std::abs(a[i] - b[i]));
  return largest;
}

class NotMinima : public ::testing::TestWithParam<std::size_t> {
 protected:
  const NotMinimum& known_ = not_minima()[GetParam()];
  AutodiffProblem problem_{known_.model, known_.start};
};

TEST_P(NotMinima, IpoptCallsSolved) {
  const IpoptAnswer answer = solve_with_ipopt(problem_);
  EXPECT_TRUE(answer.solved()) << answer.status;
  ASSERT_EQ(answer.v.size(), known_.point.size());
  EXPECT_LT(distance(answer.v, known_.point), 1e-4) << ::testing::PrintToString(answer.v);
}

TEST_P(NotMinima, PointIsNoMinimum) {
  const DenseOptimality found = dense_optimality(problem_, known_.point);
  EXPECT_EQ(found.verdict, known_.second_order ? Verdict::NotLocalMinmax : Verdict::Undecided)
      << found;
}

TEST_P(NotMinima, IsNotCertified) {
  for (const Globalization globalization : {Globalization::None, Globalization::Filter}) {
    const Result result = solve(problem_, options_with(globalization));
    const DenseOptimality found = judge(problem_, result);
    EXPECT_TRUE(is_sound(result, found))
        << name_of(result.status) << " at " << ::testing::PrintToString(result.v) << ", but found "
        << found;
    if (result.v.empty() || distance(result.v, known_.point) > 1e-4) continue;
    EXPECT_NE(result.status, Status::Solved);
    if (known_.second_order) {
      EXPECT_FALSE(is_success(result.status)) << name_of(result.status);
    }
  }
}

// A move along the tangent alone leaves a bent feasible set, and the objective need not fall on it.
TEST(NotMinimaOnBentSets, AreLeftForACertifiedMinimum) {
  for (const NotMinimum& known : not_minima()) {
    const bool bent = known.name == "far_side_of_circle" ||
                      known.name == "farthest_point_of_circle" ||
                      known.name == "middle_eigenvector" || known.name == "top_of_parabola";
    if (!bent) continue;
    AutodiffProblem problem(known.model, known.start);
    const Result result = solve(problem, options_with(Globalization::Filter));
    EXPECT_EQ(result.status, Status::Solved) << known.name << ": " << result.message;
    EXPECT_GT(distance(result.v, known.point), 1e-2) << known.name;
    const DenseOptimality found = judge(problem, result);
    EXPECT_EQ(found.verdict, Verdict::LocalMinmax) << known.name << ": " << found;
  }
}

INSTANTIATE_TEST_SUITE_P(Regression, NotMinima,
                         ::testing::Range<std::size_t>(0, not_minima().size()),
                         [](const auto& instance) { return not_minima()[instance.param].name; });

class IllPosedModel : public ::testing::TestWithParam<std::size_t> {};

TEST_P(IllPosedModel, VerdictIsHonest) {
  const IllPosed& known = ill_posed()[GetParam()];
  AutodiffProblem problem(known.model, known.start);
  const Result result = solve(problem, options_with(Globalization::Filter));
  EXPECT_NE(std::ranges::find(known.verdicts, result.status), known.verdicts.end())
      << name_of(result.status) << ": " << result.message << " at "
      << ::testing::PrintToString(result.v);
}

INSTANTIATE_TEST_SUITE_P(Regression, IllPosedModel,
                         ::testing::Range<std::size_t>(0, ill_posed().size()),
                         [](const auto& instance) { return ill_posed()[instance.param].name; });

// Whatever Ipopt calls solved there, ours is a certified minimum below it.
TEST(NotMinimaTable, OursAreCertifiedMinima) {
  int ipopt_solved = 0, certified = 0;
  std::printf("%-26s %-18s %12s   %-10s %12s  %-14s %s\n", "model", "Ipopt", "objective",
              "this solver", "objective", "certificate", "dense check of ours");
  for (const NotMinimum& known : not_minima()) {
    AutodiffProblem problem(known.model, known.start);
    const IpoptAnswer ipopt = solve_with_ipopt(problem);
    const Result ours = solve(problem, SolverOptions{});
    const DenseOptimality found = judge(problem, ours);
    std::printf("%-26s %-18s %12.5g   %-10s %12.5g  %-14s %s\n", known.name.c_str(),
                std::string(name_of(ipopt.status)).c_str(), ipopt.objective,
                std::string(name_of(ours.status)).c_str(), ours.objective,
                std::string(name_of(ours.certificate.kind)).c_str(),
                found.verdict == Verdict::LocalMinmax ? "minimum"
                : found.verdict == Verdict::Undecided ? "weakly active bound"
                                                      : "no minimum");
    ipopt_solved += ipopt.solved();
    const bool is_certified = ours.status == Status::Solved &&
                              ours.certificate.kind == PointKind::LocalMinmax &&
                              found.verdict != Verdict::NotLocalMinmax;
    certified += is_certified;
    EXPECT_TRUE(is_certified) << known.name;
    EXPECT_LT(ours.objective, ipopt.objective - 1e-4) << known.name;
  }
  std::printf(
      "%zu starts: Ipopt calls %d points solved that are no minima, %d certified minima here\n",
      not_minima().size(), ipopt_solved, certified);
  EXPECT_GE(ipopt_solved, 8);
}

/// What a status claims of the model; nothing where the solver gave up.
std::optional<Truth> claim(Ipopt::ApplicationReturnStatus status) {
  switch (status) {
    case Ipopt::Solve_Succeeded:
    case Ipopt::Solved_To_Acceptable_Level:
    case Ipopt::Feasible_Point_Found:
      return Truth::HasSolution;
    case Ipopt::Infeasible_Problem_Detected:
      return Truth::Infeasible;
    case Ipopt::Diverging_Iterates:
      return Truth::NoMinimum;
    case Ipopt::Invalid_Problem_Definition:
    case Ipopt::Invalid_Number_Detected:
      return Truth::Invalid;
    default:
      return std::nullopt;
  }
}

TEST(IllPosedTable, VerdictIsThatOfIpoptOrBetter) {
  int same = 0, better = 0;
  std::printf("%-30s %-15s %-34s %-36s %s\n", "model", "truth", "Ipopt", "this solver", "verdict");
  for (const IllPosed& known : ill_posed()) {
    AutodiffProblem problem(known.model, known.start);
    const IpoptAnswer ipopt = solve_with_ipopt(problem);
    const Result ours = solve(problem, SolverOptions{});
    // Ours in Ipopt's terms; an undefined function at the start is -13 or -1 there.
    const auto our_claim = ours.status == Status::EvaluationFailed
                               ? std::optional(Truth::Invalid)
                               : claim(application_status(ours.status));
    const auto ipopt_claim = claim(ipopt.status);
    const bool is_same = our_claim == ipopt_claim;
    const bool is_better = !is_same && our_claim == known.truth;
    same += is_same;
    better += is_better;
    std::printf("%-30s %-15s %-34s %-36s %s\n", known.name.c_str(),
                std::string(describe(known.truth)).c_str(),
                std::string(name_of(ipopt.status)).c_str(),
                std::string(name_of(ours.status)).c_str(),
                is_same     ? "same"
                : is_better ? "better"
                            : "worse");
    EXPECT_TRUE(is_same || is_better) << known.name << ": " << ours.message;
    if (ours.status == Status::OuterUnbounded) {
      EXPECT_LE(ours.iterations, 200) << known.name;
    }
  }
  std::printf("%zu models: same verdict as Ipopt's %d, better %d\n", ill_posed().size(), same,
              better);
}

}  // namespace
}  // namespace ipminmax::testing
