// Options drawn from the table, also wrong ones, and damaged options files: refused before the
// model is called, or the answer is true, and within the time limit.
//
// By hand: IPMINMAX_RUNS=20000 IPMINMAX_SEED=7 hostile_options_slow_test

#include <cmath>
#include <cstdio>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include <hostile/disturbed_problem.hpp>
#include <hostile/judge_certificate.hpp>
#include <hostile/random_options.hpp>
#include <problems/random_game.hpp>
#include <support/dice.hpp>
#include <support/doors.hpp>
#include <support/judge_truth.hpp>

#include "adapter/ipopt/application_options.hpp"
#include "adapter/ipopt/option_registry.hpp"
#include "adapter/ipopt/options_documentation.hpp"
#include "core/robust.hpp"
#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

using Ipopt::SmartPtr;

void print(const char* what, std::uint64_t runs, std::uint64_t refused) {
  std::printf("%llu %s, %llu refused\n", static_cast<unsigned long long>(runs), what,
              static_cast<unsigned long long>(refused));
}

void expect_true_certificate(Problem& model, const SolverOptions& options, const Result& result,
                             std::uint64_t seed) {
  if (result.certificate.kind != PointKind::LocalMinmax) return;
  const CertificateJudgement found = judge_certificate(model, options, result, seed);
  EXPECT_NE(found.verdict, CertificateVerdict::False) << found.why;
}

/// Whether minmax_epigraph_at_kinks has gone on over the branches of y: errors are then those of
/// the form that was solved.
bool is_over_branches(Problem& model, SolverOptions options, const Result& result) {
  if (!options.minmax_epigraph_at_kinks) return false;
  options.minmax_epigraph_at_kinks = false;
  return solve(model, options).v != result.v;
}

TEST(HostileOptions, OfTheTableAreRefusedOrTrue) {
  const std::uint64_t runs = number_from("IPMINMAX_RUNS", 1200);
  const std::uint64_t first = number_from("IPMINMAX_SEED", 1);
  std::uint64_t refused = 0;
  for (std::uint64_t seed = first; seed < first + runs; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const RandomGame game = tame_game(seed);
    const SolverOptions options = random_table_options(seed, seed % 4 == 0);
    AutodiffProblem model(game.model, game.start);
    DisturbedProblem problem(model, Disturbance::None, 1);
    const Result result = solve(problem, options);
    if (!check(options).empty()) {
      ++refused;
      EXPECT_EQ(result.status, Status::InvalidOption);
      EXPECT_EQ(problem.calls(), 0);
      continue;
    }
    EXPECT_EQ(problem.calls_not_finite(), 0);
    if (!is_over_branches(model, options, result)) {
      EXPECT_EQ(TruthJudge(model, options, result, false).untruths(), "") << name_of(result.status);
    }
    expect_true_certificate(model, options, result, seed);
    if (seed % 3 != 0 || options.minmax_epigraph_at_kinks) continue;
    const SmartPtr<MinMaxApplication> application = application_with(options);
    const SmartPtr<DoorTnlp> door = new DoorTnlp(problem, [] { return true; });
    static_cast<void>(application->OptimizeTNLP(split(door, model.structure())));
    EXPECT_EQ(TruthJudge(model, options, application->LastResult(), false).untruths(), "")
        << "TNLP: " << name_of(application->LastResult().status);
  }
  print("settings", runs, refused);
}

// What a search over the branches that meet at a kink leaves is not a point of the model's own.
TEST(HostileOptions, FailedSearchesOverBranchesLeaveTheModelsPoint) {
  std::uint64_t failed = 0;
  for (std::uint64_t seed = 1; seed <= 400; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const RandomGame game = tame_game(seed);
    SolverOptions options;
    options.minmax_epigraph_at_kinks = true;
    options.max_iter = 30;
    AutodiffProblem model(game.model, game.start);
    const RobustResult answer = solve_robust(model, options);
    if (is_success(answer.result.status)) continue;
    ++failed;
    EXPECT_EQ(TruthJudge(model, options, answer.result, false).untruths(), "")
        << name_of(answer.result.status);
  }
  EXPECT_GE(failed, 50U);
}

/// Options without files, MPI and limits of work.
std::string random_options_file(Dice& dice) {
  static const std::vector<OptionInfo> all = list_options();
  std::string text;
  for (int lines = 1 + dice.below(6); lines > 0; --lines) {
    const OptionInfo& option =
        all[static_cast<std::size_t>(dice.below(static_cast<int>(all.size())))];
    const auto has = [&](const char* part) {
      return std::string(option.name).find(part) != std::string::npos;
    };
    if (has("file") || has("starts") || has("max_iter") || has("time") || has("mpi")) continue;
    std::string value = default_of(option);
    if (std::holds_alternative<OptionInfo::Number>(option.kind)) {
      std::ostringstream number;
      number.precision(17);
      number << std::pow(10.0, dice.between(-9.0, 3.0));
      value = number.str();
    } else if (std::holds_alternative<OptionInfo::Integer>(option.kind)) {
      value = std::to_string(dice.below(9) - 1);
    } else if (const auto* choice = std::get_if<OptionInfo::Choice>(&option.kind)) {
      const int names = static_cast<int>(choice->names.size());
      value = choice->names[static_cast<std::size_t>(dice.below(names))];
    }
    if (value.find("mpi") != std::string::npos) continue;
    text += std::string(option.name) + dice.one_of({" ", "\t", "  "}) + value +
            dice.one_of({"\n", " # why\n", "\r\n", " "});
  }
  return text;
}

