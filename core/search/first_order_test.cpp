#include <algorithm>
#include <cmath>
#include <utility>

#include "core/model/compare.hpp"
#include "core/model/indices.hpp"
#include "core/model/parameters.hpp"
#include "core/search/first_order_test.hpp"

namespace ipminmax {

bool is_within_tolerances(const KktError& error, const SolverOptions& options) {
  return error.total <= options.tol &&
         std::max(error.dual_min, error.dual_max) <= options.dual_inf_tol &&
         error.primal <= options.constr_viol_tol && error.complementarity <= options.compl_inf_tol;
}

bool is_within_acceptable_tolerances(const KktError& error, const SolverOptions& options) {
  return error.total <= options.acceptable_tol &&
         std::max(error.dual_min, error.dual_max) <= options.acceptable_dual_inf_tol &&
         error.primal <= options.acceptable_constr_viol_tol &&
         error.complementarity <= options.acceptable_compl_inf_tol;
}

bool FirstOrderTest::is_acceptable(const Point& point) {
  return options_.acceptable_iter > 0 && is_within_acceptable_tolerances(point.error, options_) &&
         is_balanced(point, options_.acceptable_tol);
}

bool FirstOrderTest::is_balanced(const Point& point, double tolerance) {
  if (std::max(point.error.dual_min, point.error.dual_max) <= tolerance) return true;
  constexpr double kBalanced = 1e-4;  // |sum| over its largest term
  const Iterate& z = point.iterate;
  const Evaluation& e = point.evaluation;
  terms_ = e.gradient.cwiseAbs().cwiseMax(z.z_lower.cwiseAbs()).cwiseMax(z.z_upper.cwiseAbs());
  const auto add = [&](Index i, double term) { terms_[i] = std::max(terms_[i], std::abs(term)); };
  const auto jacobian = canonical_.jacobian();
  for (const auto k : indices(jacobian))
    add(jacobian[k].col, e.jacobian[k] * z.lambda[jacobian[k].row]);
  // The rounding of v changes the gradient, too.
  by_rounding_.setZero(terms_.size());
  const auto hessian = canonical_.hessian();
  for (const auto k : indices(e.hessian)) {
    const auto [row, col] = hessian[k];
    by_rounding_[row] += std::abs(e.hessian[k] * z.v[col]);
    if (row != col) by_rounding_[col] += std::abs(e.hessian[k] * z.v[row]);
  }
  const double f_scale = canonical_.user_objective_scale();
  for (Index i = 0; i < terms_.size(); ++i) {
    const double own = point.dual[i] / canonical_.weight(i, z);
    const double error = std::abs(own) * canonical_.variable_scale(i) / f_scale;
    const ValueRange range{.least = 0.0, .most = terms_[i], .terms = by_rounding_[i]};
    if (error > tolerance && clearly_greater(std::abs(point.dual[i]), 0.0, range, kBalanced))
      return false;
  }
  return true;
}

bool FirstOrderTest::is_at_rest(const Iterate& iterate) {
  constexpr double kGrown = 2.0;  // multipliers; under a large shift they rest as v does
  const Eigen::VectorXd& v = iterate.v;
  const double multiplier = iterate.lambda.size() > 0 ? iterate.lambda.cwiseAbs().maxCoeff() : 0.0;
  const auto moves = [&](IndexRange variables) {
    const auto of = [&](const Eigen::VectorXd& all) { return part(all, variables).array(); };
    // Beside a variable that has gone far from its start a step may look like rest.
    const auto start = of(canonical_.starting_point().v).abs();
    const auto size = (start > 0.0).select(start, of(v).abs());
    return ((of(v) - of(rest_point_)).abs() > parameters::kHardly * size).any();
  };
  if (at_rest_ == 0 || moves(canonical_.x()) || moves(canonical_.y())) {
    rest_point_ = v;
    rest_multiplier_ = multiplier;
    at_rest_ = 0;
  }
  constexpr Index kIteratesAtRest = 10;
  return ++at_rest_ > kIteratesAtRest && multiplier > kGrown * rest_multiplier_;
}

std::optional<Status> FirstOrderTest::passed(const Point& point) {
  const double objective = canonical_.unscaled_objective(point.evaluation.f);
  const double last = std::exchange(last_objective_, objective);
  if (is_within_tolerances(point.error, options_) &&
      (is_balanced(point, options_.tol) || is_at_rest(point.iterate))) {
    return Status::Solved;
  }
  const double change = std::abs(objective - last) / std::max(1.0, std::abs(objective));
  const bool counts = is_acceptable(point) && change <= options_.acceptable_obj_change_tol;
  acceptable_ = counts ? acceptable_ + 1 : 0;
  if (acceptable_ == 0 || acceptable_ < options_.acceptable_iter) return std::nullopt;
  return Status::SolvedToAcceptableLevel;
}

}  // namespace ipminmax
