// Which factorization and which ordering wins where, on KKT matrices captured from solves: the
// figures behind the rules of linear_solver auto. Google Benchmark takes the times, its repetitions
// interleaved at random; --benchmark_... options are Google Benchmark's.
//
// Then the same factorizations with OpenBLAS and with the reference BLAS, in alternating child
// processes that differ in LD_LIBRARY_PATH alone.

#include <benchmark/benchmark.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <examples/chauffeur_tnlp.hpp>
#include <problems/scalable_problems.hpp>
#include <regression/scalable_nlp.hpp>

#include <examples/sequential_chauffeur.hpp>
#include "adapter/ipopt/tnlp_problem.hpp"
#include "kkt_matrices.hpp"
#include "linalg/make_solver.hpp"
#include "linalg/ordering.hpp"
#include "planted_problem.hpp"
#include "program.hpp"

namespace bench {
namespace {

using ipminmax::Certainty;
using ipminmax::Index;
using ipminmax::LinearSolver;
using ipminmax::Ordering;

// --- Matrices ------------------------------------------------------------------------------------

struct Source {
  std::string name;
  std::function<std::unique_ptr<ipminmax::Problem>()> problem;
};

std::unique_ptr<ipminmax::Problem> chauffeur_problem(int horizon) {
  auto problem = std::make_unique<ipminmax::TnlpProblem>(new chauffeur::ChauffeurTNLP(
      chauffeur::refined(horizon), {}, chauffeur::Control{0.01, 0.002, 0.001}));
  if (const std::string error = problem->load(); !error.empty()) throw std::runtime_error(error);
  return problem;
}

std::unique_ptr<ipminmax::Problem> dense_chauffeur(int horizon) {
  return std::make_unique<chauffeur::SequentialChauffeur>(
      chauffeur::refined(horizon), chauffeur::State{},
      std::vector<chauffeur::Control>(static_cast<std::size_t>(horizon), {0.01, 0.002, 0.001}));
}

/// From small to large, chains, dense ones and grids.
std::vector<Source> sources() {
  using namespace ipminmax::testing;
  std::vector<Source> all;
  for (const int horizon : {2, 5, 20, 100, 1000}) {
    all.push_back({"chauffeur T=" + std::to_string(horizon),
                   [horizon] { return chauffeur_problem(horizon); }});
  }
  for (const int horizon : {3, 5, 10, 20, 40, 100}) {
    all.push_back({"dense chauffeur T=" + std::to_string(horizon),
                   [horizon] { return dense_chauffeur(horizon); }});
  }
  all.push_back({"robust least squares 30x10", [] { return f12_robust_ls(30, 10).problem; }});
  for (const Index side : {16, 50, 100, 200}) {
    all.push_back(
        {"elliptic grid " + std::to_string(side), [side] { return elliptic_grid(side); }});
    all.push_back({"quartic grid " + std::to_string(side), [side] { return quartic_grid(side); }});
  }
  all.push_back({"NLP distributed_control 10000",
                 [] { return scalable_nlp("distributed_control").make(10000); }});
  all.push_back(
      {"NLP power_network 10000", [] { return scalable_nlp("power_network").make(10000); }});
  return all;
}

/// K after a few iterations; the later ones have the same pattern.
KktMatrix capture(const Source& source) {
  const auto problem = source.problem();
  ipminmax::SolverOptions options;  // quick to get there
  options.linear_solver = LinearSolver::Ldlt;
  options.minmax_ordering = Ordering::Amd;
  return kkt_matrices_after(*problem, 2, options).full;
}

// --- Contestants ---------------------------------------------------------------------------------

struct Backend {
  const char* name;
  LinearSolver solver;
  Ordering ordering;
};
constexpr Backend kBackends[] = {
    {"ldlt amd", LinearSolver::Ldlt, Ordering::Amd},
    {"ldlt metis", LinearSolver::Ldlt, Ordering::Metis},
    {"mumps amd", LinearSolver::Mumps, Ordering::Amd},
    {"mumps pord", LinearSolver::Mumps, Ordering::Pord},
    {"mumps metis", LinearSolver::Mumps, Ordering::Metis},
    {"lapack", LinearSolver::Lapack, Ordering::Best},
    {"auto", LinearSolver::Auto, Ordering::Best},
};

/// LAPACK beyond it, and LDL' beyond so many flops, only cost patience.
constexpr Index kLargestDense = 1000;
constexpr double kMostLdltFlops = 5e10;

bool worthwhile(const Backend& backend, const KktMatrix& k) {
  if (backend.solver == LinearSolver::Lapack) return k.matrix.dimension() <= kLargestDense;
  if (backend.solver != LinearSolver::Ldlt) return true;
  return choose_ordering(k.matrix, backend.ordering).size.flops <= kMostLdltFlops;
}

/// A solver that has analyzed the matrix, as the iterations use it.
struct Prepared {
  std::unique_ptr<ipminmax::SymmetricSolver> solver{};
  ipminmax::Analysis analysis{};
  double analysis_seconds = 0.0;
};

Prepared prepare(const Backend& backend, const KktMatrix& k) {
  Prepared p;
  p.solver = make_symmetric_solver(backend.solver, {.ordering = backend.ordering});
  const Clock clock;
  p.analysis = p.solver->analyze(k.matrix, k.signs);
  p.analysis_seconds = clock.seconds();
  if (!p.analysis.ok) throw std::runtime_error(std::string(backend.name) + ": no analysis");
  return p;
}

const char* name_of(Ordering ordering) {
  switch (ordering) {
    case Ordering::Best:
      return "best";
    case Ordering::Amd:
      return "amd";
    case Ordering::Pord:
      return "pord";
    case Ordering::Metis:
      return "metis";
  }
  return "?";
}

// --- Google Benchmark ----------------------------------------------------------------------------

struct Measured {
  std::vector<double> seconds{};
  Prepared prepared{};
  ipminmax::Factorization result{};
};

/// By matrix and backend; filled while the benchmarks run.
using Measurements = std::map<std::pair<std::string, std::string>, Measured>;

void factorize(benchmark::State& state, const Backend& backend, const KktMatrix& k,
               Measured& measured) {
  if (measured.prepared.solver == nullptr) {
    measured.prepared = prepare(backend, k);
    (void)measured.prepared.solver->factorize(k.matrix, Certainty::Usual);  // allocates
  }
  ipminmax::SymmetricSolver& solver = *measured.prepared.solver;
  for ([[maybe_unused]] auto _ : state)
    measured.result = solver.factorize(k.matrix, Certainty::Usual);
}

/// Takes the repetitions down and prints nothing.
class Collector final : public benchmark::BenchmarkReporter {
 public:
  explicit Collector(Measurements& measurements) : measurements_(measurements) {}
  bool ReportContext(const Context&) override { return true; }
  void ReportRuns(const std::vector<Run>& runs) override {
    for (const Run& run : runs) {
      if (run.run_type != Run::RT_Iteration || run.error_occurred) continue;
      const std::string& name = run.run_name.function_name;
      const std::size_t slash = name.find('/');
      measurements_[{name.substr(0, slash), name.substr(slash + 1)}].seconds.push_back(
          run.real_accumulated_time / static_cast<double>(run.iterations));
    }
  }

