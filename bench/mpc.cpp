// Model predictive control of the homicidal chauffeur: 50 time steps, each solved cold, and, with
// what the solve before leaves, from the shifted controls and states and from the whole shifted
// primal-dual solution; and how far one solve is from the least that its iterations could cost, an
// LDL' factorization of K and one of K_yy in each.

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <support/forwarding_problem.hpp>

#include "adapter/ipopt/tnlp_problem.hpp"
#include "chauffeur.hpp"
#include "core/solver.hpp"
#include "factorizations.hpp"
#include "kkt_matrices.hpp"
#include "linalg/make_solver.hpp"
#include "program.hpp"

namespace bench {
namespace {

using chauffeur::Control;
using chauffeur::State;
using ipminmax::Result;
using ipminmax::SolverOptions;
using ipminmax::testing::StartedProblem;

constexpr double kTolerance = 1e-6;
constexpr int kMaxIterations = 200;
constexpr double kWarmBarrier = 1e-6;  // mu_init of a warm start
constexpr double kWarmPush = 1e-6;

/// What to solve at one time step, and where a solve may start.
struct Task {
  State state;
  std::vector<Control> controls;   ///< of the step before, one stage ahead
  std::optional<Result> solution;  ///< the same with multipliers; empty at the first step
};

Ipopt::SmartPtr<chauffeur::ChauffeurTNLP> model_of(const chauffeur::Parameters& parameters,
                                                   const State& state,
                                                   const std::vector<Control>& controls) {
  Ipopt::SmartPtr<chauffeur::ChauffeurTNLP> model =
      new chauffeur::ChauffeurTNLP(parameters, state, kGuess);
  model->set_controls(controls);
  return model;
}

std::unique_ptr<ipminmax::TnlpProblem> problem_of(const chauffeur::Parameters& parameters,
                                                  const State& state,
                                                  const std::vector<Control>& controls) {
  auto problem =
      std::make_unique<ipminmax::TnlpProblem>(GetRawPtr(model_of(parameters, state, controls)));
  if (const std::string error = problem->load(); !error.empty()) throw std::runtime_error(error);
  return problem;
}

SolverOptions options_with(double mu_init, bool multipliers) {
  SolverOptions options;
  options.tol = kTolerance;
  options.max_iter = kMaxIterations;
  options.mu_init = mu_init;
  options.warm_start_init_point = multipliers;
  // The shifted solution is close: it is not pushed away from its bounds.
  options.warm_start_bound_push = options.warm_start_bound_frac = kWarmPush;
  options.warm_start_slack_bound_push = options.warm_start_slack_bound_frac = kWarmPush;
  options.warm_start_mult_bound_push = kWarmPush;
  return options;
}

/// One stage ahead, the last stage repeated. Both vectors are ordered stage by stage.
Result shifted(Result r, int horizon) {
  for (auto* values : {&r.v, &r.lambda, &r.z_lower, &r.z_upper}) {
    std::shift_left(values->begin(), values->end(), std::ssize(*values) / horizon);
  }
  return r;
}

/// The closed loop, recorded, so that every contestant solves the same tasks.
std::vector<Task> record(const chauffeur::Parameters& parameters, int steps) {
  const auto horizon = static_cast<std::size_t>(parameters.horizon);
  std::vector<Task> tasks = {{State{}, std::vector<Control>(horizon, kGuess), std::nullopt}};
  while (tasks.size() < static_cast<std::size_t>(steps)) {
    const Task& now = tasks.back();
    const auto problem = problem_of(parameters, now.state, now.controls);
    const Result r = solve(*problem, options_with(0.1, false));
    if (r.v.empty()) throw std::runtime_error("a step of the closed loop failed: " + r.message);
    std::vector<Control> controls;
    const std::size_t stage = r.v.size() / horizon;  // u, p (3), d (2), e (2)
    for (std::size_t i = 0; i < r.v.size(); i += stage) {
      controls.push_back({r.v[i], r.v[i + 4], r.v[i + 5]});
    }
    const State next = advance(now.state, saturate(controls.front(), parameters), parameters.speed);
    std::shift_left(controls.begin(), controls.end(), 1);
    tasks.push_back({next, std::move(controls), shifted(r, parameters.horizon)});
  }
  return tasks;
}

/// One contestant over all tasks.
struct Contestant {
  std::string name;
  std::vector<double> seconds{}, least{}, iterations{};  ///< per task; medians
  std::vector<Result> results{};
  int certified = 0;
};

/// Seconds of one LDL' factorization of each matrix, analysis apart.
double two_factorizations(const KktMatrices& matrices) {
  double seconds = 0.0;
  for (const KktMatrix* m : {&matrices.full, &matrices.inner}) {
    const auto solver = make_symmetric_solver(ipminmax::LinearSolver::Ldlt, {});
    if (!solver->analyze(m->matrix, m->signs).ok) throw std::runtime_error("LDL' analysis failed");
    (void)solver->factorize(m->matrix);
    seconds += time_factorization(*solver, m->matrix, 2e-4);
  }
  return seconds;
}

class Comparison {
 public:
  explicit Comparison(const chauffeur::Parameters& parameters) : parameters_(parameters) {}

