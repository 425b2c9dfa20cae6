// The paper's Table 1: four functions of two scalars, random starts, three methods.
//
// Pure Newton goes to any point with a small gradient; gradient descent ascent (GDA) mostly to
// local minmax points, slowly; Algorithm 1 only to local minmax points, fast. Algorithm 1 runs
// twice: with shifts that start anew in every iteration, as printed in the paper, and with shifts
// that start at those of the last iteration, as in Ipopt.
//
// Every point is checked here with the eigenvalues of the analytic Hessian, independently of the
// solver. The program fails when the solver reports a local minmax that is none.

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

enum class Method : std::uint8_t { PureNewton, Gda, ColdShifts, WarmShifts };
constexpr std::array<Method, 4> kMethods = {Method::PureNewton, Method::Gda, Method::ColdShifts,
                                            Method::WarmShifts};
constexpr std::array<const char*, 4> kMethodNames = {"pure Newton", "GDA", "Alg. 1, cold shifts",
                                                     "Alg. 1, warm shifts"};

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

ipminmax::SolverOptions options_of(Method method) {
  ipminmax::SolverOptions options;
  options.tol = kTolerance;
  options.max_iter = kMaxIterations;
  options.acceptable_iter = 0;
  options.nlp_scaling_method = ipminmax::Scaling::None;
  options.minmax_globalization = ipminmax::Globalization::None;
  options.minmax_pure_newton = method == Method::PureNewton;
  if (method == Method::ColdShifts) {
    options.minmax_warm_start_shifts = false;
    options.perturb_inc_fact_first = 10.0;
    options.perturb_inc_fact = 10.0;
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
  outcome.certified = kind == ipminmax::PointKind::LocalMinmax;
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

Row benchmark(std::size_t function_index, Method method, const std::vector<Point>& starts) {
  const Function& function = paper_functions::kFunctions[function_index];
  paper_functions::FunctionProblem problem(function);
  const ipminmax::SolverOptions options = options_of(method);
  Row row;
  for (const Point& start : starts)
    count(function,
          method == Method::Gda ? descend_ascend(function, start, kGdaSteps[function_index])
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

int run(int argc, char** argv) {
  int starts = 1000;
  int seed = 1;
  std::array<double, 4> boxes = {1.0, 20.0, 20.0, 1.0};
  CommandLine command_line(
      "benchmark_functions: the paper's Table 1, benchmark functions from random starts");
  command_line.add("--starts", starts, "random starts for each function (1000)");
  command_line.add("--seed", seed, "of the random starts (1)");
  for (std::size_t i = 0; i < boxes.size(); ++i)
    command_line.add("--box" + std::to_string(i + 1), boxes[i],
                     "starts of f" + std::to_string(i + 1) + " lie in [-X, X]^2 (" +
                         std::to_string(static_cast<int>(boxes[i])) + ")");
  if (!command_line.parse(argc, argv)) return 0;
  if (starts < 1) throw std::invalid_argument("--starts must be at least 1");
  for (const double box : boxes)
    if (!(box > 0.0)) throw std::invalid_argument("a box must be larger than 0");

  std::printf(
      "eq.: runs that end where the gradient is at most %g; minmax: of these, the points that the\n"
      "eigenvalues of the Hessian do not refute; iter: their mean iterations; inf.: runs that end\n"
      "beyond |z| = %g, in no other column; false: reported as local minmax, but is none. Right:\n"
      "the paper's numbers for 1000 starts, whose boxes and GDA steps are not printed there.\n",
      kTolerance, kInfinityRadius);
  int false_reports = 0;
  for (std::size_t f = 0; f < paper_functions::kFunctions.size(); ++f) {
    const Function& function = paper_functions::kFunctions[f];
    const std::vector<Point> points = random_starts(starts, boxes[f], static_cast<unsigned>(seed));
    std::printf("\n%s = %s\n  %d starts in [-%g, %g]^2\n", function.name.data(),
                function.formula.data(), starts, boxes[f], boxes[f]);
    std::printf("  %-20s %6s %6s %8s %6s %6s   | %6s %6s %8s\n", "", "eq.", "minmax", "iter",
                "inf.", "false", "eq.", "minmax", "iter");
    for (std::size_t k = 0; k < kMethods.size(); ++k) {
      const Row row = benchmark(f, kMethods[k], points);
      print_row(kMethodNames[k], row, kPaper[f][std::min<std::size_t>(k, 2)]);
      false_reports += row.false_reports;
    }
  }
  std::printf("\n%d points were reported as a local minmax but are none.\n", false_reports);
  return false_reports == 0 ? 0 : 1;
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
