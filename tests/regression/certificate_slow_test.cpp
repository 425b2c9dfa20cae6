// What the certificate says of answers, beside a dense check in extended precision: minimizations,
// minmax twins of them, scalable families.

#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <problems/scalable_problems.hpp>
#include <regression/hock_schittkowski.hpp>
#include <regression/scalable_nlp.hpp>
#include <support/dense_judge.hpp>
#include <support/units_problem.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

struct Tally {
  int runs = 0, solved = 0, certified = 0, undecided = 0, flat = 0;
  int strict = 0, strict_certified = 0;
  int unjustified = 0;  ///< certified, but the check finds a wrong sign or none
  int wrongly_refuted = 0;
  Index factorizations = 0, after_convergence = 0;  ///< of undecided answers
};

void print(const char* name, const Tally& t) {
  std::printf(
      "%-24s runs %4d solved %4d certified %4d undecided %3d flat %3d | strict %4d, of them "
      "certified %4d "
      "| unjustified %d, wrongly refuted %d | factorizations of undecided: %d, %d after "
      "convergence\n",
      name, t.runs, t.solved, t.certified, t.undecided, t.flat, t.strict, t.strict_certified,
      t.unjustified, t.wrongly_refuted, t.factorizations, t.after_convergence);
}

Tally& operator+=(Tally& sum, const Tally& t) {
  sum.solved += t.solved;
  sum.undecided += t.undecided;
  sum.strict += t.strict;
  sum.strict_certified += t.strict_certified;
  sum.unjustified += t.unjustified;
  sum.wrongly_refuted += t.wrongly_refuted;
  return sum;
}

void expect(const Tally& t, double least_certified) {
  EXPECT_EQ(t.unjustified, 0);
  EXPECT_EQ(t.wrongly_refuted, 0);
  EXPECT_GE(t.strict_certified, least_certified * t.strict);
  EXPECT_LE(t.undecided, 0.08 * t.solved);
}

void print_reasons(const Certificate& found) {
  for (const CertificateReason& reason : found.reasons) {
    std::printf("      %s\n", reason.text.c_str());
  }
}

void judge(const std::string& name, Problem& problem, ExtendedFunctions& functions, Tally& tally) {
  SolveObserver observer;
  Index iterating = 0;
  observer.on_iteration = [&](const IterationInfo& info) {
    iterating += info.factorizations_full + info.factorizations_inner;
    return true;
  };
  const Result result = solve(problem, SolverOptions{}, observer);
  ++tally.runs;
  const Certificate& found = result.certificate;
  const bool refuted = found.second_order == SecondOrder::Violated;
  if (!is_success(result.status) && !refuted) return;
  const DenseOptimality truth = optimality_near(functions, result);
  const bool certified = found.kind == PointKind::LocalMinmax;
  const bool strict = truth.verdict == Verdict::LocalMinmax;
  if (is_success(result.status)) {
    ++tally.solved;
    tally.certified += certified;
    if (!certified) {
      ++tally.undecided;
      tally.factorizations += result.factorizations;
      tally.after_convergence += result.factorizations - iterating;
    }
    tally.strict += strict;
    tally.strict_certified += strict && certified;
    tally.unjustified += certified && truth.verdict == Verdict::NotLocalMinmax;
  }
  tally.wrongly_refuted += refuted && strict;
  if (certified == strict && !(refuted && strict)) return;
  std::printf(
      "  %-28s %-10s check: %-14s curvature %9.2e residual %8.1e moved %8.1e weak %d %s| K_yy "
      "%d/%d K %d/%d weak %d %d licq %d %d it %d fact %d after %d\n",
      name.c_str(), std::string(name_of(found.second_order)).c_str(),
      std::string(verdict_name(truth.verdict)).c_str(),
      std::min(truth.inner_curvature, truth.outer_curvature), truth.stationarity, truth.moved,
      truth.weakly_active, truth.independent ? "" : "dependent ", found.inner.negative,
      found.inner_expected.negative, found.full.negative, found.full_expected.negative,
      found.weakly_active_min, found.weakly_active_max, found.licq_min, found.licq_max,
      result.iterations, result.factorizations, result.factorizations - iterating);
  if (refuted) {
    std::printf("      f %.12g at", result.objective);
    for (const double value : result.v) std::printf(" %.9g", value);
    std::printf("\n");
  }
  print_reasons(found);
}

void judge(const std::string& name, const Model& model, const std::vector<double>& start,
           Tally& tally) {
  AutodiffProblem problem(model, start);
  ExtendedModel functions(model);
  judge(name, problem, functions, tally);
}

