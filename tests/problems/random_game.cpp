#include <algorithm>
#include <cmath>

#include <problems/random_game.hpp>
#include <support/dice.hpp>

namespace ipminmax::testing {
namespace {

using Variables = std::vector<Expression>;

Expression random_term(Dice& dice, const Variables& v) {
  const int n = static_cast<int>(v.size());
  const auto any = [&]() -> const Expression& {
    return v[static_cast<std::size_t>(dice.below(n))];
  };
  switch (dice.below(14)) {
    case 0:
    case 1:
      return any();
    case 2:
    case 3:
    case 4:
      return square(any() - dice.between(-1.0, 1.0));
    case 5:
    case 6:
      return any() * any();
    case 7:
      return pow(any(), dice.one_of({3.0, 4.0, 6.0}));
    case 8:
      return exp(dice.one_of({1.0, -1.0, 0.3}) * any());
    case 9:
      return sin(dice.between(0.3, 3.0) * any() + dice.between(0.0, 3.0));
    case 10:
      return cos(any()) * any();
    case 11:
      return log(any() + dice.one_of({2.0, 5.0, 0.0}));
    case 12:
      return sqrt(any() + dice.one_of({1.0, 4.0, 0.0}));
    default:
      return dice.chance(0.5) ? 1.0 / (1.0 + square(any())) : 1.0 / any();
  }
}

Expression random_sum(Dice& dice, const Variables& v, int terms) {
  Expression sum = dice.between(-2.0, 2.0);
  for (int k = 0; k < terms; ++k) {
    const double size = dice.chance(0.1) ? dice.one_of({1e-6, 1e3, 1e6}) : 1.0;
    sum += size * dice.between(-2.0, 2.0) * random_term(dice, v);
  }
  return sum;
}

struct Bounds {
  double lower = -kNoBound, upper = kNoBound;
};

Bounds random_bounds(Dice& dice) {
  const double scale = dice.chance(0.1) ? dice.one_of({1e-3, 1e3, 1e6}) : 1.0;
  const double center = scale * dice.between(-2.0, 2.0);
  switch (dice.below(8)) {
    case 0:
      return {center, kNoBound};
    case 1:
      return {-kNoBound, center};
    case 2:
    case 3:
      return {center - scale * dice.between(0.0, 3.0), center + scale * dice.between(0.0, 3.0)};
    case 4:
      return dice.chance(0.4) ? Bounds{center, center} : Bounds{};
    default:
      return {};
  }
}

SolverOptions random_options(Dice& dice) {
  SolverOptions o;
  o.max_iter = dice.one_of({200, 200, 200, 500, 40, 5, 1, 0});
  if (dice.chance(0.5)) return o;
  o.tol = dice.one_of({1e-8, 1e-8, 1e-5, 1e-12, 1e-16, 1e-2});
  o.acceptable_iter = dice.one_of({15, 0, 1, 4});
  o.acceptable_tol = dice.one_of({1e-6, 1e-3, 1e-10});
  o.constr_viol_tol = dice.one_of({1e-4, 1e-4, 1e-8});
  o.bound_relax_factor = dice.one_of({1e-8, 1e-8, 0.0, 1e-4});
  o.honor_original_bounds = dice.chance(0.2);
  o.minmax_max_restarts = dice.one_of({20, 0, 1, 3});
  o.mu_init = dice.one_of({0.1, 1e-3, 10.0});
  o.fixed_variable_treatment =
      dice.one_of({FixedVariableTreatment::MakeParameter, FixedVariableTreatment::MakeParameter,
                   FixedVariableTreatment::MakeParameterNodual,
                   FixedVariableTreatment::MakeConstraint, FixedVariableTreatment::RelaxBounds});
  o.nlp_scaling_method = dice.one_of({Scaling::GradientBased, Scaling::None});
  if (dice.chance(0.2)) o.minmax_globalization = Globalization::None;
  if (dice.chance(0.1)) o.minmax_residual_watchdog = true;
  if (dice.chance(0.05)) o.minmax_pure_newton = true;
  if (dice.chance(0.2)) o.mu_strategy = BarrierStrategy::Adaptive;
  if (dice.chance(0.1)) o.hessian_approximation = HessianApproximation::FiniteDifferenceValues;
  if (dice.chance(0.1)) o.diverging_iterates_tol = 1e6;
  if (dice.chance(0.03)) o.max_hessian_perturbation = 1.0;
  if (dice.chance(0.03)) o.max_cpu_time = 1e-9;
  o.linear_solver = dice.one_of({LinearSolver::Auto, LinearSolver::Auto, LinearSolver::Auto,
                                 LinearSolver::Ldlt, LinearSolver::Lapack});
  return o;
}

/// Curvature of the right sign in most variables.
Expression curvature(std::uint64_t seed, const std::vector<Player>& players, const Variables& v) {
  Dice dice(seed + 0x9e3779b97f4a7c15U);
  Expression sum = 0.0;
  for (std::size_t i = 0; i < v.size(); ++i) {
    if (dice.chance(0.2)) continue;
    const double right = players[i] == Player::Min ? 1.0 : -1.0;
    sum += right * std::pow(10.0, dice.between(-3.0, 2.0)) * square(v[i]);
  }
  return sum;
}

RandomGame make_game(std::uint64_t seed, bool tame) {
  Dice dice(seed);
  RandomGame game;
  const int n = 1 + dice.below(5);
  const double max_share = dice.one_of({0.5, 0.5, 0.5, 0.0, 1.0});
  Variables v;
  std::vector<Player> players;
  double start_scale = dice.one_of({1.0, 1.0, 3.0, 100.0});
  if (dice.chance(0.02)) start_scale = 1e300;
  for (int i = 0; i < n; ++i) {
    const Player player = dice.chance(max_share) ? Player::Max : Player::Min;
    const Bounds bounds = random_bounds(dice);
    players.push_back(player);
    v.push_back(game.model.variable(player, "v" + std::to_string(i), bounds.lower, bounds.upper));
    game.start.push_back(dice.chance(0.1) ? 0.0 : start_scale * dice.between(-1.0, 1.0));
  }
  Expression f = random_sum(dice, v, 1 + dice.below(2 * n + 1));
  if (tame) f += curvature(seed, players, v);
  game.model.objective(f);
  const int m = dice.chance(0.4) ? 0 : 1 + dice.below(3);
  for (int j = 0; j < m; ++j) {
    const Expression g = random_sum(dice, v, 1 + dice.below(n + 1));
    const double value = dice.between(-2.0, 2.0);
    const Bounds bounds = dice.chance(0.4) ? Bounds{value, value} : random_bounds(dice);
    game.model.constraint(g, bounds.lower, bounds.upper);
  }
  game.options = random_options(dice);
  if (dice.chance(0.15)) game.stop_at = dice.below(25);
  if (dice.chance(0.15)) {
    game.fails_from = 1 + dice.below(dice.one_of({5, 40, 200}));
    game.failing_function = dice.below(5);
    game.fails_with_nan = dice.chance(0.5);
  }
  return game;
}

}  // namespace

RandomGame random_game(std::uint64_t seed) { return make_game(seed, false); }

RandomGame tame_game(std::uint64_t seed) {
  RandomGame game = make_game(seed, true);
  game.stop_at = std::numeric_limits<int>::max();
  game.fails_from = 0;
  game.options.max_cpu_time = SolverOptions{}.max_cpu_time;
  game.options.max_iter = std::max(game.options.max_iter, 200);
  return game;
}

}  // namespace ipminmax::testing
