#include "core/certificate/trial.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

bool ActiveBounds::exceeds_variables(const CanonicalProblem& canonical) const {
  constexpr Index kMostPerVariable = 2;  // a vertex has one; where a few rows are repeated, more
  auto active = std::ranges::count(of, BoundClass::Active);
  for (const Index j : each_constraint(canonical))
    active += canonical.slack_of(j) < 0 && !is_left_out(j);
  const Index slacks = canonical.x_slacks().size() + canonical.y_slacks().size();
  return active > kMostPerVariable * (canonical.variables() - slacks);
}

void guess_active_set(const TestContext& c, double strict_ratio, TrialPoint& trial) {
  const Iterate& iterate = trial.point.iterate;
  trial.set.reset(c.canonical);
  for_each_bound(c.canonical, iterate.v, [&](Index i, int side, double distance) {
    const double unit = trial.scaling.variable[i];
    const BoundClass found =
        class_of(multiplier_of(iterate, i, side) * unit * unit, distance, strict_ratio);
    const bool relaxed = c.within_relaxation(i, side, distance);
    trial.set.include(i, side,
                      found == BoundClass::Inactive && relaxed ? BoundClass::WeaklyActive : found);
  });
  trial.hold_inactive();
}

void ActiveSetSystem::assemble(Weak fixed, const Vector& error, double error_times) {
  Vector& curvature = curvature_;
  curvature.setZero(canonical.variables());
  for (const Index i : each_variable(canonical)) {
    const bool max = canonical.owned_by_max(i);
    const bool held = set[i] == BoundClass::Active || (set[i] == BoundClass::WeaklyActive &&
                                                       (max ? fixed.max_fixed : fixed.min_fixed));
    fixed_[i] = held ? 1.0 : 0.0;
    if (is_slack(canonical, i)) {
      curvature[i] = held ? parameters::certificate::kRigid : 1.0;
    } else if (held) {
      curvature[i] = 1.0;
    } else if (error.size() > 0) {
      curvature[i] = canonical.sign(i) * error_times * error[i];
    }
  }
  reduced_.hessian = evaluation_.hessian;
  reduced_.jacobian = evaluation_.jacobian;
  scale(reduced_);
  for_each_in_hessian(canonical, reduced_, [&](Index i, Index j, double& value) {
    if (is_fixed(i) || is_fixed(j)) value = 0.0;
  });
  for_each_in_jacobian(canonical, reduced_, [&](Index row, Index col, double& value) {
    if (is_fixed(col) || !counts(row)) value = 0.0;
  });
  const bool any = !set.redundant.empty() || !set.held_rows.empty();
  left_out_.assign(any ? at(canonical.constraints()) : 0, true);
  for (Index j = 0; any && j < canonical.constraints(); ++j) {
    left_out_[at(j)] = set.is_left_out(j);
    if (canonical.slack_of(j) >= 0 && set.is_left_out(j)) curvature[canonical.slack_of(j)] = 1.0;
  }
  kkt.assemble(reduced_, curvature, left_out_);
}

void ActiveSetSystem::scale(Evaluation& derivatives) const {
  derivatives.jacobian_call = derivatives.hessian_call = 0;  // of no evaluation
  for_each_in_hessian(canonical, derivatives, [&](Index i, Index j, double& value) {
    value *= scaling.variable[i] * scaling.variable[j];
  });
  for_each_in_jacobian(canonical, derivatives, [&](Index row, Index col, double& value) {
    value *= scaling.constraint[row] * scaling.variable[col];
  });
}

}  // namespace ipminmax
