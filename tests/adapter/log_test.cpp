// The texts of the console log.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "adapter/ipopt/log.hpp"

namespace ipminmax {
namespace {

std::vector<std::string> words(const std::string& line) {
  std::istringstream stream(line);
  std::vector<std::string> result;
  for (std::string word; stream >> word;) result.push_back(word);
  return result;
}

std::string line_with(const std::string& text, const std::string& part) {
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) {
    if (line.find(part) != std::string::npos) return line;
  }
  return {};
}

/// The last two words of the line that holds part.
std::vector<std::string> last_two(const std::string& text, const std::string& part) {
  auto all = words(line_with(text, part));
  if (all.size() < 2) return all;
  return {all.end() - 2, all.end()};
}
using Words = std::vector<std::string>;

IterationInfo some_iteration() {
  IterationInfo info;
  info.iteration = 12;
  info.objective = -123.456;
  info.error = {.primal = 1e-3, .dual_min = 2e-4, .dual_max = 3e-5, .complementarity = 1.0};
  info.mu = 1e-5;
  info.step_norm = 0.5;
  info.delta_x = 1e-4;
  info.alpha_dual = 1.0;
  info.alpha_primal = 0.25;
  info.step_kind = 'f';
  info.trials = 3;
  return info;
}

TEST(IterationTable, ARow) {
  EXPECT_EQ(words(log::iteration_header()),
            (Words{"iter", "objective", "inf_pr", "inf_dx", "inf_dy", "lg(mu)", "||d||", "lg(rgx)",
                   "lg(rgy)", "alpha_du", "alpha_pr", "ls"}));
  EXPECT_EQ(words(log::iteration_row(some_iteration())),
            (Words{"12", "-1.2345600e+02", "1.00e-03", "2.00e-04", "3.00e-05", "-5.0", "5.00e-01",
                   "-4.0", "-", "1.00e+00", "2.50e-01f", "3"}));
}

TEST(IterationTable, DashesWhereNothingWasDone) {
  IterationInfo info;
  info.mu = 0.1;
  EXPECT_EQ(words(log::iteration_row(info)),
            (Words{"0", "0.0000000e+00", "0.00e+00", "0.00e+00", "0.00e+00", "-1.0", "-", "-", "-",
                   "-", "-", "-"}));
  info = some_iteration();
  info.mu = 0.0;
  info.delta_x = 0.0;
  info.delta_y = 1e2;
  const auto row = words(log::iteration_row(info));
  EXPECT_EQ(row[5], "-");
  EXPECT_EQ(row[7], "-");
  EXPECT_EQ(row[8], "2.0");
}

TEST(IterationTable, ColumnsStandBelowTheirHeadings) {
  const std::string header = log::iteration_header();
  const std::string row = log::iteration_row(some_iteration());
  EXPECT_EQ(header.size(), row.size());
  IterationInfo start;
  start.mu = 0.1;
  EXPECT_EQ(log::iteration_row(start).size(), row.size());
  for (const std::string heading : {"inf_pr", "inf_dx", "inf_dy", "lg(mu)", "lg(rgx)"}) {
    const std::size_t end = header.find(heading) + heading.size();
    EXPECT_NE(row[end - 1], ' ') << heading;
    EXPECT_EQ(row[end], ' ') << heading;
  }
}

// Programs that read Ipopt's log split lines that begin with a digit at blanks into ten columns.
TEST(IterationTable, IpoptsColumns) {
  EXPECT_EQ(words(log::ipopt_iteration_header()),
            (Words{"iter", "objective", "inf_pr", "inf_du", "lg(mu)", "||d||", "lg(rg)", "alpha_du",
                   "alpha_pr", "ls"}));
  IterationInfo info = some_iteration();
  info.delta_y = 1e-2;
  EXPECT_EQ(words(log::ipopt_iteration_row(info, info.iteration)),
            (Words{"12", "-1.2345600e+02", "1.00e-03", "2.00e-04", "-5.0", "5.00e-01", "-2.0",
                   "1.00e+00", "2.50e-01f", "3"}));
  info.step_kind = 'j';  // Ipopt has no such letter
  EXPECT_EQ(words(log::ipopt_iteration_row(info, info.iteration))[8], "2.50e-01n");
  info.iteration = 0;
  EXPECT_EQ(words(log::ipopt_iteration_row(info, info.iteration)).size(), 10U);
  info.restoration = true;
  EXPECT_EQ(words(log::ipopt_iteration_row(info, 12))[0], "12r-1.2345600e+02");  // as Ipopt's
}

TEST(Summary, IpoptsErrors) {
  Result result;
  result.objective = -2.5;
  result.error = {.primal = 1e-3, .dual_min = 2e-4, .dual_max = 3e-3, .complementarity = 1e-5};
  result.error.total = 1e-9;
  const std::string text = log::ipopt_errors(result);
  EXPECT_EQ(last_two(text, "Objective......"),
            (Words{"-2.5000000000000000e+00", "-2.5000000000000000e+00"}));
  EXPECT_EQ(last_two(text, "Dual infeasibility......:")[1], "3.0000000000000001e-03");
  EXPECT_EQ(last_two(text, "Overall NLP error.......:"),
            (Words{"1.0000000000000001e-09", "3.0000000000000001e-03"}));
}

// Pyomo, parmest and others take these out of Ipopt's log.
TEST(Summary, IpoptsWords) {
  EXPECT_NE(log::ipopt_solver_line("mumps").find("running with linear solver mumps."),
            std::string::npos);
  ProblemStructure structure;
  structure.constraint_players = {Player::Min, Player::Min};
  structure.constraint_lower = {0.0, 1.0};
  structure.constraint_upper = {0.0, 2.0};
  Result result;
  result.counts.constraints = 7;
  result.counts.jacobian = 5;
  result.timing.total = result.cpu_seconds = 3.0;
  result.timing.evaluations = 1.0;
  std::string text = log::ipopt_work(result, structure);
  EXPECT_EQ(line_with(text, "inequality constraint ev"),
            "Number of inequality constraint evaluations          = 7");
  EXPECT_EQ(last_two(text, "Number of equality constraint Jacobian"), (Words{"=", "5"}));
  EXPECT_EQ(last_two(text, "in IPOPT")[0], "=");
  EXPECT_EQ(last_two(text, "in NLP function evaluations   "), (Words{"=", "1.000"}));
  structure.constraint_upper = {1.0, 2.0};
  text = log::ipopt_work(result, structure);
  EXPECT_EQ(last_two(text, "of equality constraint evaluations"), (Words{"=", "0"}));
  EXPECT_EQ(last_two(text, "of inequality constraint evaluations"), (Words{"=", "7"}));

  const auto exit_of = [](Status status) {
    Result ended;
    ended.status = status;
    return line_with(log::ipopt_exit_line(ended), "EXIT:");
  };
  EXPECT_EQ(exit_of(Status::Solved), "EXIT: Optimal Solution Found.");
  EXPECT_EQ(exit_of(Status::SolvedDegenerate), "EXIT: Optimal Solution Found.");
  EXPECT_EQ(exit_of(Status::NotLocalMinmax), "EXIT: Search Direction is becoming Too Small.");
  EXPECT_EQ(exit_of(Status::OuterUnbounded),
            "EXIT: Iterates diverging; problem might be unbounded.");
  EXPECT_EQ(exit_of(Status::MaxIterations), "EXIT: Maximum Number of Iterations Exceeded.");
  EXPECT_EQ(exit_of(Status::LinearSolverFailed), "EXIT: Error in step computation!");
  Result ended;
  ended.status = Status::NotLocalMinmax;  // our own words follow
  EXPECT_NE(log::ipopt_exit_line(ended).find("not a local minmax"), std::string::npos);
}

TEST(IterationTable, UnusualValuesStayInTheirColumns) {
  IterationInfo info = some_iteration();
  info.iteration = 99999;
  info.objective = -1e300;
  info.error.primal = 1e120;
  info.step_kind = ' ';
  EXPECT_EQ(words(log::iteration_row(info)).size(), 12U);
}

// Min: v0 free, v1 fixed, v2 in [0, 1]; Max: v3 >= 0, v4 <= 0, v5 in [0, 1].
// Min: g0 = 0, g1 <= 1; Max: g2 in [0, 1], g3 >= 0.
ProblemStructure some_structure() {
  using enum Player;
  ProblemStructure structure;
  structure.variable_players = {Min, Min, Min, Max, Max, Max};
  structure.variable_lower = {-1e20, 2, 0, 0, -1e19, 0};
  structure.variable_upper = {1e20, 2, 1, 1e19, 0, 1};
  structure.constraint_players = {Min, Min, Max, Max};
  structure.constraint_lower = {0, -1e20, 0, 0};
  structure.constraint_upper = {0, 1, 1, 1e20};
  structure.jacobian = {{0, 0}, {0, 1}, {1, 2}, {2, 3}, {2, 4}, {3, 5}};
  structure.hessian = {{0, 0}, {3, 0}, {3, 3}};
  return structure;
}

TEST(ProblemStatistics, CountsPerPlayer) {
  const std::string text = log::problem_statistics(some_structure(), {});
  EXPECT_EQ(last_two(text, "nonzeros in equality"), (Words{"2", "0"}));
  EXPECT_EQ(last_two(text, "nonzeros in inequality"), (Words{"1", "3"}));
  EXPECT_EQ(last_two(text, "Lagrangian Hessian").back(), "3");
  EXPECT_EQ(last_two(text, "Total number of variables"), (Words{"3", "3"}));
  EXPECT_EQ(last_two(text, "fixed variables"), (Words{"1", "0"}));
  EXPECT_EQ(last_two(text, " variables with only lower"), (Words{"0", "1"}));
  EXPECT_EQ(last_two(text, "variables with lower and upper"), (Words{"1", "1"}));
  EXPECT_EQ(last_two(text, "variables with only upper"), (Words{"0", "1"}));
  EXPECT_EQ(last_two(text, "Total number of equality"), (Words{"1", "0"}));
  EXPECT_EQ(last_two(text, "Total number of inequality"), (Words{"1", "2"}));
  EXPECT_EQ(last_two(text, "constraints with only lower"), (Words{"0", "1"}));
  EXPECT_EQ(last_two(text, "constraints with lower and upper"), (Words{"0", "1"}));
  EXPECT_EQ(last_two(text, "constraints with only upper"), (Words{"1", "0"}));
}

TEST(ProblemStatistics, AnEmptyProblem) {
  EXPECT_EQ(last_two(log::problem_statistics({}, {}), "Total number of variables"),
            (Words{"0", "0"}));
}

TEST(Summary, SaysWhatTheCertificateFound) {
  Result result;
  result.objective = 1.5;
  result.iterations = 9;
  result.certificate.kind = PointKind::FirstOrderPoint;
  result.certificate.second_order = SecondOrder::Violated;
  result.certificate.inner = {2, 1, 0};
  result.certificate.inner_expected = {1, 2, 0};
  result.certificate.full = {4, 5, 1};
  result.certificate.full_expected = {5, 5, 0};
  result.certificate.licq_max = true;
  const std::string text = log::summary(result, {}, result.iterations);
  EXPECT_EQ(last_two(text, "Number of Iterations").back(), "9");
  EXPECT_EQ(last_two(text, "Objective").back(), "1.5000000000000000e+00");
  EXPECT_NE(line_with(text, "Second-order test").find("violated"), std::string::npos);
  const auto numbers = [&](const std::string& part) {
    auto all = words(line_with(text, part));
    return Words{all.end() - 6, all.end()};
  };
  EXPECT_EQ(numbers("K_yy"), (Words{"2", "1", "0", "1", "2", "0"}));
  EXPECT_EQ(numbers("Inertia of K."), (Words{"4", "5", "1", "5", "5", "0"}));
  EXPECT_NE(line_with(text, "gradients").find("Min no, Max yes"), std::string::npos);
  EXPECT_EQ(line_with(text, "Reason"), "");
  EXPECT_EQ(line_with(text, "Answer of the maximizer"), "");

  result.certificate.answer = InnerAnswer::Smooth;
  result.certificate.reasons.push_back({.kind = CertificateReason::Kind::FlatDirection,
                                        .player = Player::Min,
                                        .text = "flat: the value is constant along +1 x",
                                        .variables = {0},
                                        .constraints = {}});
  const std::string more = log::summary(result, {}, result.iterations);
  EXPECT_NE(line_with(more, "Reason").find("constant along +1 x"), std::string::npos);
  EXPECT_NE(line_with(more, "Answer of the maximizer").find("smooth"), std::string::npos);

  result.certificate.least_curvature = 2e-4;
  result.certificate.least_curvature_variable = 1;
  EXPECT_NE(line_with(log::summary(result, {}, result.iterations), "Least curvature")
                .find("2.0e-04 (of 1), most in variable 1"),
            std::string::npos);
  ProblemStructure structure;
  structure.variable_names = {"x", "wind[3]"};
  EXPECT_NE(line_with(log::summary(result, structure, result.iterations), "Least curvature")
                .find("wind[3]"),
            std::string::npos);

  result.certificate.second_order = SecondOrder::NotTested;
  EXPECT_EQ(line_with(log::summary(result, {}, result.iterations), "K_yy"), "");
}

TEST(Work, CountsAndTimes) {
  Result result;
  result.counts.hessian = 5;
  result.counts.factorizations_inner = 6;
  result.timing = {.total = 2.0, .evaluations = 0.5};
  EXPECT_EQ(last_two(log::work(result), "Hessian evaluations").back(), "5");
  EXPECT_EQ(last_two(log::work(result), "factorizations of K_yy").back(), "6");
  EXPECT_EQ(last_two(log::work(result), "w/o function").back(), "1.500");
  EXPECT_EQ(line_with(log::work(result), "K + K_yy for"), "");
  result.counts.factorizations_for(FactorizationCause::Step) = {4, 3};
  result.counts.factorizations_for(FactorizationCause::Certificate) = {1, 2};
  EXPECT_EQ(line_with(log::work(result), "K + K_yy for"),
            "  K + K_yy for steps 4 + 3, certificate 1 + 2");
  result.counts.factorizations_full = 5;
  result.counts.factorizations_for(FactorizationCause::Restoration) = {7, 0};
  EXPECT_EQ(last_two(log::work(result), "factorizations of K ").back(), "12");  // the parts add up
  EXPECT_EQ(last_two(log::timing(result.timing), "Everything else").back(), "1.500");
}

TEST(ExitLine, EveryStatusHasItsOwnWords) {
  std::set<std::string> lines;
  const auto last = static_cast<int>(Status::WorstCaseNotMet);
  for (int i = 0; i <= last; ++i) {
    Result result;
    result.status = static_cast<Status>(i);
    const std::string line = log::exit_line(result);
    EXPECT_EQ(line.find("\nEXIT: "), 0U);
    EXPECT_EQ(line.back(), '\n');
    EXPECT_TRUE(lines.insert(line).second) << line;
  }
}

TEST(ExitLine, TellsTheTruth) {
  Result result;
  result.status = Status::NotLocalMinmax;
  result.certificate.inner = {2, 0, 0};
  result.certificate.inner_expected = {1, 1, 0};
  EXPECT_EQ(log::exit_line(result),
            "\nEXIT: First-order point found, but it is not a local minmax: curvature of the "
            "maximizer has the wrong sign.\n"
            "      begin elsewhere, or make several starts (minmax_starts)\n");
  result.certificate.inner = result.certificate.inner_expected;
  EXPECT_NE(log::exit_line(result).find("curvature of the minimizer"), std::string::npos);
  result.certificate.reasons = {{.kind = CertificateReason::Kind::RobustRow}};
  EXPECT_NE(log::exit_line(result).find("no maximum of its constraint"), std::string::npos);
}

TEST(ExitLine, AddsTheCoresMessageWhenItSaysMore) {
  Result result;
  result.status = Status::InvalidOption;
  result.message = "tol = nan is not in (0, inf)";
  EXPECT_EQ(log::exit_line(result),
            "\nEXIT: Invalid option encountered.\n      tol = nan is not in (0, inf)\n");
  result.message = std::string(name_of(result.status));
  EXPECT_EQ(log::exit_line(result), "\nEXIT: Invalid option encountered.\n");
  result.status = Status::MaxIterations;
  result.message = "first\nsecond";
  EXPECT_EQ(
      log::exit_line(result),
      "\nEXIT: Maximum Number of Iterations Exceeded.\n      first\n      second\n"
      "      raise the limit reached (max_iter, minmax_max_factorizations), or begin nearer the "
      "answer\n");
}

TEST(Banner, NamesTheProgram) {
  EXPECT_NE(log::banner().find("Ipminmax"), std::string::npos);
  const std::string text = log::banner();
  EXPECT_TRUE(std::all_of(text.begin(), text.end(),
                          [](char c) { return c == '\n' || (c >= ' ' && c <= '~'); }));
}

TEST(Summary, AViolationThatWasNotLookedForIsNotANumber) {
  ProblemStructure game;
  game.variable_players = {Player::Min, Player::Max};
  Result result;
  result.over_y = {.asked = 8, .functions = 3, .maximizations = 7, .largest_violation = 1.5e-9};
  EXPECT_NE(log::summary(result, game, result.iterations).find("largest violation 1.5e-09"),
            std::string::npos);
  result.over_y.largest_violation = std::numeric_limits<double>::quiet_NaN();
  const std::string text = log::summary(result, game, result.iterations);
  EXPECT_EQ(text.find("violation 1.5"), std::string::npos) << text;
  EXPECT_EQ(text.find("largest violation nan"), std::string::npos) << text;
}

TEST(Summary, SaysWhatWasLookedAtOverYAndX) {
  ProblemStructure game;
  game.variable_players = {Player::Min, Player::Max};
  Result result;
  EXPECT_NE(log::summary(result, game, result.iterations).find("not searched"), std::string::npos);
  result.over_x = {.asked = 20, .made = 7};
  result.over_y = {.asked = 8, .finished = false};
  EXPECT_NE(log::summary(result, game, result.iterations).find("7 of 20 starts"),
            std::string::npos);
  EXPECT_NE(log::summary(result, game, result.iterations).find("cut short"), std::string::npos);
  ProblemStructure minimization;
  minimization.variable_players = {Player::Min};
  EXPECT_EQ(log::summary({}, minimization, 0).find("Over all y"), std::string::npos);
}

}  // namespace
}  // namespace ipminmax
