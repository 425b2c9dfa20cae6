#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>
#include <utility>

#include "core/model/canonical_problem.hpp"
#include "core/model/timer.hpp"
#include "core/point/norms.hpp"

namespace ipminmax {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

std::string named(std::string_view kind, const std::vector<std::string>& names, Index i) {
  std::ostringstream text;
  text << kind << ' ' << i;
  if (at(i) < names.size() && !names[at(i)].empty()) text << " (" << names[at(i)] << ')';
  return text.str();
}

std::string number(double value) {
  std::ostringstream text;
  text.precision(17);
  text << value;
  return text.str();
}

/// First entry that is NaN or infinite, -1 when there is none.
Index first_not_finite(std::span<const double> values) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i])) return static_cast<Index>(i);
  }
  return -1;
}

/// Start value inside (lower, upper): Waechter and Biegler 2006, section 3.6.
double push_inside(double value, double lower, double upper, double push, double fraction) {
  const bool has_lower = lower > -kInfinity;
  const bool has_upper = upper < kInfinity;
  const double width = has_lower && has_upper ? fraction * (upper - lower) : kInfinity;
  if (has_lower) {
    value = std::max(value, lower + std::min(push * std::max(1.0, std::abs(lower)), width));
  }
  if (has_upper) {
    value = std::min(value, upper - std::min(push * std::max(1.0, std::abs(upper)), width));
  }
  return value;
}

}  // namespace

CanonicalProblem::CanonicalProblem(Problem& problem, const SolverOptions& options, Counts& counts,
                                   Timing& timing)
    : problem_(problem),
      structure_(problem.structure()),
      options_(options),
      counts_(counts),
      timing_(timing) {}

std::string CanonicalProblem::variable_name(Index i) const {
  return named("variable", structure_.variable_names, i);
}

std::string CanonicalProblem::constraint_name(Index i) const {
  return named("constraint", structure_.constraint_names, i);
}

std::string CanonicalProblem::fail(Status status, std::string message) {
  error_status_ = status;
  return message;
}

std::string CanonicalProblem::build(const std::optional<GradientScaling>& kept) {
  if (auto error = validate(); !error.empty()) return error;
  if (auto error = index_variables(); !error.empty()) return error;
  index_constraints();
  map_entries();
  if (auto error = read_start(); !error.empty()) return error;
  std::string error = scale(kept);
  model_start_ = {};
  return error;
}

std::string CanonicalProblem::validate() {
  const ProblemStructure& s = structure_;
  const auto n = static_cast<Index>(s.variable_players.size());
  const auto m = static_cast<Index>(s.constraint_players.size());
  if (s.variable_lower.size() != at(n) || s.variable_upper.size() != at(n)) {
    return "the bounds of the variables do not have one entry per variable";
  }
  if (s.constraint_lower.size() != at(m) || s.constraint_upper.size() != at(m)) {
    return "the bounds of the constraints do not have one entry per constraint";
  }
  const auto bad_bounds = [&](double lower, double upper) -> std::string {
    if (std::isnan(lower) || std::isnan(upper)) return " has a bound that is NaN";
    if (lower > upper) {
      return " has inconsistent bounds: lower " + number(lower) + " above upper " + number(upper);
    }
    if (lower >= options_.nlp_upper_bound_inf || upper <= options_.nlp_lower_bound_inf) {
      return lower > 0.0 ? " has the lower bound " + number(lower) + ", which means +infinity"
                         : " has the upper bound " + number(upper) + ", which means -infinity";
    }
    return {};
  };
  const auto no_player = [](Player player) {
    return player != Player::Min && player != Player::Max ? " is owned by no player" : "";
  };
  for (Index i = 0; i < n; ++i) {
    if (*no_player(s.variable_players[at(i)])) {
      return variable_name(i) + no_player(s.variable_players[at(i)]);
    }
    const auto error = bad_bounds(s.variable_lower[at(i)], s.variable_upper[at(i)]);
    if (!error.empty()) return variable_name(i) + error;
  }
  for (Index j = 0; j < m; ++j) {
    if (*no_player(s.constraint_players[at(j)])) {
      return constraint_name(j) + no_player(s.constraint_players[at(j)]);
    }
    const auto error = bad_bounds(s.constraint_lower[at(j)], s.constraint_upper[at(j)]);
    if (!error.empty()) return constraint_name(j) + error;
  }
  for (std::size_t k = 0; k < s.jacobian.size(); ++k) {
    const auto [row, col] = s.jacobian[k];
    if (row < 0 || row >= m || col < 0 || col >= n) {
      std::ostringstream text;
      text << "entry " << k << " of the Jacobian's structure is at row " << row << ", column "
           << col << ", outside " << m << " constraints and " << n << " variables (0-based)";
      return text.str();
    }
    if (auto error = check_robust(s.jacobian[k]); !error.empty()) return error;
  }
  for (std::size_t k = 0; k < s.hessian.size(); ++k) {
    const auto [row, col] = s.hessian[k];
    if (row < 0 || row >= n || col < 0 || col >= n) {
      std::ostringstream text;
      text << "entry " << k << " of the Hessian's structure is at row " << row << ", column " << col
           << ", outside " << n << " variables (0-based)";
      return text.str();
    }
  }
  return {};
}

