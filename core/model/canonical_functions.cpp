#include "core/model/canonical_problem.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "core/model/budget.hpp"
#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "linalg/numbers.hpp"

// What it is asked for: the model's functions in canonical form, and points in the model's units.

namespace ipminmax {

namespace {

constexpr double kLargest = std::numeric_limits<double>::max();
constexpr std::string_view kConstraints = "the vector of constraints";
constexpr std::string_view kJacobian = "the Jacobian of the constraints";

}  // namespace

bool CanonicalProblem::take_new_point() { return std::exchange(new_point_, false); }

bool CanonicalProblem::load(const Eigen::VectorXd& v) {
  Index bad = -1;
  const auto copy = [&](IndexRange range) {
    for (const Index i : indices(range)) {
      const double value = v[i] / variable_scale(i);
      if (!std::isfinite(value)) bad = i;
      double& target = model_v_[model_variable(i)];
      if (target != value) {
        target = value;
        new_point_ = true;
      }
    }
  };
  copy(map_.x);
  copy(map_.y);
  return bad < 0 ||
         fails({.function = "the point tried", .status = Status::EvaluationFailed, .col = bad});
}

std::string CanonicalProblem::undefined_function(std::string_view function) {
  constexpr std::size_t kMostRows = 1000;
  const bool of_jacobian = function == kJacobian;
  const std::size_t m = model_g_.size();
  std::string text(function);
  if ((!of_jacobian && function != kConstraints) || m > kMostRows) return text;
  Index first = -1;
  std::size_t undefined = 0;
  for (Index row = 0; row < static_cast<Index>(m); ++row) {
    const std::span one(&row, 1);
    ++(of_jacobian ? counts_.jacobian : counts_.constraints);
    const bool defined = ask([&] {
      return of_jacobian ? problem_.jacobian_rows(one, model_v_, true, model_jacobian_)
                         : problem_.constraint_rows(one, model_v_, true, model_g_);
    });
    if (defined) continue;
    if (undefined++ == 0) first = row;
  }
  // Where single rows are not evaluated all are undefined.
  if (undefined == 0 || (undefined == m && m > 1)) return text;
  return (of_jacobian ? "the Jacobian of " : "") + constraint_name(first);
}

std::string CanonicalProblem::evaluation_error() {
  const EvaluationFailure& failure = evaluation_failure_;
  std::string text(failure.function);
  if (failure.status == Status::EvaluationFailed && failure.row < 0 && failure.col < 0)
    return undefined_function(failure.function) + " is undefined";
  const auto name = [&](Index variable) { return variable_name(model_variable(variable)); };
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

bool CanonicalProblem::objective(const Eigen::VectorXd& v, double& f) {
  const ScopedTimer timer(timing_.evaluations);
  if (!load(v)) return false;
  ++counts_.objective;
  double value = 0.0;
  if (!ask([&] { return problem_.objective(model_v_, take_new_point(), value); }))
    return undefined("the objective");
  if (!std::isfinite(value)) return fails({.function = "the objective"});
  objective_point_ = model_v_;
  objective_value_ = value;
  f = objective_scale_ * value;
  return true;
}

bool CanonicalProblem::constraints(const Eigen::VectorXd& v, Eigen::VectorXd& c) {
  const ScopedTimer timer(timing_.evaluations);
  if (!load(v)) return false;
  if (constraints() == 0) return true;
  if (!model_g_.empty()) {  // else all rows fix a variable
    ++counts_.constraints;
    constraints_point_.clear();
    if (!ask([&] { return problem_.constraints(model_v_, take_new_point(), model_g_); })) {
      return undefined(kConstraints);
    }
  }
  for (Index j = 0; j < constraints(); ++j) {
    const Index fixed = map_.fixing_variable[j];
    const double value =
        fixed >= 0 ? v[fixed] / variable_scale(fixed) : model_g_[model_constraint(j)];
    if (!std::isfinite(value)) return fails({.function = "the constraint function", .row = j});
    const Index slack = slack_of(j);
    c[j] = constraint_scale(j) * value - (slack >= 0 ? v[slack] : right_hand_side_[j]);
  }
  if (!model_g_.empty()) {
    constraints_point_ = model_v_;
    constraint_values_ = model_g_;
  }
  return true;
}

bool CanonicalProblem::values(const Eigen::VectorXd& v, double& f, Eigen::VectorXd& c) {
  return objective(v, f) && constraints(v, c);
}

bool CanonicalProblem::first_derivatives(const Eigen::VectorXd& v, Evaluation& evaluation) {
  const ScopedTimer timer(timing_.evaluations);
  if (!load(v)) return false;
  evaluation.jacobian_call = 0;
  ++counts_.gradient;
  if (!ask([&] { return problem_.gradient(model_v_, take_new_point(), model_gradient_); })) {
    return undefined("the gradient of the objective");
  }
  for (Index i = 0; i < variables(); ++i) {
    const Index model = model_variable(i);
    if (model < 0) {
      evaluation.gradient[i] = 0.0;
      continue;
    }
    const double value = model_gradient_[model];
    if (!std::isfinite(value)) {
      return fails({.function = "the gradient of the objective", .col = i});
    }
    evaluation.gradient[i] = objective_scale_ * value / variable_scale(i);
  }
  if (constraints() == 0) {
    evaluation.jacobian_call = ++derivative_calls_;
    return true;
  }
  if (!model_g_.empty()) {
    ++counts_.jacobian;
    if (!ask([&] { return problem_.jacobian(model_v_, take_new_point(), model_jacobian_); })) {
      return undefined(kJacobian);
    }
  }
  const Index* source = map_.jacobian_source.data();
  const double* given = model_jacobian_.data();
  const double* scale = jacobian_scale_.data();
  double* jacobian = evaluation.jacobian.data();
  for (const auto k : indices(map_.jacobian)) {
    const double value = source[k] >= 0 ? given[source[k]] : 1.0;
    if (!(std::abs(value) <= kLargest)) {
      return fails(
          {.function = "the Jacobian", .row = map_.jacobian[k].row, .col = map_.jacobian[k].col});
    }
    jacobian[k] = scale[k] * value;
  }
  evaluation.jacobian_call = ++derivative_calls_;
  return true;
}

bool CanonicalProblem::second_derivatives(const Eigen::VectorXd& v, const Eigen::VectorXd& lambda,
                                          Evaluation& evaluation, double objective_factor) {
  const ScopedTimer timer(timing_.evaluations);
  if (!load(v)) return false;
  if (quasi_newton_) {
    evaluation.low_rank = quasi_newton_->update(*this, v, lambda, evaluation);
    evaluation.hessian_call = ++derivative_calls_;
    return true;
  }
  evaluation.hessian_call = 0;
  if (!load_multipliers(lambda)) return false;
  ++counts_.hessian;
  if (!ask([&] {
        return problem_.hessian(model_v_, take_new_point(), objective_factor * objective_scale_,
                                model_lambda_, true, model_hessian_);
      })) {
    return undefined("the Hessian of the Lagrangian");
  }
  const Index* source = map_.hessian_source.data();
  const double* given = model_hessian_.data();
  double* hessian = evaluation.hessian.data();
  const std::size_t entries = map_.hessian.size();
  for (std::size_t k = 0; k < entries; ++k) {
    const double value = given[source[k]];
    if (!(std::abs(value) <= kLargest)) {
      return fails({.function = "the Hessian of the Lagrangian",
                    .col = map_.hessian[k].row,
                    .other_col = map_.hessian[k].col});
    }
    hessian[k] = value;
  }
  if (!hessian_scale_.empty()) {
    for (std::size_t k = 0; k < entries; ++k) hessian[k] *= hessian_scale_[k];
  }
  evaluation.hessian_call = ++derivative_calls_;
  return true;
}

bool CanonicalProblem::load_multipliers(const Eigen::VectorXd& lambda) {
  Index bad = -1;
  for_each_of_model(map_.model_constraint, [&](Index j, std::size_t model) {
    model_lambda_[model] = constraint_scale(j) * lambda[j];
    if (!std::isfinite(model_lambda_[model])) bad = j;
  });
  return bad < 0 ||
         fails({.function = "the multiplier", .status = Status::EvaluationFailed, .row = bad});
}

std::optional<Eigen::VectorXd> CanonicalProblem::hessian_error(const Eigen::VectorXd& v,
                                                               const Eigen::VectorXd& lambda) {
  const ScopedTimer timer(timing_.evaluations);
  Array<double>& rows = model_errors_;
  rows.assign(model_v_.size(), 0.0);
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
  for_each_of_model(map_.model_variable, [&](Index i, std::size_t model) {
    error[i] = rows[model] / (variable_scale(i) * variable_scale(i));
  });
  return error;
}

// Back to the model's units.

void CanonicalProblem::restore(const Iterate& iterate, Result& result) {
  const ProblemStructure& s = structure_;
  const bool finite = load(iterate.v);
  result.v = model_v_;
  result.lambda.assign(s.constraint_players.size(), 0.0);
  result.z_lower.assign(s.variable_players.size(), 0.0);
  result.z_upper.assign(s.variable_players.size(), 0.0);
  for_each_of_model(map_.model_variable, [&](Index i, std::size_t model) {
    const double factor = sign(i) * variable_scale(i) / objective_scale_;
    result.z_lower[model] = factor * iterate.z_lower[i];
    result.z_upper[model] = factor * iterate.z_upper[i];
    if (options_.honor_original_bounds) {
      result.v[model] =
          std::clamp(result.v[model], s.variable_lower[model], s.variable_upper[model]);
    }
  });
  for (Index j = 0; j < constraints(); ++j) {
    const double value = iterate.lambda[j] * constraint_scale(j) / objective_scale_;
    if (const Index fixed = map_.fixing_variable[j]; fixed >= 0) {
      set_fixed_multiplier(model_variable(fixed), -value, result);
    } else {
      result.lambda[at(model_constraint(j))] = value;
    }
  }
  if (finite) restore_fixed_multipliers(result);
  restore_values(finite, result);
}

void CanonicalProblem::write_scaling(UserScaling& factors) const {
  factors.objective = objective_scale_;
  factors.variables.assign(structure_.variable_players.size(), 1.0);
  factors.constraints.assign(structure_.constraint_players.size(), 1.0);
  for_each_of_model(map_.model_variable, [&](Index i, std::size_t model) {
    factors.variables[model] = variable_scale(i);
  });
  for_each_of_model(map_.model_constraint, [&](Index j, std::size_t model) {
    factors.constraints[model] = constraint_scale(j);
  });
}

void CanonicalProblem::restore_values(bool finite, Result& result) {
  bool new_point = true;
  result.objective = kNaN;
  if (result.v == objective_point_) {
    result.objective = objective_value_;
  } else if (finite) {
    ++counts_.objective;
    if (!ask([&] {
          return problem_.objective(result.v, std::exchange(new_point, false), result.objective);
        })) {
      result.objective = kNaN;
    }
  }
  result.constraints.assign(structure_.constraint_players.size(), kNaN);
  if (result.constraints.empty()) return;
  if (result.v == constraints_point_) {
    result.constraints = constraint_values_;
  } else if (finite) {
    ++counts_.constraints;
    if (!ask([&] { return problem_.constraints(result.v, new_point, result.constraints); })) {
      std::ranges::fill(result.constraints, kNaN);
    }
  }
  new_point_ = true;
}

std::optional<Index> CanonicalProblem::violated_constant_constraint() const {
  if (constraint_values_.empty()) return std::nullopt;
  const std::vector<bool>& varies = map_.varies;
  for (const auto j : indices(varies)) {
    if (varies[j] || map_.constraint_of_model[j] < 0) continue;
    const double tolerance = options_.constr_viol_tol;
    if (structure_.constraint_lower[j] - constraint_values_[j] > tolerance ||
        constraint_values_[j] - structure_.constraint_upper[j] > tolerance) {
      return static_cast<Index>(j);
    }
  }
  return std::nullopt;
}

double CanonicalProblem::bound_violation(double value, double lower, double upper) const {
  const bool bounded = lower > options_.nlp_lower_bound_inf || upper < options_.nlp_upper_bound_inf;
  return bounded ? largest(0.0, largest(lower - value, value - upper)) : 0.0;
}

double CanonicalProblem::violation(const Result& result) const {
  const ProblemStructure& s = structure_;
  double most = 0.0;
  for (const auto i : indices(s.variable_players)) {
    most = largest(most, bound_violation(result.v[i], s.variable_lower[i], s.variable_upper[i]));
  }
  for (const auto j : indices(s.constraint_players)) {
    most = largest(
        most, bound_violation(result.constraints[j], s.constraint_lower[j], s.constraint_upper[j]));
  }
  return most;
}

Index CanonicalProblem::most_violated_constraint(const Result& result) const {
  const ProblemStructure& s = structure_;
  Index found = 0;
  double most = 0.0;
  for (const auto j : indices(s.constraint_players)) {
    const double violation =
        bound_violation(result.constraints[j], s.constraint_lower[j], s.constraint_upper[j]);
    if (!(violation > most)) continue;
    most = violation;
    found = static_cast<Index>(j);
  }
  return found;
}

void CanonicalProblem::restore_fixed_multipliers(Result& result) {
  // A fixed variable's bounds balance grad f + J' lambda.
  if (options_.fixed_variable_treatment == FixedVariableTreatment::MakeParameterNodual) return;
  const bool any_fixed = std::any_of(map_.variable_of_model.begin(), map_.variable_of_model.end(),
                                     [](Index i) { return i < 0; });
  if (!any_fixed) return;
  ++counts_.gradient;
  if (!ask([&] { return problem_.gradient(result.v, true, model_gradient_); })) return;
  counts_.jacobian += model_jacobian_.empty() ? 0 : 1;
  if (!model_jacobian_.empty() &&
      !ask([&] { return problem_.jacobian(result.v, false, model_jacobian_); }))
    return;
  for (const auto k : indices(structure_.jacobian)) {
    const auto [row, col] = structure_.jacobian[k];
    model_gradient_[col] += model_jacobian_[k] * result.lambda[at(row)];
  }
  for (const auto i : indices(map_.variable_of_model)) {
    // Where the derivative does not exist there is no multiplier.
    if (map_.variable_of_model[i] >= 0 || !std::isfinite(model_gradient_[i])) continue;
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