 private:
  Measurements& measurements_;
};

/// The measurements of one matrix.
class MatrixReport {
 public:
  MatrixReport(const std::string& name, const KktMatrix& k, const Measurements& measurements)
      : name_(name), k_(k), size_(choose_ordering(k.matrix, Ordering::Best).size) {
    for (const Backend& backend : kBackends) {
      const auto found = measurements.find({name, backend.name});
      if (found == measurements.end() || found->second.seconds.empty()) continue;
      lines_.push_back({&backend, &found->second, spread(found->second.seconds)});
    }
  }

  void add_all(Table& table) const {
    for (const Line& line : lines_) {
      const Measured& m = *line.measured;
      const bool dense = line.backend->solver == LinearSolver::Lapack;
      table.row().text(name_).integer(k_.matrix.dimension()).integer(k_.matrix.nonzeros());
      table.text(line.backend->name);
      table.text(dense ? "-" : name_of(m.prepared.analysis.ordering));
      table.number(static_cast<double>(m.prepared.analysis.factor_entries));
      table.number(m.prepared.analysis.flops).number(flops_per_entry());
      table.time(m.prepared.analysis_seconds).time(line.time).number(line.time.median / best());
      table.text(std::to_string(m.result.inertia.positive) + " " +
                 std::to_string(m.result.inertia.negative) + " " +
                 std::to_string(m.result.inertia.zero));
    }
  }

  void add_summary(Table& table) const {
    table.row().text(name_).integer(k_.matrix.dimension()).integer(k_.matrix.nonzeros());
    table.number(static_cast<double>(size_.entries)).number(flops_per_entry());
    for (const LinearSolver solver :
         {LinearSolver::Ldlt, LinearSolver::Mumps, LinearSolver::Lapack, LinearSolver::Auto}) {
      const Line* line = fastest(solver);
      line == nullptr ? table.none() : table.time(line->time);
    }
    const Line* chosen = fastest(LinearSolver::Auto);
    if (chosen == nullptr) return;
    table.number(chosen->time.median / best());
    table.time(chosen->measured->prepared.analysis_seconds);
    table.text(chosen->measured->result.trust.pivoted ? "pivoting" : "LDL'");
    table.text(name_of(chosen->measured->prepared.analysis.ordering));
  }

 private:
  struct Line {
    const Backend* backend;
    const Measured* measured;
    Spread time;
  };

