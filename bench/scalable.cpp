// Sparse minmax families with a planted solution, 10^3 to 10^6 unknowns (variables and
// multipliers): time, its growth against the predicted factor entries, and peak memory against what
// MUMPS says it uses. Every solve runs in a process of its own, so that VmHWM is that solve's.

#include <dmumps_c.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/solver.hpp"
#include "kkt_matrices.hpp"
#include "linalg/ordering.hpp"
#include "planted_problem.hpp"
#include "program.hpp"

namespace bench {
namespace {

using ipminmax::Index;

struct Family {
  const char* name;
  std::unique_ptr<PlantedProblem> (*make)(Index unknowns);
};

Index side_of(Index nodes, int dimensions = 2) {
  const double side = std::pow(nodes, 1.0 / dimensions);
  return std::max<Index>(2, static_cast<Index>(std::lround(side)));
}

constexpr Family kFamilies[] = {
    {"quartic_chain", [](Index unknowns) { return quartic_chain(unknowns / 2); }},
    {"quartic_grid", [](Index unknowns) { return quartic_grid(side_of(unknowns / 2)); }},
    {"elliptic_grid", [](Index unknowns) { return elliptic_grid(side_of(unknowns / 4)); }},
    {"elliptic_cube", [](Index unknowns) { return elliptic_cube(side_of(unknowns / 4, 3)); }},
};

const Family& family_named(const std::string& name) {
  for (const Family& family : kFamilies) {
    if (family.name == name) return family;
  }
  throw std::invalid_argument("no family " + name);
}

// --- The child: one solve ------------------------------------------------------------------------

/// Megabytes of a line of /proc/self/status.
double status_megabytes(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(key + ":")) return std::stod(line.substr(key.size() + 1)) / 1024.0;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

/// What a child tells, one number per word, in this order.
struct Report {
  double unknowns = 0.0, seconds = 0.0, iterations = 0.0, certified = 0.0, success = 0.0;
  double factorizations_full = 0.0, factorizations_inner = 0.0;
  double distance = 0.0;                       ///< |v - v*|
  double peak_megabytes = 0.0;                 ///< VmHWM after the solve - VmRSS before it
  double analysis = 0.0, factorization = 0.0;  ///< shares of the time
  static constexpr std::size_t kFields = 11;
  [[nodiscard]] std::array<double*, kFields> fields() {
    return {&unknowns,
            &seconds,
            &iterations,
            &certified,
            &success,
            &factorizations_full,
            &factorizations_inner,
            &distance,
            &peak_megabytes,
            &analysis,
            &factorization};
  }
};

void solve_as_child(const Family& family, Index unknowns, const std::string& solver, double limit) {
  const auto problem = family.make(unknowns);
  ipminmax::SolverOptions options;
  options.max_wall_time = limit;
  if (solver == "mumps") options.linear_solver = ipminmax::LinearSolver::Mumps;
  const double before = status_megabytes("VmRSS");
  const Clock clock;
  const ipminmax::Result result = solve(*problem, options);
  Report report;
  report.seconds = clock.seconds();
  report.peak_megabytes = status_megabytes("VmHWM") - before;
  const ipminmax::ProblemStructure& s = problem->structure();
  report.unknowns = static_cast<double>(s.variable_lower.size() + s.constraint_lower.size());
  report.iterations = result.iterations;
  report.analysis = result.timing.analysis / result.timing.total;
  report.factorization = result.timing.factorization / result.timing.total;
  report.certified = result.certificate.kind == ipminmax::PointKind::LocalMinmax ? 1.0 : 0.0;
  report.success = is_success(result.status) ? 1.0 : 0.0;
  report.factorizations_full = result.counts.factorizations_full;
  report.factorizations_inner = result.counts.factorizations_inner;
  for (std::size_t i = 0; i < result.v.size(); ++i) {
    report.distance = std::max(report.distance, std::abs(result.v[i] - problem->solution()[i]));
  }
  for (const double* field : report.fields()) std::printf("%.17g ", *field);
  std::printf("\n");
}

/// What MUMPS says of factorizing K and K_yy, in megabytes: estimated before, used in fact.
struct MumpsMemory {
  double estimated = 0.0, used = 0.0;
};

void add_mumps_memory(const ipminmax::SymmetricMatrix& matrix, MumpsMemory& memory) {
  if (matrix.dimension() == 0) return;
  DMUMPS_STRUC_C data{};
  const auto run = [&](int job) {
    data.job = job;
    dmumps_c(&data);
    if (data.infog[0] < 0) {
      throw std::runtime_error("MUMPS gives up: INFOG(1) = " + std::to_string(data.infog[0]));
    }
  };
  data.sym = 2;
  data.par = 1;
  data.comm_fortran = -987654;
  run(-1);
  for (int k = 0; k < 4; ++k) data.icntl[k] = 0;  // silent
  const ipminmax::OrderingChoice choice =
      choose_ordering(matrix, ipminmax::Ordering::Best);  // of AMD and METIS
  std::vector<MUMPS_INT> rows, cols, order;
  std::vector<double> values(matrix.values().begin(), matrix.values().end());
  for (Index j = 0; j < matrix.dimension(); ++j) {
    const auto column = static_cast<std::size_t>(j);
    for (Index p = matrix.column_starts()[column]; p < matrix.column_starts()[column + 1]; ++p) {
      rows.push_back(matrix.rows()[static_cast<std::size_t>(p)] + 1);
      cols.push_back(j + 1);
    }
    order.push_back(choice.new_index[column] + 1);
  }
  data.n = matrix.dimension();
  data.nnz = matrix.nonzeros();
  data.irn = rows.data();
  data.jcn = cols.data();
  data.a = values.data();
  data.perm_in = order.data();
  data.icntl[6] = 1;     // the given ordering
  data.icntl[12] = 1;    // no ScaLAPACK
  data.icntl[13] = 100;  // percent of extra workspace
  run(1);
  memory.estimated += data.infog[16];
  run(2);
  memory.used += data.infog[21];
  run(-2);
}

/// Prints the predicted entries and flops of K, or what MUMPS says of its memory.
void analyze_as_child(const Family& family, Index unknowns, bool by_mumps) {
  const auto problem = family.make(unknowns);
  ipminmax::SolverOptions options;  // the pattern is all that counts
  options.linear_solver = ipminmax::LinearSolver::Ldlt;
  options.minmax_ordering = ipminmax::Ordering::Amd;
  const KktMatrices matrices = kkt_matrices_after(*problem, 0, options);
  if (by_mumps) {
    MumpsMemory memory;
    add_mumps_memory(matrices.full.matrix, memory);
    add_mumps_memory(matrices.inner.matrix, memory);
    std::printf("%.17g %.17g\n", memory.used, memory.estimated);
  } else {
    const ipminmax::FactorSize size =
        choose_ordering(matrices.full.matrix, ipminmax::Ordering::Best).size;
    std::printf("%.17g %.17g\n", static_cast<double>(size.entries), size.flops);
  }
}

// --- The parent ----------------------------------------------------------------------------------

/// Runs this program with arguments and returns the numbers it prints; empty when it fails.
std::vector<double> child(const std::string& arguments) {
  std::array<char, 4096> path{};
  if (readlink("/proc/self/exe", path.data(), path.size() - 1) <= 0) {
    throw std::runtime_error("cannot find this program's file");
  }
  const std::string command = "'" + std::string(path.data()) + "' " + arguments;
  std::FILE* out = popen(command.c_str(), "r");
  if (out == nullptr) throw std::runtime_error("cannot start " + command);
  std::vector<double> numbers;
  for (double value = 0.0; std::fscanf(out, "%lf", &value) == 1;) numbers.push_back(value);
  return pclose(out) == 0 ? numbers : std::vector<double>{};
}

Report solve_in_child(const Family& family, Index unknowns, const char* solver, double limit) {
  Report report;
  std::ostringstream arguments;
  arguments << "--child-solve " << solver << " --family " << family.name << " --unknowns "
            << unknowns << " --limit " << limit;
  const std::vector<double> numbers = child(arguments.str());
  if (numbers.size() != Report::kFields) return report;  // out of memory, say
  for (std::size_t k = 0; k < Report::kFields; ++k) *report.fields()[k] = numbers[k];
  return report;
}

/// Two numbers from an analyzing child, NaN when it failed.
std::array<double, 2> analyze_in_child(const char* what, const Family& family, Index unknowns) {
  const std::vector<double> numbers =
      child(std::string("--child-analyze ") + what + " --family " + family.name + " --unknowns " +
            std::to_string(unknowns));
  if (numbers.size() != 2) return {std::nan(""), std::nan("")};
  return {numbers[0], numbers[1]};
}

struct Growth {
  std::vector<double> unknowns{}, per_iteration{}, entries{}, flops{};
};

/// One row per size; stops where the flops say that the next size would take longer than limit.
Growth grow(const Family& family, Index largest, double limit, double seconds, Table& table) {
  Growth growth;
  double last_flops = 0.0, last_seconds = 0.0;
  for (Index unknowns = 1000; unknowns <= largest; unknowns *= 10) {
    const auto [entries, flops] = analyze_in_child("sizes", family, unknowns);
    const double expected = last_flops > 0.0 ? last_seconds * flops / last_flops : 0.0;
    if (!(expected <= limit)) {
      std::printf("%s with %d unknowns left out: about %.0f s, above --limit\n", family.name,
                  unknowns, expected);
      break;
    }
    Report with_auto, with_mumps;
    const std::vector<std::function<double()>> contestants = {
        [&] { return (with_auto = solve_in_child(family, unknowns, "auto", limit)).seconds; },
        [&] { return (with_mumps = solve_in_child(family, unknowns, "mumps", limit)).seconds; }};
    const Effort effort{
        .seconds = seconds / 4.0, .min_rounds = 1, .max_rounds = 9, .warm_up = false};
    const auto times = alternate(effort, contestants);
    const auto [used, estimated] = analyze_in_child("mumps", family, unknowns);
    const Spread time = spread(times[0]);
    const double per_iteration = time.median / std::max(with_auto.iterations, 1.0);
    table.row().text(family.name).integer(static_cast<std::int64_t>(with_auto.unknowns));
    table.text(with_auto.certified > 0.0 ? "yes" : with_auto.success > 0.0 ? "undecided" : "no");
    table.number(with_auto.iterations).number(with_auto.factorizations_full);
    table.number(with_auto.factorizations_inner).number(with_auto.distance, 2).time(time);
    table.time(per_iteration).percent(with_auto.analysis).percent(with_auto.factorization);
    table.time(spread(times[1]).median).number(spread_of_ratios(times[1], times[0]));
    table.number(entries).number(flops).number(with_auto.peak_megabytes);
    table.number(with_mumps.peak_megabytes).number(used).number(estimated);
    last_flops = flops;
    last_seconds = std::max(time.median, spread(times[1]).median);
    if (with_auto.success == 0.0) continue;
    growth.unknowns.push_back(with_auto.unknowns);
    growth.per_iteration.push_back(per_iteration);
    growth.entries.push_back(entries);
    growth.flops.push_back(flops);
  }
  return growth;
}

void run(const Settings& settings, Index largest, double limit, const std::string& only) {
  Table table({"family", "unknowns", "cert", "iter", "fact K", "fact K_yy", "|v - v*|", "time",
               "time/iter", "analysis", "fact", "with MUMPS", "MUMPS / auto", "L entries",
               "L flops", "peak MB", "peak MB MUMPS", "MUMPS says used", "estimated"});
  Table growths({"family", "unknowns from", "to", "entries ~ N^", "flops ~ N^", "time/iter ~ N^",
                 "time/iter ~ entries^"});
  for (const Family& family : kFamilies) {
    if (!only.empty() && only != family.name) continue;
    const double seconds = settings.seconds / static_cast<double>(std::size(kFamilies));
    const Growth growth = grow(family, largest, limit, seconds, table);
    if (growth.unknowns.size() < 2) continue;
    growths.row().text(family.name).number(growth.unknowns.front(), 8);
    growths.number(growth.unknowns.back(), 8);
    growths.number(fitted_exponent(growth.unknowns, growth.entries));
    growths.number(fitted_exponent(growth.unknowns, growth.flops));
    growths.number(fitted_exponent(growth.unknowns, growth.per_iteration));
    growths.number(fitted_exponent(growth.entries, growth.per_iteration));
  }
  publish(table,
          "Planted solutions: median [quartiles]; peak MB = VmHWM after - VmRSS before the solve; "
          "MUMPS's figures are for K and K_yy",
          "scalable", settings);
  publish(growths, "Growth (least-squares fits)", "scalable_growth", settings);
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  bench::Settings settings;
  std::string family, solver, analyze;
  int unknowns = 1000000;
  double limit = 0.0;
  CommandLine command_line("scalable: time and memory of sparse minmax problems of any size");
  command_line.add("--family", family,
                   "only this one: quartic_chain, quartic_grid, elliptic_grid, elliptic_cube");
  command_line.add("--unknowns", unknowns, "largest number, variables and multipliers (1000000)");
  command_line.add("--limit", limit, "seconds for one solve (6 x --seconds)");
  command_line.add("--child-solve", solver, "auto or mumps: one solve, for the parent process");
  command_line.add("--child-analyze", analyze, "sizes or mumps: figures for the parent process");
  return bench::run_program(argc, argv, command_line, settings, [&] {
    if (unknowns < 100) throw std::invalid_argument("--unknowns must be at least 100");
    if (limit <= 0.0) limit = 6.0 * settings.seconds;
    if (!family.empty()) (void)bench::family_named(family);
    if (!solver.empty()) {
      bench::solve_as_child(bench::family_named(family), unknowns, solver, limit);
    } else if (!analyze.empty()) {
      bench::analyze_as_child(bench::family_named(family), unknowns, analyze == "mumps");
    } else {
      bench::print_environment();
      bench::run(settings, unknowns, limit, family);
    }
  });
}
