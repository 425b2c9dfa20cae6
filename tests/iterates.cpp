// The bits of every iterate, to prove that a change of the code changes none of them.
//
//   iterates FILE             solves the small, multimodal, scalable and Hock-Schittkowski
//                             problems, some of them from many starts, semi-infinite and branching
//                             ones with copies of y, and writes a line per call of the iteration
//                             callback and per result
//   iterates --compare A B    names the first difference of two such files and counts the solves
//                             that differ; exit code 1 if there is any
//
// Doubles are written as hexadecimal floating-point numbers: all their bits, but a NaN's payload.

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <problems/branching_problems.hpp>
#include <problems/random_multimodal.hpp>
#include <problems/scalable_problems.hpp>
#include <problems/semi_infinite_programs.hpp>
#include <problems/small_problems.hpp>
#include <regression/hock_schittkowski.hpp>
#include <regression/not_minima.hpp>
#include <regression/scalable_nlp.hpp>

#include "core/multistart.hpp"
#include "core/robust.hpp"
#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

/// Lines "<solve> <iteration> <what> <numbers>", <solve> without spaces.
class Writer {
 public:
  explicit Writer(const std::string& path) : file_(std::fopen(path.c_str(), "w")) {
    if (file_ == nullptr) throw std::runtime_error("cannot write " + path);
  }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  ~Writer() {
    if (file_ != nullptr) std::fclose(file_);
  }

  void run(std::string name, Problem& problem, const SolverOptions& options) {
    std::ranges::replace(name, ' ', '_');
    end(name, solve(problem, options, [&](const IterationInfo& info) { return step(name, info); }));
  }

  void run_robust(std::string name, Problem& problem, const SolverOptions& options) {
    std::ranges::replace(name, ' ', '_');
    SolveObserver observer;
    observer.on_iteration = [&](const IterationInfo& info) { return step(name, info); };
    const RobustResult found = solve_robust(problem, options, observer);
    for (const RobustWorstCase& worst : found.worst_cases) {
      Result at;
      at.v = worst.v;
      at.lambda = {worst.value, worst.multiplier};
      line(name, worst.constraint, worst.active ? "worst_active" : "worst", 0.0, at);
    }
    for (const DistinctPoint& point : found.points) end(name, point.result);
    end(name, found.result);
  }

  void run_multistart(std::string name, Problem& problem, const SolverOptions& options) {
    std::ranges::replace(name, ' ', '_');
    MultistartObserver observer;
    observer.on_iteration = [&](Index, const IterationInfo& info) { return step(name, info); };
    observer.on_result = [&](Index, const Result& result) { end(name, result); };
    const MultistartResult found = multistart(problem, options, observer);
    for (const DistinctPoint& point : found.points) end(name, point.result);
    end(name, found.best);
  }

  void close() {
    const bool failed = std::ferror(file_) != 0;
    if (std::fclose(std::exchange(file_, nullptr)) != 0 || failed) {
      throw std::runtime_error("not everything could be written");
    }
  }

 private:
  bool step(const std::string& name, const IterationInfo& info) {
    std::string kind(1, info.step_kind == ' ' ? '-' : info.step_kind);
    if (info.restoration) kind += '*';
    line(name, info.iteration, kind, info.mu, info.result());
    return true;
  }
  void end(const std::string& name, const Result& result) {
    line(name, result.iterations, "status_" + std::to_string(static_cast<int>(result.status)),
         result.mu, result);
  }
  void line(const std::string& name, Index iteration, const std::string& what, double mu,
            const Result& at) {
    std::fprintf(file_, "%s %d %s mu %a", name.c_str(), static_cast<int>(iteration), what.c_str(),
                 mu);
    vector(" v", at.v);
    vector(" lambda", at.lambda);
    vector(" z_lower", at.z_lower);
    vector(" z_upper", at.z_upper);
    std::fputc('\n', file_);
  }
  void vector(const char* name, const std::vector<double>& values) {
    std::fputs(name, file_);
    for (const double value : values) std::fprintf(file_, " %a", value);
  }

  std::FILE* file_;
};

using Options = std::vector<std::pair<std::string, std::function<void(SolverOptions&)>>>;

void run_all(Writer& writer, const std::string& name, Problem& problem, const Options& variants) {
  for (const auto& [variant, change] : variants) {
    SolverOptions options;
    change(options);
    writer.run(name + '/' + variant, problem, options);
  }
}

