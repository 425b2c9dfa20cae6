#include <hostile/rewritten_problem.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace ipminmax::testing {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kNone = 2e19;
bool is_bound(double value) { return std::abs(value) < 1e19; }
std::size_t at(Index i) { return static_cast<std::size_t>(i); }
std::span<const double> list(const VectorXd& v) { return {v.data(), at(v.size())}; }
ipminmax::Index to_int(Index i) { return static_cast<ipminmax::Index>(i); }

std::string say(const char* format, double a, double b = 0.0) {
  char text[80];
  std::snprintf(text, sizeof text, format, a, b);
  return text;
}

}  // namespace

Rewriting Rewriting::unchanged(Problem& model) {
  const ProblemStructure& s = model.structure();
  const auto n = std::ssize(s.variable_players);
  Rewriting r;
  std::vector<double> v(at(n));
  StartingPoint start{.v = v, .lambda = {}, .z_lower = {}, .z_upper = {}};
  if (!model.starting_point(start)) return r;
  for (std::size_t i = 0; i < v.size(); ++i) {
    r.variables.push_back({s.variable_players[i], s.variable_lower[i], s.variable_upper[i], v[i]});
  }
  for (std::size_t j = 0; j < s.constraint_lower.size(); ++j) {
    r.rows.push_back({std::ssize(r.rows), s.constraint_players[j], s.constraint_lower[j],
                      s.constraint_upper[j]});
  }
  r.a = MatrixXd::Identity(n, n);
  r.b = VectorXd::Zero(n);
  r.model_rows = std::ssize(r.rows);
  return r;
}

RewrittenProblem::RewrittenProblem(Problem& model, Rewriting rewriting)
    : model_(model), r_(std::move(rewriting)) {
  const ProblemStructure& s = model.structure();
  const Index n = r_.b.size(), size = std::ssize(r_.variables);
  for (const Rewriting::Variable& u : r_.variables) {
    structure_.variable_players.push_back(u.player);
    structure_.variable_lower.push_back(u.lower);
    structure_.variable_upper.push_back(u.upper);
  }
  const MatrixXd reads = (r_.a.array() != 0.0).cast<double>();
  MatrixXd sources = MatrixXd::Zero(r_.model_rows + n, n);
  sources.bottomRows(n).setIdentity();
  for (const auto [row, col] : s.jacobian) sources(row, col) = 1.0;
  MatrixXd pairs = MatrixXd::Zero(n, n);
  for (const auto [row, col] : s.hessian) pairs(row, col) = pairs(col, row) = 1.0;
  sources = (sources * reads).eval();
  pairs = (reads.transpose() * pairs * reads).eval();
  for (const Rewriting::Row& row : r_.rows) {
    structure_.constraint_players.push_back(row.owner);
    structure_.constraint_lower.push_back(row.lower);
    structure_.constraint_upper.push_back(row.upper);
    const auto number = to_int(std::ssize(structure_.constraint_players) - 1);
    for (Index k = 0; k < size; ++k) {
      if (sources(row.source, k) != 0.0) structure_.jacobian.push_back({number, to_int(k)});
    }
    if (row.sign != 0.0) pairs += sources.row(row.source).transpose() * sources.row(row.source);
  }
  for (Index i = 0; i < size; ++i) {
    for (Index j = 0; j <= i; ++j) {
      if (pairs(i, j) != 0.0) structure_.hessian.push_back({to_int(i), to_int(j)});
    }
  }
}

bool RewrittenProblem::starting_point(StartingPoint& start) {
  for (std::size_t i = 0; i < r_.variables.size(); ++i) start.v[i] = r_.variables[i].start;
  return !start.needs_multipliers;
}

bool RewrittenProblem::see(std::span<const double> u, bool derivatives) {
  v_ = r_.a * VectorXd::Map(u.data(), std::ssize(u)) + r_.b;
  sources_.resize(r_.model_rows + v_.size());
  sources_.tail(v_.size()) = v_;
  const auto rows = std::span(sources_.data(), at(r_.model_rows));
  if (!rows.empty() && !model_.constraints(list(v_), true, rows)) return false;
  if (!derivatives) return true;
  const std::vector<Triplet>& places = model_.structure().jacobian;
  std::vector<double> values(places.size());
  if (!rows.empty() && !model_.jacobian(list(v_), false, values)) return false;
  source_jacobian_ = MatrixXd::Zero(sources_.size(), v_.size());
  source_jacobian_.bottomRows(v_.size()).setIdentity();
  for (std::size_t k = 0; k < places.size(); ++k) {
    source_jacobian_(places[k].row, places[k].col) += values[k];
  }
  source_jacobian_ = (source_jacobian_ * r_.a).eval();
  return true;
}

