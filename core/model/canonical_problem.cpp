#include <utility>

#include "core/model/budget.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/indices.hpp"
#include "core/model/structure_check.hpp"
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
      kept = &*gradient_scaling_;
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

}  // namespace ipminmax
