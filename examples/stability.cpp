// What attracts a Newton iteration and what repels it: the paper's Examples 1 to 3, as printed.
//
// At a point with zero gradient the iteration z+ = z - (H + E)^-1 grad f(z) has the Jacobian
// I - (H + E)^-1 H. The program prints its eigenvalues and inertias there for several shifts E,
// runs the iteration from nearby, and draws the phase portraits into stability.svg. It fails when
// an eigenvalue and the trajectories contradict each other.
//
//   stability [--output FOLDER]

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <ipminmax/core/iteration_map.hpp>
#include <ipminmax/core/solver.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "paper_functions.hpp"
#include "report.hpp"
#include "svg_plot.hpp"

namespace {

using ipminmax::SolverOptions;
using paper_functions::FunctionProblem;

constexpr int kSteps = 12;  // of a trajectory

/// Algorithm 1 as printed, with prescribed shifts where they are not negative.
struct Variant {
  std::string name;
  double delta_x = -1.0, delta_y = -1.0;
  bool line7 = true;

  [[nodiscard]] SolverOptions options() const {
    SolverOptions options = ipminmax::as_printed();
    options.minmax_prescribed_delta_x = delta_x;
    options.minmax_prescribed_delta_y = delta_y;
    options.minmax_instability = line7;
    options.tol = 1e-13;
    return options;
  }
};

ipminmax::Result point_at(std::vector<double> v) {
  ipminmax::Result at;
  at.z_lower = at.z_upper = std::vector<double>(v.size(), 0.0);
  at.v = std::move(v);
  at.mu = 0.1;
  return at;
}

std::string text_of(const std::complex<double>& value) {
  char text[64];
  if (std::abs(value.imag()) < 1e-12)
    std::snprintf(text, sizeof text, "%.4g", value.real() + 0.0);
  else
    std::snprintf(text, sizeof text, "%.4g%+.4gi", value.real(), value.imag());
  return text;
}

/// One line of the table; returns the spectral radius.
double print_map(FunctionProblem& problem, const std::vector<double>& v, const Variant& variant) {
  const auto map = ipminmax::iteration_map(problem, point_at(v), variant.options());
  if (!map.error.empty()) throw std::runtime_error(map.error);
  std::string eigenvalues;
  for (const auto& value : map.eigenvalues)
    eigenvalues += (eigenvalues.empty() ? "" : ", ") + text_of(value);
  const auto right = [](const ipminmax::Inertia& found, const ipminmax::Inertia& expected) {
    return found == expected ? "right" : "wrong";
  };
  std::printf("  %-34s %9.4g %9.4g  %-5s %-5s  %-26s %s\n", variant.name.c_str(), map.delta_x,
              map.delta_y, right(map.inner, map.inner_expected), right(map.full, map.full_expected),
              eigenvalues.c_str(), map.spectral_radius < 1.0 ? "attracts" : "repels");
  return map.spectral_radius;
}

void print_heading(const char* title) {
  std::printf("\n%s\n  %-34s %9s %9s  %-5s %-5s  %-26s\n", title, "", "eps_x", "eps_y", "K_yy", "K",
              "eigenvalues of the map");
}

/// The iterates, the start first.
std::vector<std::vector<double>> trajectory(FunctionProblem& problem, std::array<double, 2> start,
                                            const SolverOptions& options, int steps = kSteps) {
  problem.start_at(start[0], start[1]);
  std::vector<std::vector<double>> points;
  SolverOptions limited = options;
  limited.max_iter = steps;
  static_cast<void>(ipminmax::solve(problem, limited, [&](const ipminmax::IterationInfo& info) {
    points.emplace_back(info.v.begin(), info.v.end());
    return true;
  }));
  return points;
}

// ---- Example 1 ----------------------------------------------------------------------------------

svg::Panel example1() {
  FunctionProblem problem({"Example 1", "x^3 - 3x", paper_functions::example1}, 1);
  const Variant newton{"Newton's method", 0.0, 0.0}, printed{"Algorithm 1"};
  print_heading("Example 1: min x^3 - 3x, a minimum at 1 and a maximum at -1");
  for (const double x : {1.0, -1.0}) {
    std::printf("  at x = %g\n", x);
    const double rho_newton = print_map(problem, {x}, newton);
    const double rho = print_map(problem, {x}, printed);
    if (rho_newton >= 1.0 || (rho < 1.0) != (x > 0.0))
      throw std::runtime_error("not as in the paper");
  }
  svg::Panel panel{.title = "Example 1: x^3 - 3x", .subtitle = "x_k over k", .same_scale = false};
  for (const Variant& variant : {newton, printed}) {
    std::printf("  %s:\n", variant.name.c_str());
    svg::Series series{.mark = svg::Mark::LineAndDots,
                       .color = variant.delta_x == 0.0 ? "#c03030" : "#3050c0",
                       .label = variant.name};
    for (const double start : {2.5, 0.3, -0.3, -0.9, -1.0, -1.1}) {
      const auto points = trajectory(problem, {start, 0.0}, variant.options());
      std::printf("    ");
      svg::Series one = series;
      for (std::size_t k = 0; k < points.size(); ++k) {
        if (k < 7) std::printf(" %9.4g", points[k][0]);
        one.points.push_back({static_cast<double>(k), std::clamp(points[k][0], -4.0, 4.0)});
      }
      std::printf("%s\n", points.size() > 7 ? " ..." : "");
      panel.series.push_back(one);
      series.label.clear();  // once in the legend
    }
  }
  return panel;
}

// ---- Examples 2 and 3 ---------------------------------------------------------------------------

/// Trajectories from a circle around 0. Checks that they come nearer exactly where the map says so.
svg::Panel portrait(FunctionProblem& problem, const std::string& title, const Variant& variant,
                    double rho) {
  constexpr int kStarts = 12;
  constexpr double kTwoPi = 6.283185307179586;
  svg::Panel panel{.title = title, .subtitle = variant.name, .half_width = 2.0};
  bool all_closer = true, any_farther = false;
  for (int k = 0; k < kStarts; ++k) {
    const double angle = kTwoPi * (k + 0.5) / kStarts;
    const auto points = trajectory(problem, {std::cos(angle), std::sin(angle)}, variant.options());
    svg::Series series{.mark = svg::Mark::LineAndDots, .color = rho < 1.0 ? "#3050c0" : "#c03030"};
    for (const auto& p : points) series.points.push_back({p[0], p[1]});
    const auto& last = points.back();
    const double distance = std::hypot(last[0], last[1]);
    all_closer = all_closer && distance < 1.0;
    any_farther = any_farther || distance > 1.0;
    panel.series.push_back(series);
  }
  panel.series.push_back(
      {.points = {{0.0, 0.0}}, .mark = svg::Mark::Circles, .color = "#000000", .size = 5.0});
  if (rho < 1.0 ? !all_closer : !any_farther)
    throw std::runtime_error(title + ": the trajectories contradict the eigenvalues");
  return panel;
}

void example2(std::vector<svg::Panel>& panels) {
  FunctionProblem problem({"Example 2", "1.5x^2 - 4xy + y^2", paper_functions::example2});
  print_heading("Example 2: 1.5x^2 - 4xy + y^2, at (0, 0): no local minmax");
  print_map(problem, {0.0, 0.0}, {"Newton's method", 0.0, 0.0});
  const Variant paper{"the paper's shifts", 0.0, 4.0};
  const Variant printed{"Algorithm 1"};
  const double attracting = print_map(problem, {0.0, 0.0}, paper);
  print_map(problem, {0.0, 0.0}, {"Algorithm 1 without line 7", -1.0, -1.0, false});
  const double repelling = print_map(problem, {0.0, 0.0}, printed);
  if (std::abs(attracting - 6.0 / 11.0) > 1e-9 || repelling <= 1.0)
    throw std::runtime_error("Example 2 is not as in the paper");
  panels.push_back(portrait(problem, "Example 2: no local minmax", paper, attracting));
  panels.push_back(portrait(problem, "Example 2: no local minmax", printed, repelling));
}

void example3(std::vector<svg::Panel>& panels) {
  FunctionProblem problem({"Example 3", "-0.25x^2 + xy - 0.5y^2", paper_functions::example3});
  print_heading("Example 3: -0.25x^2 + xy - 0.5y^2, at (0, 0): a local minmax");
  const Variant paper{"the paper's matrix", 0.3, 3.0};
  const Variant enough{"eps_x = lambda_max of (eps-cond)", 3.0, 3.0};
  const double repelling = print_map(problem, {0.0, 0.0}, paper);
  print_map(problem, {0.0, 0.0}, {"the paper's text", 0.2, 3.0});
  const double attracting = print_map(problem, {0.0, 0.0}, enough);
  const double zero = print_map(problem, {0.0, 0.0}, {"Algorithm 1"});
  if (std::abs(repelling - std::hypot(1.5, 1.5)) > 1e-9 || attracting >= 1.0 || zero != 0.0)
    throw std::runtime_error("Example 3 is not as in the paper");
  panels.push_back(portrait(problem, "Example 3: a local minmax", paper, repelling));
  panels.push_back(portrait(problem, "Example 3: a local minmax", enough, attracting));
}

int run(int argc, char** argv) {
  std::string output = ".";
  CommandLine command_line(
      "stability: what attracts Newton iterations, the paper's Examples 1 to 3");
  command_line.add("--output", output, "folder for stability.svg (.)");
  if (!command_line.parse(argc, argv)) return 0;
  std::filesystem::create_directories(output);
  std::printf(
      "K_yy, K: whether the inertias without shift are those of a local minmax. The eigenvalues "
      "are\n"
      "those of I - (H + E)^-1 H, E = diag(eps_x I, -eps_y I).\n");
  std::vector<svg::Panel> panels = {example1()};
  example2(panels);
  example3(panels);
  std::printf("\n");
  svg::write(panels, std::filesystem::path(output) / "stability.svg");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  return guarded("stability", [&] { return run(argc, argv); });
}