/// What is wrong with a Jacobian entry of Min's constraint in Max's variable, if anything.
std::string CanonicalProblem::check_robust(Triplet entry) const {
  const ProblemStructure& s = structure_;
  if (s.constraint_players[at(entry.row)] != Player::Min ||
      s.variable_players[at(entry.col)] != Player::Max) {
    return {};
  }
  const bool equality = s.constraint_lower[at(entry.row)] == s.constraint_upper[at(entry.row)];
  if (options_.minmax_robust_constraints && !equality) return {};
  std::string text = constraint_name(entry.row) +
                     " belongs to the Min player but depends on the Max player's " +
                     variable_name(entry.col);
  if (equality) text += ", and an equality cannot hold for every value of it";
  return text;
}

std::string CanonicalProblem::index_variables() {
  const auto& players = structure_.variable_players;
  variable_of_model_.assign(players.size(), -1);
  model_v_.assign(players.size(), 0.0);
  const auto treatment = options_.fixed_variable_treatment;
  const bool takes_out = treatment == FixedVariableTreatment::MakeParameter ||
                         treatment == FixedVariableTreatment::MakeParameterNodual;
  const auto is_fixed = [&](std::size_t i) {
    return takes_out && has_equal_bounds(static_cast<Index>(i));
  };
  std::array<Index, 2> free{}, equalities{}, inequalities{};
  for (std::size_t i = 0; i < players.size(); ++i) {
    const bool max = players[i] == Player::Max;
    if (!is_fixed(i)) ++free[max];
    if (is_fixed_by_constraint(static_cast<Index>(i))) ++equalities[max];
  }
  // An equation without free variables holds or not; it takes no degree of freedom.
  std::array<Index, 2> constant{};
  std::vector<bool> varies(structure_.constraint_players.size(), false);
  for (const Triplet& entry : structure_.jacobian) {
    if (!is_fixed(at(entry.col))) varies[at(entry.row)] = true;
  }
  for (std::size_t j = 0; j < structure_.constraint_players.size(); ++j) {
    const bool max = structure_.constraint_players[j] == Player::Max;
    if (structure_.constraint_lower[j] == structure_.constraint_upper[j]) {
      ++equalities[max];
      if (!varies[j]) ++constant[max];
    } else if (structure_.constraint_lower[j] > options_.nlp_lower_bound_inf ||
               structure_.constraint_upper[j] < options_.nlp_upper_bound_inf) {
      ++inequalities[max];
    }
  }
  for (const bool max : {false, true}) {
    const Index equations = equalities[max] - constant[max];
    if (equations > free[max]) {
      std::ostringstream text;
      text << "too few degrees of freedom: the " << (max ? "Max" : "Min") << " player has "
           << free[max] << " free variables and " << equations << " equality constraints";
      return fail(Status::TooFewDegreesOfFreedom, text.str());
    }
  }

  x_ = {0, free[0]};
  x_slacks_ = {x_.end, x_.end + inequalities[0]};
  y_ = {x_slacks_.end, x_slacks_.end + free[1]};
  y_slacks_ = {y_.end, y_.end + inequalities[1]};
  min_constraints_ = {0, equalities[0] + inequalities[0]};
  max_constraints_ = {min_constraints_.end, min_constraints_.end + equalities[1] + inequalities[1]};

  model_variable_.assign(at(variables()), -1);
  std::array<Index, 2> next{x_.begin, y_.begin};
  for (std::size_t i = 0; i < players.size(); ++i) {
    if (is_fixed(i)) {
      model_v_[i] = structure_.variable_lower[i];
      continue;
    }
    const Index canonical = next[players[i] == Player::Max]++;
    variable_of_model_[i] = canonical;
    model_variable_[at(canonical)] = static_cast<Index>(i);
  }
  return {};
}

bool CanonicalProblem::has_equal_bounds(Index i) const {
  return structure_.variable_lower[at(i)] == structure_.variable_upper[at(i)];
}

bool CanonicalProblem::is_fixed_by_constraint(Index i) const {
  return options_.fixed_variable_treatment == FixedVariableTreatment::MakeConstraint &&
         has_equal_bounds(i);
}

std::string CanonicalProblem::row_name(Index constraint) const {
  const Index model = model_constraint_[at(constraint)];
  if (model >= 0) return constraint_name(model);
  return "fixed " + variable_name(model_variable_[at(fixing_variable_[at(constraint)])]);
}

void CanonicalProblem::index_constraints() {
  const std::size_t m = structure_.constraint_players.size();
  constraint_of_model_.assign(m, -1);
  model_constraint_.assign(at(constraints()), -1);
  fixing_variable_.assign(at(constraints()), -1);
  slack_of_constraint_.assign(at(constraints()), -1);
  std::array<Index, 2> next{min_constraints_.begin, max_constraints_.begin};
  std::array<Index, 2> next_slack{x_slacks_.begin, y_slacks_.begin};
  for (std::size_t j = 0; j < m; ++j) {
    const double lower = structure_.constraint_lower[j];
    const double upper = structure_.constraint_upper[j];
    const bool equality = lower == upper;
    if (!equality && lower <= options_.nlp_lower_bound_inf &&
        upper >= options_.nlp_upper_bound_inf) {
      continue;
    }
    const bool max = structure_.constraint_players[j] == Player::Max;
    const Index canonical = next[max]++;
    constraint_of_model_[j] = canonical;
    model_constraint_[at(canonical)] = static_cast<Index>(j);
    if (!equality) slack_of_constraint_[at(canonical)] = next_slack[max]++;
  }
  for (Index i = 0; i < variables(); ++i) {
    const Index model = model_variable_[at(i)];
    if (model < 0 || !is_fixed_by_constraint(model)) continue;
    fixing_variable_[at(next[owned_by_max(i)]++)] = i;
  }
}

