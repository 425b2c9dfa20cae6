#include "core/point/point.hpp"

#include <algorithm>
#include <cmath>

#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

Point unevaluated_point(const CanonicalProblem& canonical, const Iterate& iterate) {
  Point point;
  begin_at(canonical, iterate, point);
  return point;
}

void begin_at(const CanonicalProblem& canonical, const Iterate& iterate, Point& point) {
  point.iterate = iterate;
  point.evaluation.f = 0.0;
  point.evaluation.jacobian_call = point.evaluation.hessian_call = 0;
  point.error = KktError::unknown();
  point.evaluation.c.setZero(canonical.constraints());
  point.evaluation.gradient.setZero(canonical.variables());
  point.evaluation.jacobian.assign(canonical.jacobian().size(), 0.0);
  point.evaluation.hessian.assign(canonical.hessian().size(), 0.0);
  point.evaluation.low_rank = nullptr;
  point.dual.setZero(canonical.variables());
}

bool evaluate_values(CanonicalProblem& canonical, Point& point) {
  return canonical.values(point.iterate.v, point.evaluation.f, point.evaluation.c);
}

bool evaluate_first_derivatives(CanonicalProblem& canonical, Point& point) {
  if (!canonical.first_derivatives(point.iterate.v, point.evaluation)) return false;
  renew_dual(canonical, point);
  return true;
}

bool evaluate_second_derivatives(CanonicalProblem& canonical, Point& point) {
  return canonical.second_derivatives(point.iterate.v, point.iterate.lambda, point.evaluation);
}

bool evaluate_derivatives(CanonicalProblem& canonical, Point& point) {
  return evaluate_first_derivatives(canonical, point) &&
         evaluate_second_derivatives(canonical, point);
}

void evaluate_where_defined(CanonicalProblem& canonical, Point& point) {
  const Eigen::VectorXd& v = point.iterate.v;
  Evaluation& e = point.evaluation;
  if (!canonical.objective(v, e.f)) e.f = kNaN;
  if (!canonical.constraints(v, e.c)) e.c.setConstant(kNaN);
  if (!canonical.first_derivatives(v, e)) {
    e.gradient.setConstant(kNaN);
    std::ranges::fill(e.jacobian, kNaN);
  }
  renew_dual(canonical, point);
}

void measure(const CanonicalProblem& canonical, const SolverOptions& options, Point& point) {
  point.parts = error_parts(canonical, point, options.s_max);
  point.error = kkt_error(canonical, point, options.mu_target);
}

void measure_anew(const CanonicalProblem& canonical, const SolverOptions& options, Point& point) {
  renew_dual(canonical, point);
  measure(canonical, options, point);
}

namespace {

/// Sum of the logarithms of distances with the signs of their players, of copies or of the others.
double logs(const CanonicalProblem& canonical, const Eigen::VectorXd& v, bool of_copies) {
  double sum = 0.0;
  for_each_bound(canonical, v, [&](Index i, int, double distance) {
    if ((canonical.robust_slack(i) >= 0) != of_copies) return;
    sum += canonical.sign(i) * std::log(distance);
  });
  return sum;
}

}  // namespace

double barrier_objective(const CanonicalProblem& canonical, const Eigen::VectorXd& v, double f,
                         double mu) {
  return f + mu * (canonical.damping().dot(v) - logs(canonical, v, false));
}

double barrier_of_copies(const CanonicalProblem& canonical, const Eigen::VectorXd& v, double mu) {
  return canonical.has_copies() ? -mu * logs(canonical, v, true) : 0.0;
}

void barrier_gradient(const CanonicalProblem& canonical, const Point& point, double mu,
                      Eigen::VectorXd& gradient) {
  gradient = point.evaluation.gradient + mu * canonical.damping();
  for_each_bound(canonical, point.iterate.v, [&](Index i, int side, double distance) {
    gradient[i] += side * canonical.sign(i) * mu / distance;
  });
}

double violation(const Eigen::VectorXd& c, IndexRange constraints) {
  return constraints.size() > 0 ? c.segment(constraints.begin, constraints.size()).lpNorm<1>()
                                : 0.0;
}

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

Step zero_step(const CanonicalProblem& canonical) {
  Step step;
  set_zero(canonical, step);
  return step;
}

void set_zero(const CanonicalProblem& canonical, Step& step) {
  step.v.setZero(canonical.variables());
  step.lambda.setZero(canonical.constraints());
  step.z_lower.setZero(canonical.variables());
  step.z_upper.setZero(canonical.variables());
}

void set_zero(Step& step) {
  step.v.setZero();
  step.lambda.setZero();
  step.z_lower.setZero();
  step.z_upper.setZero();
}

