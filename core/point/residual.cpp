#include <algorithm>
#include <cmath>

#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/point/residual.hpp"

namespace ipminmax {
namespace {

/// max |S z / weight - mu| over the bounds.
double complementarity(const CanonicalProblem& canonical, const Iterate& iterate, double mu) {
  double error = 0.0;
  for_each_bound(canonical, iterate.v, [&](Index i, int side, double distance) {
    const double z = multiplier_of(iterate, i, side) / canonical.weight(i, iterate);
    error = largest(error, std::abs(distance * z - mu));
  });
  return error;
}

}  // namespace

double max_error(const CanonicalProblem& canonical, const Point& point) {
  const Index y = canonical.y().begin;
  if (!canonical.has_copies()) return max_norm(point.dual, y, canonical.variables());
  double error = 0.0;
  for (Index i = y; i < canonical.variables(); ++i) {
    error = largest(error, std::abs(point.dual[i]) / canonical.weight(i, point.iterate));
  }
  return error;
}

double BarrierError::norm() const {
  return largest(largest(primal, complementarity), largest(dual_min, dual_max));
}

void renew_dual(const CanonicalProblem& canonical, Point& point) {
  const Iterate& iterate = point.iterate;
  const Evaluation& evaluation = point.evaluation;
  Eigen::VectorXd& residual = point.dual;
  residual = evaluation.gradient;
  const auto jacobian = canonical.jacobian();
  for (const auto k : indices(jacobian)) {
    residual[jacobian[k].col] += evaluation.jacobian[k] * iterate.lambda[jacobian[k].row];
  }
  for (Index j = 0; j < canonical.constraints(); ++j) {
    if (const Index slack = canonical.slack_of(j); slack >= 0) {
      residual[slack] -= iterate.lambda[j];
    }
  }
  for_each_bound(canonical, iterate.v, [&](Index i, int side, double) {
    residual[i] += side * canonical.sign(i) * multiplier_of(iterate, i, side);
  });
}

ErrorParts error_parts(const CanonicalProblem& canonical, const Point& point, double s_max) {
  const Iterate& iterate = point.iterate;
  const Index m = canonical.constraints();
  const double z_sum = iterate.z_lower.lpNorm<1>() + iterate.z_upper.lpNorm<1>();
  const auto bounds =
      static_cast<double>(canonical.lower_bounded().size() + canonical.upper_bounded().size());
  const auto scale = [&](double sum, double count) {
    return count > 0.0 ? std::max(s_max, sum / count) / s_max : 1.0;
  };
  return {.primal = max_norm(point.evaluation.c, 0, m),
          .dual_min = max_norm(point.dual, 0, canonical.y().begin),
          .dual_max = max_error(canonical, point),
          .s_d = scale(z_sum + iterate.lambda.lpNorm<1>(), bounds + static_cast<double>(m)),
          .s_c = scale(z_sum, bounds)};
}

namespace {

BarrierError barrier_error_of(const CanonicalProblem& canonical, const Iterate& iterate,
                              const ErrorParts& parts, double mu) {
  BarrierError error{
      .primal = parts.primal, .dual_min = parts.dual_min, .dual_max = parts.dual_max};
  error.complementarity = complementarity(canonical, iterate, mu);
  error.scaled = largest(largest(error.primal, largest(error.dual_min, error.dual_max) / parts.s_d),
                         error.complementarity / parts.s_c);
  return error;
}

}  // namespace

BarrierError barrier_error(const CanonicalProblem& canonical, const Point& point, double mu,
                           double s_max) {
  return barrier_error_of(canonical, point.iterate, error_parts(canonical, point, s_max), mu);
}

BarrierError measured_barrier_error(const CanonicalProblem& canonical, const Point& point,
                                    double mu) {
  return barrier_error_of(canonical, point.iterate, point.parts, mu);
}

KktError kkt_error(const CanonicalProblem& canonical, const Point& point, double mu) {
  KktError error;
  const BarrierError scaled = measured_barrier_error(canonical, point, mu);
  error.total = scaled.scaled;
  error.scaled_primal = scaled.primal;
  error.scaled_dual = std::max(scaled.dual_min, scaled.dual_max);
  error.scaled_complementarity = scaled.complementarity;
  const double f_scale = canonical.user_objective_scale();
  for (Index j = 0; j < canonical.constraints(); ++j) {
    error.primal =
        largest(error.primal, std::abs(point.evaluation.c[j]) / canonical.constraint_scale(j));
  }
  for (Index i = 0; i < canonical.variables(); ++i) {
    const double value = std::abs(point.dual[i]) / canonical.weight(i, point.iterate) *
                         canonical.variable_scale(i) / f_scale;
    double& dual_error = canonical.owned_by_max(i) ? error.dual_max : error.dual_min;
    dual_error = largest(dual_error, value);
  }
  error.complementarity = scaled.complementarity / f_scale;
  return error;
}

void newton_residual(const CanonicalProblem& canonical, const Point& point, double mu,
                     NewtonResidual& rhs) {
  const Iterate& iterate = point.iterate;
  const Evaluation& evaluation = point.evaluation;
  rhs.v = -point.dual - mu * canonical.damping();
  rhs.lambda = -evaluation.c;
  for_each_bound(canonical, iterate.v, [&](Index i, int side, double distance) {
    multiplier_of(rhs, i, side) =
        mu * canonical.weight(i, iterate) - distance * multiplier_of(iterate, i, side);
  });
  if (!canonical.has_copies()) return;
  for (Index i = canonical.y().begin; i < canonical.variables(); ++i) {
    rhs.v[i] += mu * (1.0 - canonical.weight(i, iterate)) * canonical.damping()[i];
  }
  // See row_jacobian.
  const auto& owners = canonical.owners();
  for (Index j = canonical.max_constraints().begin; j < canonical.constraints(); ++j) {
    const Index slack = owners.slack_of_constraint[static_cast<std::size_t>(j)];
    if (slack < 0) continue;
    rhs.lambda[canonical.constraint_of_slack(slack)] -=
        iterate.lambda[j] / canonical.signed_weight(slack, iterate) * evaluation.c[j];
  }
}

void row_jacobian(const CanonicalProblem& canonical, const Iterate& iterate,
                  const Evaluation& evaluation, std::vector<double>& jacobian) {
  jacobian = evaluation.jacobian;
  const auto& owners = canonical.owners();
  for (const auto& [of_robust, of_copy, copy] : owners.shared_entries) {
    const Index slack = owners.slack_of_constraint[static_cast<std::size_t>(copy)];
    jacobian[of_robust] += iterate.lambda[copy] / canonical.signed_weight(slack, iterate) *
                           evaluation.jacobian[of_copy];
  }
  for (const std::size_t entry : owners.own_entries) jacobian[entry] = 0.0;
}

}  // namespace ipminmax
