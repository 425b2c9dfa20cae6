// Our solver as a contestant, pure Newton (e), and the judge of all answers.

#include <cmath>

#include <support/forwarding_problem.hpp>

#include "../measure.hpp"
#include "core/solver.hpp"
#include "game.hpp"

namespace bench {
namespace {

using ipminmax::SolverOptions;
using ipminmax::testing::StartedProblem;

Answer solve_by_us(Game& game, std::span<const double> start, const SolverOptions& options) {
  const Clock clock;
  StartedProblem problem(*game.problem, std::vector<double>(start.begin(), start.end()));
  const ipminmax::Result result = solve(problem, options);
  Answer answer;
  answer.v = result.v;
  // Pure Newton by itself stops at any first-order point.
  answer.claims = is_success(result.status) ||
                  (options.minmax_pure_newton && result.status == ipminmax::Status::NotLocalMinmax);
  answer.certified = result.certificate.kind == ipminmax::PointKind::LocalMinmax;
  answer.seconds = clock.seconds();
  answer.counts = result.counts;
  return answer;
}

}  // namespace

Answer solve_filter(Game& game, std::span<const double> start, const Limits& limits) {
  SolverOptions options;
  options.max_cpu_time = limits.seconds;
  return solve_by_us(game, start, options);
}

Answer solve_algorithm_one(Game& game, std::span<const double> start, const Limits& limits) {
  SolverOptions options;
  options.max_cpu_time = limits.seconds;
  options.max_iter = 500;
  options.minmax_globalization = ipminmax::Globalization::None;
  return solve_by_us(game, start, options);
}

Answer solve_pure_newton(Game& game, std::span<const double> start, const Limits& limits) {
  SolverOptions options;
  options.max_cpu_time = limits.seconds;
  options.max_iter = 500;
  options.minmax_globalization = ipminmax::Globalization::None;
  options.minmax_pure_newton = true;
  return solve_by_us(game, start, options);
}

bool is_local_minmax(Problem& problem, const std::vector<double>& v) {
  constexpr double kNear = 1e-3;
  double size = 1.0;
  for (const double value : v) {
    if (!std::isfinite(value)) return false;
    size = std::max(size, std::abs(value));
  }
  if (v.empty()) return false;
  for (const double mu : {1e-9, 1e-7, 1e-5, 1e-3}) {
    SolverOptions options;
    options.max_iter = 50;
    options.mu_init = mu;
    options.bound_mult_init_method = ipminmax::BoundMultiplierInit::MuBased;
    options.constr_mult_init_max = 1e6;
    options.bound_push = options.bound_frac = std::sqrt(mu) * 1e-3;
    options.slack_bound_push = options.slack_bound_frac = std::sqrt(mu) * 1e-3;
    StartedProblem started(problem, v);
    const ipminmax::Result result = solve(started, options);
    if (result.certificate.kind != ipminmax::PointKind::LocalMinmax) continue;
    double distance = 0.0;
    for (std::size_t i = 0; i < v.size(); ++i) {
      distance = std::max(distance, std::abs(result.v[i] - v[i]));
    }
    if (distance <= kNear * size) return true;
  }
  return false;
}

}  // namespace bench
