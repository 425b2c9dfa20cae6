#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <ipminmax/core/problem.hpp>
#include <span>
#include <string_view>

/// The four functions f(x, y) of two scalars in the paper's benchmark of unconstrained minmax
/// (Table 1), with exact derivatives.
namespace paper_functions {

/// Value, gradient and Hessian at a point.
struct Derivatives {
  double f = 0.0;
  double fx = 0.0, fy = 0.0;
  double fxx = 0.0, fxy = 0.0, fyy = 0.0;
};

struct Function {
  std::string_view name;
  std::string_view formula;
  Derivatives (*evaluate)(double x, double y);
};

inline Derivatives f1(double x, double y) {
  return {2.0 * x * x - y * y + 4.0 * x * y + 4.0 / 3.0 * y * y * y - 0.25 * y * y * y * y,
          4.0 * x + 4.0 * y,
          -2.0 * y + 4.0 * x + 4.0 * y * y - y * y * y,
          4.0,
          4.0,
          -2.0 + 8.0 * y - 3.0 * y * y};
}

/// f2 = p e with p = 4x^2 - r^2 - 0.1 y^4, r = y - 3x + 0.05 x^3, e = exp(-0.01 (x^2 + y^2)).
inline Derivatives f2(double x, double y) {
  const double r = y - 3.0 * x + 0.05 * x * x * x;
  const double rx = -3.0 + 0.15 * x * x, rxx = 0.3 * x;
  const double p = 4.0 * x * x - r * r - 0.1 * y * y * y * y;
  const double px = 8.0 * x - 2.0 * r * rx, py = -2.0 * r - 0.4 * y * y * y;
  const double pxx = 8.0 - 2.0 * rx * rx - 2.0 * r * rxx;
  const double pxy = -2.0 * rx, pyy = -2.0 - 1.2 * y * y;
  const double e = std::exp(-0.01 * (x * x + y * y));
  const double a = -0.02 * x, b = -0.02 * y;  // e_x = a e, e_y = b e
  return {p * e,
          (px + a * p) * e,
          (py + b * p) * e,
          (pxx + 2.0 * a * px + (a * a - 0.02) * p) * e,
          (pxy + a * py + b * px + a * b * p) * e,
          (pyy + 2.0 * b * py + (b * b - 0.02) * p) * e};
}

inline Derivatives f3(double x, double y) {
  const double dx = x - 0.25, dy = y - 0.75;
  const double e = std::exp(-dx * dx - dy * dy);
  return {(x - 0.5) * (y - 0.5) + e, (y - 0.5) - 2.0 * dx * e, (x - 0.5) - 2.0 * dy * e,
          (4.0 * dx * dx - 2.0) * e, 1.0 + 4.0 * dx * dy * e,  (4.0 * dy * dy - 2.0) * e};
}

inline Derivatives f4(double x, double y) { return {x * y, y, x, 0.0, 1.0, 0.0}; }

inline constexpr std::array<Function, 4> kFunctions = {{
    {"f1", "2x^2 - y^2 + 4xy + 4/3 y^3 - 1/4 y^4", f1},
    {"f2", "(4x^2 - (y - 3x + 0.05x^3)^2 - 0.1y^4) exp(-0.01(x^2 + y^2))", f2},
    {"f3", "(x - 0.5)(y - 0.5) + exp(-(x - 0.25)^2 - (y - 0.75)^2)", f3},
    {"f4", "xy", f4},
}};

/// The paper's Example 1, in x alone.
inline Derivatives example1(double x, double) {
  return {x * x * x - 3.0 * x, 3.0 * x * x - 3.0, 0.0, 6.0 * x, 0.0, 0.0};
}
/// Example 2: (0, 0) is no local minmax.
inline Derivatives example2(double x, double y) {
  return {1.5 * x * x - 4.0 * x * y + y * y, 3.0 * x - 4.0 * y, -4.0 * x + 2.0 * y, 3.0, -4.0, 2.0};
}
/// Example 3: (0, 0) is a local minmax.
inline Derivatives example3(double x, double y) {
  return {-0.25 * x * x + x * y - 0.5 * y * y, -0.5 * x + y, x - y, -0.5, 1.0, -1.0};
}

/// min over x, max over y of one of the functions, for ipminmax::solve; in x alone with y = 0 where
/// there is but one variable.
class FunctionProblem : public ipminmax::Problem {
 public:
  explicit FunctionProblem(const Function& function, int variables = 2) : function_(function) {
    structure_.variable_players = {ipminmax::Player::Min, ipminmax::Player::Max};
    structure_.variable_players.resize(static_cast<std::size_t>(variables));
    structure_.variable_lower.assign(static_cast<std::size_t>(variables), -2e19);
    structure_.variable_upper.assign(static_cast<std::size_t>(variables), 2e19);
    structure_.hessian = {{0, 0}};
    if (variables == 2) structure_.hessian = {{0, 0}, {1, 0}, {1, 1}};
  }

  void start_at(double x, double y) { start_ = {x, y}; }

  [[nodiscard]] const ipminmax::ProblemStructure& structure() const override { return structure_; }

  [[nodiscard]] bool starting_point(ipminmax::StartingPoint& start) override {
    std::copy_n(start_.begin(), start.v.size(), start.v.begin());
    return true;
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    f = at(v).f;
    return true;
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    const Derivatives d = at(v);
    grad[0] = d.fx;
    if (v.size() > 1) grad[1] = d.fy;
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
    const Derivatives d = at(v);
    values[0] = sigma * d.fxx;
    if (v.size() == 1) return true;
    values[1] = sigma * d.fxy;
    values[2] = sigma * d.fyy;
    return true;
  }

 private:
  [[nodiscard]] Derivatives at(std::span<const double> v) const {
    return function_.evaluate(v[0], v.size() > 1 ? v[1] : 0.0);
  }

  Function function_;
  ipminmax::ProblemStructure structure_;
  std::array<double, 2> start_{};
};

}  // namespace paper_functions
