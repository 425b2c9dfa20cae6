#include <algorithm>
#include <cmath>

#include <hostile/trap_game.hpp>
#include <support/dice.hpp>

namespace ipminmax::testing {
namespace {

using Variables = std::vector<Expression>;

double power(Dice& dice, double low, double high) {
  return std::pow(10.0, dice.between(low, high));
}

SolverOptions trap_options(Dice& dice) {
  SolverOptions o;
  o.max_iter = 200;
  if (dice.chance(0.6)) return o;
  o.tol = dice.one_of({1e-8, 1e-6, 1e-4, 1e-2, 1e-10});
  o.bound_relax_factor = dice.one_of({1e-8, 1e-8, 0.0});
  o.nlp_scaling_method = dice.one_of({Scaling::GradientBased, Scaling::None});
  o.acceptable_tol = std::max(o.tol, dice.one_of({1e-6, 1e-3}));
  o.acceptable_iter = dice.one_of({15, 1, 0});
  if (dice.chance(0.15)) o.hessian_approximation = HessianApproximation::FiniteDifferenceValues;
  if (dice.chance(0.1)) o.mu_strategy = BarrierStrategy::Adaptive;
  if (dice.chance(0.1)) o.minmax_globalization = Globalization::None;
  if (dice.chance(0.1)) o.obj_scaling_factor = dice.one_of({-1.0, 1e-3, 1e3});
  if (dice.chance(0.2)) o.fixed_variable_treatment = FixedVariableTreatment::MakeConstraint;
  o.linear_solver = dice.one_of({LinearSolver::Auto, LinearSolver::Auto, LinearSolver::Ldlt,
                                 LinearSolver::Lapack, LinearSolver::Mumps});
  return o;
}

/// What hides the curvature of one variable, which is about zero at the solution.
Expression trap_term(Dice& dice, const Expression& u, double sign) {
  const double right = sign * power(dice, -9.0, 3.0);
  switch (dice.below(9)) {
    case 0:
    case 1:
      return right * square(u);
    case 2:  // wrong
      return -right * square(u);
    case 3:
      return right * pow(u, 4.0) +
             sign * dice.one_of({1.0, -1.0}) * power(dice, -12.0, -5.0) * square(u);
    case 4:
      return right * pow(u, 3.0) + sign * power(dice, -9.0, 0.0) * square(u);
    case 5:
      return right * (1.0 - cos(dice.between(0.5, 3.0) * u));
    case 6:
      return sign * dice.one_of({1.0, -1.0}) * power(dice, -6.0, 0.0) * u;  // to a bound or away
    case 7:
      return right * (exp(u) - u);
    default:
      return right * square(u) + sign * power(dice, -6.0, 2.0) * pow(u, 4.0);
  }
}

void add_couplings(Dice& dice, const std::vector<Player>& players, const Variables& u,
                   Expression& f) {
  for (std::size_t i = 0; i < u.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (!dice.chance(0.4)) continue;
      const double b = dice.one_of({1.0, -1.0}) * power(dice, -4.0, 2.0);
      f += b * u[i] * u[j];
      if (players[i] == players[j] || dice.chance(0.5)) continue;
      // -c y^2 + b x y + a x^2 with a nearly -b^2 / (4 c): phi'' about zero.
      const double c = power(dice, -3.0, 3.0);
      const double a =
          -b * b / (4.0 * c) * (1.0 + dice.one_of({1.0, -1.0}) * power(dice, -9.0, -1.0));
      const std::size_t x = players[i] == Player::Min ? i : j;
      f += a * square(u[x]) - c * square(u[i + j - x]);
    }
  }
}

void add_constraint(Dice& dice, const Variables& u, Model& model) {
  const int n = static_cast<int>(u.size());
  const Expression& v = u[static_cast<std::size_t>(dice.below(n))];
  const Expression& w = u[static_cast<std::size_t>(dice.below(n))];
  const double scale = power(dice, -2.0, 7.0);
  switch (dice.below(6)) {
    case 0:
    case 1:  // inactive, of strong curvature
      model.constraint(scale * square(v), -kNoBound, dice.one_of({1.0, scale, 1e3}));
      break;
    case 2:
      model.constraint(square(v) + square(w), -kNoBound, dice.one_of({1.0, 1e-6, 4.0}));
      break;
    case 3:
      model.constraint(v * w, dice.one_of({-1.0, -kNoBound}), dice.one_of({0.0, 1.0, 1e-8}));
      break;
    case 4:
      model.constraint(v + w, dice.one_of({0.0, -1.0, -1e-7}), dice.one_of({kNoBound, 1.0}));
      break;
    default:
      model.constraint(v - dice.between(-1.0, 1.0) * square(w), 0.0, 0.0);
  }
}

}  // namespace

RandomGame trap_game(std::uint64_t seed) {
  Dice dice(seed);
  RandomGame game;
  const int n = 1 + dice.below(4);
  const double max_share = dice.one_of({0.5, 0.5, 0.0, 1.0});
  const double away = dice.one_of({0.0, 1e-12, 1e-8, 1e-5, 1e-3, 0.1, 1.0});
  const bool units = dice.chance(0.3);
  std::vector<Player> players;
  Variables u;
  for (int i = 0; i < n; ++i) {
    const Player player = dice.chance(max_share) ? Player::Max : Player::Min;
    const double unit = units ? power(dice, -4.0, 4.0) : 1.0;
    const double center = dice.chance(0.3) ? dice.between(-2.0, 2.0) : 0.0;
    const double lower =
        dice.chance(0.3) ? unit * (center + dice.one_of({0.0, -1.0, -1e-6})) : -kNoBound;
    const double upper =
        dice.chance(0.3) ? unit * (center + dice.one_of({1.0, 1e-6, 1e3})) : kNoBound;
    players.push_back(player);
    u.push_back(game.model.variable(player, "v" + std::to_string(i), lower, upper) / unit - center);
    game.start.push_back(unit * (center + away * dice.between(-1.0, 1.0)));
  }
  Expression f = dice.between(-1.0, 1.0);
  for (std::size_t i = 0; i < u.size(); ++i) {
    f += trap_term(dice, u[i], players[i] == Player::Min ? 1.0 : -1.0);
  }
  add_couplings(dice, players, u, f);
  game.model.objective(dice.one_of({1.0, 1.0, 1e-3, 1e3}) * f);
  const int m = dice.below(3);
  for (int j = 0; j < m; ++j) add_constraint(dice, u, game.model);
  game.options = trap_options(dice);
  return game;
}

}  // namespace ipminmax::testing
