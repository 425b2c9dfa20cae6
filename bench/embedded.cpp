// A controller with a deadline: the homicidal chauffeur from random present states, each solved
// through the application with at most so many factorizations (minmax_max_factorizations). What is
// the worst that happens?

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "chauffeur.hpp"
#include "program.hpp"

namespace bench {
namespace {

using chauffeur::Control;
using chauffeur::State;
using ipminmax::Index;
using ipminmax::Result;

constexpr int kMaxIterations = 3000;
constexpr unsigned kSeed = 1;
constexpr double kReach = 1.0;  // of the evader, in each direction

std::vector<State> random_states(int count) {
  std::mt19937_64 generator(kSeed);
  const auto uniform = [&](double from, double to) {
    return from + (to - from) * std::ldexp(static_cast<double>(generator() >> 11U), -53);
  };
  std::vector<State> states(static_cast<std::size_t>(count));
  for (State& s : states) {
    s.heading = uniform(-std::numbers::pi, std::numbers::pi);
    s.ex = uniform(-kReach, kReach);
    s.ey = uniform(-kReach, kReach);
  }
  return states;
}

/// What became of all states under one limit.
struct Tally {
  Index most_factorizations = 0, most_iterations = 0;
  int certified = 0, first_order = 0, feasible = 0, infeasible = 0, stopped = 0;
  double worst_violation = 0.0, slowest = 0.0;
  std::vector<double> seconds;

  void add(const Result& r, double elapsed) {
    most_factorizations = std::max(most_factorizations, r.factorizations);
    most_iterations = std::max(most_iterations, r.iterations);
    switch (r.certificate.kind) {
      case ipminmax::PointKind::LocalMinmax:
        ++certified;
        break;
      case ipminmax::PointKind::FirstOrderPoint:
        ++first_order;
        break;
      case ipminmax::PointKind::FeasiblePoint:
        ++feasible;
        break;
      default:
        ++infeasible;
    }
    stopped += r.status == ipminmax::Status::MaxIterations ? 1 : 0;
    worst_violation = std::max(worst_violation, r.error.primal);
    slowest = std::max(slowest, elapsed);
    seconds.push_back(elapsed);
  }
};

Tally solve_all(const std::vector<State>& states, const chauffeur::Parameters& parameters,
                int limit, double tolerance) {
  const Ipopt::SmartPtr<chauffeur::ChauffeurTNLP> model =
      new chauffeur::ChauffeurTNLP(parameters, {}, kGuess);
  const auto application = quiet_application(tolerance, kMaxIterations, limit);
  const std::vector<Control> guess(static_cast<std::size_t>(parameters.horizon), kGuess);
  application->OptimizeTNLP(GetRawPtr(model));  // makes the analysis
  Tally tally;
  for (const State& state : states) {
    model->set_state(state);
    model->set_controls(guess);
    const Clock clock;
    application->ReOptimizeTNLP(GetRawPtr(model));
    tally.add(application->LastResult(), clock.seconds());
  }
  return tally;
}

void run(const Settings& settings, const chauffeur::Parameters& parameters, int count) {
  const std::vector<State> states = random_states(count);
  Table table({"at most", "used", "iterations", "certified", "first-order", "feasible",
               "infeasible", "stopped", "worst violation", "time", "99.9 %", "slowest"});
  for (const int limit : {12, 20, 30, 60, 0}) {
    const Tally t = solve_all(states, parameters, limit, 1e-6);
    std::vector<double> sorted = t.seconds;
    std::ranges::sort(sorted);
    const auto last_permille = static_cast<std::size_t>(0.999 * static_cast<double>(sorted.size()));
    table.row().text(limit > 0 ? std::to_string(limit) : "no limit");
    table.integer(t.most_factorizations).integer(t.most_iterations).integer(t.certified);
    table.integer(t.first_order).integer(t.feasible).integer(t.infeasible).integer(t.stopped);
    table.number(t.worst_violation).time(spread(t.seconds));
    table.time(sorted[std::min(last_permille, sorted.size() - 1)]).time(t.slowest);
  }
  publish(table,
          "Random present states, T = " + std::to_string(parameters.horizon) +
              ": the most factorizations and iterations of a solve, what was returned, times",
          "embedded", settings);
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Settings settings;
  chauffeur::Parameters parameters;
  int states = 10000;
  CommandLine command_line("embedded: solves with a limit on factorizations, the worst of many");
  command_line.add("--horizon", parameters.horizon, "T, stages to look ahead (20)");
  command_line.add("--states", states, "random present states (10000)");
  return bench::run_program(argc, argv, command_line, settings, [&] {
    if (parameters.horizon < 1 || states < 1) {
      throw std::invalid_argument("--horizon and --states must be at least 1");
    }
    bench::print_environment();
    bench::run(settings, parameters, states);
  });
}
