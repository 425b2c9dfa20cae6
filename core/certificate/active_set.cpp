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
  Vector& curvature = arrays_.curvature;
  curvature.setZero(canonical.variables());
  for (const Index i : each_variable(canonical)) {
    const bool max = canonical.owned_by_max(i);
    const bool held = set[i] == BoundClass::Active || (set[i] == BoundClass::WeaklyActive &&
                                                       (max ? fixed.max_fixed : fixed.min_fixed));
    arrays_.fixed[at(i)] = held;
    if (is_slack(canonical, i)) {
      curvature[i] = held ? parameters::certificate::kRigid : 1.0;
    } else if (held) {
      curvature[i] = 1.0;
    } else if (error.size() > 0) {
      curvature[i] = canonical.sign(i) * error_times * error[i];
    }
  }
  arrays_.reduced.hessian = arrays_.scaled.hessian;
  for_each_in_hessian(canonical, arrays_.reduced, [&](Index i, Index j, double& value) {
    if (is_fixed(i) || is_fixed(j)) value = 0.0;
  });
  arrays_.reduced.jacobian = arrays_.scaled.jacobian;
  for_each_in_jacobian(canonical, arrays_.reduced, [&](Index row, Index col, double& value) {
    if (is_fixed(col) || !counts(row)) value = 0.0;
  });
  const bool any = !set.redundant.empty() || !set.held_rows.empty();
  arrays_.left_out.assign(any ? at(canonical.constraints()) : 0, true);
  for (Index j = 0; any && j < canonical.constraints(); ++j) {
    arrays_.left_out[at(j)] = set.is_left_out(j);
    if (canonical.slack_of(j) >= 0 && set.is_left_out(j)) curvature[canonical.slack_of(j)] = 1.0;
  }
  kkt.assemble(arrays_.reduced, curvature, arrays_.left_out);
}

}  // namespace ipminmax
