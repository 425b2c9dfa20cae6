#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/model/canonical_problem.hpp"
#include "core/model/indices.hpp"
#include "core/model/structure_check.hpp"

// Scaling factors of objective, constraints and variables.

namespace ipminmax {

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
  Array<double> row_norm(row_scale_.size(), 0.0);
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
  gradient_scaling_ = {.objective = factor(norm),
                       .constraints = std::move(row_norm),
                       .largest_gradient = largest,
                       .least_factor = options_.nlp_scaling_min_value};
  return {};
}

}  // namespace ipminmax
