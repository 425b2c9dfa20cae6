#include <utility>

#include "core/model/canonical_problem.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/model/timer.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// kappa_d leaves kappa_d mu in the dual residual. Where mu ends at mu_target > 0, that is an error
/// of the answer: a tenth of tol at most.
double damping_factor(const SolverOptions& options) {
  if (!(options.mu_target > 0.0)) return options.kappa_d;
  return std::min(options.kappa_d, 0.1 * options.tol / options.mu_target);
}

}  // namespace

CanonicalProblem::CanonicalProblem(Problem& problem, const SolverOptions& options, Counts& counts,
                                   Timing& timing, CanonicalArrays* arrays)
    : problem_(problem),
      structure_(problem.structure()),
      options_(options),
      counts_(counts),
      timing_(timing),
      arrays_(arrays != nullptr ? *arrays : own_.emplace()) {}

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

std::string CanonicalProblem::build(const GradientScaling* kept) {
  if (auto error = check_structure(structure_, options_); !error.empty()) return error;
  if (auto error = arrays_.map.build(structure_, options_); !error.empty()) {
    return fail(Status::TooFewDegreesOfFreedom, std::move(error));
  }
  make_buffers();
  if (auto error = read_start(); !error.empty()) return error;
  return scale(kept);
}

std::string CanonicalProblem::row_name(Index constraint) const {
  const Index model = arrays_.map.model_constraint[at(constraint)];
  if (model >= 0) return constraint_name(model);
  return "fixed " +
         variable_name(arrays_.map.model_variable[at(arrays_.map.fixing_variable[at(constraint)])]);
}

void CanonicalProblem::make_buffers() {
  arrays_.model_v.assign(structure_.variable_players.size(), 0.0);
  for (std::size_t i = 0; i < arrays_.model_v.size(); ++i) {
    if (arrays_.map.variable_of_model[i] < 0) arrays_.model_v[i] = structure_.variable_lower[i];
  }
  arrays_.model_g.assign(structure_.constraint_players.size(), 0.0);
  arrays_.model_lambda.assign(structure_.constraint_players.size(), 0.0);
  arrays_.model_gradient.assign(structure_.variable_players.size(), 0.0);
  arrays_.model_jacobian.assign(structure_.jacobian.size(), 0.0);
  arrays_.model_hessian.assign(structure_.hessian.size(), 0.0);
  arrays_.objective_point.clear();
  arrays_.constraints_point.clear();
  arrays_.constraint_values.clear();
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
                      kept->constraints.size() == arrays_.row_scale.size();
    if (!fits) {
      if (auto error = gradient_based_scaling(); !error.empty()) return error;
      kept = &*gradient_scaling_;
    }
    objective_scale_ *= kept->objective;
    arrays_.row_scale = kept->constraints;
  }

  // Slacks are measured as their constraints.
  for (std::size_t j = 0; j < arrays_.map.slack_of_constraint.size(); ++j) {
    if (arrays_.map.slack_of_constraint[j] >= 0)
      arrays_.col_scale[at(arrays_.map.slack_of_constraint[j])] = arrays_.row_scale[j];
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
      const bool exists = model >= 0 && at(model) < arrays_.map.variable_of_model.size();
      const Index i = exists ? arrays_.map.variable_of_model[at(model)] : -1;
      if (i >= 0 && !std::ranges::count(nonlinear, i)) nonlinear.push_back(i);
    }
  } else {
    for (Index i = x().begin; i < x().end; ++i) nonlinear.push_back(i);
  }
  quasi_newton_.emplace(variables(), std::move(nonlinear));
}

void CanonicalProblem::set_bounds(Index variable, double lower, double upper) {
  const double scale = arrays_.col_scale[at(variable)];
  const auto relaxed = [&](double bound, double outwards) {
    const double most = options_.constr_viol_tol;
    const double moved = bound + outwards * relaxation(bound, upper - lower, options_);
    // Rounding must not exceed it: numbers near 1e12 are 1e-4 apart.
    return std::abs(moved - bound) <= most ? moved : std::nextafter(moved, bound);
  };
  if (lower > options_.nlp_lower_bound_inf) arrays_.lower[variable] = scale * relaxed(lower, -1.0);
  if (upper < options_.nlp_upper_bound_inf) arrays_.upper[variable] = scale * relaxed(upper, 1.0);
}