void CanonicalProblem::map_entries() {
  const ProblemStructure& s = structure_;
  jacobian_.reserve(s.jacobian.size());
  jacobian_source_.reserve(s.jacobian.size());
  hessian_.reserve(s.hessian.size());
  hessian_source_.reserve(s.hessian.size());
  for (std::size_t k = 0; k < s.jacobian.size(); ++k) {
    const Index row = constraint_of_model_[at(s.jacobian[k].row)];
    const Index col = variable_of_model_[at(s.jacobian[k].col)];
    if (row < 0 || col < 0) continue;
    jacobian_.push_back({row, col});
    jacobian_source_.push_back(static_cast<Index>(k));
  }
  for (Index j = 0; j < constraints(); ++j) {
    if (fixing_variable_[at(j)] < 0) continue;
    jacobian_.push_back({j, fixing_variable_[at(j)]});
    jacobian_source_.push_back(-1);
  }
  for (std::size_t k = 0; k < s.hessian.size(); ++k) {
    const Index row = variable_of_model_[at(s.hessian[k].row)];
    const Index col = variable_of_model_[at(s.hessian[k].col)];
    if (row < 0 || col < 0) continue;
    hessian_.push_back({std::max(row, col), std::min(row, col)});
    hessian_source_.push_back(static_cast<Index>(k));
  }
  list_robust_constraints();
  model_g_.assign(s.constraint_players.size(), 0.0);
  model_lambda_.assign(s.constraint_players.size(), 0.0);
  model_gradient_.assign(s.variable_players.size(), 0.0);
  model_jacobian_.assign(s.jacobian.size(), 0.0);
  model_hessian_.assign(s.hessian.size(), 0.0);
}

void CanonicalProblem::list_robust_constraints() {
  for (const auto [row, col] : jacobian_) {
    if (owned_by_max(col) && min_constraints_.contains(row)) robust_constraints_.push_back(row);
  }
  std::ranges::sort(robust_constraints_);
  robust_constraints_.erase(std::unique(robust_constraints_.begin(), robust_constraints_.end()),
                            robust_constraints_.end());
}

std::string CanonicalProblem::read_start() {
  objective_scale_ = options_.obj_scaling_factor;
  col_scale_.assign(at(variables()), 1.0);
  row_scale_.assign(at(constraints()), 1.0);
  model_start_.v.assign(model_v_.size(), 0.0);
  model_start_.lambda.assign(model_g_.size(), 0.0);
  model_start_.z_lower.assign(model_v_.size(), 0.0);
  model_start_.z_upper.assign(model_v_.size(), 0.0);
  StartingPoint request{.v = model_start_.v,
                        .needs_multipliers = options_.warm_start_init_point,
                        .lambda = model_start_.lambda,
                        .z_lower = model_start_.z_lower,
                        .z_upper = model_start_.z_upper};
  if (!ask([&] { return problem_.starting_point(request); }))
    return "the model gives no starting point";
  return check_start();
}

std::string CanonicalProblem::check_start() {
  const auto refuse = [&](const std::string& what) {
    return fail(Status::InvalidNumber, "the starting " + what + " is not a finite number");
  };
  if (const Index i = first_not_finite(model_start_.v); i >= 0) {
    return refuse("point of " + variable_name(i));
  }
  if (!options_.warm_start_init_point) return {};
  // Multipliers of bounds that do not exist are not read, as in Ipopt.
  for (const Index j : model_constraint_) {
    if (j >= 0 && !std::isfinite(model_start_.lambda[at(j)])) {
      return refuse("multiplier of " + constraint_name(j));
    }
  }
  for (const Index i : model_variable_) {
    if (i < 0) continue;
    if (structure_.variable_lower[at(i)] > options_.nlp_lower_bound_inf &&
        !std::isfinite(model_start_.z_lower[at(i)])) {
      return refuse("multiplier of the lower bound of " + variable_name(i));
    }
    if (structure_.variable_upper[at(i)] < options_.nlp_upper_bound_inf &&
        !std::isfinite(model_start_.z_upper[at(i)])) {
      return refuse("multiplier of the upper bound of " + variable_name(i));
    }
  }
  return {};
}

std::string CanonicalProblem::scale(const std::optional<GradientScaling>& kept) {
  if (options_.nlp_scaling_method == Scaling::User) {
    if (auto error = user_scaling(); !error.empty()) return error;
  }
  set_variable_bounds();
  push_start();
  if (options_.nlp_scaling_method == Scaling::GradientBased) {
    const bool fits = kept && kept->largest_gradient == options_.nlp_scaling_max_gradient &&
                      kept->least_factor == options_.nlp_scaling_min_value &&
                      kept->constraints.size() == row_scale_.size();
    if (fits) {
      gradient_scaling_ = kept;
    } else if (auto error = gradient_based_scaling(); !error.empty()) {
      return error;
    }
    objective_scale_ *= gradient_scaling_->objective;
    row_scale_ = gradient_scaling_->constraints;
  }

  // Slacks are measured as their constraints.
  for (std::size_t j = 0; j < slack_of_constraint_.size(); ++j) {
    if (slack_of_constraint_[j] >= 0) col_scale_[at(slack_of_constraint_[j])] = row_scale_[j];
  }
  set_constraint_bounds();
  list_bounds();
  if (options_.warm_start_init_point) start_multipliers();
  scale_entries();
  return {};
}

