// Statistics of the default method over many starts, printed as tables.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include <problems/random_multimodal.hpp>
#include <problems/small_problems.hpp>
#include <support/judge_result.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

bool certified(const Result& result) { return result.certificate.kind == PointKind::LocalMinmax; }

const SmallProblem& problem_named(std::string_view name) {
  const auto& problems = small_problems();
  return *std::ranges::find(problems, name, &SmallProblem::name);
}

/// Counts over runs; per run means over the certified ones.
struct Tally {
  int runs = 0, certified = 0, unsound = 0;
  Index most_iterations = 0;  ///< of a run that is not certified
  double iterations = 0.0, full = 0.0, inner = 0.0, seconds = 0.0;
  std::map<std::string, int> statuses;

  void add(const Result& result) {
    ++runs;
    ++statuses[std::string(name_of(result.status))];
    if (!testing::certified(result)) {
      most_iterations = std::max(most_iterations, result.iterations);
      return;
    }
    ++certified;
    iterations += result.iterations;
    full += result.counts.factorizations_full;
    inner += result.counts.factorizations_inner;
    seconds += result.seconds;
  }
  [[nodiscard]] double mean(double sum) const { return sum / std::max(1, certified); }
  void print(const std::string& name) const {
    std::printf("%-26s %5d/%-5d it %6.2f  K %6.2f  Kyy %7.2f  ms %7.3f ", name.c_str(), certified,
                runs, mean(iterations), mean(full), mean(inner), 1e3 * mean(seconds));
    for (const auto& [status, count] : statuses) std::printf(" [%s %d]", status.c_str(), count);
    std::printf("\n");
  }
};

TEST(Convergence, OfThePapersFunctions) {
  constexpr int kStarts = 1000;
  for (const std::string_view name : {"paper_f1", "paper_f2", "paper_f3", "paper_f4"}) {
    AutodiffProblem problem(problem_named(name).model);
    for (const double box : {1.0, 2.0, 5.0, 10.0, 20.0}) {
      std::mt19937_64 generator(static_cast<std::uint64_t>(box));
      const auto coordinate = [&] {
        return box * (2.0 * static_cast<double>(generator() >> 11) * 0x1p-53 - 1.0);
      };
      Tally tally;
      int at_infinity_solved = 0;  // where f is flat to rounding, and said to be undecided
      for (int k = 0; k < kStarts; ++k) {
        const double x = coordinate(), y = coordinate();
        problem.set_start({x, y});
        const Result result = solve(problem, SolverOptions{});
        tally.add(result);
        // Where f2's gradient dies nothing is a solution, and little looks like one.
        const bool at_infinity = name == "paper_f2" && std::hypot(result.v[0], result.v[1]) > 25.0;
        at_infinity_solved += at_infinity && is_success(result.status) ? 1 : 0;
        EXPECT_FALSE(at_infinity && result.certificate.kind == PointKind::LocalMinmax)
            << name << " from " << x << ", " << y << ": " << name_of(result.status);
        if (name == "paper_f4") {
          EXPECT_EQ(result.certificate.answer, InnerAnswer::BestNotUnique);
          EXPECT_LE(result.iterations, 2);
        }
      }
      tally.print(std::string(name) + " in [-" + std::to_string(static_cast<int>(box)) + ", .]^2");
      if (name == "paper_f1" || name == "paper_f3") {
        EXPECT_GE(tally.certified, 999) << name << ' ' << box;
        EXPECT_LE(tally.mean(tally.iterations), 9.8) << name << ' ' << box;
      } else if (name == "paper_f2") {
        EXPECT_GE(tally.certified, box <= 10.0 ? 990 : 960) << box;
        EXPECT_LE(at_infinity_solved, kStarts / 50) << box;
        if (box <= 5.0) {
          EXPECT_LE(tally.mean(tally.iterations), 9.0) << box;
        }
      } else if (name == "paper_f4") {
        EXPECT_EQ(tally.certified, kStarts);
      }
    }
  }
}

TEST(Convergence, OfTheSmallProblems) {
  constexpr int kStarts = 100;
  Tally all;
  for (const SmallProblem& known : small_problems()) {
    AutodiffProblem problem(known.model);
    std::mt19937_64 generator(2);
    Tally tally;
    for (int k = 0; k < kStarts; ++k) {
      std::vector<double> start;
      for (const auto& [lower, upper] : known.random_start_box) {
        start.push_back(lower + (upper - lower) * static_cast<double>(generator() >> 11) * 0x1p-53);
      }
      problem.set_start(start);
      const Result result = solve(problem, SolverOptions{});
      tally.add(result);
      if (certified(result)) all.add(result);
    }
    tally.print(std::string(known.name));
    const bool strict =
        known.expectation == Expectation::Local || known.expectation == Expectation::Global;
    if (strict && known.name != "paper_f2") {
      EXPECT_GE(tally.certified, 95) << known.name;
    } else if (known.expectation == Expectation::None) {
      EXPECT_EQ(tally.certified, 0) << known.name;
      EXPECT_EQ(tally.statuses.count(std::string(name_of(Status::Solved))), 0U) << known.name;
      EXPECT_EQ(tally.statuses.count(std::string(name_of(Status::SolvedDegenerate))), 0U)
          << known.name;
      EXPECT_LE(tally.most_iterations, 400) << known.name;
    }
  }
  all.print("all certified runs");
  std::printf("per iteration: K %.2f, K_yy %.2f\n", all.full / all.iterations,
              all.inner / all.iterations);
  EXPECT_LE(all.inner / all.iterations, 3.1);
  EXPECT_LE(all.full / all.iterations, 2.0);
}