TEST(CertificateTable, HockSchittkowski) {
  Tally minimizations, min_twins, max_twins;
  for (const MinimizationProblem& known : hock_schittkowski()) {
    judge(known.name, known.model, known.start, minimizations);
    AutodiffProblem problem(known.model, known.start);
    const Result result = solve(problem, SolverOptions{});
    if (!is_success(result.status) || known.model.variables() >= 64) continue;
    std::vector<double> start = known.start;
    start.push_back(0.1);
    judge(known.name + " twin of Min", twin(known.model, Player::Min, result.v), start, min_twins);
    judge(known.name + " twin of Max", twin(known.model, Player::Max, result.v), start, max_twins);
  }
  print("minimizations", minimizations);
  print("twins, Min's rows", min_twins);
  print("twins, Max's rows", max_twins);
  Tally all;
  for (const Tally& tally : {minimizations, min_twins, max_twins}) all += tally;
  // Not certified: hs116, its twin and hs108's, flat once bounds are relaxed.
  expect(all, 0.97);
}

/// The problems and their twins with units of 10^-6 to 10^6 for each variable and constraint, which
/// relaxed bounds move by up to a hundredth of their units: judged in the units of the model.
TEST(CertificateTable, InOtherUnits) {
  int all = 0, certified = 0;
  std::uint64_t seed = 0;
  const auto run = [&](const std::string& name, const Model& model,
                       const std::vector<double>& start) {
    AutodiffProblem problem(model, start);
    UnitsProblem other = UnitsProblem::random(problem, 6, ++seed);
    const Result result = solve(other, SolverOptions{});
    const Certificate& found = result.certificate;
    const bool refuted = found.second_order == SecondOrder::Violated;
    if (!is_success(result.status) && !refuted) return;
    ExtendedModel functions(model);
    const DenseOptimality truth = optimality_near(functions, other.original(result));
    const bool strict = truth.verdict == Verdict::LocalMinmax;
    const std::vector<double> v = other.original(result).v;
    double size = 1.0;
    for (const double value : v) size = std::max(size, std::abs(value));
    // As far as relaxed bounds move it.
    const bool strict_there = strict && truth.moved <= 2e-2 * size;
    const bool relaxed = std::ranges::any_of(found.reasons, [](const CertificateReason& reason) {
      return reason.kind == CertificateReason::Kind::Relaxed;
    });
    // Elsewhere the check is about another point than the one between relaxed bounds.
    const bool wrong = truth.verdict == Verdict::NotLocalMinmax && truth.moved < 1e-6;
    EXPECT_FALSE(refuted && strict_there) << name;
    EXPECT_FALSE(found.kind == PointKind::LocalMinmax && wrong) << name;
    EXPECT_FALSE(found.kind == PointKind::LocalMinmax && strict && !strict_there && !relaxed)
        << name << ": the solution is farther by " << truth.moved;
    if (refuted || !strict_there) return;
    ++all;
    if (found.kind == PointKind::LocalMinmax) {
      ++certified;
      return;
    }
    std::printf("  %s\n", name.c_str());
    print_reasons(found);
  };
  for (const MinimizationProblem& known : hock_schittkowski()) {
    run(known.name, known.model, known.start);
    AutodiffProblem problem(known.model, known.start);
    const Result result = solve(problem, SolverOptions{});
    if (!is_success(result.status) || known.model.variables() >= 64) continue;
    std::vector<double> start = known.start;
    start.push_back(0.1);
    run(known.name + " twin of Min", twin(known.model, Player::Min, result.v), start);
    run(known.name + " twin of Max", twin(known.model, Player::Max, result.v), start);
  }
  std::printf("in other units: strict %d, of them certified %d\n", all, certified);
  EXPECT_GT(all, 400);
  EXPECT_GE(certified, 0.97 * all);
}

TEST(CertificateTable, ScalableFamilies) {
  Tally tally;
  for (const ScalableNlp& family : scalable_nlps()) {
    for (const Index n : {20, 40}) {
      const auto problem = family.make(n);
      ExtendedProblem functions(*problem);
      judge(family.name + " " + std::to_string(n), *problem, functions, tally);
    }
  }
  for (ScalableProblem& family : small_scalable_problems()) {
    ExtendedProblem functions(*family.problem);
    judge(family.name, *family.problem, functions, tally);
  }
  print("scalable families", tally);
  expect(tally, 0.97);  // all but one
}

}  // namespace
}  // namespace ipminmax::testing