std::string CanonicalProblem::user_scaling() {
  UserScaling scaling;
  if (!ask([&] { return problem_.user_scaling(scaling); })) return {};
  const auto error_of = [](const std::string& of_what, double factor) {
    return "the model's scaling factor of " + of_what + " is " + number(factor) + ", not in [" +
           number(kLeastScaling) + ", " + number(kLargestScaling) + "]";
  };
  if (!is_sane_scaling(std::abs(scaling.objective))) {
    return error_of("the objective", scaling.objective);
  }
  const auto fits = [](const std::vector<double>& factors, std::size_t size) {
    return factors.empty() || factors.size() == size;
  };
  if (!fits(scaling.variables, variable_of_model_.size()) ||
      !fits(scaling.constraints, constraint_of_model_.size())) {
    return "the model's scaling factors do not have one entry per variable and constraint";
  }
  objective_scale_ *= scaling.objective;
  for (std::size_t i = 0; i < scaling.variables.size(); ++i) {
    if (!is_sane_scaling(scaling.variables[i])) {
      return error_of(variable_name(static_cast<Index>(i)), scaling.variables[i]);
    }
    if (variable_of_model_[i] >= 0) col_scale_[at(variable_of_model_[i])] = scaling.variables[i];
  }
  for (std::size_t j = 0; j < scaling.constraints.size(); ++j) {
    if (!is_sane_scaling(scaling.constraints[j])) {
      return error_of(constraint_name(static_cast<Index>(j)), scaling.constraints[j]);
    }
    if (constraint_of_model_[j] >= 0) {
      row_scale_[at(constraint_of_model_[j])] = scaling.constraints[j];
    }
  }
  return {};
}

void CanonicalProblem::push_start() {
  const bool warm = options_.warm_start_init_point;
  const Index n = variables();
  start_.v.setZero(n);
  start_.lambda.setZero(constraints());
  start_.z_lower.setZero(n);
  start_.z_upper.setZero(n);
  for (Index i = 0; i < n; ++i) {
    const Index model = model_variable_[at(i)];
    if (model < 0) continue;
    start_.v[i] = push_inside(model_start_.v[at(model)] * col_scale_[at(i)], lower_[i], upper_[i],
                              warm ? options_.warm_start_bound_push : options_.bound_push,
                              warm ? options_.warm_start_bound_frac : options_.bound_frac);
  }
}

void CanonicalProblem::start_multipliers() {
  // Signs of Result, so those of a Max variable's bounds are <= 0.
  const double largest = options_.warm_start_mult_init_max;
  for (const Index i : lower_bounded_) {
    if (const Index model = model_variable_[at(i)]; model >= 0) {
      start_.z_lower[i] =
          model_start_.z_lower[at(model)] * sign(i) * objective_scale_ / col_scale_[at(i)];
    }
  }
  for (const Index i : upper_bounded_) {
    if (const Index model = model_variable_[at(i)]; model >= 0) {
      start_.z_upper[i] =
          model_start_.z_upper[at(model)] * sign(i) * objective_scale_ / col_scale_[at(i)];
    }
  }
  for (Index j = 0; j < constraints(); ++j) {
    const Index model = model_constraint_[at(j)];
    double value = 0.0;
    if (model >= 0) {
      value = model_start_.lambda[at(model)];
    } else {  // -z_L + z_U and the multiplier of v = value stand for each other
      const auto i = at(model_variable_[at(fixing_variable_[at(j)])]);
      value = model_start_.z_upper[i] - model_start_.z_lower[i];
    }
    start_.lambda[j] = std::clamp(value * objective_scale_ / row_scale_[at(j)], -largest, largest);
    // A slack's stationarity: -lambda + sign (-z_lower + z_upper) = 0.
    if (const Index slack = slack_of_constraint_[at(j)]; slack >= 0) {
      start_.z_lower[slack] = std::max(-sign(slack) * start_.lambda[j], 0.0);
      start_.z_upper[slack] = std::max(sign(slack) * start_.lambda[j], 0.0);
    }
  }
}

void CanonicalProblem::scale_entries() {
  jacobian_scale_.resize(jacobian_.size());
  for (std::size_t k = 0; k < jacobian_.size(); ++k) {
    jacobian_scale_[k] = row_scale_[at(jacobian_[k].row)] / col_scale_[at(jacobian_[k].col)];
  }
  const bool variables_scaled =
      std::any_of(col_scale_.begin(), col_scale_.begin() + x_.end,
                  [](double d) { return d != 1.0; }) ||
      std::any_of(col_scale_.begin() + y_.begin, col_scale_.begin() + y_.end,
                  [](double d) { return d != 1.0; });
  if (!variables_scaled) return;
  hessian_scale_.resize(hessian_.size());
  for (std::size_t k = 0; k < hessian_.size(); ++k) {
    hessian_scale_[k] = 1.0 / (col_scale_[at(hessian_[k].row)] * col_scale_[at(hessian_[k].col)]);
  }
}

std::string CanonicalProblem::gradient_based_scaling() {
  // At the model's own point, as in Ipopt. It may lie outside its bounds, where the functions need
  // not be defined; then where the solve starts.
  for (const Index i : model_variable_) {
    if (i >= 0) model_v_[at(i)] = model_start_.v[at(i)];
  }
  new_point_ = true;
  std::string error = scale_gradients();
  if (error.empty()) return {};
  if (!load(start_.v)) {
    return fail(Status::InvalidNumber, "the scaled starting point is not finite");
  }
  return new_point_ ? scale_gradients() : error;
}