/// From many starts, some with worst cases of the points found.
void write_multistarts(Writer& writer) {
  for (const auto kind : {MultimodalKind::Box, MultimodalKind::Constrained}) {
    for (std::uint64_t seed = 21; seed <= 26; ++seed) {
      const MultimodalProblem many = random_multimodal(kind, 2, 1, seed);
      AutodiffProblem problem(many.model, many.starts[0]);
      SolverOptions options;
      options.minmax_starts = 4;
      options.minmax_worst_case_starts = seed % 2 == 0 ? 3 : 0;
      writer.run_multistart(
          "multistart/" + std::to_string(static_cast<int>(kind)) + '.' + std::to_string(seed),
          problem, options);
    }
  }
}

/// Robust constraints with their worst cases, and worst cases of f.
void write_robust(Writer& writer) {
  for (const SemiInfinite& program : semi_infinite_programs()) {
    AutodiffProblem problem(model_of(program), start_of(program));
    SolverOptions options;
    options.minmax_worst_case_starts = 3;
    options.minmax_starts = program.start.size() < 3 ? 2 : 1;
    writer.run_robust(program.name, problem, options);
  }
  for (const auto family : {BranchingFamily::Response, BranchingFamily::Network}) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const BranchingProblem branching = branching_problem(family, 1, seed);
      AutodiffProblem problem(branching.model, branching.starts[0]);
      SolverOptions options;
      options.minmax_worst_case_starts = 4;
      (seed % 2 == 0 ? options.minmax_epigraph : options.minmax_epigraph_at_kinks) = true;
      writer.run_robust("branching/" + branching.name, problem, options);
    }
  }
}

void write(const std::string& path) {
  Writer writer(path);
  const Options defaults = {{"default", [](SolverOptions&) {}}};
  Options minmax = defaults;
  minmax.emplace_back("none",
                      [](SolverOptions& o) { o.minmax_globalization = Globalization::None; });
  minmax.emplace_back("adaptive",
                      [](SolverOptions& o) { o.mu_strategy = BarrierStrategy::Adaptive; });
  minmax.emplace_back("mumps", [](SolverOptions& o) { o.linear_solver = LinearSolver::Mumps; });
  minmax.emplace_back("ldlt", [](SolverOptions& o) { o.linear_solver = LinearSolver::Ldlt; });
  minmax.emplace_back(
      "schur", [](SolverOptions& o) { o.minmax_schur_complement = SchurComplementUse::Yes; });

  for (const SmallProblem& known : small_problems()) {
    for (std::size_t k = 0; k < known.starts.size(); ++k) {
      AutodiffProblem problem(known.model, known.starts[k]);
      run_all(writer, known.name + '/' + std::to_string(k), problem, minmax);
    }
  }
  const std::pair<const char*, MultimodalKind> kinds[] = {
      {"free", MultimodalKind::Free},
      {"box", MultimodalKind::Box},
      {"constrained", MultimodalKind::Constrained}};
  for (const auto& [kind, value] : kinds) {
    for (const int n : {1, 2, 5}) {
      for (std::uint64_t seed = 1; seed <= 10; ++seed) {
        const MultimodalProblem many = random_multimodal(value, n, 4, seed);
        for (std::size_t k = 0; k < many.starts.size(); ++k) {
          AutodiffProblem problem(many.model, many.starts[k]);
          run_all(writer,
                  "multimodal_" + std::string(kind) + '_' + std::to_string(n) + '/' +
                      std::to_string(seed) + '.' + std::to_string(k),
                  problem, defaults);
        }
      }
    }
  }
  for (const MinimizationProblem& known : hock_schittkowski()) {
    AutodiffProblem problem(known.model, known.start);
    run_all(writer, known.name, problem, defaults);
  }
  for (const IllPosed& known : ill_posed()) {
    AutodiffProblem problem(known.model, known.start);
    run_all(writer, known.name, problem, defaults);
  }
  for (const NotMinimum& known : not_minima()) {
    AutodiffProblem problem(known.model, known.start);
    run_all(writer, known.name, problem, defaults);
  }
  ScalableProblem scalable[] = {
      f01_quad(50),    f03_quad_box(50), f05_trig(20), f10_ball_halfspace(20), f12_robust_ls(10, 4),
      f16_lq_game(30), f17_mpc_box(30),  f19_pde(40),  f23_sphere(8),          f30_few_min(3, 8)};
  for (ScalableProblem& known : scalable) {
    run_all(writer, known.name, *known.problem, minmax);
  }
  for (const ScalableNlp& family : scalable_nlps()) {
    const auto problem = family.make(100);
    run_all(writer, family.name, *problem, defaults);
  }
  write_multistarts(writer);
  write_robust(writer);
  writer.close();
}

