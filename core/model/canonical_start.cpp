#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "core/model/canonical_problem.hpp"
#include "core/model/indices.hpp"
#include "core/model/structure_check.hpp"
#include "linalg/numbers.hpp"

// The starting point.

namespace ipminmax {
namespace {

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

}  // namespace ipminmax
