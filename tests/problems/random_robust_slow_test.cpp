// Random robust programs: what is certified is judged by maximizations of every row over y that
// share nothing with the solver.
//
// By hand, any number of programs from any seed, in units near one or in others, of any size, with
// any number of starts of the judge for each row:
//   IPMINMAX_RUNS=1000 IPMINMAX_SEED=7 IPMINMAX_DISTURBANCES=4 IPMINMAX_ASCENTS=30
//   problems_random_robust_slow_test --gtest_filter='*Violated'
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <random>

#include <gtest/gtest.h>

#include <hostile/rewritten_problem.hpp>
#include <problems/random_robust.hpp>
#include <support/dice.hpp>

#include "core/robust.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax::testing {
namespace {

struct Counted {
  int programs = 0, solved = 0, certified = 0, violated = 0, false_ones = 0;
};

/// Every variable in a unit between 1 / most and most.
Rewriting in_other_units(Problem& model, double most, std::mt19937_64& random) {
  Rewriting rewriting = Rewriting::unchanged(model);
  std::uniform_real_distribution<double> exponent(-std::log(most), std::log(most));
  for (std::size_t i = 0; i < rewriting.variables.size(); ++i) {
    const double unit = std::exp(exponent(random));
    rewriting.a.diagonal()[static_cast<Eigen::Index>(i)] = unit;
    Rewriting::Variable& variable = rewriting.variables[i];
    for (double* value : {&variable.lower, &variable.upper, &variable.start}) *value /= unit;
  }
  return rewriting;
}

/// Each program has a seed of its own; variables in units between 1 / most_unit and most_unit.
Counted count(int programs, std::uint64_t seed, double most_unit = 1.0) {
  Counted counted;
  const auto disturbances = static_cast<Eigen::Index>(number_from("IPMINMAX_DISTURBANCES", 20));
  const auto ascents = static_cast<int>(number_from("IPMINMAX_ASCENTS", 200));
  for (int k = 0; k < programs; ++k) {
    std::mt19937_64 random(seed + static_cast<std::uint64_t>(k));
    const RobustProgram p = RobustProgram::random(random, disturbances);
    RobustProgramModel model(p);
    const Rewriting units = in_other_units(model, most_unit, random);
    RewrittenProblem problem(model, units);
    SolverOptions options;
    options.minmax_max_factorizations = 50000;
    const Result result = solve_robust(problem, options).result;
    ++counted.programs;
    if (!is_success(result.status)) continue;
    ++counted.solved;
    const bool certified = result.certificate.kind == PointKind::LocalMinmax;
    counted.certified += certified ? 1 : 0;
    const Eigen::VectorXd x = units.original(result.v).head(p.target.size());
    double worst = -kInfinity;
    for (const RobustRow& row : p.rows) {
      worst = std::max(worst, p.largest(row, x, ascents, random));
    }
    if (worst <= 1e-5) continue;
    ++counted.violated;
    counted.false_ones += certified ? 1 : 0;
    std::printf("program of seed %llu: violated by %.2e%s\n",
                static_cast<unsigned long long>(seed) + static_cast<unsigned long long>(k), worst,
                certified ? ", certified" : "");
  }
  std::printf("%d programs: %d solved, %d certified, %d violated, %d of these certified\n",
              counted.programs, counted.solved, counted.certified, counted.violated,
              counted.false_ones);
  return counted;
}

TEST(RandomRobustPrograms, NoneIsCertifiedThatIsViolated) {
  const auto programs = static_cast<int>(number_from("IPMINMAX_RUNS", 20));
  const Counted counted = count(programs, number_from("IPMINMAX_SEED", 20261123));
  EXPECT_EQ(counted.false_ones, 0);
  EXPECT_GE(counted.solved, 8 * counted.programs / 10);
}

TEST(RandomRobustPrograms, NoneIsCertifiedThatIsViolatedInOtherUnits) {
  const auto programs = static_cast<int>(number_from("IPMINMAX_RUNS", 20));
  const double most_unit = 1e6;
  const Counted counted = count(programs, number_from("IPMINMAX_SEED", 20261127), most_unit);
  EXPECT_EQ(counted.false_ones, 0);
  EXPECT_GE(counted.solved, 8 * counted.programs / 10);
}

// A row over fifteen disturbances, of which no start but one below a climb finds the highest
// maximum; one over seven, with two active maxima of one value: that is no reason to look no
// longer; one over six, with a maximum 6e-5 above the active one beside it, a bound away; and one
// over fourteen whose eight starts end at one maximum, 1.6 below the bound.
TEST(RandomRobustPrograms, OnceFalse) {
  for (const std::uint64_t seed : {830000588, 833000733, 830000439, 833000749}) {
    EXPECT_EQ(count(1, seed).false_ones, 0) << seed;
  }
}

}  // namespace
}  // namespace ipminmax::testing
