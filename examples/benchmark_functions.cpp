// The paper's Table 1: four functions of two scalars, random starts, three methods.
//
// Pure Newton goes to any point with a small gradient; gradient descent ascent (GDA) mostly to
// local minmax points, slowly; Algorithm 1 only to local minmax points, fast. The paper leaves open
// how "increase epsilon" is done; each first shift and growth factor is a row. Two more rows leave
// out line 7 and start the shifts at those of the last iteration, as Ipopt does.
//
// Every point is checked here with the eigenvalues of the analytic Hessian, independently of the
// solver. The program fails when the solver reports a local minmax that is none, or when Algorithm
// 1 with line 7 ends at an equilibrium that is none.
//
//   benchmark_functions
//   benchmark_functions --box3 1 --first-shift 1e-3 --growth 4

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <ipminmax/core/solver.hpp>
#include <optional>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "paper_functions.hpp"

namespace {

using paper_functions::Derivatives;
using paper_functions::Function;

struct Point {
  double x = 0.0, y = 0.0;
};

/// One run: where it stopped, if at a point with a small gradient.
struct Outcome {
  std::optional<Point> point;
  int iterations = 0;
  bool certified = false;    ///< the method says: a local minmax (GDA never does)
  bool not_refuted = false;  ///< the method says: a local minmax, or singular
};

/// One row of the table.
struct Row {
  int equilibria = 0;
  int minmax = 0;
  double mean_iterations = 0.0;  ///< of those that reached a local minmax
  int at_infinity = 0;           ///< |z| > 25: f2 vanishes there, and its gradient with it
  int false_reports = 0;         ///< reported as a local minmax, but is not
};

struct PaperRow {
  int equilibria, minmax;
  double iterations;
};

enum class Kind : std::uint8_t { PureNewton, Gda, Algorithm1 };

/// A row of the table.
struct Method {
  std::string name;
  Kind kind = Kind::Algorithm1;
  bool line7 = true;
  bool warm_shifts = false;
  double first_shift = 1e-4, growth = 10.0;
};

/// The paper's three methods, Algorithm 1 with every pair of first shift and growth.
std::vector<Method> methods(const std::vector<double>& first_shifts,
                            const std::vector<double>& growths, bool with_gda) {
  std::vector<Method> methods = {{"pure Newton", Kind::PureNewton}};
  if (with_gda) methods.push_back({"GDA", Kind::Gda});
  for (const double first : first_shifts) {
    for (const double growth : growths) {
      std::array<char, 40> name{};
      std::snprintf(name.data(), name.size(), "Alg. 1, %g x %g", first, growth);
      methods.push_back({.name = name.data(), .first_shift = first, .growth = growth});
    }
  }
  methods.push_back({.name = "  line 7 off",
                     .line7 = false,
                     .first_shift = first_shifts.front(),
                     .growth = growths.front()});
  methods.push_back({.name = "  warm shifts", .warm_shifts = true});
  return methods;
}

// [function][pure Newton, GDA, Algorithm 1], from the paper.
constexpr std::array<std::array<PaperRow, 3>, 4> kPaper = {{
    {{{1000, 1000, 4.1}, {1000, 1000, 485.0}, {1000, 1000, 5.7}}},
    {{{1000, 665, 7.3}, {976, 976, 18195.0}, {996, 996, 8.1}}},
    {{{954, 485, 4.8}, {373, 373, 40936.0}, {709, 709, 7.1}}},
    {{{1000, 1000, 1.0}, {0, 0, 0.0}, {1000, 1000, 1.0}}},
}};

// GDA's step sizes alpha_x, alpha_y, the best of a grid for each function; every choice diverges on
// f4.
constexpr std::array<Point, 4> kGdaSteps = {{{0.1, 0.03}, {0.02, 0.2}, {0.03, 0.1}, {0.01, 0.01}}};

constexpr double kTolerance = 1e-5;
constexpr int kMaxIterations = 500;
constexpr int kMaxGdaIterations = 50000;
constexpr double kInfinityRadius = 25.0;

/// Second-order test at a stationary point by the eigenvalues of the Hessian K and K_yy = f_yy.
struct SecondOrder {
  bool satisfied = false;  ///< f_yy negative, K with one eigenvalue of each sign
  bool refuted = false;    ///< a wrong sign beyond rounding; at the solution of f4, f_yy = 0
};

SecondOrder second_order(const Derivatives& d) {
  const double half_trace = 0.5 * (d.fxx + d.fyy);
  const double radius = std::hypot(0.5 * (d.fxx - d.fyy), d.fxy);
  const double largest = half_trace + radius, smallest = half_trace - radius;
  const double zero = 1e-8 * std::max(1.0, std::abs(half_trace) + radius);
  return {d.fyy < 0.0 && smallest < 0.0 && largest > 0.0,
          d.fyy > zero || largest < -zero || smallest > zero};
}

double gradient_norm(const Derivatives& d) { return std::max(std::abs(d.fx), std::abs(d.fy)); }

/// x+ = x - alpha_x f_x, y+ = y + alpha_y f_y.
Outcome descend_ascend(const Function& function, Point z, const Point& alpha) {
  Outcome outcome;
  for (int k = 0; k <= kMaxGdaIterations && std::hypot(z.x, z.y) < 1e6; ++k) {
    const Derivatives d = function.evaluate(z.x, z.y);
    outcome.iterations = k;
    if (gradient_norm(d) <= kTolerance) {
      outcome.point = z;
      return outcome;
    }
    z.x -= alpha.x * d.fx;
    z.y += alpha.y * d.fy;
  }
  return outcome;
}

ipminmax::SolverOptions options_of(const Method& method) {
  ipminmax::SolverOptions options = ipminmax::as_printed();
  options.tol = kTolerance;
  options.max_iter = kMaxIterations;
  options.minmax_pure_newton = method.kind == Kind::PureNewton;
  options.minmax_instability = method.line7;
  options.first_hessian_perturbation = method.first_shift;
  options.perturb_inc_fact = options.perturb_inc_fact_first = method.growth;
  if (method.warm_shifts) {
    const ipminmax::SolverOptions defaults;
    options.minmax_warm_start_shifts = true;
    options.perturb_inc_fact = defaults.perturb_inc_fact;
    options.perturb_inc_fact_first = defaults.perturb_inc_fact_first;
  }
  return options;
}

Outcome solve_with_ipminmax(paper_functions::FunctionProblem& problem, const Point& start,
                            const ipminmax::SolverOptions& options) {
  problem.start_at(start.x, start.y);
  const ipminmax::Result result = ipminmax::solve(problem, options);
  Outcome outcome;
  outcome.iterations = result.iterations;
  outcome.not_refuted = is_success(result.status);
  const auto kind = result.certificate.kind;
  // f4 = x y: y = 0 is best, but not the only one, so f_yy = 0 is no fault.
  outcome.certified = kind == ipminmax::PointKind::LocalMinmax &&
                      result.certificate.answer != ipminmax::InnerAnswer::BestNotUnique;
  if (kind == ipminmax::PointKind::LocalMinmax || kind == ipminmax::PointKind::FirstOrderPoint)
    outcome.point = Point{result.v[0], result.v[1]};
  return outcome;
}

/// Sorts the run into the table's columns.
void count(const Function& function, const Outcome& outcome, Row& row) {
  if (!outcome.point) return;
  const Derivatives d = function.evaluate(outcome.point->x, outcome.point->y);
  const SecondOrder test = second_order(d);
  const bool wrong = !(gradient_norm(d) <= 1.01 * kTolerance) || test.refuted;
  row.false_reports +=
      (outcome.not_refuted && wrong) || (outcome.certified && !test.satisfied) ? 1 : 0;
  if (std::hypot(outcome.point->x, outcome.point->y) > kInfinityRadius) {
    ++row.at_infinity;
    return;
  }
  ++row.equilibria;
  if (wrong) return;
  ++row.minmax;
  row.mean_iterations += (outcome.iterations - row.mean_iterations) / row.minmax;
}

Row benchmark(std::size_t function_index, const Method& method, const std::vector<Point>& starts) {
  const Function& function = paper_functions::kFunctions[function_index];
  paper_functions::FunctionProblem problem(function);
  const ipminmax::SolverOptions options = options_of(method);
  Row row;
  for (const Point& start : starts)
    count(function,
          method.kind == Kind::Gda ? descend_ascend(function, start, kGdaSteps[function_index])
                                   : solve_with_ipminmax(problem, start, options),
          row);
  return row;
}

/// The same starts for every method and on every machine (the distribution of the standard library
/// is not prescribed, its engine is).
std::vector<Point> random_starts(int number, double box, unsigned seed) {
  std::mt19937 engine(seed);
  const auto coordinate = [&] {
    return box * (2.0 * (static_cast<double>(engine()) / 4294967296.0) - 1.0);
  };
  std::vector<Point> starts(static_cast<std::size_t>(number));
  for (Point& start : starts) {
    start.x = coordinate();
    start.y = coordinate();
  }
  return starts;
}

void print_row(const char* name, const Row& row, const PaperRow& paper) {
  std::printf("  %-20s %6d %6d %8.1f %6d %6d   |", name, row.equilibria, row.minmax,
              row.mean_iterations, row.at_infinity, row.false_reports);
  if (paper.minmax > 0)
    std::printf(" %6d %6d %8.1f\n", paper.equilibria, paper.minmax, paper.iterations);
  else
    std::printf(" %6d %6d %8s\n", paper.equilibria, paper.minmax, "-");
}

/// Equilibria over several rows.
struct Tally {
  int equilibria = 0;
  int wrong = 0;  ///< no local minmax
  void add(const Row& row) {
    equilibria += row.equilibria;
    wrong += row.equilibria - row.minmax;
  }
};

/// A list separated by commas.
std::vector<double> numbers(const std::string& text) {
  std::vector<double> values;
  std::istringstream list(text);
  for (std::string item; std::getline(list, item, ',');)
    values.push_back(CommandLine::number<double>(item));
  if (values.empty()) throw std::invalid_argument("a list of numbers is needed");
  return values;
}

int run(int argc, char** argv) {
  int starts = 1000;
  int seed = 1;
  // f1 and f3: with these pure Newton needs the paper's iterations and finds its number of points.
  std::array<double, 4> boxes = {1.0, 20.0, 2.0, 1.0};
  std::vector<double> first_shifts = {1e-4, 1e-6}, growths = {10.0, 2.0};
  bool no_gda = false;
  CommandLine command_line(
      "benchmark_functions: the paper's Table 1, benchmark functions from random starts");
  command_line.add("--starts", starts, "random starts for each function (1000)");
  command_line.add("--seed", seed, "of the random starts (1)");
  command_line.add("--first-shift", "X,X,...", "first epsilon tried by Algorithm 1 (1e-4,1e-6)",
                   [&](const std::string& text) { first_shifts = numbers(text); });
  command_line.add("--growth", "X,X,...", "factor by which epsilon is increased (10,2)",
                   [&](const std::string& text) { growths = numbers(text); });
  command_line.add_flag("--no-gda", no_gda, "leave out gradient descent ascent, the slowest");
  for (std::size_t i = 0; i < boxes.size(); ++i)
    command_line.add("--box" + std::to_string(i + 1), boxes[i],
                     "starts of f" + std::to_string(i + 1) + " lie in [-X, X]^2 (" +
                         std::to_string(static_cast<int>(boxes[i])) + ")");
  if (!command_line.parse(argc, argv)) return 0;
  if (starts < 1) throw std::invalid_argument("--starts must be at least 1");
  for (const double box : boxes)
    if (!(box > 0.0)) throw std::invalid_argument("a box must be larger than 0");
  for (const double growth : growths)
    if (!(growth > 1.0)) throw std::invalid_argument("--growth must be above 1");
  for (const double first : first_shifts)
    if (!(first > 0.0)) throw std::invalid_argument("--first-shift must be above 0");

  std::printf(
      "eq.: runs that end where the gradient is at most %g; minmax: of these, the points that the\n"
      "eigenvalues of the Hessian do not refute; iter: their mean iterations; inf.: runs that end\n"
      "beyond |z| = %g, in no other column; false: reported as local minmax, but is none. Right:\n"
      "the paper's numbers for 1000 starts, whose boxes and GDA steps are not printed there.\n",
      kTolerance, kInfinityRadius);
  int false_reports = 0;
  Tally newton, algorithm1;  // of all functions
  for (std::size_t f = 0; f < paper_functions::kFunctions.size(); ++f) {
    const Function& function = paper_functions::kFunctions[f];
    const std::vector<Point> points = random_starts(starts, boxes[f], static_cast<unsigned>(seed));
    std::printf("\n%s = %s\n  %d starts in [-%g, %g]^2\n", function.name.data(),
                function.formula.data(), starts, boxes[f], boxes[f]);
    std::printf("  %-20s %6s %6s %8s %6s %6s   | %6s %6s %8s\n", "", "eq.", "minmax", "iter",
                "inf.", "false", "eq.", "minmax", "iter");
    for (const Method& method : methods(first_shifts, growths, !no_gda)) {
      const Row row = benchmark(f, method, points);
      print_row(method.name.c_str(), row, kPaper[f][static_cast<std::size_t>(method.kind)]);
      false_reports += row.false_reports;
      if (method.kind == Kind::PureNewton) newton.add(row);
      if (method.kind == Kind::Algorithm1 && method.line7) algorithm1.add(row);
    }
  }
  std::printf("\nequilibria that are no local minmax: pure Newton %d of %d, Algorithm 1 %d of %d\n",
              newton.wrong, newton.equilibria, algorithm1.wrong, algorithm1.equilibria);
  std::printf("%d points were reported as a local minmax but are none.\n", false_reports);
  return false_reports == 0 && algorithm1.wrong == 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "benchmark_functions: %s\n", error.what());
    return 2;
  }
}