  [[nodiscard]] double flops_per_entry() const {
    return size_.flops / static_cast<double>(size_.entries);
  }
  [[nodiscard]] const Line* fastest(LinearSolver solver) const {
    const Line* best = nullptr;
    for (const Line& line : lines_) {
      if (line.backend->solver != solver) continue;
      if (best == nullptr || line.time.median < best->time.median) best = &line;
    }
    return best;
  }
  /// Median of the fastest backend, auto apart.
  [[nodiscard]] double best() const {
    double seconds = INFINITY;
    for (const Line& line : lines_) {
      if (line.backend->solver != LinearSolver::Auto) seconds = std::min(seconds, line.time.median);
    }
    return seconds;
  }

  std::string name_;
  const KktMatrix& k_;
  ipminmax::FactorSize size_;
  std::vector<Line> lines_;
};

void report(const std::vector<std::string>& names, const std::vector<KktMatrix>& matrices,
            const Measurements& measurements, bool all, const Settings& settings) {
  Table summary({"matrix", "rows", "entries", "L entries", "flops/entry", "LDL' (best ordering)",
                 "MUMPS (best ordering)", "LAPACK", "auto", "auto / best", "analysis of auto",
                 "auto takes", "ordering"});
  Table every({"matrix", "rows", "entries", "backend", "ordering", "L entries", "L flops",
               "flops/entry", "analysis", "factorization", "time / best", "inertia + - 0"});
  for (std::size_t k = 0; k < names.size(); ++k) {
    const MatrixReport matrix(names[k], matrices[k], measurements);
    matrix.add_summary(summary);
    matrix.add_all(every);
  }
  publish(summary,
          "Factorization of K: median [quartiles] of interleaved repetitions; by flops/entry (and "
          "rows) linear_solver auto chooses",
          "backends_summary", settings);
  if (all) {
    publish(every, "Every backend and ordering", "backends", settings);
  } else if (!settings.csv.empty()) {
    every.write_csv(settings.csv / "backends.csv");
  }
}

// --- BLAS ----------------------------------------------------------------------------------------

/// The factorizations where dense kernels work.
constexpr const char* kBlasBackends[] = {"mumps metis", "lapack"};

const Backend& backend_named(const std::string& name) {
  return *std::ranges::find_if(kBackends, [&](const Backend& b) { return name == b.name; });
}

/// In the child: prints the BLAS that is loaded, then seconds per factorization, matrix by matrix.
void time_blas_as_child(const std::string& only) {
  std::string blas = "?";
  for (const std::string& library : loaded_numerical_libraries()) {
    if (library.find("blas.so") != std::string::npos) blas = library;
    if (library.find("libopenblas") != std::string::npos) {
      blas = library;
      break;
    }
  }
  std::printf("%s\n", blas.c_str());
  for (const Source& source : sources()) {
    if (source.name.find(only) == std::string::npos) continue;
    const KktMatrix k = capture(source);
    for (const char* name : kBlasBackends) {
      const Backend& backend = backend_named(name);
      if (!worthwhile(backend, k)) continue;
      const Prepared p = prepare(backend, k);
      (void)p.solver->factorize(k.matrix, Certainty::Usual);
      std::printf("%.17g %s/%s\n", time_factorization(*p.solver, k.matrix, 5e-3),
                  source.name.c_str(), name);
    }
  }
}

struct BlasFolder {
  const char* name;
  std::string library_path;  ///< LD_LIBRARY_PATH
};

/// Where Debian keeps the alternatives of libblas.so.3 and liblapack.so.3.
std::vector<BlasFolder> blas_folders() {
  const std::filesystem::path lib = "/usr/lib/" + std::string(BENCH_LIBRARY_ARCHITECTURE);
  return {{"OpenBLAS", (lib / "openblas-pthread").string()},
          {"reference", (lib / "blas").string() + ":" + (lib / "lapack").string()}};
}

void compare_blas(const Settings& settings, const std::string& only) {
  const std::vector<BlasFolder> folders = blas_folders();
  for (const BlasFolder& folder : folders) {
    const std::filesystem::path first =
        folder.library_path.substr(0, folder.library_path.find(':'));
    if (!std::filesystem::exists(first / "libblas.so.3")) {
      std::printf("\n%s has no libblas.so.3: no comparison of BLAS\n", first.c_str());
      return;
    }
  }
  std::array<char, 4096> path{};
  if (readlink("/proc/self/exe", path.data(), path.size() - 1) <= 0) {
    throw std::runtime_error("cannot find this program's file");
  }
  std::vector<std::string> order;
  std::map<std::string, std::vector<double>> times[2];
  std::string loaded[2];
  std::vector<std::function<double()>> contestants;
  for (std::size_t which = 0; which < folders.size(); ++which) {
    contestants.emplace_back([&, which] {
      const Clock clock;
      const std::string command = "LD_LIBRARY_PATH='" + folders[which].library_path +
                                  "' OPENBLAS_NUM_THREADS=1 '" + path.data() +
                                  "' --child-blas --matrices '" + only + "'";
      std::FILE* out = popen(command.c_str(), "r");
      if (out == nullptr) throw std::runtime_error("cannot start " + command);
      std::array<char, 512> line{};
      if (std::fgets(line.data(), line.size(), out) != nullptr) {
        loaded[which] = line.data();
        loaded[which].pop_back();
      }
      double seconds = 0.0;
      while (std::fscanf(out, "%lf %511[^\n]", &seconds, line.data()) == 2) {
        auto& values = times[which][line.data()];
        if (which == 0 && values.empty()) order.emplace_back(line.data());
        values.push_back(seconds);
      }
      if (pclose(out) != 0) throw std::runtime_error("failed: " + command);
      return clock.seconds();
    });
  }
  (void)alternate({.seconds = settings.seconds / 3.0, .min_rounds = 3, .warm_up = false},
                  contestants);
  for (std::size_t which = 0; which < folders.size(); ++which) {
    std::printf("\n%s: %s", folders[which].name, loaded[which].c_str());
  }
  Table table({"matrix", "backend", "OpenBLAS", "reference", "reference / OpenBLAS"});
  for (const std::string& name : order) {
    const std::size_t slash = name.find('/');
    table.row().text(name.substr(0, slash)).text(name.substr(slash + 1));
    table.time(spread(times[0][name])).time(spread(times[1][name]));
    table.number(spread_of_ratios(times[1][name], times[0][name]));
  }
  publish(table, "\nOne factorization with either BLAS, one thread: median [quartiles]", "blas",
          settings);
}

// --- main ----------------------------------------------------------------------------------------

void run(const Settings& settings, const std::string& only, bool all) {
  std::vector<std::string> names;
  std::vector<KktMatrix> matrices;
  for (const Source& source : sources()) {
    if (source.name.find(only) == std::string::npos) continue;
    names.push_back(source.name);
    matrices.push_back(capture(source));
  }
  if (names.empty()) throw std::invalid_argument("no matrix " + only);
  Measurements measurements;
  std::size_t count = 0;
  for (std::size_t k = 0; k < names.size(); ++k) {
    for (const Backend& backend : kBackends) count += worthwhile(backend, matrices[k]) ? 1 : 0;
  }
  constexpr int kRepetitions = 7;
  const double each = settings.seconds * 2.0 / 3.0 / static_cast<double>(count) / kRepetitions;
  for (std::size_t k = 0; k < names.size(); ++k) {
    for (const Backend& backend : kBackends) {
      if (!worthwhile(backend, matrices[k])) continue;
      Measured& measured = measurements[{names[k], backend.name}];
      benchmark::RegisterBenchmark(
          (names[k] + "/" + backend.name).c_str(),
          [&, k](benchmark::State& state) { factorize(state, backend, matrices[k], measured); })
          ->Repetitions(kRepetitions)
          ->MinTime(std::clamp(each / 2.0, 1e-4, 0.2));
    }
  }
  Collector collector(measurements);
  benchmark::RunSpecifiedBenchmarks(&collector);
  benchmark::ClearRegisteredBenchmarks();
  report(names, matrices, measurements, all, settings);
  compare_blas(settings, only);
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  // Google Benchmark's own options are for it, the others for us.
  std::string interleave = "--benchmark_enable_random_interleaving=true";
  std::vector<char*> for_google = {argv[0], interleave.data()}, for_us = {argv[0]};
  for (int i = 1; i < argc; ++i) {
    (std::string_view(argv[i]).starts_with("--benchmark_") ? for_google : for_us)
        .push_back(argv[i]);
  }
  int google_count = static_cast<int>(for_google.size());
  for_google.push_back(nullptr);
  benchmark::Initialize(&google_count, for_google.data());
  if (benchmark::ReportUnrecognizedArguments(google_count, for_google.data())) return 2;
  const int count = static_cast<int>(for_us.size());
  for_us.push_back(nullptr);

  bench::Settings settings{.seconds = 60.0, .csv = {}};
  std::string only;
  bool child = false;
  bool all = false;
  CommandLine command_line("backends: factorizations and orderings on captured KKT matrices");
  command_line.add("--matrices", only, "only those whose name contains it");
  command_line.add_flag("--all", all, "prints every backend and ordering, not only the best");
  command_line.add_flag("--child-blas", child, "times for the parent process");
  return bench::run_program(count, for_us.data(), command_line, settings, [&] {
    if (child) {
      bench::time_blas_as_child(only);
    } else {
      bench::print_environment();
      bench::run(settings, only, all);
    }
  });
}
