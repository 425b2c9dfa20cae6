// The homicidal chauffeur, the same continuous-time pursuit in T = 10 to 10000 steps: how time
// grows with the horizon, where it goes, and what the sequential formulation costs.

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <examples/chauffeur_tnlp.hpp>

#include <examples/sequential_chauffeur.hpp>
#include "adapter/ipopt/tnlp_problem.hpp"
#include "core/solver.hpp"
#include "factorizations.hpp"
#include "program.hpp"

namespace bench {
namespace {

using ipminmax::Result;
using ipminmax::SolverOptions;

/// Inside the players' bounds. Not symmetric: the iterates would stay on the line through both.
constexpr chauffeur::Control kGuess{0.2, 0.04, 0.02};

/// One contestant: a formulation solved by a method.
struct Run {
  std::string name;
  std::unique_ptr<ipminmax::Problem> problem;
  SolverOptions options{};
  std::vector<double> seconds{};  ///< wall time around solve
  std::vector<Result> results{};  ///< one per round

  double solve_once() {
    const Clock clock;
    Result result = solve(*problem, options);
    const double elapsed = clock.seconds();
    results.push_back(std::move(result));
    return elapsed;
  }
  [[nodiscard]] const Result& result() const { return results.back(); }
  [[nodiscard]] Spread over_results(const std::function<double(const Result&)>& value) const {
    std::vector<double> values;
    for (const Result& r : results) values.push_back(value(r));
    return spread(std::move(values));
  }
};

std::unique_ptr<ipminmax::Problem> simultaneous(int horizon) {
  auto problem = std::make_unique<ipminmax::TnlpProblem>(
      new chauffeur::ChauffeurTNLP(chauffeur::refined_in_rates(horizon), {}, kGuess));
  if (const std::string error = problem->load(); !error.empty()) throw std::runtime_error(error);
  return problem;
}

std::unique_ptr<ipminmax::Problem> sequential(int horizon) {
  return std::make_unique<chauffeur::SequentialChauffeur>(
      chauffeur::refined_in_rates(horizon), chauffeur::State{},
      std::vector<chauffeur::Control>(static_cast<std::size_t>(horizon), kGuess));
}

SolverOptions method(ipminmax::Globalization globalization, int threads) {
  SolverOptions options;
  options.tol = 1e-6;
  options.max_iter = 200;
  options.minmax_globalization = globalization;
  options.minmax_threads = threads;
  return options;
}

void solve_alternately(std::vector<Run>& runs, double seconds) {
  std::vector<std::function<double()>> contestants;
  for (Run& run : runs) contestants.emplace_back([&run] { return run.solve_once(); });
  const auto times = alternate({.seconds = seconds}, contestants);
  for (std::size_t k = 0; k < runs.size(); ++k) {
    runs[k].seconds = times[k];
    runs[k].results.erase(runs[k].results.begin());  // the untimed round
  }
}

double per_iteration(const Result& r) { return r.seconds / std::max(r.iterations, 1); }

/// Wall time over what no interior-point method can avoid: factorizations, solves and callbacks.
double overhead(const Result& r) {
  return r.timing.total / (r.timing.factorization + r.timing.solves + r.timing.evaluations);
}

/// Below, what does not depend on T hides the growth.
constexpr int kLeastForGrowth = 100;

/// T^p by the points of one contestant, in column `value`.
struct Growth {
  std::vector<double> horizons, per_iteration, iterations;
};

void report_growth(const std::vector<std::pair<std::string, Growth>>& growths,
                   const Settings& settings) {
  Table table({"contestant", "T from", "to", "time/iteration ~ T^", "iterations ~ T^"});
  for (const auto& [name, growth] : growths) {
    table.row().text(name).number(growth.horizons.front()).number(growth.horizons.back(), 4);
    table.number(fitted_exponent(growth.horizons, growth.per_iteration));
    table.number(fitted_exponent(growth.horizons, growth.iterations));
  }
  publish(table, "Growth with the horizon (least-squares fits to the medians)", "horizon_growth",
          settings);
}

void run(const Settings& settings, int largest, int threads) {
  Table times({"T", "variables", "contestant", "status", "objective", "cert", "iter", "fact K",
               "fact K_yy", "time", "time/iter", "overhead", "time / filter"});
  Table stages(
      {"T", "contestant", "callbacks", "assembly", "analysis", "factorization", "solves", "rest"});
  Table causes = factorizations_by_cause("T");
  std::vector<std::pair<std::string, Growth>> growths;
  const auto growth_of = [&](const std::string& name) -> Growth& {
    for (auto& [known, growth] : growths) {
      if (known == name) return growth;
    }
    return growths.emplace_back(name, Growth{}).second;
  };

  const std::vector<int> horizons = {10, 30, 100, 300, 1000, 3000, 10000, 100000, 1000000};
  for (const int horizon : horizons) {
    if (horizon > largest) break;
    std::vector<Run> runs;
    runs.push_back(
        {"filter", simultaneous(horizon), method(ipminmax::Globalization::Filter, threads)});
    if (horizon <= 3000) {
      runs.push_back(
          {"none", simultaneous(horizon), method(ipminmax::Globalization::None, threads)});
    }
    if (horizon <= 100) {
      runs.push_back({"sequential, filter", sequential(horizon),
                      method(ipminmax::Globalization::Filter, threads)});
      runs.push_back({"sequential, none", sequential(horizon),
                      method(ipminmax::Globalization::None, threads)});
    }
    solve_alternately(runs, settings.seconds / static_cast<double>(horizons.size()));

    for (const Run& run : runs) {
      const Result& r = run.result();
      const Spread each = run.over_results(per_iteration);
      times.row().integer(horizon).integer(static_cast<std::int64_t>(r.v.size())).text(run.name);
      times.text(std::string(name_of(r.status))).number(r.objective, 8);
      times.text(r.certificate.kind == ipminmax::PointKind::LocalMinmax ? "yes" : "no");
      times.integer(r.iterations).integer(r.counts.factorizations_full);
      times.integer(r.counts.factorizations_inner).time(spread(run.seconds)).time(each);
      times.number(run.over_results(overhead));
      times.number(spread_of_ratios(run.seconds, runs.front().seconds));

      const auto share = [&](double ipminmax::Timing::*stage) {
        return run.over_results([&](const Result& x) { return x.timing.*stage / x.timing.total; })
            .median;
      };
      using ipminmax::Timing;
      double rest = 1.0;
      stages.row().integer(horizon).text(run.name);
      for (double Timing::*stage : {&Timing::evaluations, &Timing::assembly, &Timing::analysis,
                                    &Timing::factorization, &Timing::solves}) {
        stages.percent(share(stage));
        rest -= share(stage);
      }
      stages.percent(rest);

      add_factorizations(causes.row().integer(horizon).text(run.name), std::span(&r, 1));

      const bool goes_on = !run.name.starts_with("sequential") && largest > kLeastForGrowth;
      if (goes_on && horizon < kLeastForGrowth) continue;
      Growth& growth = growth_of(run.name);
      growth.horizons.push_back(horizon);
      growth.per_iteration.push_back(each.median);
      growth.iterations.push_back(std::max(r.iterations, 1));
    }
  }
  publish(times, "Homicidal chauffeur, refined family: median [quartiles]", "horizon", settings);
  publish(causes, kFactorizationsTitle, "horizon_factorizations", settings);
  publish(stages, "Share of the wall time by stage", "horizon_stages", settings);
  report_growth(growths, settings);
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Settings settings;
  int largest = 10000, threads = 1;
  CommandLine command_line(
      "horizon: time of one solve of the homicidal chauffeur as the horizon grows");
  command_line.add("--largest", largest, "horizon (10000)");
  command_line.add("--threads", threads, "minmax_threads (1)");
  return bench::run_program(argc, argv, command_line, settings, [&] {
    bench::print_environment();
    bench::run(settings, largest, threads);
  });
}