void CanonicalProblem::set_variable_bounds() {
  arrays_.lower.setConstant(variables(), -kInfinity);
  arrays_.upper.setConstant(variables(), kInfinity);
  for (Index i = 0; i < variables(); ++i) {
    const Index model = arrays_.map.model_variable[at(i)];
    if (model < 0 || is_fixed_by_constraint(structure_, options_, model)) continue;
    set_bounds(i, structure_.variable_lower[at(model)], structure_.variable_upper[at(model)]);
  }
}

void CanonicalProblem::set_constraint_bounds() {
  arrays_.right_hand_side.setZero(constraints());
  for (Index j = 0; j < constraints(); ++j) {
    if (const Index i = arrays_.map.fixing_variable[at(j)]; i >= 0) {
      arrays_.right_hand_side[j] = arrays_.row_scale[at(j)] *
                                   structure_.variable_lower[at(arrays_.map.model_variable[at(i)])];
      continue;
    }
    const auto model = at(arrays_.map.model_constraint[at(j)]);
    const Index slack = arrays_.map.slack_of_constraint[at(j)];
    if (slack >= 0) {
      set_bounds(slack, structure_.constraint_lower[model], structure_.constraint_upper[model]);
    } else {
      arrays_.right_hand_side[j] = arrays_.row_scale[at(j)] * structure_.constraint_lower[model];
    }
  }
}

void CanonicalProblem::list_bounds() {
  const Index n = variables();
  arrays_.room_below.setZero(n);
  arrays_.room_above.setZero(n);
  arrays_.lower_bounded.clear();
  arrays_.upper_bounded.clear();
  for (Index i = 0; i < n; ++i) {
    if (arrays_.lower[i] > -kInfinity) arrays_.lower_bounded.push_back(i);
    if (arrays_.upper[i] < kInfinity) arrays_.upper_bounded.push_back(i);
  }
  // A robust constraint with two bounds has two sides, and its multiplier no sign.
  RowOwners& owners = arrays_.map.owners;
  const auto is_two_sided = [&](Index slack) {
    return slack >= 0 && arrays_.lower[slack] > -kInfinity && arrays_.upper[slack] < kInfinity;
  };
  std::ranges::replace_if(owners.slack_of_variable, is_two_sided, -1);
  std::ranges::replace_if(owners.slack_of_constraint, is_two_sided, -1);
  std::erase_if(owners.shared_entries, [&](const auto& entry) {
    return owners.slack_of_constraint[at(entry.serving)] < 0;
  });
  std::erase_if(owners.own_entries, [&](std::size_t entry) {
    return owners.slack_of_variable[at(arrays_.map.jacobian[entry].col)] < 0;
  });
  for (std::size_t i = 0; i < owners.is_served.size(); ++i) {
    owners.is_served[i] = owners.is_served[i] && !is_two_sided(static_cast<Index>(i));
  }
  arrays_.damping.setZero(n);
  if (options_.minmax_globalization == Globalization::None) return;
  const double factor = damping_factor(options_);
  for (Index i = 0; i < n; ++i) {
    const int sides =
        (arrays_.lower[i] > -kInfinity ? 1 : 0) - (arrays_.upper[i] < kInfinity ? 1 : 0);
    arrays_.damping[i] = sign(i) * sides * factor;
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
  for (const Index i : arrays_.lower_bounded) {
    keep(iterate.v[i] - arrays_.lower[i], arrays_.lower[i], iterate.z_lower[i] / weight(i, iterate),
         arrays_.room_below[i]);
  }
  for (const Index i : arrays_.upper_bounded) {
    keep(arrays_.upper[i] - iterate.v[i], arrays_.upper[i], iterate.z_upper[i] / weight(i, iterate),
         arrays_.room_above[i]);
  }
}

}  // namespace ipminmax
