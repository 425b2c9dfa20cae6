// Solves the collection from its stated starts and from random ones. No answer may claim more than
// dense linear algebra confirms; how many runs must end certified is stated per problem.

#include <algorithm>
#include <cstdio>
#include <random>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include <problems/small_problems.hpp>
#include <support/judge_result.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

constexpr int kRandomStarts = 20;

/// Least numbers of certified runs from the stated and from the random starts.
struct Required {
  std::string_view name;
  int stated = 0;
  int random = 0;
};

constexpr Required kRequired[] = {
    {"paper_f1", 1, 19},
    {"paper_f2", 1, 8},
    {"paper_f3", 2, 19},
    {"paper_ex3", 1, 19},
    {"tc1", 1, 19},
    {"adolphs", 2, 19},
    {"jin_nash", 1, 19},
    {"grimmer_A1", 2, 19},
    {"dp1", 1, 19},
    {"dp_poly", 1, 19},
    {"dirac_gan_reg", 1, 19},
    {"nls_freudenstein", 1, 19},
    {"nls_jennrich", 1, 15},
    {"nls_wood", 1, 19},
    {"tc5", 1, 19},
    {"kbeam_rot", 1, 19},
    {"kbeam_f13", 1, 19},
    {"kbeam_weapons", 1, 19},
    {"forsaken_variant", 1, 19},
    {"rh1", 1, 19},
    {"rh3", 1, 19},
    {"rh5", 1, 19},
    {"rh7", 2, 19},
    {"ea3", 2, 19},
    {"ea5", 1, 19},
    {"tc2.5", 1, 19},
    {"tc3.5", 1, 19},
    {"bolib_tp7", 2, 19},
    {"attack_ball", 1, 19},
    {"eq_coupled", 1, 19},
    {"hyperbola", 1, 19},
};

Required required_of(std::string_view name) {
  const auto* found = std::ranges::find(kRequired, name, &Required::name);
  return found == std::end(kRequired) ? Required{name} : *found;
}

/// What became of a number of runs.
struct Tally {
  int runs = 0;
  int certified = 0;   ///< kind LocalMinmax
  int degenerate = 0;  ///< success, second-order test undecided
  int known = 0;       ///< certified, at a listed solution
  int unsound = 0;
  Index iterations = 0;  ///< of certified runs
};

class SolveSmall : public ::testing::TestWithParam<std::size_t> {
 protected:
  void run(const std::vector<double>& start, Tally& tally) {
    problem_.set_start(start);
    const Result result = solve(problem_, SolverOptions{});
    const DenseOptimality found = judge(problem_, result, tolerances(start));
    ++tally.runs;
    if (!is_sound(result, found)) {
      ++tally.unsound;
      ADD_FAILURE() << known_.name << " from " << ::testing::PrintToString(start) << " ended at "
                    << ::testing::PrintToString(result.v) << " with status "
                    << name_of(result.status) << ", kind " << name_of(result.certificate.kind)
                    << ", but found " << found;
    }
    if (result.certificate.kind == PointKind::LocalMinmax) {
      ++tally.certified;
      tally.iterations += result.iterations;
      if (is_known(result)) ++tally.known;
      EXPECT_NE(known_.expectation, Expectation::None)
          << known_.name
          << " has no local minmax, certified: " << ::testing::PrintToString(result.v);
    } else if (is_success(result.status)) {
      ++tally.degenerate;
    }
  }

  /// tol is on the scaled problem: gradients above 100 at the start are scaled down to it.
  DenseTolerances tolerances(const std::vector<double>& start) {
    const Eigen::VectorXd v =
        Eigen::Map<const Eigen::VectorXd>(start.data(), static_cast<Eigen::Index>(start.size()));
    const double gradient = DenseEvaluation(problem_, v).gradient.lpNorm<Eigen::Infinity>();
    return {.first_order = 1e-6 * std::clamp(gradient / 100.0, 1.0, 1e8), .curvature = 1e-5};
  }

  [[nodiscard]] bool is_known(const Result& result) const {
    return std::ranges::any_of(known_.solutions, [&](const KnownSolution& solution) {
      for (std::size_t i = 0; i < solution.v.size(); ++i) {
        if (std::abs(solution.v[i] - result.v[i]) > 1e-5 * (1.0 + std::abs(solution.v[i]))) {
          return false;
        }
      }
      return true;
    });
  }

  void print(const char* starts, const Tally& tally) const {
    std::printf(
        "%-18s %-7s runs %3d certified %3d (listed %3d) degenerate %3d iterations %.1f\n",
        known_.name.c_str(), starts, tally.runs, tally.certified, tally.known, tally.degenerate,
        tally.certified == 0 ? 0.0 : static_cast<double>(tally.iterations) / tally.certified);
  }

  const SmallProblem& known_ = small_problems()[GetParam()];
  AutodiffProblem problem_{known_.model};
};

TEST_P(SolveSmall, FromStatedAndRandomStarts) {
  Tally stated, drawn;
  for (const auto& start : known_.starts) run(start, stated);
  std::mt19937 random(7);
  for (int trial = 0; trial < kRandomStarts; ++trial) {
    std::vector<double> start;
    for (const Interval& side : known_.random_start_box) {
      start.push_back(std::uniform_real_distribution(side.lower, side.upper)(random));
    }
    run(start, drawn);
  }
  print("stated", stated);
  print("random", drawn);
  EXPECT_GE(stated.certified, required_of(known_.name).stated);
  EXPECT_GE(drawn.certified, required_of(known_.name).random);
}

INSTANTIATE_TEST_SUITE_P(Small, SolveSmall,
                         ::testing::Range<std::size_t>(0, small_problems().size()),
                         [](const auto& instance) {
                           std::string name = small_problems()[instance.param].name;
                           std::ranges::replace(name, '.', '_');
                           return name;
                         });

TEST(SolveSmall, RequirementsNameProblems) {
  for (const Required& required : kRequired) {
    EXPECT_NO_THROW((void)small_problem(std::string(required.name)));
  }
}

}  // namespace
}  // namespace ipminmax::testing
