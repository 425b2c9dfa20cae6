// Many starts: which local minmax points a game has, what they are worth, and how often a random
// start ends at each.
//
//   min_x max_y  sum_i (x_i^2 - 1)^2 + a_i x_i + x_i y_i - y_i^2,   |x_i| <= 3, |y_i| <= 3,   i = 1 to 4
//
// The maximum over y is sum_i p_i(x_i), p_i(x) = (x^2 - 1)^2 + a_i x + x^2 / 4, each with a better
// and a worse valley: 16 local minmax points. The program finds them by multistart, prints them,
// writes many_starts.csv and draws value against basin size (share of the starts that ended there)
// into many_starts.svg. It fails when a value found is not a sum of minima of the p_i, which it
// finds by bisection, or when one of the 16 is missing.
//
//   many_starts [--starts N] [--threads N] [--seed N] [--output FOLDER]

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <ipminmax/core/multistart.hpp>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "report.hpp"
#include "svg_plot.hpp"

namespace {

constexpr std::size_t kPairs = 4;
constexpr std::array<double, kPairs> kSlope = {0.1, 0.25, 0.45, 0.7};  // a_i

/// Variables x_1 .. x_4, then y_1 .. y_4.
class Valleys final : public ipminmax::Problem {
 public:
  Valleys() {
    using ipminmax::Index;
    structure_.variable_players.assign(2 * kPairs, ipminmax::Player::Min);
    std::fill(structure_.variable_players.begin() + kPairs, structure_.variable_players.end(),
              ipminmax::Player::Max);
    structure_.variable_lower.assign(2 * kPairs, -3.0);
    structure_.variable_upper.assign(2 * kPairs, 3.0);
    const auto pairs = static_cast<Index>(kPairs);
    for (Index i = 0; i < pairs; ++i) structure_.hessian.push_back({i, i});
    for (Index i = 0; i < pairs; ++i) structure_.hessian.push_back({pairs + i, i});
    for (Index i = 0; i < pairs; ++i) structure_.hessian.push_back({pairs + i, pairs + i});
  }
  [[nodiscard]] const ipminmax::ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(ipminmax::StartingPoint& start) override {
    std::ranges::fill(start.v, 0.5);
    return true;
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    f = 0.0;
    for (std::size_t i = 0; i < kPairs; ++i) {
      const double x = v[i], y = v[kPairs + i];
      f += (x * x - 1.0) * (x * x - 1.0) + kSlope[i] * x + x * y - y * y;
    }
    return true;
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    for (std::size_t i = 0; i < kPairs; ++i) {
      const double x = v[i], y = v[kPairs + i];
      grad[i] = 4.0 * x * (x * x - 1.0) + kSlope[i] + y;
      grad[kPairs + i] = x - 2.0 * y;
    }
    return true;
  }
  [[nodiscard]] bool constraints(std::span<const double>, bool, std::span<double>) override {
    return true;
  }
  [[nodiscard]] bool jacobian(std::span<const double>, bool, std::span<double>) override {
    return true;
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma, std::span<const double>,
                             bool, std::span<double> values) override {
    for (std::size_t i = 0; i < kPairs; ++i) {
      values[i] = sigma * (12.0 * v[i] * v[i] - 4.0);
      values[kPairs + i] = sigma;
      values[2 * kPairs + i] = -2.0 * sigma;
    }
    return true;
  }

 private:
  ipminmax::ProblemStructure structure_;
};

/// The minimum of p_i in the valley on that side of 0, by bisection of p_i'.
double valley(std::size_t i, double side) {
  const auto slope = [i](double x) { return 4.0 * x * (x * x - 1.0) + 0.5 * x + kSlope[i]; };
  double low = side > 0.0 ? 0.5 : -3.0, high = side > 0.0 ? 3.0 : -0.5;
  for (int k = 0; k < 200; ++k) {
    const double middle = 0.5 * (low + high);
    (slope(middle) > 0.0 ? high : low) = middle;
  }
  return (low * low - 1.0) * (low * low - 1.0) + kSlope[i] * low + 0.25 * low * low;
}

/// Of all local minmax points, ascending.
std::vector<double> known_values() {
  std::vector<double> values;
  for (std::size_t choice = 0; choice < (std::size_t{1} << kPairs); ++choice) {
    double sum = 0.0;
    for (std::size_t i = 0; i < kPairs; ++i) sum += valley(i, (choice >> i) & 1U ? 1.0 : -1.0);
    values.push_back(sum);
  }
  std::ranges::sort(values);
  return values;
}

void print_table(const ipminmax::MultistartResult& found) {
  std::puts("    value   starts   share  x");
  for (const auto& point : found.points) {
    std::printf("%9.5f %8d %6.1f%% ", point.result.objective, point.found,
                100.0 * point.found / found.starts);
    for (std::size_t i = 0; i < kPairs; ++i) std::printf(" %7.4f", point.result.v[i]);
    std::puts("");
  }
}

void draw(const ipminmax::MultistartResult& found, const std::filesystem::path& folder) {
  svg::Series points{.mark = svg::Mark::Dots, .label = "a local minmax point", .size = 4.0};
  for (const auto& point : found.points) {
    points.points.push_back({100.0 * point.found / found.starts, point.result.objective});
  }
  svg::Series best{.points = {points.points.front()},
                   .mark = svg::Mark::Circles,
                   .color = "#c03030",
                   .label = "the best value",
                   .size = 8.0};
  svg::write({{.title = "Value against basin size",
               .subtitle = "value over the share of " + std::to_string(found.starts) +
                           " starts that end there, in %",
               .series = {points, best},
               .same_scale = false}},
             folder / "many_starts.svg");
}

int run(int argc, char** argv) {
  ipminmax::SolverOptions options;
  options.minmax_starts = 2000;
  int threads = 1;
  std::string output = ".";
  CommandLine line("many_starts [--starts N] [--threads N] [--seed N] [--output FOLDER]");
  line.add("--starts", options.minmax_starts, "number of starting points");
  line.add("--threads", threads, "threads that share them; the answer is the same");
  line.add("--seed", options.minmax_start_seed, "of the random starting points");
  line.add("--output", output, "folder of the table and the picture");
  if (!line.parse(argc, argv)) return 0;

  const ipminmax::MultistartResult found =
      ipminmax::multistart([] { return std::make_unique<Valleys>(); }, threads, options);
  print_table(found);
  std::filesystem::create_directories(output);
  const std::filesystem::path folder(output);
  std::ofstream csv(folder / "many_starts.csv");
  csv << ipminmax::points_as_csv(found);
  if (!csv.flush()) throw std::runtime_error("cannot write many_starts.csv");
  draw(found, folder);

  const std::vector<double> known = known_values();
  bool all = found.points.size() == known.size();
  for (std::size_t k = 0; all && k < known.size(); ++k) {
    all = std::abs(found.points[k].result.objective - known[k]) < 1e-6;
  }
  std::printf("%zu of %zu local minmax points found, %s\n", found.points.size(), known.size(),
              all ? "all values as computed by bisection" : "NOT the values computed by bisection");
  return all ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  return guarded("many_starts", [&] { return run(argc, argv); });
}
