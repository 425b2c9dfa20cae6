// Best approximation of a function by a polynomial, the oldest semi-infinite program:
//
//   min E   subject to   -E <= h(t) - (x_0 + x_1 t + ... + x_n t^n) <= E   for every t in [-1, 1]
//
// h(t) = 1 / (t + a), a > 1, whose least error is known: (a - sqrt(a^2 - 1))^n / (a^2 - 1). The
// worst t are the n + 2 points where the error alternates.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ipminmax/core/robust.hpp>
#include <stdexcept>

#include "command_line.hpp"
#include "report.hpp"

namespace {

using ipminmax::Index;
using ipminmax::Player;

/// Variables x_0, ..., x_n, E of Min and t of Max. Both constraints read t and are Min's: robust.
class BestApproximation final : public ipminmax::Problem {
 public:
  BestApproximation(int degree, double a) : terms_(degree + 1), a_(a) {
    const auto n = static_cast<std::size_t>(terms_) + 2;
    s_.variable_players.assign(n, Player::Min);
    s_.variable_players.back() = Player::Max;
    s_.variable_lower.assign(n, -2e19);
    s_.variable_upper.assign(n, 2e19);
    s_.variable_lower.back() = -1.0;
    s_.variable_upper.back() = 1.0;
    s_.constraint_players = {Player::Min, Player::Min};
    s_.constraint_lower = {-2e19, -2e19};
    s_.constraint_upper = {0.0, 0.0};
    for (Index row = 0; row < 2; ++row)
      for (Index i = 0; i < terms_ + 2; ++i) s_.jacobian.push_back({row, i});
    for (Index k = 1; k < terms_ + 2; ++k)
      if (k != terms_) s_.hessian.push_back({terms_ + 1, k});  // t with x_1, ..., x_n and t
  }

  const ipminmax::ProblemStructure& structure() const override { return s_; }
  bool starting_point(ipminmax::StartingPoint& start) override {
    std::fill(start.v.begin(), start.v.end(), 0.0);
    start.v[at(terms_)] = 1.0 / (a_ - 1.0);
    return true;
  }
  bool objective(std::span<const double> v, bool, double& f) override {
    f = v[at(terms_)];
    return true;
  }
  bool gradient(std::span<const double>, bool, std::span<double> grad) override {
    std::fill(grad.begin(), grad.end(), 0.0);
    grad[at(terms_)] = 1.0;
    return true;
  }
  bool constraints(std::span<const double> v, bool, std::span<double> g) override {
    double error = 1.0 / (v.back() + a_);
    for (Index k = 0; k < terms_; ++k) error -= v[at(k)] * std::pow(v.back(), k);
    g[0] = error - v[at(terms_)];
    g[1] = -error - v[at(terms_)];
    return true;
  }
  bool jacobian(std::span<const double> v, bool, std::span<double> values) override {
    std::size_t entry = 0;
    for (const double sign : {1.0, -1.0}) {
      for (Index k = 0; k < terms_; ++k) values[entry++] = -sign * std::pow(v.back(), k);
      values[entry++] = -1.0;
      values[entry++] = sign * slope(v);
    }
    return true;
  }
  bool hessian(std::span<const double> v, bool, double, std::span<const double> lambda, bool,
               std::span<double> values) override {
    const double t = v.back(), weight = lambda[0] - lambda[1];
    std::size_t entry = 0;
    for (Index k = 1; k < terms_; ++k) values[entry++] = -weight * k * std::pow(t, k - 1);
    double curvature = 2.0 / std::pow(t + a_, 3.0);
    for (Index k = 2; k < terms_; ++k) curvature -= v[at(k)] * k * (k - 1) * std::pow(t, k - 2);
    values[entry] = weight * curvature;
    return true;
  }

 private:
  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }
  /// Of the error in t.
  [[nodiscard]] double slope(std::span<const double> v) const {
    double sum = -1.0 / ((v.back() + a_) * (v.back() + a_));
    for (Index k = 1; k < terms_; ++k) sum -= v[at(k)] * k * std::pow(v.back(), k - 1);
    return sum;
  }

  Index terms_;
  double a_;
  ipminmax::ProblemStructure s_;
};

int run(int argc, char** argv) {
  int degree = 3;
  double a = 1.25;
  ipminmax::SolverOptions options;
  options.minmax_worst_case_starts = 20;
  CommandLine command_line("chebyshev: best polynomial for 1 / (t + a) on [-1, 1]");
  command_line.add("--degree", degree, "of the polynomial (3)");
  command_line.add("--a", a, "above 1 (1.25)");
  if (!command_line.parse(argc, argv)) return 0;
  if (degree < 1 || !(a > 1.0)) throw std::invalid_argument("--degree from 1 on, --a above 1");

  BestApproximation problem(degree, a);
  const ipminmax::RobustResult answer = ipminmax::solve_robust(problem, options);
  const int exit_status = report(answer.result);
  const double root = std::sqrt(a * a - 1.0);
  const double exact = std::pow(a - root, degree) / (a * a - 1.0);
  std::printf("error        %.10f, known %.10f, %d solves, %d maximizations over t\n",
              answer.result.objective, exact, answer.solves, answer.maximizations);
  std::printf("\n%12s %8s %14s\n", "worst t", "sign", "multiplier");
  auto worst = answer.worst_cases;
  std::sort(worst.begin(), worst.end(),
            [](const auto& p, const auto& q) { return p.v.back() < q.v.back(); });
  for (const ipminmax::RobustWorstCase& found : worst)
    std::printf("%12.6f %8s %14.6f\n", found.v.back(), found.constraint == 0 ? "+" : "-",
                found.multiplier);
  const bool agrees = std::abs(answer.result.objective - exact) <= 1e-6;
  return agrees ? exit_status : 1;
}

}  // namespace

int main(int argc, char** argv) {
  return guarded("chebyshev", [&] { return run(argc, argv); });
}