std::string CanonicalProblem::scale_gradients() {
  const double largest = options_.nlp_scaling_max_gradient;
  const auto factor = [&](double norm) {
    return norm > largest ? std::max(largest / norm, options_.nlp_scaling_min_value) : 1.0;
  };
  ++counts_.gradient;
  if (!ask([&] { return problem_.gradient(model_v_, take_new_point(), model_gradient_); })) {
    return fail(Status::EvaluationFailed,
                "the gradient of the objective is undefined at the starting point");
  }
  double norm = 0.0;
  for (const Index i : model_variable_) {
    if (i < 0) continue;
    if (!std::isfinite(model_gradient_[at(i)])) {
      return fail(Status::InvalidNumber, "the gradient of the objective in " + variable_name(i) +
                                             " is not finite at the starting point");
    }
    norm = std::max(norm, std::abs(model_gradient_[at(i)]));
  }
  std::vector<double> row_norm(row_scale_.size(), 0.0);
  if (constraints() > 0 && !model_g_.empty()) {
    ++counts_.jacobian;
    if (!ask([&] { return problem_.jacobian(model_v_, take_new_point(), model_jacobian_); })) {
      return fail(Status::EvaluationFailed,
                  "the Jacobian of the constraints is undefined at the starting point");
    }
  }
  for (std::size_t k = 0; k < jacobian_.size(); ++k) {
    const double value = model_jacobian(k);
    if (!std::isfinite(value)) {
      return fail(Status::InvalidNumber, "the Jacobian of " + row_name(jacobian_[k].row) + " in " +
                                             variable_name(model_variable_[at(jacobian_[k].col)]) +
                                             " is not finite at the starting point");
    }
    row_norm[at(jacobian_[k].row)] = std::max(row_norm[at(jacobian_[k].row)], std::abs(value));
  }
  for (double& scale : row_norm) scale = factor(scale);
  gradient_scaling_ = {.objective = factor(norm),
                       .constraints = std::move(row_norm),
                       .largest_gradient = largest,
                       .least_factor = options_.nlp_scaling_min_value};
  return {};
}

void CanonicalProblem::set_bounds(Index variable, double lower, double upper) {
  const double scale = col_scale_[at(variable)];
  const auto relaxed = [&](double bound, double outwards) {
    const double most = options_.constr_viol_tol;
    const double factor = options_.bound_relax_factor;
    const double moved = bound + outwards * std::min(factor * std::max(1.0, std::abs(bound)), most);
    // Rounding must not exceed it: numbers near 1e12 are 1e-4 apart.
    return std::abs(moved - bound) <= most ? moved : std::nextafter(moved, bound);
  };
  if (lower > options_.nlp_lower_bound_inf) lower_[variable] = scale * relaxed(lower, -1.0);
  if (upper < options_.nlp_upper_bound_inf) upper_[variable] = scale * relaxed(upper, 1.0);
}

void CanonicalProblem::set_variable_bounds() {
  lower_.setConstant(variables(), -kInfinity);
  upper_.setConstant(variables(), kInfinity);
  for (Index i = 0; i < variables(); ++i) {
    const Index model = model_variable_[at(i)];
    if (model < 0 || is_fixed_by_constraint(model)) continue;
    set_bounds(i, structure_.variable_lower[at(model)], structure_.variable_upper[at(model)]);
  }
}

void CanonicalProblem::set_constraint_bounds() {
  right_hand_side_.setZero(constraints());
  for (Index j = 0; j < constraints(); ++j) {
    if (const Index i = fixing_variable_[at(j)]; i >= 0) {
      right_hand_side_[j] =
          row_scale_[at(j)] * structure_.variable_lower[at(model_variable_[at(i)])];
      continue;
    }
    const auto model = at(model_constraint_[at(j)]);
    const Index slack = slack_of_constraint_[at(j)];
    if (slack >= 0) {
      set_bounds(slack, structure_.constraint_lower[model], structure_.constraint_upper[model]);
    } else {
      right_hand_side_[j] = row_scale_[at(j)] * structure_.constraint_lower[model];
    }
  }
}

void CanonicalProblem::list_bounds() {
  const Index n = variables();
  room_below_.setZero(n);
  room_above_.setZero(n);
  for (Index i = 0; i < n; ++i) {
    if (lower_[i] > -kInfinity) lower_bounded_.push_back(i);
    if (upper_[i] < kInfinity) upper_bounded_.push_back(i);
  }
  damping_.setZero(n);
  if (options_.minmax_globalization == Globalization::None) return;
  for (Index i = 0; i < n; ++i) {
    const int sides = (lower_[i] > -kInfinity ? 1 : 0) - (upper_[i] < kInfinity ? 1 : 0);
    damping_[i] = sign(i) * sides * options_.kappa_d;
  }
}

void CanonicalProblem::keep_distances(const Iterate& iterate, double mu) {
  constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
  const double least = kEpsilon * std::min(1.0, mu);
  const auto keep = [&](double subtracted, double bound, double multiplier, double& room) {
    const double size = std::max(1.0, std::abs(bound));
    const double distance = subtracted + room;
    // Once moved, a bound follows mu down as long as the iterate cannot be told from it.
    const bool lost = distance < least || (room > 0.0 && subtracted <= kEpsilon * size);
    if (!lost) return;
    const double most = std::min(kSlackMove * size, 1e-2 * options_.constr_viol_tol);
    const double wanted = std::max(mu / multiplier, least);
    room = std::clamp(room + (wanted - distance), 0.0, most);
  };
  for (const Index i : lower_bounded_) {
    keep(iterate.v[i] - lower_[i], lower_[i], iterate.z_lower[i], room_below_[i]);
  }
  for (const Index i : upper_bounded_) {
    keep(upper_[i] - iterate.v[i], upper_[i], iterate.z_upper[i], room_above_[i]);
  }
}

