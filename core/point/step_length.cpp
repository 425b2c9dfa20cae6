#include <algorithm>
#include <cmath>

#include "core/model/indices.hpp"
#include "core/point/step_length.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

Step zero_step(const CanonicalProblem& canonical) {
  return {.v = Eigen::VectorXd::Zero(canonical.variables()),
          .lambda = Eigen::VectorXd::Zero(canonical.constraints()),
          .z_lower = Eigen::VectorXd::Zero(canonical.variables()),
          .z_upper = Eigen::VectorXd::Zero(canonical.variables())};
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

}  // namespace

namespace {

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
