// Starts from which Ipopt calls a saddle or a maximum solved, and models without an answer.

#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include <ipminmax/core/solver.hpp>
#include <regression/not_minima.hpp>
#include <regression/problem_tnlp.hpp>
#include <support/judge_result.hpp>

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

}  // namespace
}  // namespace ipminmax::testing
