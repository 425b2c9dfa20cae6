#include "core/certificate/feasible_arc.hpp"

#include <algorithm>
#include <cmath>

#include "core/certificate/parameters.hpp"
#include "core/model/norms.hpp"

namespace ipminmax {

namespace parameter = parameters::certificate;

Eigen::VectorXd FeasibleArc::step_along(const Eigen::VectorXd& direction) const {
  Eigen::VectorXd step = direction.cwiseProduct(system_.units().variable);
  for (std::size_t k = 0; k < point_.evaluation.jacobian.size(); ++k) {
    const auto [row, col] = canonical_.jacobian()[k];
    const Index slack = canonical_.slack_of(row);
    if (slack >= 0 && !system_.is_fixed(slack)) {
      step[slack] += point_.evaluation.jacobian[k] * step[col];
    }
  }
  return step;
}

/// Bounds and open inequalities, of which c tells by how much their slack is off.
bool FeasibleArc::is_inside(const Eigen::VectorXd& v, const Eigen::VectorXd& c) const {
  Eigen::VectorXd at_end = v;
  for (Index j = 0; j < c.size(); ++j) {
    const Index slack = canonical_.slack_of(j);
    if (slack >= 0 && !system_.is_fixed(slack)) at_end[slack] += c[j];
  }
  bool inside = true;
  for_each_bound(canonical_, at_end, [&](Index i, int side, double) {
    inside = inside &&
             (side < 0 ? at_end[i] >= canonical_.lower()[i] : at_end[i] <= canonical_.upper()[i]);
  });
  return inside;
}

/// Without f, which corrections do not need.
bool FeasibleArc::evaluate(Trial& trial) {
  return canonical_.constraints(trial.v, trial.evaluation.c) == EvaluationStatus::Ok &&
         canonical_.first_derivatives(trial.v, trial.evaluation) == EvaluationStatus::Ok;
}

/// f with what the violation left over is worth.
double FeasibleArc::lagrangian(const Evaluation& evaluation) const {
  double value = evaluation.f;
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    if (system_.counts(j)) value += point_.iterate.lambda[j] * evaluation.c[j];
  }
  return value;
}

/// Of the constraints and the stationarity of those who answer, negative, in units.
NewtonResidual FeasibleArc::residual_of(const Trial& trial) const {
  const Units& units = system_.units();
  NewtonResidual rhs = zero_step(canonical_);
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    if (corrects(j)) rhs.lambda[j] = -units.constraint[j] * trial.evaluation.c[j];
  }
  if (inner_ && !stationary_) return rhs;
  Eigen::VectorXd gradient = trial.evaluation.gradient;
  for (std::size_t k = 0; k < trial.evaluation.jacobian.size(); ++k) {
    const auto [row, col] = canonical_.jacobian()[k];
    const bool kept = system_.counts(row) || system_.classes().is_redundant(row);
    if (kept) gradient[col] += trial.evaluation.jacobian[k] * trial.lambda[row];
  }
  for (Index i = 0; i < gradient.size(); ++i) {
    const bool answers = canonical_.y().contains(i) || (!inner_ && stationary_);
    if (answers && system_.is_free(i)) rhs.v[i] = -units.variable[i] * gradient[i];
  }
  for (const Eigen::VectorXd& direction : free_) {
    const auto free = direction.segment(own_.begin, own_.size());
    auto part = rhs.v.segment(own_.begin, own_.size());
    part -= free.dot(part) * free;
  }
  return rhs;
}

/// One Newton step with the matrix at hand. residual: what was left before, in units.
bool FeasibleArc::correct(Trial& trial, double& residual) {
  const Units& units = system_.units();
  const NewtonResidual rhs = residual_of(trial);
  residual = std::max(max_norm(rhs.v), max_norm(rhs.lambda));
  if (residual == 0.0) return true;
  Step step = zero_step(canonical_);
  const bool solved = inner_ ? system_.kkt().solve_inner(system_.assembled(), rhs, step)
                             : system_.kkt().solve(system_.assembled(), rhs, step);
  if (!solved) return false;
  for (Index i = inner_ ? own_.begin : 0; i < canonical_.variables(); ++i) {
    if (system_.is_free(i)) trial.v[i] += units.variable[i] * step.v[i];
  }
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    if (corrects(j)) trial.lambda[j] += units.constraint[j] * step.lambda[j];
  }
  return evaluate(trial);
}

FeasibleArc::End FeasibleArc::take(const Eigen::VectorXd& step, double length) {
  End end;
  Trial trial{point_.iterate.v + length * step, point_.iterate.lambda, point_.evaluation};
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(canonical_.constraints());
  if (!is_inside(trial.v, none) || !evaluate(trial)) return end;  // corrections are small
  const double scale = stationary_ ? std::abs(length) : length * length;
  const double small = stationary_ ? parameter::kRootOfRounding : parameter::kSmall;
  const double negligible =
      stationary_ ? parameter::kLittle * parameter::kRootOfRounding : parameter::kHardly;
  double residual = 0.0;
  for (int k = 0; k < parameter::kSeveral; ++k) {
    if (!correct(trial, residual)) return end;
    if (residual <= negligible * scale) break;
  }
  if (!(residual <= small * scale) ||
      canonical_.objective(trial.v, trial.evaluation.f) != EvaluationStatus::Ok) {
    return end;
  }
  end.reached = is_inside(trial.v, trial.evaluation.c);
  end.change = lagrangian(trial.evaluation) - lagrangian(point_.evaluation);
  end.left = std::abs(end.change - (trial.evaluation.f - point_.evaluation.f));
  end.moved = longest(canonical_, trial.v - point_.iterate.v, system_.units());
  return end;
}

}  // namespace ipminmax
