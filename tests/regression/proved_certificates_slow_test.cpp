// How many of the certified answers can be proved, and at what cost: the table of certificates.

#include <chrono>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <problems/random_game.hpp>
#include <regression/hock_schittkowski.hpp>
#include <support/dense_judge.hpp>
#include <support/tape_over_boxes.hpp>

#include "core/proof/local_minmax.hpp"
#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

struct Tally {
  int certified = 0, strict = 0, regular = 0, proved = 0, regular_proved = 0, false_proofs = 0;
  double seconds_solve = 0.0, seconds_proof = 0.0, farthest = 0.0;
};

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void judge(const std::string& name, const Model& model, const std::vector<double>& start,
           Tally& tally, const SolverOptions& options = {}) {
  ProvableModel problem(model, start);
  const auto begin = std::chrono::steady_clock::now();
  Result result = solve(problem, options);
  const double solve_seconds = seconds_since(begin);
  if (result.certificate.kind != PointKind::LocalMinmax) return;
  const auto middle = std::chrono::steady_clock::now();
  prove_local_minmax(
      problem, {}, [] { return true; }, result);
  tally.seconds_proof += seconds_since(middle);
  tally.seconds_solve += solve_seconds;
  ExtendedModel functions(model);
  const DenseOptimality truth = optimality_near(functions, result);
  const bool strict = truth.verdict == Verdict::LocalMinmax;
  // Strict complementarity and independent gradients, which the proof needs.
  const bool regular = strict && truth.weakly_active == 0 && truth.independent;
  const bool proved = result.certificate.proved;
  ++tally.certified;
  tally.strict += strict;
  tally.proved += proved;
  tally.regular += regular;
  tally.regular_proved += regular && proved;
  tally.false_proofs += proved && truth.verdict == Verdict::NotLocalMinmax;
  if (proved) {
    tally.farthest = std::max(tally.farthest, result.certificate.proved_within);
  } else if (!name.empty()) {
    std::printf("  %-28s %s (check: %s, weak %d%s)\n", name.c_str(),
                result.certificate.proof.c_str(), std::string(verdict_name(truth.verdict)).c_str(),
                truth.weakly_active, truth.independent ? "" : ", dependent");
  }
}

void print(const Tally& tally) {
  std::printf(
      "certified %d, strict %d, regular %d, proved %d (%d of the regular ones), false %d; "
      "farthest %.1e; "
      "seconds: solves %.2f, proofs %.2f\n",
      tally.certified, tally.strict, tally.regular, tally.proved, tally.regular_proved,
      tally.false_proofs, tally.farthest, tally.seconds_solve, tally.seconds_proof);
}

/// Random formulas and options, tame games and wild ones in turns.
TEST(ProvedCertificates, OfRandomGames) {
  Tally tally;
  for (std::uint64_t seed = 20261123; seed < 20261123 + 3000; ++seed) {
    const RandomGame game = seed % 2 == 0 ? tame_game(seed) : random_game(seed);
    SolverOptions options = game.options;
    options.max_cpu_time = SolverOptions{}.max_cpu_time;
    judge("", game.model, game.start, tally, options);
  }
  print(tally);
  EXPECT_EQ(tally.false_proofs, 0);
  EXPECT_GT(tally.proved, 0.5 * tally.regular);
}

TEST(ProvedCertificates, OfHockAndSchittkowskiAndTheirTwins) {
  Tally tally;
  for (const MinimizationProblem& known : hock_schittkowski()) {
    judge(known.name, known.model, known.start, tally);
    AutodiffProblem problem(known.model, known.start);
    const Result result = solve(problem, SolverOptions{});
    if (!is_success(result.status) || known.model.variables() >= 64) continue;
    std::vector<double> start = known.start;
    start.push_back(0.1);
    judge(known.name + " twin of Min", twin(known.model, Player::Min, result.v), start, tally);
    judge(known.name + " twin of Max", twin(known.model, Player::Max, result.v), start, tally);
  }
  print(tally);
  EXPECT_EQ(tally.false_proofs, 0);
  EXPECT_GE(tally.proved, 0.87 * tally.strict);
}

}  // namespace
}  // namespace ipminmax::testing