bool CanonicalProblem::take_new_point() { return std::exchange(new_point_, false); }

bool CanonicalProblem::load(const Eigen::VectorXd& v) {
  Index bad = -1;
  const auto copy = [&](IndexRange range) {
    for (Index i = range.begin; i < range.end; ++i) {
      const double value = v[i] / col_scale_[at(i)];
      if (!std::isfinite(value)) bad = i;
      double& target = model_v_[at(model_variable_[at(i)])];
      if (target != value) {
        target = value;
        new_point_ = true;
      }
    }
  };
  copy(x_);
  copy(y_);
  if (bad >= 0) evaluation_failure_ = {.function = "the point tried", .col = bad};
  return bad < 0;
}

std::string CanonicalProblem::evaluation_error() const {
  const EvaluationFailure& failure = evaluation_failure_;
  std::string text(failure.function);
  if (failure.status == EvaluationStatus::Undefined) return text + " is undefined";
  const auto name = [&](Index variable) { return variable_name(model_variable_[at(variable)]); };
  if (failure.row >= 0 && failure.col >= 0) text += " of " + row_name(failure.row);
  text += " is NaN or infinite";
  if (failure.col >= 0) {
    text += " in " + name(failure.col);
  } else if (failure.row >= 0) {
    text += " in " + row_name(failure.row);
  }
  if (failure.other_col >= 0) text += " and " + name(failure.other_col);
  return text;
}

void CanonicalProblem::start_slacks(Iterate& start, const Eigen::VectorXd& c) const {
  // With the slacks at zero, c holds g; push it inside the slack's bounds.
  const bool warm = options_.warm_start_init_point;
  for (Index j = 0; j < constraints(); ++j) {
    const Index slack = slack_of_constraint_[at(j)];
    if (slack < 0) continue;
    start.v[slack] =
        push_inside(c[j], lower_[slack], upper_[slack],
                    warm ? options_.warm_start_slack_bound_push : options_.slack_bound_push,
                    warm ? options_.warm_start_slack_bound_frac : options_.slack_bound_frac);
  }
}

EvaluationStatus CanonicalProblem::objective(const Eigen::VectorXd& v, double& f) {
  const ScopedTimer timer(timing_.evaluations);
  if (!load(v)) return EvaluationStatus::Undefined;
  return objective_here(f);
}

EvaluationStatus CanonicalProblem::constraints(const Eigen::VectorXd& v, Eigen::VectorXd& c) {
  const ScopedTimer timer(timing_.evaluations);
  if (!load(v)) return EvaluationStatus::Undefined;
  return constraints_here(v, c);
}

EvaluationStatus CanonicalProblem::values(const Eigen::VectorXd& v, double& f, Eigen::VectorXd& c) {
  const ScopedTimer timer(timing_.evaluations);
  if (!load(v)) return EvaluationStatus::Undefined;
  const EvaluationStatus status = objective_here(f);
  return status == EvaluationStatus::Ok ? constraints_here(v, c) : status;
}

EvaluationStatus CanonicalProblem::first_derivatives(const Eigen::VectorXd& v,
                                                     Evaluation& evaluation) {
  const ScopedTimer timer(timing_.evaluations);
  if (!load(v)) return EvaluationStatus::Undefined;
  return first_derivatives_here(evaluation);
}

EvaluationStatus CanonicalProblem::second_derivatives(const Eigen::VectorXd& v,
                                                      const Eigen::VectorXd& lambda,
                                                      Evaluation& evaluation,
                                                      double objective_factor) {
  const ScopedTimer timer(timing_.evaluations);
  if (!load(v)) return EvaluationStatus::Undefined;
  return second_derivatives_here(lambda, evaluation, objective_factor);
}

EvaluationStatus CanonicalProblem::derivatives(const Eigen::VectorXd& v,
                                               const Eigen::VectorXd& lambda,
                                               Evaluation& evaluation) {
  const ScopedTimer timer(timing_.evaluations);
  if (!load(v)) return EvaluationStatus::Undefined;
  const EvaluationStatus status = first_derivatives_here(evaluation);
  return status == EvaluationStatus::Ok ? second_derivatives_here(lambda, evaluation, 1.0) : status;
}

EvaluationStatus CanonicalProblem::objective_here(double& f) {
  ++counts_.objective;
  double value = 0.0;
  if (!ask([&] { return problem_.objective(model_v_, take_new_point(), value); }))
    return undefined("the objective");
  if (!std::isfinite(value)) return not_finite({.function = "the objective"});
  objective_point_ = model_v_;
  objective_value_ = value;
  f = objective_scale_ * value;
  return EvaluationStatus::Ok;
}

