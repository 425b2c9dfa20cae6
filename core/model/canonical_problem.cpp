#include "core/model/canonical_problem.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/model/budget.hpp"
#include "core/model/indices.hpp"
#include "core/model/structure_check.hpp"
#include "linalg/numbers.hpp"

// How it is made: map, starting point, scaling, bounds.

namespace ipminmax {

namespace {

/// kappa_d leaves kappa_d mu in the dual residual. Where mu ends at mu_target > 0, that is an error
/// of the answer: a tenth of tol at most.
double damping_factor(const SolverOptions& options) {
  if (!(options.mu_target > 0.0)) return options.kappa_d;
  return std::min(options.kappa_d, 0.1 * options.tol / options.mu_target);
}

/// First entry that is NaN or infinite, -1 when there is none.
Index first_not_finite(std::span<const double> values) {
  for (const auto i : indices(values)) {
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
                                   Timing& timing, CanonicalArrays* arrays)
    : Kept(arrays),
      problem_(problem),
      structure_(problem.structure()),
      options_(options),
      counts_(counts),
      timing_(timing) {}

std::string CanonicalProblem::variable_name(Index i) const {
  return ipminmax::variable_name(structure_, i);
}

std::string CanonicalProblem::constraint_name(Index i) const {
  return ipminmax::constraint_name(structure_, i);
}

std::string CanonicalProblem::fail(Status status, std::string message) {
  error_status_ = status;
  return message;
}

std::string CanonicalProblem::build(const GradientScaling* kept, SolveLimit* limit) {
  const auto is_late = [&] { return limit != nullptr && limit->expired(); };
  const auto late = [&] { return fail(*limit->exceeded(), "the time limit passed"); };
  if (auto error = check_structure(structure_, options_); !error.empty()) return error;
  if (is_late()) return late();
  if (auto error = map_.build(structure_, options_); !error.empty()) {
    return fail(Status::TooFewDegreesOfFreedom, std::move(error));
  }
  if (is_late()) return late();
  make_buffers();
  if (auto error = read_start(); !error.empty()) return error;
  return is_late() ? late() : scale(kept);
}

std::string CanonicalProblem::row_name(Index constraint) const {
  const Index model = model_constraint(constraint);
  if (model >= 0) return constraint_name(model);
  return "fixed " + variable_name(model_variable(map_.fixing_variable[constraint]));
}

void CanonicalProblem::make_buffers() {
  model_v_.assign(structure_.variable_players.size(), 0.0);
  for (const auto i : indices(model_v_)) {
    if (map_.variable_of_model[i] < 0) model_v_[i] = structure_.variable_lower[i];
  }
  model_g_.assign(structure_.constraint_players.size(), 0.0);
  model_lambda_.assign(structure_.constraint_players.size(), 0.0);
  model_gradient_.assign(structure_.variable_players.size(), 0.0);
  model_jacobian_.assign(structure_.jacobian.size(), 0.0);
  model_hessian_.assign(structure_.hessian.size(), 0.0);
  objective_point_.clear();
  constraints_point_.clear();
  constraint_values_.clear();
}

std::string CanonicalProblem::scale(const GradientScaling* kept) {
  if (options_.nlp_scaling_method == Scaling::User) {
    if (auto error = user_scaling(); !error.empty()) return error;
  } else {
    scale_variables();
  }
  set_variable_bounds();
  push_start();
  if (options_.nlp_scaling_method == Scaling::GradientBased) {
    const bool fits = kept != nullptr &&
                      kept->largest_gradient == options_.nlp_scaling_max_gradient &&
                      kept->least_factor == options_.nlp_scaling_min_value &&
                      kept->constraints.size() == row_scale_.size();
    if (!fits) {
      if (auto error = gradient_based_scaling(); !error.empty()) return error;
      kept = &gradient_scaling_;
    }
    objective_scale_ *= kept->objective;
    row_scale_ = kept->constraints;
  }

  // Slacks are measured as their constraints.
  for (const auto j : indices(map_.slack_of_constraint)) {
    if (map_.slack_of_constraint[j] >= 0) col_scale_[map_.slack_of_constraint[j]] = row_scale_[j];
  }
  set_constraint_bounds();
  list_bounds();
  if (options_.warm_start_init_point) start_multipliers();
  scale_entries();
  begin_quasi_newton();
  return {};
}

void CanonicalProblem::begin_quasi_newton() {
  quasi_newton_.reset();
  if (options_.hessian_approximation != HessianApproximation::LimitedMemory || max_size() > 0)
    return;
  std::vector<Index> nonlinear;
  if (structure_.nonlinear_variables) {
    for (const Index model : *structure_.nonlinear_variables) {
      const bool exists = model >= 0 && at(model) < map_.variable_of_model.size();
      const Index i = exists ? map_.variable_of_model[model] : -1;
      if (i >= 0 && !std::ranges::count(nonlinear, i)) nonlinear.push_back(i);
    }
  } else {
    for (const Index i : indices(x())) nonlinear.push_back(i);
  }
  quasi_newton_.emplace(variables(), std::move(nonlinear));
}

void CanonicalProblem::set_bounds(Index variable, double lower, double upper) {
  const double scale = variable_scale(variable);
  const auto relaxed = [&](double bound, double outwards) {
    const double most = options_.constr_viol_tol;
    const double moved = bound + outwards * relaxation(bound, upper - lower, options_);
    // Rounding must not exceed it: numbers near 1e12 are 1e-4 apart.
    return std::abs(moved - bound) <= most ? moved : std::nextafter(moved, bound);
  };
  if (lower > options_.nlp_lower_bound_inf) lower_[variable] = scale * relaxed(lower, -1.0);
  if (upper < options_.nlp_upper_bound_inf) upper_[variable] = scale * relaxed(upper, 1.0);
}

void CanonicalProblem::set_variable_bounds() {
  lower_.setConstant(variables(), -kInfinity);
  upper_.setConstant(variables(), kInfinity);
  for_each_of_model(map_.model_variable, [&](Index i, std::size_t model) {
    if (is_fixed_by_constraint(structure_, options_, model_variable(i))) return;
    set_bounds(i, structure_.variable_lower[model], structure_.variable_upper[model]);
  });
}

void CanonicalProblem::set_constraint_bounds() {
  right_hand_side_.setZero(constraints());
  for (Index j = 0; j < constraints(); ++j) {
    if (const Index i = map_.fixing_variable[j]; i >= 0) {
      right_hand_side_[j] = constraint_scale(j) * structure_.variable_lower[at(model_variable(i))];
      continue;
    }
    const auto model = at(model_constraint(j));
    const Index slack = slack_of(j);
    if (slack >= 0) {
      set_bounds(slack, structure_.constraint_lower[model], structure_.constraint_upper[model]);
    } else {
      right_hand_side_[j] = constraint_scale(j) * structure_.constraint_lower[model];
    }
  }
}

void CanonicalProblem::list_bounds() {
  const Index n = variables();
  room_below_.setZero(n);
  room_above_.setZero(n);
  lower_bounded_.clear();
  upper_bounded_.clear();
  for (Index i = 0; i < n; ++i) {
    if (lower_[i] > -kInfinity) lower_bounded_.push_back(i);
    if (upper_[i] < kInfinity) upper_bounded_.push_back(i);
  }
  // A robust constraint with two bounds has two sides, and its multiplier no sign.
  RowOwners& owners = map_.owners;
  const auto is_two_sided = [&](Index slack) {
    return slack >= 0 && lower_[slack] > -kInfinity && upper_[slack] < kInfinity;
  };
  std::ranges::replace_if(owners.slack_of_variable, is_two_sided, -1);
  std::ranges::replace_if(owners.slack_of_constraint, is_two_sided, -1);
  std::erase_if(owners.shared_entries,
                [&](const auto& entry) { return owners.slack_of_constraint[entry.serving] < 0; });
  std::erase_if(owners.own_entries, [&](std::size_t entry) {
    return owners.slack_of_variable[map_.jacobian[entry].col] < 0;
  });
  for (const auto i : indices(owners.is_served)) {
    owners.is_served[i] = owners.is_served[i] && !is_two_sided(static_cast<Index>(i));
  }
  damping_.setZero(n);
  if (options_.minmax_globalization == Globalization::None) return;
  const double factor = damping_factor(options_);
  for (Index i = 0; i < n; ++i) {
    const int sides = (lower_[i] > -kInfinity ? 1 : 0) - (upper_[i] < kInfinity ? 1 : 0);
    damping_[i] = sign(i) * sides * factor;
  }
}

void CanonicalProblem::keep_distances(const Iterate& iterate, double mu) {
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
    keep(iterate.v[i] - lower_[i], lower_[i], iterate.z_lower[i] / weight(i, iterate),
         room_below_[i]);
  }
  for (const Index i : upper_bounded_) {
    keep(upper_[i] - iterate.v[i], upper_[i], iterate.z_upper[i] / weight(i, iterate),
         room_above_[i]);
  }
}

// The starting point.

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
  for (const Index j : map_.model_constraint) {
    if (j >= 0 && !std::isfinite(model_start_.lambda[j])) {
      return refuse("multiplier of " + constraint_name(j));
    }
  }
  for (const Index i : map_.model_variable) {
    if (i < 0) continue;
    if (structure_.variable_lower[at(i)] > options_.nlp_lower_bound_inf &&
        !std::isfinite(model_start_.z_lower[i])) {
      return refuse("multiplier of the lower bound of " + variable_name(i));
    }
    if (structure_.variable_upper[at(i)] < options_.nlp_upper_bound_inf &&
        !std::isfinite(model_start_.z_upper[i])) {
      return refuse("multiplier of the upper bound of " + variable_name(i));
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
  for_each_of_model(map_.model_variable, [&](Index i, std::size_t model) {
    start_.v[i] = push_inside(model_start_.v[model] * variable_scale(i), lower_[i], upper_[i],
                              warm ? options_.warm_start_bound_push : options_.bound_push,
                              warm ? options_.warm_start_bound_frac : options_.bound_frac);
  });
}

void CanonicalProblem::start_multipliers() {
  // Signs of Result, so those of a Max variable's bounds are <= 0.
  const double largest = options_.warm_start_mult_init_max;
  const auto take = [&](const auto& bounded, const Array<double>& given, Eigen::VectorXd& z) {
    for (const Index i : bounded) {
      const Index model = model_variable(i);
      if (model >= 0) z[i] = given[at(model)] * sign(i) * objective_scale_ / variable_scale(i);
    }
  };
  take(lower_bounded_, model_start_.z_lower, start_.z_lower);
  take(upper_bounded_, model_start_.z_upper, start_.z_upper);
  for (Index j = 0; j < constraints(); ++j) {
    const Index model = model_constraint(j);
    double value = 0.0;
    if (model >= 0) {
      value = model_start_.lambda[model];
    } else {  // -z_L + z_U and the multiplier of v = value stand for each other
      const auto i = at(model_variable(map_.fixing_variable[j]));
      value = model_start_.z_upper[i] - model_start_.z_lower[i];
    }
    start_.lambda[j] =
        std::clamp(value * objective_scale_ / constraint_scale(j), -largest, largest);
    // A slack's stationarity: -lambda + sign (-z_lower + z_upper) = 0.
    if (const Index slack = slack_of(j); slack >= 0) {
      start_.z_lower[slack] = std::max(-sign(slack) * start_.lambda[j], 0.0);
      start_.z_upper[slack] = std::max(sign(slack) * start_.lambda[j], 0.0);
    }
  }
}

void CanonicalProblem::start_slacks(Iterate& start, const Eigen::VectorXd& c) const {
  // With the slacks at zero, c holds g; push it inside the slack's bounds.
  const bool warm = options_.warm_start_init_point;
  const double push = warm ? options_.warm_start_slack_bound_push : options_.slack_bound_push;
  const double fraction = warm ? options_.warm_start_slack_bound_frac : options_.slack_bound_frac;
  for (Index j = 0; j < constraints(); ++j) {
    const Index slack = slack_of(j);
    if (slack < 0) continue;
    // Where nothing is left to choose, a slack is what it is.
    start.v[slack] =
        push_inside(c[j], lower_[slack], upper_[slack], is_constant() ? 0.0 : push, fraction);
  }
}

// Scaling factors of objective, constraints and variables.

std::string CanonicalProblem::user_scaling() {
  UserScaling scaling;
  if (!ask([&] { return problem_.user_scaling(scaling); })) return {};
  const auto error_of = [](const std::string& of_what, double factor) {
    return "the model's scaling factor of " + of_what + " is " + number_text(factor) +
           ", not in [" + number_text(kLeastScaling) + ", " + number_text(kLargestScaling) + "]";
  };
  if (!is_sane_scaling(std::abs(scaling.objective))) {
    return error_of("the objective", scaling.objective);
  }
  const auto fits = [](const std::vector<double>& factors, std::size_t size) {
    return factors.empty() || factors.size() == size;
  };
  if (!fits(scaling.variables, map_.variable_of_model.size()) ||
      !fits(scaling.constraints, map_.constraint_of_model.size())) {
    return "the model's scaling factors do not have one entry per variable and constraint";
  }
  objective_scale_ *= scaling.objective;
  for (const auto i : indices(scaling.variables)) {
    if (!is_sane_scaling(scaling.variables[i])) {
      return error_of(variable_name(static_cast<Index>(i)), scaling.variables[i]);
    }
    // Anywhere between its bounds would meet the tolerances.
    const double width = structure_.variable_upper[i] - structure_.variable_lower[i];
    if (width > 0.0 && scaling.variables[i] * width < options_.tol) {
      return "the model's scaling factor of " + variable_name(static_cast<Index>(i)) + " is " +
             number_text(scaling.variables[i]) + ": times the " + number_text(width) +
             " between its bounds it is below tol";
    }
    if (map_.variable_of_model[i] >= 0)
      col_scale_[map_.variable_of_model[i]] = scaling.variables[i];
  }
  for (const auto j : indices(scaling.constraints)) {
    if (!is_sane_scaling(scaling.constraints[j])) {
      return error_of(constraint_name(static_cast<Index>(j)), scaling.constraints[j]);
    }
    if (map_.constraint_of_model[j] >= 0) {
      row_scale_[map_.constraint_of_model[j]] = scaling.constraints[j];
    }
  }
  return {};
}

void CanonicalProblem::scale_variables() {
  for (const auto i : indices(structure_.variable_units)) {
    const Index variable = map_.variable_of_model[i];
    if (variable >= 0) col_scale_[variable] = 1.0 / structure_.variable_units[i];
  }
}

void CanonicalProblem::scale_entries() {
  jacobian_scale_.resize(map_.jacobian.size());
  for (const auto k : indices(map_.jacobian)) {
    jacobian_scale_[k] =
        constraint_scale(map_.jacobian[k].row) / variable_scale(map_.jacobian[k].col);
  }
  const bool variables_scaled =
      std::any_of(col_scale_.begin(), col_scale_.begin() + map_.x.end,
                  [](double d) { return d != 1.0; }) ||
      std::any_of(col_scale_.begin() + map_.y.begin, col_scale_.begin() + map_.y.end,
                  [](double d) { return d != 1.0; });
  hessian_scale_.clear();
  if (!variables_scaled) return;
  hessian_scale_.resize(map_.hessian.size());
  for (const auto k : indices(map_.hessian)) {
    hessian_scale_[k] =
        1.0 / (variable_scale(map_.hessian[k].row) * variable_scale(map_.hessian[k].col));
  }
}

std::string CanonicalProblem::gradient_based_scaling() {
  // At the model's own point, as in Ipopt. It may lie outside its bounds, where the functions need
  // not be defined; then where the solve starts.
  for (const Index i : map_.model_variable) {
    if (i >= 0) model_v_[i] = model_start_.v[i];
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
    if (!(norm > largest)) return 1.0;
    return std::max({largest / norm, options_.nlp_scaling_min_value, kLeastScaling});
  };
  ++counts_.gradient;
  if (!ask([&] { return problem_.gradient(model_v_, take_new_point(), model_gradient_); })) {
    return fail(Status::EvaluationFailed,
                "the gradient of the objective is undefined at the starting point");
  }
  double norm = 0.0;
  for (const Index i : map_.model_variable) {
    if (i < 0) continue;
    if (!std::isfinite(model_gradient_[i])) {
      return fail(Status::InvalidNumber, "the gradient of the objective in " + variable_name(i) +
                                             " is not finite at the starting point");
    }
    const double scale = variable_scale(map_.variable_of_model[i]);
    norm = std::max(norm, std::abs(model_gradient_[i]) / scale);
  }
  Array<double>& row_norm = gradient_scaling_.constraints;
  row_norm.assign(row_scale_.size(), 0.0);
  if (constraints() > 0 && !model_g_.empty()) {
    ++counts_.jacobian;
    if (!ask([&] { return problem_.jacobian(model_v_, take_new_point(), model_jacobian_); })) {
      return fail(Status::EvaluationFailed, undefined_function("the Jacobian of the constraints") +
                                                " is undefined at the starting point");
    }
  }
  for (const auto k : indices(map_.jacobian)) {
    const double value = model_jacobian(k);
    if (!std::isfinite(value)) {
      return fail(Status::InvalidNumber, "the Jacobian of " + row_name(map_.jacobian[k].row) +
                                             " in " +
                                             variable_name(model_variable(map_.jacobian[k].col)) +
                                             " is not finite at the starting point");
    }
    row_norm[map_.jacobian[k].row] = std::max(
        row_norm[map_.jacobian[k].row], std::abs(value) / variable_scale(map_.jacobian[k].col));
  }
  for (double& scale : row_norm) scale = factor(scale);
  gradient_scaling_.objective = factor(norm);
  gradient_scaling_.largest_gradient = largest;
  gradient_scaling_.least_factor = options_.nlp_scaling_min_value;
  makes_scaling_ = true;
  return {};
}

}  // namespace ipminmax