/// A method of the comparison on random problems.
struct Variant {
  std::string_view name;
  SolverOptions options;
};

std::vector<Variant> variants() {
  SolverOptions tuned;
  tuned.minmax_globalization = Globalization::None;
  tuned.max_iter = 300;
  SolverOptions printed = tuned;
  printed.minmax_barrier_rule = BarrierRule::Paper;
  printed.minmax_warm_start_shifts = false;
  SolverOptions lqac = tuned;
  lqac.minmax_instability = false;
  SolverOptions newton = tuned;
  newton.minmax_pure_newton = true;
  SolverOptions watchdog = tuned;
  watchdog.minmax_residual_watchdog = true;
  SolverOptions one_search;
  one_search.minmax_max_restarts = 0;
  std::vector<Variant> all{{"default", {}},
                           {"one search", one_search},
                           {"Algorithm 1, tuned", tuned},
                           {"tuned, watchdog", watchdog},
                           {"Algorithm 1, printed", printed},
                           {"without line 7", lqac},
                           {"Newton", newton}};
  for (Variant& variant : all) variant.options.tol = 1e-6;
  return all;
}

struct Family {
  MultimodalKind kind;
  int n, problems, starts;
  double least_share;  ///< of the union of all variants
};

class Multimodal : public ::testing::TestWithParam<Family> {};

TEST_P(Multimodal, ComesCloseToTheUnionOfAllMethods) {
  const Family family = GetParam();
  const std::vector<Variant> methods = variants();
  constexpr std::size_t kDefault = 0, kTuned = 2;
  std::vector<Tally> tallies(methods.size());
  int any = 0, both = 0;
  std::array<double, 2> factorizations{}, seconds{};  // where both are certified: default, tuned
  for (int p = 0; p < family.problems; ++p) {
    const auto seed = 20261121ULL * 1000 + static_cast<std::uint64_t>(p);
    const MultimodalProblem random = random_multimodal(family.kind, family.n, family.starts, seed);
    AutodiffProblem problem(random.model);
    for (const std::vector<double>& start : random.starts) {
      problem.set_start(start);
      bool found = false;
      std::vector<Result> results;
      for (std::size_t m = 0; m < methods.size(); ++m) {
        results.push_back(solve(problem, methods[m].options));
        const Result& result = results.back();
        tallies[m].add(result);
        if (is_success(result.status) || certified(result)) {
          const auto judged = judge(problem, result, {.first_order = 1e-5, .curvature = 1e-5});
          const bool sound = is_sound(result, judged);
          EXPECT_TRUE(sound) << methods[m].name << " problem " << p << ": " << judged;
          tallies[m].unsound += !sound;
        }
        found |= certified(result);
      }
      any += found;
      if (!certified(results[kDefault]) || !certified(results[kTuned])) continue;
      ++both;
      for (const auto& [slot, m] : {std::pair{0, kDefault}, std::pair{1, kTuned}}) {
        factorizations[static_cast<std::size_t>(slot)] += results[m].factorizations;
        seconds[static_cast<std::size_t>(slot)] += results[m].seconds;
      }
    }
  }
  std::printf("%d runs, certified by any method: %d\n", family.problems * family.starts, any);
  for (std::size_t m = 0; m < methods.size(); ++m) tallies[m].print(std::string(methods[m].name));
  std::printf("where default and tuned are certified (%d): factorizations %.2f, time %.2f times\n",
              both, factorizations[0] / std::max(1.0, factorizations[1]),
              seconds[0] / std::max(1e-9, seconds[1]));
  EXPECT_GE(tallies[kDefault].certified, family.least_share * any);
}

std::string family_name(const ::testing::TestParamInfo<Family>& family) {
  constexpr std::array kNames{"Free", "Box", "Constrained"};
  return kNames.at(static_cast<std::size_t>(family.param.kind)) + std::to_string(family.param.n);
}

INSTANTIATE_TEST_SUITE_P(Random, Multimodal,
                         ::testing::Values(Family{MultimodalKind::Free, 2, 40, 10, 0.96},
                                           Family{MultimodalKind::Box, 2, 40, 10, 0.97},
                                           Family{MultimodalKind::Constrained, 2, 40, 10, 0.93},
                                           Family{MultimodalKind::Free, 5, 20, 5, 0.5},
                                           Family{MultimodalKind::Box, 4, 20, 5, 0.8},
                                           Family{MultimodalKind::Constrained, 5, 20, 5, 0.8}),
                         family_name);

}  // namespace
}  // namespace ipminmax::testing