EvaluationStatus CanonicalProblem::constraints_here(const Eigen::VectorXd& v, Eigen::VectorXd& c) {
  if (constraints() == 0) return EvaluationStatus::Ok;
  if (!model_g_.empty()) {  // else all rows fix a variable
    ++counts_.constraints;
    constraints_point_.clear();
    if (!ask([&] { return problem_.constraints(model_v_, take_new_point(), model_g_); })) {
      return undefined("the vector of constraints");
    }
  }
  for (Index j = 0; j < constraints(); ++j) {
    const Index fixed = fixing_variable_[at(j)];
    const double value =
        fixed >= 0 ? v[fixed] / col_scale_[at(fixed)] : model_g_[at(model_constraint_[at(j)])];
    if (!std::isfinite(value)) return not_finite({.function = "the constraint function", .row = j});
    const Index slack = slack_of_constraint_[at(j)];
    c[j] = row_scale_[at(j)] * value - (slack >= 0 ? v[slack] : right_hand_side_[j]);
  }
  if (!model_g_.empty()) {
    constraints_point_ = model_v_;
    constraint_values_ = model_g_;
  }
  return EvaluationStatus::Ok;
}

EvaluationStatus CanonicalProblem::first_derivatives_here(Evaluation& evaluation) {
  evaluation.jacobian_call = 0;
  ++counts_.gradient;
  if (!ask([&] { return problem_.gradient(model_v_, take_new_point(), model_gradient_); })) {
    return undefined("the gradient of the objective");
  }
  for (Index i = 0; i < variables(); ++i) {
    const Index model = model_variable_[at(i)];
    if (model < 0) {
      evaluation.gradient[i] = 0.0;
      continue;
    }
    const double value = model_gradient_[at(model)];
    if (!std::isfinite(value)) {
      return not_finite({.function = "the gradient of the objective", .col = i});
    }
    evaluation.gradient[i] = objective_scale_ * value / col_scale_[at(i)];
  }
  if (constraints() == 0) {
    evaluation.jacobian_call = ++derivative_calls_;
    return EvaluationStatus::Ok;
  }
  if (!model_g_.empty()) {
    ++counts_.jacobian;
    if (!ask([&] { return problem_.jacobian(model_v_, take_new_point(), model_jacobian_); })) {
      return undefined("the Jacobian of the constraints");
    }
  }
  for (std::size_t k = 0; k < jacobian_.size(); ++k) {
    const double value = model_jacobian(k);
    if (!std::isfinite(value)) {
      return not_finite(
          {.function = "the Jacobian", .row = jacobian_[k].row, .col = jacobian_[k].col});
    }
    evaluation.jacobian[k] = jacobian_scale_[k] * value;
  }
  evaluation.jacobian_call = ++derivative_calls_;
  return EvaluationStatus::Ok;
}

EvaluationStatus CanonicalProblem::second_derivatives_here(const Eigen::VectorXd& lambda,
                                                           Evaluation& evaluation,
                                                           double objective_factor) {
  evaluation.hessian_call = 0;
  if (!load_multipliers(lambda)) return EvaluationStatus::Undefined;
  ++counts_.hessian;
  if (!ask([&] {
        return problem_.hessian(model_v_, take_new_point(), objective_factor * objective_scale_,
                                model_lambda_, true, model_hessian_);
      })) {
    return undefined("the Hessian of the Lagrangian");
  }
  for (std::size_t k = 0; k < hessian_.size(); ++k) {
    const double value = model_hessian_[at(hessian_source_[k])];
    if (!std::isfinite(value)) {
      return not_finite({.function = "the Hessian of the Lagrangian",
                         .col = hessian_[k].row,
                         .other_col = hessian_[k].col});
    }
    evaluation.hessian[k] = hessian_scale_.empty() ? value : hessian_scale_[k] * value;
  }
  evaluation.hessian_call = ++derivative_calls_;
  return EvaluationStatus::Ok;
}

bool CanonicalProblem::load_multipliers(const Eigen::VectorXd& lambda) {
  Index bad = -1;
  for (Index j = 0; j < constraints(); ++j) {
    const Index model = model_constraint_[at(j)];
    if (model < 0) continue;
    model_lambda_[at(model)] = row_scale_[at(j)] * lambda[j];
    if (!std::isfinite(model_lambda_[at(model)])) bad = j;
  }
  if (bad >= 0) evaluation_failure_ = {.function = "the multiplier", .row = bad};
  return bad < 0;
}

std::optional<Eigen::VectorXd> CanonicalProblem::hessian_error(const Eigen::VectorXd& v,
                                                               const Eigen::VectorXd& lambda) {
  const ScopedTimer timer(timing_.evaluations);
  std::vector<double> rows(model_v_.size(), 0.0);
  if (!load(v) || !load_multipliers(lambda)) {
    return Eigen::VectorXd::Constant(variables(), kInfinity);
  }
  if (!ask([&] {
        return problem_.hessian_errors(model_v_, objective_scale_, model_lambda_, rows);
      })) {
    return std::nullopt;
  }
  // |d'Ed| <= sum |E_ij| (d_i^2 + d_j^2)/2: the row sums of |E| bound E, and scale as its diagonal.
  Eigen::VectorXd error = Eigen::VectorXd::Zero(variables());
  for (Index i = 0; i < variables(); ++i) {
    if (const Index model = model_variable_[at(i)]; model >= 0) {
      error[i] = rows[at(model)] / (col_scale_[at(i)] * col_scale_[at(i)]);
    }
  }
  return error;
}