void damage(Dice& dice, std::string& text) {
  for (int k = dice.below(4); k > 0 && !text.empty(); --k) {
    const auto at = static_cast<std::size_t>(dice.below(static_cast<int>(text.size())));
    switch (dice.below(4)) {
      case 0:
        text.erase(at, static_cast<std::size_t>(1 + dice.below(5)));
        break;
      case 1:
        text[at] = static_cast<char>(dice.below(256));
        break;
      case 2:
        text.insert(at, dice.one_of({"\"", "#", "\n", " ", "1e999", "-", "nan", "\xff"}));
        break;
      default:
        text.resize(at);
    }
  }
}

TEST(HostileOptions, OfDamagedFilesAreRefusedOrTrue) {
  const std::uint64_t runs = number_from("IPMINMAX_RUNS", 1500);
  const std::uint64_t first = number_from("IPMINMAX_SEED", 1);
  std::uint64_t refused = 0;
  for (std::uint64_t seed = first; seed < first + runs; ++seed) {
    Dice dice(seed);
    std::string text = random_options_file(dice);
    damage(dice, text);
    SCOPED_TRACE("seed " + std::to_string(seed) + ":\n" + text);
    const RandomGame game = tame_game(seed);
    AutodiffProblem model(game.model, game.start);
    DisturbedProblem problem(model, Disturbance::None, 1);
    const SmartPtr<MinMaxApplication> application = new MinMaxApplication(false);
    application->Options()->SetIntegerValue("max_iter", 200);
    std::istringstream file(text);
    if (application->Initialize(file) != Ipopt::Solve_Succeeded) {
      ++refused;
      EXPECT_EQ(application->LastResult().status, Status::InvalidOption);
      EXPECT_FALSE(application->LastResult().message.empty());
      continue;
    }
    SolverOptions options;
    const std::string error = solver_options(*application->Options(), options);
    const SmartPtr<DoorTnlp> door = new DoorTnlp(problem, [] { return true; });
    static_cast<void>(application->OptimizeTNLP(split(door, model.structure())));
    const Result& result = application->LastResult();
    if (!error.empty()) {
      EXPECT_EQ(result.status, Status::InvalidOption) << error;
      EXPECT_EQ(problem.calls(), 0);
      ++refused;
      continue;
    }
    EXPECT_EQ(problem.calls_not_finite(), 0);
    // Errors are those of the barrier problem, or of another form.
    if (options.mu_target > 0.0 || options.minmax_epigraph ||
        is_over_branches(model, options, result)) {
      continue;
    }
    EXPECT_EQ(TruthJudge(model, options, result, false).untruths(), "") << name_of(result.status);
  }
  print("files", runs, refused);
}

// Shifts that grow by rounding only are never large enough.
TEST(HostileOptions, ShiftsGrow) {
  SolverOptions options;
  for (double SolverOptions::*factor :
       {&SolverOptions::perturb_inc_fact, &SolverOptions::perturb_inc_fact_first}) {
    options = {};
    options.*factor = 1.0 + 1e-12;
    EXPECT_NE(check(options), "");
  }
}

// A shift that has become zero stays zero, and a denormal one may round to itself: for ever.
TEST(HostileOptions, ShiftsGrowFromNothing) {
  constexpr double kTiny = 5e-324;
  SolverOptions decreasing, beginning;
  decreasing.min_hessian_perturbation = 0.0;
  decreasing.perturb_dec_fact = kTiny;
  beginning.first_hessian_perturbation = kTiny;
  beginning.perturb_inc_fact = beginning.perturb_inc_fact_first = 1.4;
  for (SolverOptions options : {decreasing, beginning}) {
    for (const Globalization method : {Globalization::Filter, Globalization::None}) {
      options.minmax_globalization = method;
      options.max_cpu_time = 20.0;
      options.max_iter = 40;
      Model model;  // either player needs shifts in several iterations
      const Expression x = model.variable(Player::Min, "x", -3.0, 3.0);
      const Expression y = model.variable(Player::Max, "y", -3.0, 3.0);
      model.objective(cos(x) + 0.3 * sin(3.0 * x) + x * y - cos(y) + 0.1 * pow(y, 3.0));
      AutodiffProblem problem(model, {0.3, 0.2});
      const Result result = solve(problem, options);
      EXPECT_NE(result.status, Status::MaxCpuTime);
      EXPECT_GT(result.factorizations, result.iterations);
    }
  }
}

TEST(HostileOptions, LimitsOfTimeHold) {
  const std::uint64_t runs = number_from("IPMINMAX_RUNS", 200);
  const std::uint64_t first = number_from("IPMINMAX_SEED", 1);
  double worst = 0.0;
  for (std::uint64_t seed = first; seed < first + runs; ++seed) {
    const RandomGame game = random_game(seed);
    AutodiffProblem model(game.model, game.start);
    SolverOptions options = game.options;
    options.max_iter = 1000000;
    options.max_cpu_time = 1e-3;
    const Result result = solve(model, options);
    worst = std::max(worst, result.cpu_seconds - options.max_cpu_time);
    EXPECT_EQ(TruthJudge(model, options, result, false).untruths(), "") << "seed " << seed;
  }
  std::printf("worst time over the limit: %.2g s\n", worst);
  EXPECT_LT(worst, 0.5);
}

}  // namespace
}  // namespace ipminmax::testing