  /// All contestants in turn on one task. The first step has no shifted solution and is left out.
  void solve_all(const Task& task, double seconds) {
    const std::vector<Control> guess(task.controls.size(), kGuess);
    const auto from_guess = problem_of(parameters_, task.state, guess);
    const auto from_controls = problem_of(parameters_, task.state, task.controls);
    StartedProblem from_solution(*from_controls, *task.solution);
    std::vector<Result> results(4);
    const auto again = [&](std::size_t k, ipminmax::Problem& problem, SolverOptions options) {
      return [this, &results, k, &problem, options] {
        const Clock clock;
        solvers_[k].solve(problem, options, {}, results[k]);
        return clock.seconds();
      };
    };
    const std::vector<std::function<double()>> contestants = {
        [&] {
          const SolverOptions options = options_with(0.1, false);
          const Clock clock;
          results[0] = solve(*from_guess, options);
          return clock.seconds();
        },
        again(1, *from_controls, options_with(0.1, false)),
        again(2, from_solution, options_with(kWarmBarrier, true)),
        [&] {
          // As a user's program does: the model keeps the controls of the answer.
          model_->set_state(task.state);
          model_->set_controls(task.controls);
          const Clock clock;
          if (optimized_) {
            application_->ReOptimizeTNLP(GetRawPtr(model_));
          } else {
            application_->OptimizeTNLP(GetRawPtr(model_));
          }
          optimized_ = true;
          const double elapsed = clock.seconds();
          results[3] = application_->LastResult();
          return elapsed;
        },
    };
    const auto times = alternate({.seconds = seconds, .min_rounds = 3}, contestants);
    for (std::size_t k = 0; k < contestants_.size(); ++k) {
      Contestant& c = contestants_[k];
      const Result& r = results[k];
      ipminmax::Problem& problem = k == 0 ? *from_guess : *from_controls;
      const double pair = two_factorizations(kkt_matrices_at(problem, r, options_with(0.1, false)));
      c.seconds.push_back(spread(times[k]).median);
      c.iterations.push_back(r.iterations);
      c.least.push_back(std::max(r.iterations, 1) * pair);
      c.results.push_back(r);
      c.certified += r.certificate.kind == ipminmax::PointKind::LocalMinmax ? 1 : 0;
    }
  }

  void report(const Settings& settings) const {
    Table table({"start", "certified", "iterations", "time per solve", "slowest", "least",
                 "time / least", "time / cold"});
    for (const Contestant& c : contestants_) {
      table.row().text(c.name);
      table.text(std::to_string(c.certified) + "/" + std::to_string(c.seconds.size()));
      table.number(spread(c.iterations)).time(spread(c.seconds));
      table.time(std::ranges::max(c.seconds)).time(spread(c.least).median);
      table.number(spread_of_ratios(c.seconds, c.least));
      table.number(spread_of_ratios(c.seconds, contestants_.front().seconds));
    }
    publish(table,
            "MPC, T = " + std::to_string(parameters_.horizon) +
                ": median [quartiles] over the time steps; least = iterations x (one LDL' of K + "
                "one of K_yy)",
            "mpc", settings);
    Table causes = factorizations_by_cause("T");
    for (const Contestant& c : contestants_) {
      add_factorizations(causes.row().integer(parameters_.horizon).text(c.name), c.results);
    }
    publish(causes, kFactorizationsTitle, "mpc_factorizations", settings);
    if (settings.csv.empty()) return;
    Table steps({"step", "start", "seconds", "iterations", "least"});
    for (const Contestant& c : contestants_) {
      for (std::size_t t = 0; t < c.seconds.size(); ++t) {
        steps.row().integer(static_cast<std::int64_t>(t) + 2).text(c.name).number(c.seconds[t]);
        steps.number(c.iterations[t]).number(c.least[t]);
      }
    }
    steps.write_csv(settings.csv / "mpc_steps.csv");
  }

 private:
  chauffeur::Parameters parameters_;
  Ipopt::SmartPtr<chauffeur::ChauffeurTNLP> model_ =
      new chauffeur::ChauffeurTNLP(parameters_, {}, kGuess);
  Ipopt::SmartPtr<ipminmax::MinMaxApplication> application_ =
      quiet_application(kTolerance, kMaxIterations);
  bool optimized_ = false;
  std::array<ipminmax::RepeatedSolver, 3> solvers_;  ///< of the contestants by the core
  std::vector<Contestant> contestants_ = {{"cold"},
                                          {"shifted controls"},
                                          {"shifted primal-dual, mu_init 1e-6"},
                                          {"shifted controls, MinMaxApplication"}};
};

void run(const Settings& settings, const chauffeur::Parameters& parameters, int steps) {
  const std::vector<Task> tasks = record(parameters, steps);
  Comparison comparison(parameters);
  for (const Task& task : tasks) {
    if (task.solution) comparison.solve_all(task, settings.seconds / steps);
  }
  comparison.report(settings);
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Settings settings;
  chauffeur::Parameters parameters;  // steering and walking expensive: almost always solvable
  int steps = 50;
  CommandLine command_line("mpc: time of the solves of a model predictive controller");
  bool refined = false;
  command_line.add_flag("--refined", refined, "the family whose local minmax exists for every T");
  command_line.add("--gamma-u", parameters.gamma_u, "price of steering (80)");
  command_line.add("--horizon", parameters.horizon, "T, stages to look ahead (20)");
  command_line.add("--steps", steps, "time steps of the closed loop (50)");
  return bench::run_program(argc, argv, command_line, settings, [&] {
    if (parameters.horizon < 1 || steps < 2) {
      throw std::invalid_argument("--horizon must be at least 1 and --steps at least 2");
    }
    if (refined) parameters = chauffeur::refined(parameters.horizon);
    bench::print_environment();
    bench::run(settings, parameters, steps);
  });
}
