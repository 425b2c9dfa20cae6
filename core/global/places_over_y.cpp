#include "core/global/places_over_y.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <utility>

#include "core/model/indices.hpp"
#include "core/model/sampling.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// By which a start that leaves Y is drawn back, again and again.
constexpr double kDrawnBack = 0.8;
constexpr int kMostDrawnBack = 10;
/// Of a box: the distance from which a variable is not at a bound of it.
constexpr double kOffBound = 1e-3;

/// From the center that share of the way, or less where Max's constraints do not hold there.
std::vector<double> drawn_back(Problem& inner, const SolverOptions& options,
                               std::span<const double> center, const std::vector<double>& from,
                               double share) {
  std::vector<double> v(from.size());
  for (int k = 0; k <= kMostDrawnBack; ++k, share *= kDrawnBack) {
    for (const auto i : indices(v)) v[i] = center[i] + share * (from[i] - center[i]);
    if (is_feasible(inner, options, v)) break;
  }
  return v;
}

/// f + sum lambda_j g_j at v; -infinity where it is undefined.
double lagrangian(Problem& inner, const std::vector<double>& v, const std::vector<double>& lambda,
                  Counts& counts) {
  double sum = 0.0;
  ++counts.objective;
  if (!inner.objective(v, true, sum)) return -kInfinity;
  if (std::ranges::all_of(lambda, [](double factor) { return factor == 0.0; })) return sum;
  ++counts.constraints;
  std::vector<double> g(lambda.size());
  if (!inner.constraints(v, false, g)) return -kInfinity;
  for (const auto j : indices(g)) {
    if (lambda[j] != 0.0) sum += lambda[j] * g[j];
  }
  return sum;
}

/// Moves single boxed variables of v, one after the other, to bounds at which they are not. A move
/// stays if keep(variable, bound, f + lambda'g there) says so.
template <class Keep>
void try_bounds(Problem& inner, const SolverOptions& options, std::vector<double>& v,
                const std::vector<double>& lambda, Counts& counts, const Keep& keep) {
  for (const std::size_t i : SetOfY(inner.structure(), options).boxed) {
    const double lower = inner.structure().variable_lower[i], own = v[i];
    const double upper = inner.structure().variable_upper[i];
    for (const double bound : {lower, upper}) {
      if (!(std::abs(bound - own) >= kOffBound * (upper - lower))) continue;
      const double before = std::exchange(v[i], bound);
      if (!keep(i, bound, lagrangian(inner, v, lambda, counts))) v[i] = before;
    }
  }
}

/// Single variables moved to bounds as long as f grows; empty: it does not.
std::vector<double> moved_to_bounds(Problem& inner, const SolverOptions& options,
                                    std::vector<double> v, Counts& counts) {
  double highest = lagrangian(inner, v, {}, counts);
  bool moved = false;
  for (bool gained = true; gained;) {
    gained = false;
    try_bounds(inner, options, v, {}, counts, [&](std::size_t, double, double value) {
      if (!(value > highest)) return false;
      highest = value;
      return gained = moved = true;
    });
  }
  return moved ? v : std::vector<double>{};
}

}  // namespace

SetOfY::SetOfY(const ProblemStructure& s, const SolverOptions& options)
    : has_rows(!s.constraint_lower.empty()) {
  for (const auto i : indices(s.variable_lower)) {
    const double lower = s.variable_lower[i], upper = s.variable_upper[i];
    if (!(lower < upper)) continue;
    free.push_back(i);
    if (lower > options.nlp_lower_bound_inf && upper < options.nlp_upper_bound_inf)
      boxed.push_back(i);
  }
  for (const auto j : indices(s.constraint_lower)) {
    const double lower = s.constraint_lower[j], upper = s.constraint_upper[j];
    if (lower == upper) ++equations;
    const bool bounded = lower > options.nlp_lower_bound_inf || upper < options.nlp_upper_bound_inf;
    if (bounded && lower < upper) has_inequalities = true;
  }
}

bool is_feasible(Problem& inner, const SolverOptions& options, std::span<const double> v) {
  const ProblemStructure& s = inner.structure();
  std::vector<double> g(s.constraint_lower.size());
  if (!inner.constraints(v, true, g)) return false;
  for (const auto j : indices(g)) {
    if (!(g[j] >= s.constraint_lower[j] - options.constr_viol_tol) ||
        !(g[j] <= s.constraint_upper[j] + options.constr_viol_tol)) {
      return false;
    }
  }
  return true;
}

SolverOptions staying_near(const SolverOptions& options) {
  constexpr double kMuNear = 1e-4;
  SolverOptions near = options;
  near.mu_init = std::min(options.mu_init, kMuNear);
  for (double* push :
       {&near.bound_push, &near.bound_frac, &near.slack_bound_push, &near.slack_bound_frac}) {
    *push = std::min(*push, kMuNear);
  }
  near.bound_mult_init_method = BoundMultiplierInit::MuBased;
  return near;
}

std::vector<double> start_above(Problem& inner, const SolverOptions& options,
                                std::span<const double> center, std::vector<double> random,
                                Index start, Counts& counts) {
  const ProblemStructure& s = inner.structure();
  std::mt19937_64 generator(at(start));
  const double share = uniform(generator);
  std::vector<double> middle(center.begin(), center.end());
  for (const std::size_t i : SetOfY(s, options).boxed) {
    middle[i] = 0.5 * (s.variable_lower[i] + s.variable_upper[i]);
    random[i] = random[i] > middle[i] ? s.variable_upper[i] : s.variable_lower[i];
  }
  if (is_feasible(inner, options, middle)) center = middle;
  std::vector<double> v = drawn_back(inner, options, center, random, share);
  const std::vector<double> above = moved_to_bounds(inner, options, v, counts);
  return above.empty() ? v : drawn_back(inner, options, center, above, 1.0);
}

Points next_to(Problem& inner, const SolverOptions& options, std::vector<double> v,
               const std::vector<double>& lambda, std::size_t most, Counts& counts) {
  struct Move {
    std::size_t variable;
    double bound, value;
  };
  std::vector<Move> moves;
  try_bounds(inner, options, v, lambda, counts, [&](std::size_t i, double bound, double value) {
    if (std::isfinite(value)) moves.push_back({i, bound, value});
    return false;
  });
  std::ranges::stable_sort(moves, std::greater{}, &Move::value);
  Points places;
  for (std::size_t k = 0; k < std::min(most, moves.size()); ++k) {
    places.push_back(v);
    places.back()[moves[k].variable] = moves[k].bound;
  }
  return places;
}

}  // namespace ipminmax
