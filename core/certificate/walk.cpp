#include "core/certificate/walk.hpp"

#include <algorithm>
#include <cmath>

namespace ipminmax {
namespace {

constexpr int kCorrections = 6;
// Of a residual over length^2, in a valley over length: needs no correction; is accepted.
constexpr double kNegligible = 1e-6, kSmall = 1e-2;
constexpr double kNegligibleInValley = 1e-9, kSmallInValley = 1e-8;
constexpr double kHopeless = 100.0;  // residual expected at the end, over what is accepted

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

Walk::Walk(CanonicalProblem& canonical, ActiveSetSystem& system, const Point& point, Kind kind)
    : canonical_(canonical),
      system_(system),
      point_(point),
      kind_(kind),
      begin_(inner() ? canonical.y().begin : 0) {}

Eigen::VectorXd Walk::step_along(const Eigen::VectorXd& direction) const {
  Eigen::VectorXd step = direction.cwiseProduct(system_.units().variable);
  const auto slack_of = canonical_.slack_of_constraint();
  for (std::size_t k = 0; k < point_.evaluation.jacobian.size(); ++k) {
    const auto [row, col] = canonical_.jacobian()[k];
    const Index slack = slack_of[at(row)];
    if (slack >= 0 && !system_.is_fixed(slack)) {
      step[slack] += point_.evaluation.jacobian[k] * step[col];
    }
  }
  return step;
}

/// Bounds and open inequalities, of which c tells by how much their slack is off.
bool Walk::is_inside(const Eigen::VectorXd& v, const Eigen::VectorXd& c) const {
  Eigen::VectorXd at_end = v;
  const auto slack_of = canonical_.slack_of_constraint();
  for (Index j = 0; j < c.size(); ++j) {
    const Index slack = slack_of[at(j)];
    if (slack >= 0 && !system_.is_fixed(slack)) at_end[slack] += c[j];
  }
  return std::ranges::all_of(canonical_.lower_bounded(),
                             [&](Index i) { return at_end[i] >= canonical_.lower()[i]; }) &&
         std::ranges::all_of(canonical_.upper_bounded(),
                             [&](Index i) { return at_end[i] <= canonical_.upper()[i]; });
}

/// Without f, which corrections do not need.
bool Walk::evaluate(Trial& trial) {
  return canonical_.constraints(trial.v, trial.evaluation.c) == EvaluationStatus::Ok &&
         canonical_.first_derivatives(trial.v, trial.evaluation) == EvaluationStatus::Ok;
}

/// f with what the violation left over is worth.
double Walk::lagrangian(const Evaluation& evaluation) const {
  double value = evaluation.f;
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    if (system_.counts(j)) value += point_.iterate.lambda[j] * evaluation.c[j];
  }
  return value;
}

/// Of the constraints and the stationarity of those who answer, negative, in units.
NewtonResidual Walk::residual_of(const Trial& trial) const {
  const Units& units = system_.units();
  NewtonResidual rhs = zero_step(canonical_);
  const Index first_row = inner() ? canonical_.max_constraints().begin : 0;
  for (Index j = first_row; j < canonical_.constraints(); ++j) {
    if (system_.counts(j)) rhs.lambda[j] = -units.constraint[j] * trial.evaluation.c[j];
  }
  if (kind_ == Kind::Inner) return rhs;
  Eigen::VectorXd gradient = trial.evaluation.gradient;
  for (std::size_t k = 0; k < trial.evaluation.jacobian.size(); ++k) {
    const auto [row, col] = canonical_.jacobian()[k];
    const bool kept = system_.counts(row) || system_.classes().is_redundant(row);
    if (kept) gradient[col] += trial.evaluation.jacobian[k] * trial.lambda[row];
  }
  const auto answer = [&](IndexRange own) {
    for (Index i = own.begin; i < own.end; ++i) {
      if (!system_.is_fixed(i)) rhs.v[i] = -units.variable[i] * gradient[i];
    }
  };
  answer(canonical_.y());
  if (kind_ == Kind::Valley) answer(canonical_.x());
  const IndexRange own = inner() ? canonical_.y() : canonical_.x();
  for (const Eigen::VectorXd& direction : free_) {
    const auto free = direction.segment(own.begin, own.size());
    rhs.v.segment(own.begin, own.size()) -= free.dot(rhs.v.segment(own.begin, own.size())) * free;
  }
  return rhs;
}

/// One Newton step with the matrix at hand. residual: what was left before, in units.
bool Walk::correct(Trial& trial, double& residual) {
  const Units& units = system_.units();
  const NewtonResidual rhs = residual_of(trial);
  residual = 0.0;
  for (const Eigen::VectorXd* part : {&rhs.v, &rhs.lambda}) {
    if (part->size() > 0) residual = std::max(residual, part->lpNorm<Eigen::Infinity>());
  }
  if (residual == 0.0) return true;
  Step step = zero_step(canonical_);
  const bool solved = inner() ? system_.kkt().solve_inner(system_.assembled(), rhs, step)
                              : system_.kkt().solve(system_.assembled(), rhs, step);
  if (!solved) return false;
  for (Index i = begin_; i < canonical_.variables(); ++i) {
    if (!system_.is_slack(i) && !system_.is_fixed(i)) trial.v[i] += units.variable[i] * step.v[i];
  }
  const Index first_row = inner() ? canonical_.max_constraints().begin : 0;
  for (Index j = first_row; j < canonical_.constraints(); ++j) {
    if (system_.counts(j)) trial.lambda[j] += units.constraint[j] * step.lambda[j];
  }
  return evaluate(trial);
}

Walk::End Walk::take(const Eigen::VectorXd& step, double length) {
  End end;
  Trial trial{point_.iterate.v + length * step, point_.iterate.lambda, point_.evaluation};
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(canonical_.constraints());
  if (!is_inside(trial.v, none) || !evaluate(trial)) return end;  // corrections are small
  const double scale = valley() ? std::abs(length) : length * length;
  const double small = (valley() ? kSmallInValley : kSmall) * scale;
  double residual = 0.0, last = 0.0;
  for (int k = 0; k < kCorrections; ++k) {
    if (!correct(trial, residual)) return end;
    if (residual <= (valley() ? kNegligibleInValley : kNegligible) * scale) break;
    // With the same matrix all the way they converge linearly.
    const double rate = k > 0 ? residual / last : 0.0;
    if (!(residual * std::pow(rate, kCorrections - 1 - k) <= kHopeless * small)) return end;
    last = residual;
  }
  if (!(residual <= small) ||
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
