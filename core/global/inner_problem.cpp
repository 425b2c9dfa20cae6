#include "core/global/inner_problem.hpp"

#include <cmath>
#include <functional>
#include <random>

#include "core/model/indices.hpp"
#include "core/model/sampling.hpp"
#include "core/robust/robust_scope.hpp"
#include "core/search/starts.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// By which a start that leaves Y is drawn back, again and again.
constexpr double kDrawnBack = 0.8;
constexpr int kMostDrawnBack = 10;
/// Of a box: the distance from which a variable is not at a bound of it.
constexpr double kOffBound = 1e-3;

/// From the center that share of the way, or less where Max's constraints do not hold there.
std::vector<double> drawn_back(const InnerProblem& inner, std::span<const double> center,
                               const std::vector<double>& from, double share) {
  std::vector<double> v(from.size());
  for (int k = 0; k <= kMostDrawnBack; ++k, share *= kDrawnBack) {
    for (const auto i : indices(v)) v[i] = center[i] + share * (from[i] - center[i]);
    if (is_feasible(inner.model, inner.options, v)) break;
  }
  return v;
}

/// f + sum lambda_j g_j at v; -infinity where it is undefined.
double lagrangian(const InnerProblem& inner, const std::vector<double>& v,
                  const std::vector<double>& lambda) {
  double sum = 0.0;
  ++inner.counts.objective;
  if (!inner.model.objective(v, true, sum)) return -kInfinity;
  if (std::ranges::all_of(lambda, [](double factor) { return factor == 0.0; })) return sum;
  ++inner.counts.constraints;
  std::vector<double> g(lambda.size());
  if (!inner.model.constraints(v, false, g)) return -kInfinity;
  for (const auto j : indices(g)) {
    if (lambda[j] != 0.0) sum += lambda[j] * g[j];
  }
  return sum;
}

/// Moves single boxed variables of v, one after the other, to bounds at which they are not. A move
/// stays if keep(variable, bound, f + lambda'g there) says so.
template <class Keep>
void try_bounds(const InnerProblem& inner, std::vector<double>& v,
                const std::vector<double>& lambda, const Keep& keep) {
  for (const std::size_t i : inner.boxed) {
    const double lower = inner.s.variable_lower[i], own = v[i], upper = inner.s.variable_upper[i];
    for (const double bound : {lower, upper}) {
      if (!(std::abs(bound - own) >= kOffBound * (upper - lower))) continue;
      const double before = std::exchange(v[i], bound);
      if (!keep(i, bound, lagrangian(inner, v, lambda))) v[i] = before;
    }
  }
}

/// Single variables moved to bounds as long as f grows; empty: it does not.
std::vector<double> moved_to_bounds(const InnerProblem& inner, std::vector<double> v) {
  double highest = lagrangian(inner, v, {});
  bool moved = false;
  for (bool gained = true; gained;) {
    gained = false;
    try_bounds(inner, v, {}, [&](std::size_t, double, double value) {
      if (!(value > highest)) return false;
      highest = value;
      return gained = moved = true;
    });
  }
  return moved ? v : std::vector<double>{};
}

}  // namespace

Held alone(Problem& model, Player player, std::span<const double> v) {
  const Player other = player == Player::Max ? Player::Min : Player::Max;
  Held held(model, variables_of(model.structure(), other), {v.begin(), v.end()});
  for (const auto j : indices(held.changed.constraint_players)) {
    if (held.changed.constraint_players[j] == other)
      drop_constraint(held.changed, static_cast<Index>(j));
  }
  return held;
}

bool is_feasible(Problem& inner, const SolverOptions& options, std::span<const double> v) {
  const ProblemStructure& s = inner.structure();
  std::vector<double> g(s.constraint_lower.size());
  if (!inner.constraints(v, true, g)) return false;
  for (const auto j : indices(g)) {
    if (!(excess_of_row(s, j, g[j]) <= options.constr_viol_tol)) return false;
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

InnerProblem::InnerProblem(Problem& problem, const SolverOptions& its_options, Counts& evaluations)
    : model(problem),
      s(problem.structure()),
      options(its_options),
      counts(evaluations),
      start(starting_values(problem)),
      sampled(with_bounds_of_rows(problem, start, counts)) {
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

std::optional<double> InnerProblem::value_at(const std::vector<double>& v) const {
  double value = 0.0;
  ++counts.objective;
  ++counts.constraints;
  if (is_feasible(model, options, v) && model.objective(v, false, value)) return value;
  return {};
}

std::vector<double> best_vertex(const InnerProblem& inner) {
  constexpr std::size_t kMostBoxed = 8;
  std::vector<double> best;
  if (inner.start.empty() || inner.boxed.empty() || inner.boxed.size() > kMostBoxed ||
      !inner.is_box() || inner.equations > 0 || inner.has_inequalities) {
    return best;
  }
  double highest = -kInfinity;
  for (std::size_t number = 0; number < inner.vertices(); ++number) {
    std::vector<double> v = inner.vertex(number);
    double f = 0.0;
    if (!inner.model.objective(v, true, f) || !(f > highest)) continue;
    highest = f;
    best = std::move(v);
  }
  return best;
}

std::vector<double> higher_sample(const InnerProblem& inner, Index first, const ValueRange& range,
                                  double highest) {
  constexpr Index kPoints = 32;
  std::vector<double> best;
  if (inner.start.empty() || inner.equations > 0) return best;
  for (Index k = first; k < first + kPoints; ++k) {
    std::vector<double> v = random_start(inner.sampled, inner.start, k, inner.options);
    const auto value = inner.value_at(v);
    if (!value || !clearly_greater(*value, highest, range, inner.options.minmax_worst_case_tol))
      continue;
    highest = *value;
    best = std::move(v);
  }
  return best;
}

std::vector<double> start_above(const InnerProblem& inner, std::span<const double> center,
                                std::vector<double> random, Index start) {
  std::mt19937_64 generator(at(start));
  const double share = uniform(generator);
  std::vector<double> middle(center.begin(), center.end());
  for (const std::size_t i : inner.boxed) {
    middle[i] = 0.5 * (inner.s.variable_lower[i] + inner.s.variable_upper[i]);
    random[i] = (random[i] > middle[i] ? inner.s.variable_upper : inner.s.variable_lower)[i];
  }
  if (is_feasible(inner.model, inner.options, middle)) center = middle;
  std::vector<double> v = drawn_back(inner, center, random, share);
  const std::vector<double> above = moved_to_bounds(inner, v);
  return above.empty() ? v : drawn_back(inner, center, above, 1.0);
}

Points next_to(const InnerProblem& inner, std::vector<double> v, const std::vector<double>& lambda,
               std::size_t most) {
  struct Move {
    std::size_t variable;
    double bound, value;
  };
  std::vector<Move> moves;
  try_bounds(inner, v, lambda, [&](std::size_t i, double bound, double value) {
    if (std::isfinite(value)) moves.push_back({i, bound, value});
    return false;
  });
  std::ranges::stable_sort(moves, std::greater{}, &Move::value);
  moves.resize(std::min(most, moves.size()));
  Points points;
  for (const auto& [variable, bound, value] : moves) points.emplace_back(v)[variable] = bound;
  return points;
}

}  // namespace ipminmax