/// Derivative of a row in its source.
double RewrittenProblem::slope(const Rewriting::Row& row) const {
  if (row.sign == 0.0) return row.factor;
  return row.factor * row.sign * std::exp(row.sign * (sources_[row.source] - row.origin));
}

bool RewrittenProblem::objective(std::span<const double> u, bool, double& f) {
  v_ = r_.a * VectorXd::Map(u.data(), std::ssize(u)) + r_.b;
  if (!model_.objective(list(v_), true, f)) return false;
  f = r_.f_factor * f + r_.f_shift;
  return true;
}

bool RewrittenProblem::gradient(std::span<const double> u, bool, std::span<double> grad) {
  v_ = r_.a * VectorXd::Map(u.data(), std::ssize(u)) + r_.b;
  VectorXd of_v(v_.size());
  if (!model_.gradient(list(v_), true, {of_v.data(), at(of_v.size())})) return false;
  VectorXd::Map(grad.data(), std::ssize(grad)) = r_.f_factor * (r_.a.transpose() * of_v);
  return true;
}

bool RewrittenProblem::constraints(std::span<const double> u, bool, std::span<double> g) {
  if (!see(u, false)) return false;
  for (std::size_t j = 0; j < g.size(); ++j) {
    const Rewriting::Row& row = r_.rows[j];
    const double source = sources_[row.source];
    g[j] = row.factor * (row.sign == 0.0 ? source : std::exp(row.sign * (source - row.origin))) +
           row.shift;
    if (!std::isfinite(g[j])) return false;
  }
  return true;
}

bool RewrittenProblem::jacobian(std::span<const double> u, bool, std::span<double> values) {
  if (!see(u, true)) return false;
  for (std::size_t k = 0; k < values.size(); ++k) {
    const auto [j, col] = structure_.jacobian[k];
    const Rewriting::Row& row = r_.rows[at(j)];
    values[k] = slope(row) * source_jacobian_(row.source, col);
    if (!std::isfinite(values[k])) return false;
  }
  return true;
}

bool RewrittenProblem::hessian(std::span<const double> u, bool, double sigma,
                               std::span<const double> lambda, bool, std::span<double> values) {
  if (!see(u, true)) return false;
  std::vector<double> weights(at(r_.model_rows), 0.0);
  MatrixXd h = MatrixXd::Zero(std::ssize(u), std::ssize(u));
  for (std::size_t j = 0; j < lambda.size(); ++j) {
    const Rewriting::Row& row = r_.rows[j];
    if (row.source < r_.model_rows) weights[at(row.source)] += lambda[j] * slope(row);
    if (row.sign == 0.0) continue;
    const auto gradient = source_jacobian_.row(row.source);
    h += lambda[j] * row.sign * slope(row) * gradient.transpose() * gradient;
  }
  const std::vector<Triplet>& places = model_.structure().hessian;
  std::vector<double> entries(places.size());
  if (!model_.hessian(list(v_), false, sigma * r_.f_factor, weights, true, entries)) return false;
  MatrixXd of_v = MatrixXd::Zero(v_.size(), v_.size());
  for (std::size_t k = 0; k < places.size(); ++k) {
    of_v(places[k].row, places[k].col) += entries[k];
    if (places[k].row != places[k].col) of_v(places[k].col, places[k].row) += entries[k];
  }
  h += r_.a.transpose() * of_v * r_.a;
  for (std::size_t k = 0; k < values.size(); ++k) {
    values[k] = h(structure_.hessian[k].row, structure_.hessian[k].col);
  }
  return h.allFinite();
}

// Transformations.