StepLength largest_step(const CanonicalProblem& canonical, const Iterate& iterate, const Step& step,
                        double tau) {
  StepLength alpha;
  const auto limit = [tau](double& alpha_i, double value, double change) {
    if (alpha_i * change < -tau * value) alpha_i = -tau * value / change;
  };
  for_each_bound(canonical, iterate.v, [&](Index i, int side, double distance) {
    limit(alpha.primal, distance, -side * step.v[i]);
    limit(alpha.dual, multiplier_of(iterate, i, side), multiplier_of(step, i, side));
  });
  return alpha;
}

namespace {

/// Whether some variable changes by more than its rounding, or by what matters beside its bounds.
bool moves(const CanonicalProblem& canonical, const Iterate& iterate, const Step& step) {
  constexpr double kRounding = 2.0 * kEpsilon;
  const auto more = [&](Index i, double size) { return std::abs(step.v[i]) > kRounding * size; };
  for (Index i = 0; i < step.v.size(); ++i) {
    if (more(i, std::abs(iterate.v[i]))) return true;
  }
  const auto lower = [&](Index i) { return more(i, canonical.above_lower(i, iterate.v[i])); };
  const auto upper = [&](Index i) { return more(i, canonical.below_upper(i, iterate.v[i])); };
  return std::ranges::any_of(canonical.lower_bounded(), lower) ||
         std::ranges::any_of(canonical.upper_bounded(), upper);
}

/// Multipliers of copies are weight times their row's own, and so are their steps: they grow as it
/// does; see row_jacobian. Copies come behind the slacks of the rows that they serve.
void advance_multipliers(const CanonicalProblem& canonical, const Step& step, StepLength alpha,
                         Iterate& iterate, InequalityLength inequalities) {
  const auto change = [&](Index slack) {
    return slack < 0 ? 0.0
                     : (step.z_lower[slack] + step.z_upper[slack]) /
                           CanonicalProblem::weight_by(slack, iterate);
  };
  for (Index j = canonical.constraints() - 1; j >= 0; --j) {
    const bool is_equality = canonical.slack_of(j) < 0;
    const bool is_primal = is_equality || inequalities == InequalityLength::Primal;
    const double length = is_primal ? alpha.primal : alpha.dual;
    const double factor = 1.0 + alpha.dual * change(canonical.robust_slack_of_constraint(j));
    iterate.lambda[j] = (iterate.lambda[j] + length * step.lambda[j]) * factor;
  }
  for (Index i = canonical.variables() - 1; i >= 0; --i) {
    const double factor = 1.0 + alpha.dual * change(canonical.robust_slack(i));
    iterate.z_lower[i] = (iterate.z_lower[i] + alpha.dual * step.z_lower[i]) * factor;
    iterate.z_upper[i] = (iterate.z_upper[i] + alpha.dual * step.z_upper[i]) * factor;
  }
  // Its slack's stationarity, which rounding in lambda_r would spoil for copies of small weight.
  for (const Index i : indices(canonical.x_slacks())) {
    if (!canonical.owners().has_copies[static_cast<std::size_t>(i)]) continue;
    iterate.lambda[canonical.constraint_of_slack(i)] = CanonicalProblem::signed_weight(i, iterate);
  }
}

}  // namespace

void advance(const CanonicalProblem& canonical, const Step& step, StepLength alpha,
             Iterate& iterate, InequalityLength inequalities) {
  // A step of v that is its rounding would renew the rounding errors of the gradient, which the
  // step of the multipliers answers.
  if (moves(canonical, iterate, step)) iterate.v += alpha.primal * step.v;
  if (canonical.has_copies()) {
    advance_multipliers(canonical, step, alpha, iterate, inequalities);
    return;
  }
  if (inequalities == InequalityLength::Primal || alpha.primal == alpha.dual) {
    iterate.lambda += alpha.primal * step.lambda;
  } else {
    for (Index j = 0; j < step.lambda.size(); ++j) {
      const bool has_slack = canonical.slack_of(j) >= 0;
      iterate.lambda[j] += (has_slack ? alpha.dual : alpha.primal) * step.lambda[j];
    }
  }
  iterate.z_lower += alpha.dual * step.z_lower;
  iterate.z_upper += alpha.dual * step.z_upper;
}

void clip_bound_multipliers(const CanonicalProblem& canonical, double mu, double kappa,
                            Iterate& iterate) {
  // A distance lost in rounding says nothing of its multiplier, see keep_distances.
  const double least = kEpsilon * std::min(1.0, mu);
  for_each_bound(canonical, iterate.v, [&](Index i, int side, double distance) {
    if (distance < least) return;
    const double central = mu * canonical.weight(i, iterate) / distance;
    double& z = multiplier_of(iterate, i, side);
    z = std::clamp(z, central / kappa, kappa * central);
  });
}

}  // namespace ipminmax