void CanonicalProblem::restore(const Iterate& iterate, Result& result) {
  const ProblemStructure& s = structure_;
  const bool finite = load(iterate.v);
  result.v = model_v_;
  result.lambda.assign(s.constraint_players.size(), 0.0);
  result.z_lower.assign(s.variable_players.size(), 0.0);
  result.z_upper.assign(s.variable_players.size(), 0.0);
  for (Index i = 0; i < variables(); ++i) {
    const Index model = model_variable_[at(i)];
    if (model < 0) continue;
    const double factor = sign(i) * col_scale_[at(i)] / objective_scale_;
    result.z_lower[at(model)] = factor * iterate.z_lower[i];
    result.z_upper[at(model)] = factor * iterate.z_upper[i];
    if (options_.honor_original_bounds) {
      result.v[at(model)] =
          std::clamp(result.v[at(model)], s.variable_lower[at(model)], s.variable_upper[at(model)]);
    }
  }
  for (Index j = 0; j < constraints(); ++j) {
    const double value = iterate.lambda[j] * row_scale_[at(j)] / objective_scale_;
    if (const Index fixed = fixing_variable_[at(j)]; fixed >= 0) {
      set_fixed_multiplier(model_variable_[at(fixed)], -value, result);
    } else {
      result.lambda[at(model_constraint_[at(j)])] = value;
    }
  }
  if (finite) restore_fixed_multipliers(result);
  restore_values(finite, result);
}

void CanonicalProblem::restore_values(bool finite, Result& result) {
  constexpr double kUndefined = std::numeric_limits<double>::quiet_NaN();
  bool new_point = true;
  result.objective = kUndefined;
  if (result.v == objective_point_) {
    result.objective = objective_value_;
  } else if (finite) {
    ++counts_.objective;
    if (!ask([&] {
          return problem_.objective(result.v, std::exchange(new_point, false), result.objective);
        })) {
      result.objective = kUndefined;
    }
  }
  result.constraints.assign(structure_.constraint_players.size(), kUndefined);
  if (result.constraints.empty()) return;
  if (result.v == constraints_point_) {
    result.constraints = constraint_values_;
  } else if (finite) {
    ++counts_.constraints;
    if (!ask([&] { return problem_.constraints(result.v, new_point, result.constraints); })) {
      std::ranges::fill(result.constraints, kUndefined);
    }
  }
  new_point_ = true;
}

std::optional<Index> CanonicalProblem::violated_constant_constraint() const {
  if (constraint_values_.empty()) return std::nullopt;
  std::vector<bool> varies(constraint_values_.size(), false);
  for (const Triplet& entry : structure_.jacobian) {
    if (variable_of_model_[at(entry.col)] >= 0) varies[at(entry.row)] = true;
  }
  for (std::size_t j = 0; j < varies.size(); ++j) {
    if (varies[j] || constraint_of_model_[j] < 0) continue;
    const double tolerance = options_.constr_viol_tol;
    if (structure_.constraint_lower[j] - constraint_values_[j] > tolerance ||
        constraint_values_[j] - structure_.constraint_upper[j] > tolerance) {
      return static_cast<Index>(j);
    }
  }
  return std::nullopt;
}

double CanonicalProblem::violation(const Result& result) const {
  const ProblemStructure& s = structure_;
  double most = 0.0;
  const auto measure = [&](double value, double lower, double upper) {
    if (lower > options_.nlp_lower_bound_inf || upper < options_.nlp_upper_bound_inf) {
      most = largest(most, largest(lower - value, value - upper));
    }
  };
  for (std::size_t i = 0; i < s.variable_players.size(); ++i) {
    measure(result.v[i], s.variable_lower[i], s.variable_upper[i]);
  }
  for (std::size_t j = 0; j < s.constraint_players.size(); ++j) {
    measure(result.constraints[j], s.constraint_lower[j], s.constraint_upper[j]);
  }
  return most;
}

void CanonicalProblem::restore_fixed_multipliers(Result& result) {
  // A fixed variable's bounds balance grad f + J' lambda.
  if (options_.fixed_variable_treatment == FixedVariableTreatment::MakeParameterNodual) return;
  const bool any_fixed = std::any_of(variable_of_model_.begin(), variable_of_model_.end(),
                                     [](Index i) { return i < 0; });
  if (!any_fixed) return;
  ++counts_.gradient;
  if (!ask([&] { return problem_.gradient(result.v, true, model_gradient_); })) return;
  counts_.jacobian += model_jacobian_.empty() ? 0 : 1;
  if (!model_jacobian_.empty() &&
      !ask([&] { return problem_.jacobian(result.v, false, model_jacobian_); }))
    return;
  for (std::size_t k = 0; k < structure_.jacobian.size(); ++k) {
    const auto [row, col] = structure_.jacobian[k];
    model_gradient_[at(col)] += model_jacobian_[k] * result.lambda[at(row)];
  }
  for (std::size_t i = 0; i < variable_of_model_.size(); ++i) {
    // Where the derivative does not exist there is no multiplier.
    if (variable_of_model_[i] >= 0 || !std::isfinite(model_gradient_[i])) continue;
    set_fixed_multiplier(static_cast<Index>(i), model_gradient_[i], result);
  }
}

void CanonicalProblem::set_fixed_multiplier(Index model_variable, double slope,
                                            Result& result) const {
  // z_L - z_U = slope, on the side that gives the owner's sign.
  const auto i = at(model_variable);
  const double sign = structure_.variable_players[i] == Player::Max ? -1.0 : 1.0;
  result.z_lower[i] = sign * std::max(sign * slope, 0.0);
  result.z_upper[i] = sign * std::max(-sign * slope, 0.0);
}

}  // namespace ipminmax