namespace {

using Said = std::optional<std::string>;
using Row = Rewriting::Row;

void change_bounds(double& lower, double& upper, double factor, double shift) {
  if (is_bound(lower)) lower = factor * lower + shift;
  if (is_bound(upper)) upper = factor * upper + shift;
}

void scale_variable(Rewriting& r, Index k, double unit) {
  Rewriting::Variable& u = r.variables[at(k)];
  change_bounds(u.lower, u.upper, 1.0 / unit, 0.0);
  u.start /= unit;
  r.a.col(k) *= unit;
}

void shift_variable(Rewriting& r, Index k, double shift) {
  Rewriting::Variable& u = r.variables[at(k)];
  change_bounds(u.lower, u.upper, 1.0, shift);
  u.start += shift;
  r.b -= shift * r.a.col(k);
}

void scale_row(Row& row, double factor) {
  change_bounds(row.lower, row.upper, factor, 0.0);
  row.factor *= factor;
  row.shift *= factor;
}

Index any(Dice& dice, std::size_t size) { return dice.below(static_cast<int>(size)); }
double power_of_ten(Dice& dice) { return std::pow(10.0, dice.below(13) - 6); }

Said one_unit(Rewriting& r, Dice& dice) {
  const Index k = any(dice, r.variables.size());
  const double unit = power_of_ten(dice);
  scale_variable(r, k, unit);
  return say("unit of variable %.0f %.0e", static_cast<double>(k), unit);
}

Said all_units(Rewriting& r, Dice& dice) {
  std::string said = "units";
  for (Index k = 0; k < std::ssize(r.variables); ++k) {
    const double unit = power_of_ten(dice);
    scale_variable(r, k, unit);
    said += say(" %.0e", unit);
  }
  return said;
}

Said one_shift(Rewriting& r, Dice& dice) {
  const Index k = any(dice, r.variables.size());
  shift_variable(r, k, 1e4);
  return say("variable %.0f + 1e4", static_cast<double>(k));
}

Said all_shifts(Rewriting& r, Dice& dice) {
  for (Index k = 0; k < std::ssize(r.variables); ++k)
    shift_variable(r, k, dice.one_of({-1e4, 1e4}));
  return "all variables +- 1e4";
}

Said extra_variable(Rewriting& r, Dice& dice, bool fixed) {
  const Player player = dice.one_of({Player::Min, Player::Max});
  const double size = dice.one_of({1e-6, 1e6});
  const double lower = fixed ? size : dice.one_of({-1.0, 0.0, -kNone / size}) * size;
  const double upper = fixed ? size : is_bound(lower) ? 2.0 * size : kNone;
  r.variables.push_back({player, lower, upper, size});
  r.a.conservativeResize(Eigen::NoChange, std::ssize(r.variables));
  r.a.rightCols(1).setZero();
  return std::string(player == Player::Min ? "Min's in [" : "Max's in [") +
         say("%.0e, %.0e]", lower, upper);
}
Said unread_variable(Rewriting& r, Dice& dice) { return extra_variable(r, dice, false); }
Said fixed_variable(Rewriting& r, Dice& dice) { return extra_variable(r, dice, true); }

Said scale_objective(Rewriting& r, Dice& dice) {
  const double factor = dice.one_of({1e-6, 1e6});
  r.f_factor *= factor;
  r.f_shift *= factor;
  return say("f times %.0e", factor);
}

Said shift_objective(Rewriting& r, Dice&) {
  r.f_shift += 1e6;
  return "f + 1e6";
}

Said scale_rows(Rewriting& r, Dice& dice) {
  if (r.rows.empty()) return {};
  std::string said = "rows times";
  for (Row& row : r.rows) {
    const double factor = dice.one_of({1e-6, 1.0, 1e6});
    scale_row(row, factor);
    said += say(" %.0e", factor);
  }
  return said;
}

Said shift_rows(Rewriting& r, Dice&) {
  if (r.rows.empty()) return {};
  for (Row& row : r.rows) {
    row.shift += 1e6;
    change_bounds(row.lower, row.upper, 1.0, 1e6);
  }
  return "rows + 1e6";
}

template <class T>
std::vector<Index> shuffled(const std::vector<T>& of, Dice& dice) {
  std::vector<Index> order(of.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    order[i] = static_cast<Index>(i);
    std::swap(order[i], order[at(any(dice, i + 1))]);
  }
  return order;
}

Said permute(Rewriting& r, Dice& dice) {
  const Rewriting old = r;
  const std::vector<Index> order = shuffled(r.variables, dice), rows = shuffled(r.rows, dice);
  for (std::size_t k = 0; k < order.size(); ++k) {
    r.variables[k] = old.variables[at(order[k])];
    r.a.col(static_cast<Index>(k)) = old.a.col(order[k]);
  }
  for (std::size_t k = 0; k < rows.size(); ++k) r.rows[k] = old.rows[at(rows[k])];
  return "permuted";
}

Said row_twice(Rewriting& r, Dice& dice) {
  if (r.rows.empty()) return {};
  const Index j = any(dice, r.rows.size());
  r.rows.push_back(Row(r.rows[at(j)]));
  return say("row %.0f twice", static_cast<double>(j));
}

/// A bounded row again, with bounds that are further away.
Said redundant_row(Rewriting& r, Dice& dice) {
  if (r.rows.empty()) return {};
  const Index j = any(dice, r.rows.size());
  Row row = r.rows[at(j)];
  if (row.lower == row.upper) return {};
  const double more = 0.5 * std::abs(row.factor);
  row.is_redundant = true;
  if (is_bound(row.lower)) row.lower -= more;
  if (is_bound(row.upper)) row.upper += more;
  r.rows.push_back(row);
  return say("row %.0f again, further away", static_cast<double>(j));
}

Said split_row(Rewriting& r, Dice&) {
  for (Row& row : r.rows) {
    if (!is_bound(row.lower) || !is_bound(row.upper) || row.lower == row.upper) continue;
    Row below = row;
    below.lower = -kNone;
    row.upper = kNone;
    r.rows.push_back(below);
    return "a two-sided row in two";
  }
  return {};
}

/// The bounds of v_i = a_ik u_k + b_i, u_k's alone.
Said bound_as_row(Rewriting& r, Dice& dice) {
  const Index k = any(dice, r.variables.size());
  Rewriting::Variable& u = r.variables[at(k)];
  if (r.a.col(k).isZero(0.0) || (!is_bound(u.lower) && !is_bound(u.upper))) return {};
  Index i = 0;
  r.a.col(k).cwiseAbs().maxCoeff(&i);
  Row row{r.model_rows + i, u.player, u.lower, u.upper};
  change_bounds(row.lower, row.upper, r.a(i, k), r.b[i]);
  r.rows.push_back(row);
  u.lower = -kNone;
  u.upper = kNone;
  return say("bounds of variable %.0f as a row", static_cast<double>(k));
}

/// exp(g - upper) <= 1 or exp(lower - g) <= 1.
Said exponential_row(Rewriting& r, Dice& dice) {
  std::vector<Row*> one_sided;
  for (Row& row : r.rows) {
    if (is_bound(row.lower) != is_bound(row.upper)) one_sided.push_back(&row);
  }
  if (one_sided.empty()) return {};
  Row& row = *one_sided[at(any(dice, one_sided.size()))];
  row.sign = is_bound(row.upper) ? 1.0 : -1.0;
  row.origin = row.sign > 0.0 ? row.upper : row.lower;
  row.lower = -kNone;
  row.upper = 1.0;
  return "exp(g) <= 1";
}

/// Two variables of Max turned; their bounds become rows.
Said rotate(Rewriting& r, Dice& dice) {
  std::vector<Index> y;
  for (Index k = 0; k < std::ssize(r.variables); ++k) {
    if (r.variables[at(k)].player == Player::Max) y.push_back(k);
  }
  if (y.size() < 2) return {};
  const double angle = dice.between(0.2, 1.4);
  Eigen::Matrix2d turn;
  turn << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  Eigen::Vector2d start;
  for (int k = 0; k < 2; ++k) {
    Rewriting::Variable& u = r.variables[at(y[at(k)])];
    if (is_bound(u.lower) || is_bound(u.upper)) {
      r.rows.push_back({r.model_rows + y[at(k)], Player::Max, u.lower, u.upper});
    }
    start[k] = u.start;
    u.lower = -kNone;
    u.upper = kNone;
  }
  start = (turn.transpose() * start).eval();
  r.a(Eigen::all, {y[0], y[1]}) = (r.a(Eigen::all, {y[0], y[1]}) * turn).eval();
  for (int k = 0; k < 2; ++k) r.variables[at(y[at(k)])].start = start[k];
  return say("y rotated by %.2f", angle);
}

Said widen(Rewriting& r, Dice&) {
  bool any_wider = false;
  for (Rewriting::Variable& u : r.variables) {
    if (u.player == Player::Min || !is_bound(u.lower) || !is_bound(u.upper)) continue;
    const double middle = 0.5 * (u.lower + u.upper), reach = 50.0 * (u.upper - u.lower);
    u.lower = middle - reach;
    u.upper = middle + reach;
    any_wider = true;
  }
  return any_wider ? Said("box of y 100 times as wide") : Said();
}

Said exchange(Rewriting& r, Dice&) {
  const auto other = [](Player& player) {
    player = player == Player::Min ? Player::Max : Player::Min;
  };
  for (Rewriting::Variable& u : r.variables) other(u.player);
  for (Row& row : r.rows) other(row.owner);
  r.f_factor = -r.f_factor;
  r.f_shift = -r.f_shift;
  return "roles exchanged";
}

}  // namespace

const std::vector<Transformation>& transformations() {
  // First those that read the model's own variables and bounds.
  using enum Transformation::Kind;
  static const std::vector<Transformation> all = {
      {"y rotated", rotate},
      {"exp(g) <= 1", exponential_row},
      {"y's box wider", widen, Wide},
      {"roles exchanged", exchange, Saddle},
      {"bound as row", bound_as_row},
      {"split row", split_row},
      {"row twice", row_twice},
      {"redundant row", redundant_row},
      {"unread variable", unread_variable},
      {"fixed variable", fixed_variable},
      {"one unit", one_unit, Units},
      {"all units", all_units, Units},
      {"one shift", one_shift, Units},
      {"all shifts", all_shifts, Units},
      {"f scaled", scale_objective, Units},
      {"f shifted", shift_objective, Units},
      {"rows scaled", scale_rows, Units},
      {"rows shifted", shift_rows, Units},
      {"permuted", permute},
  };
  return all;
}

}  // namespace ipminmax::testing