/// One line, split at its first three spaces.
struct Line {
  std::string_view solve, iteration, what, numbers;
  [[nodiscard]] bool is_result() const { return what.starts_with("status"); }
};

Line split(std::string_view text) {
  Line line;
  for (std::string_view* part : {&line.solve, &line.iteration, &line.what}) {
    const std::size_t end = text.find(' ');
    if (end == std::string_view::npos) throw std::runtime_error("a file is damaged");
    *part = text.substr(0, end);
    text.remove_prefix(end + 1);
  }
  line.numbers = text;
  return line;
}

/// All lines of each solve.
std::map<std::string, std::vector<std::string>> read(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("cannot read " + path);
  std::map<std::string, std::vector<std::string>> solves;
  for (std::string text; std::getline(file, text);) {
    solves[std::string(split(text).solve)].push_back(text);
  }
  return solves;
}

/// The first number that differs, by the name of its array and its place.
std::string first_difference(std::string_view a, std::string_view b) {
  std::string array;
  int place = -1;
  while (!a.empty() || !b.empty()) {
    std::string_view words[2];
    std::string_view* texts[2] = {&a, &b};
    for (int k = 0; k < 2; ++k) {
      words[k] = texts[k]->substr(0, texts[k]->find(' '));
      texts[k]->remove_prefix(std::min(words[k].size() + 1, texts[k]->size()));
    }
    if (words[0] != words[1]) {
      return array + '[' + std::to_string(place + 1) + "]: " + std::string(words[0]) + " and " +
             std::string(words[1]);
    }
    const bool name = words[0] == "mu" || words[0] == "v" || words[0] == "lambda" ||
                      words[0] == "z_lower" || words[0] == "z_upper";
    if (name) array = words[0];
    place = name ? -1 : place + 1;
  }
  return "nothing";
}

/// Where two solves part, empty: nowhere.
std::string compare(const std::vector<std::string>& a, const std::vector<std::string>& b) {
  for (std::size_t k = 0; k < std::max(a.size(), b.size()); ++k) {
    if (k == a.size() || k == b.size()) return "one has more iterates";
    if (a[k] == b[k]) continue;
    const Line x = split(a[k]), y = split(b[k]);
    const std::string where =
        x.is_result() && y.is_result() ? "result" : "iteration " + std::string(x.iteration);
    if (x.iteration != y.iteration || x.what != y.what) {
      return where + " (" + std::string(x.what) + ") and " + std::string(y.iteration) + " (" +
             std::string(y.what) + ")";
    }
    return where + " (" + std::string(x.what) + "), " + first_difference(x.numbers, y.numbers);
  }
  return {};
}

/// Number of solves that differ.
int compare(const std::string& first, const std::string& second) {
  const auto a = read(first), b = read(second);
  int solves = 0, iterates = 0, results = 0;
  for (const auto& [name, lines] : a) {
    ++solves;
    const auto other = b.find(name);
    const std::string difference =
        other == b.end() ? "only in the first file" : compare(lines, other->second);
    if (difference.empty()) continue;
    ++(difference.starts_with("result") ? results : iterates);
    std::printf("%s: %s\n", name.c_str(), difference.c_str());
  }
  for (const auto& [name, lines] : b) {
    if (a.contains(name)) continue;
    ++solves;
    ++iterates;
    std::printf("%s: only in the second file\n", name.c_str());
  }
  std::printf("%d solves: %d differ in their iterates, %d in the result alone\n", solves, iterates,
              results);
  return iterates + results;
}

}  // namespace
}  // namespace ipminmax::testing

int main(int argc, char** argv) {
  try {
    if (argc == 2 && argv[1][0] != '-') {
      ipminmax::testing::write(argv[1]);
      return 0;
    }
    if (argc == 4 && std::string_view(argv[1]) == "--compare") {
      return ipminmax::testing::compare(argv[2], argv[3]) == 0 ? 0 : 1;
    }
    std::fprintf(stderr, "usage: iterates FILE | iterates --compare FILE FILE\n");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "iterates: %s\n", error.what());
  }
  return 2;
}
