// Without Max variables the solver is a minimizer: its wall time over Ipopt's on the scalable NLP
// families, with the same MUMPS library and the same BLAS in one process.
//
// Ipopt asks MUMPS for an automatic ordering by default; the best of MUMPS's orderings for each
// problem, found before the timing starts, competes too. Ipminmax compares AMD, PORD and METIS by
// itself.

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include <IpIpoptApplication.hpp>
#include <IpSolveStatistics.hpp>
#include <regression/problem_tnlp.hpp>
#include <regression/scalable_nlp.hpp>

#include "core/solver.hpp"
#include "program.hpp"

namespace bench {
namespace {

using ipminmax::Index;
using ipminmax::Result;
using ipminmax::testing::IpoptAnswer;
using ipminmax::testing::ScalableNlp;

struct MumpsOrdering {
  int pivot_order;  ///< ICNTL(7)
  const char* name;
};
constexpr MumpsOrdering kAutomatic{7, "automatic"};
constexpr MumpsOrdering kOrderings[] = {kAutomatic, {0, "AMD"}, {4, "PORD"}, {6, "QAMD"}};

/// Wall seconds of OptimizeTNLP, as for our solver; options and output set up before.
double run_ipopt(ipminmax::Problem& problem, const MumpsOrdering& ordering, double limit,
                 IpoptAnswer& answer) {
  const Ipopt::SmartPtr<ipminmax::testing::ProblemTnlp> model =
      new ipminmax::testing::ProblemTnlp(problem);
  const Ipopt::SmartPtr<Ipopt::IpoptApplication> application = new Ipopt::IpoptApplication(false);
  Ipopt::OptionsList& options = *application->Options();
  options.SetIntegerValue("print_level", 0);
  options.SetStringValue("sb", "yes");
  options.SetStringValue("linear_solver", "mumps");
  options.SetIntegerValue("mumps_pivot_order", ordering.pivot_order);
  options.SetNumericValue("max_cpu_time", limit);
  if (application->Initialize("") != Ipopt::Solve_Succeeded) {
    throw std::runtime_error("Ipopt refuses its options");
  }
  const Clock clock;
  const Ipopt::ApplicationReturnStatus status = application->OptimizeTNLP(GetRawPtr(model));
  const double seconds = clock.seconds();
  answer = model->answer();
  answer.status = status;
  if (IsValid(application->Statistics())) {
    answer.iterations = application->Statistics()->IterationCount();
  }
  return seconds;
}

double run_ours(ipminmax::Problem& problem, ipminmax::LinearSolver solver, double limit,
                Result& result) {
  ipminmax::SolverOptions options;
  options.linear_solver = solver;
  options.max_wall_time = limit;
  const Clock clock;
  result = solve(problem, options);
  return clock.seconds();
}

struct Row {
  std::string name;
  std::size_t n = 0, m = 0;
  Result ours{};
  IpoptAnswer ipopt{};
  Index ipopt_factorizations = 0;
  const char* best_ordering = "";
  std::vector<double> ours_seconds{}, ours_mumps_seconds{}, ipopt_seconds{}, best_seconds{};
};

/// The ordering with which Ipopt is fastest.
MumpsOrdering best_ordering(ipminmax::Problem& problem, double limit) {
  MumpsOrdering best = kAutomatic;
  double best_time = INFINITY;
  for (const MumpsOrdering& ordering : kOrderings) {
    IpoptAnswer answer;
    const double time = run_ipopt(problem, ordering, std::min(limit, 1.2 * best_time), answer);
    if (answer.solved() && time < best_time) {
      best_time = time;
      best = ordering;
    }
  }
  return best;
}

Row compare(const ScalableNlp& family, Index n, const Effort& effort, double limit) {
  const auto problem = family.make(n);
  Row row{family.name, problem->structure().variable_lower.size(),
          problem->structure().constraint_lower.size()};
  const MumpsOrdering best = best_ordering(*problem, limit);
  row.best_ordering = best.name;
  row.ipopt_factorizations =
      ipminmax::testing::solve_with_ipopt(*problem).counts.factorizations_full;

  using ipminmax::LinearSolver;
  Result with_mumps;
  IpoptAnswer with_best;
  std::vector<std::function<double()>> contestants = {
      [&] { return run_ours(*problem, LinearSolver::Auto, limit, row.ours); },
      [&] { return run_ours(*problem, LinearSolver::Mumps, limit, with_mumps); },
      [&] { return run_ipopt(*problem, kAutomatic, limit, row.ipopt); }};
  const bool another = best.pivot_order != kAutomatic.pivot_order;
  if (another) {
    contestants.emplace_back([&] { return run_ipopt(*problem, best, limit, with_best); });
  }
  const auto times = alternate(effort, contestants);
  row.ours_seconds = times[0];
  row.ours_mumps_seconds = times[1];
  row.ipopt_seconds = times[2];
  row.best_seconds = times[another ? 3 : 2];
  return row;
}

/// Ratios of the problems that both solved to the same objective.
struct Means {
  std::vector<double> to_default{}, to_best{}, mumps_to_best{};
};

/// All contestants on the families; returns those that are quick enough for ten times the size.
std::vector<const ScalableNlp*> run(const Settings& settings,
                                    const std::vector<const ScalableNlp*>& families, Index n,
                                    const Effort& effort, double limit) {
  std::vector<const ScalableNlp*> quick;
  Table times({"family", "n", "m", "status", "Ipopt", "objectives", "iter", "Ipopt iter", "time",
               "with MUMPS", "Ipopt default", "best order", "Ipopt best", "time / default",
               "time / best", "MUMPS / best"});
  Table stages({"family", "time", "callbacks", "assembly", "analysis", "factorization", "solves",
                "rest", "fact", "Ipopt fact"});
  Means means;
  for (const ScalableNlp* family : families) {
    const Row row = compare(*family, n, effort, limit);
    constexpr double kGrowth = 15.0;  // of the time, for ten times the size
    const double slowest =
        std::max(spread(row.ours_mumps_seconds).median, spread(row.ipopt_seconds).median);
    if (kGrowth * slowest <= limit) quick.push_back(family);
    const double difference = std::abs(row.ours.objective - row.ipopt.objective);
    const bool agree = difference <= 1e-6 * std::max(1.0, std::abs(row.ipopt.objective));
    const bool both = is_success(row.ours.status) && row.ipopt.solved();
    times.row().text(row.name).integer(static_cast<std::int64_t>(row.n));
    times.integer(static_cast<std::int64_t>(row.m)).text(std::string(name_of(row.ours.status)));
    times.text(row.ipopt.solved() ? "solved" : "status " + std::to_string(row.ipopt.status));
    times.text(both ? (agree ? "agree" : "differ") : "-").integer(row.ours.iterations);
    times.integer(row.ipopt.iterations).time(spread(row.ours_seconds));
    times.time(spread(row.ours_mumps_seconds).median).time(spread(row.ipopt_seconds));
    times.text(row.best_ordering).time(spread(row.best_seconds).median);
    const Spread to_default = spread_of_ratios(row.ours_seconds, row.ipopt_seconds);
    const Spread to_best = spread_of_ratios(row.ours_seconds, row.best_seconds);
    const Spread mumps_to_best = spread_of_ratios(row.ours_mumps_seconds, row.best_seconds);
    times.number(to_default).number(to_best).number(mumps_to_best);
    if (both && agree) {
      means.to_default.push_back(to_default.median);
      means.to_best.push_back(to_best.median);
      means.mumps_to_best.push_back(mumps_to_best.median);
    }

    const ipminmax::Timing& t = row.ours.timing;
    const double known = t.evaluations + t.assembly + t.analysis + t.factorization + t.solves;
    stages.row().text(row.name).time(t.total);
    for (const double stage :
         {t.evaluations, t.assembly, t.analysis, t.factorization, t.solves, t.total - known}) {
      stages.percent(stage / t.total);
    }
    stages.integer(row.ours.factorizations).integer(row.ipopt_factorizations);
  }
  times.row().text("geometric mean");
  for (int k = 0; k < 12; ++k) times.none();
  times.number(geometric_mean(means.to_default)).number(geometric_mean(means.to_best));
  times.number(geometric_mean(means.mumps_to_best));

  const std::string size = std::to_string(n);
  publish(times,
          "Minimization, about " + size + " variables: median [quartiles], our time / Ipopt's",
          "minimization_" + size, settings);
  publish(stages, "Where our time goes", "minimization_stages_" + size, settings);
  return quick;
}

void run(const Settings& settings, Index n, double limit, const std::string& only, bool large) {
  std::vector<const ScalableNlp*> families;
  for (const ScalableNlp& family : ipminmax::testing::scalable_nlps()) {
    if (only.empty() || family.name == only) families.push_back(&family);
  }
  if (families.empty()) throw std::invalid_argument("no family " + only);
  Effort effort{.seconds = settings.seconds / static_cast<double>(families.size()),
                .min_rounds = 2,
                .max_rounds = 9,
                .warm_up = false};
  const std::vector<const ScalableNlp*> quick = run(settings, families, n, effort, limit);
  if (!large || quick.empty()) return;
  effort.min_rounds = 1;
  (void)run(settings, quick, 10 * n, effort, 10.0 * limit);
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Settings settings{.seconds = 60.0, .csv = {}};
  int n = 10000;
  double limit = 20.0;
  bool large = false;
  std::string family;
  CommandLine command_line("minimization: our wall time over Ipopt's");
  command_line.add("--variables", n, "of each problem, about (10000)");
  command_line.add("--limit", limit, "seconds for one solve (20)");
  command_line.add_flag("--large", large,
                        "then ten times as many, where Ipopt stays within the limit");
  command_line.add("--family", family, "only this one");
  return bench::run_program(argc, argv, command_line, settings, [&] {
    if (n < 100) throw std::invalid_argument("--variables must be at least 100");
    bench::print_environment();
    bench::run(settings, n, limit, family, large);
  });
}
