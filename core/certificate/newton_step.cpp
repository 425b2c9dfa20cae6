#include <algorithm>
#include <cmath>

#include "core/certificate/trial.hpp"
#include "core/model/iterate.hpp"

namespace ipminmax {

namespace {

using namespace parameters::certificate;

double ratio(double a, double b) { return b > 0.0 ? a / b : 0.0; }

/// Newton's method for  grad L = 0 (free variables),  c = 0 (rows that count), v = bound (fixed).
struct ActiveSetNewton {
  TestContext& c;
  TrialPoint& trial;
  ActiveSetSystem& system;
  const KktSolve& solve;
  CanonicalProblem& canonical = c.canonical;
  const Iterate& iterate = trial.point.iterate;
  const Evaluation& evaluation = trial.point.evaluation;
  NewtonTest& test = trial.newton;
  const ActiveBounds& set = trial.set;
  const VariableScaling& scaling = trial.scaling;
  Parts parts = system.parts;
  /// v: the gradient of the Lagrangian, as predicted for the end of the step; of slacks -lambda.
  /// lambda: without those of rows that do not count.
  Step& here = parts.step();
  Step& newton = parts.step();
  Step& probe = parts.step();  ///< v: the step; lambda: at its end
  Step& end = parts.step();    ///< v: of the probe step; lambda: a little beyond
  Step& rows = parts.step();   ///< minus a right-hand side
  Step& changes = parts.step();
  Step& back = parts.step();
  Step& second = parts.step();
  Evaluation& there = parts.point().evaluation;  ///< at the end of the probe step

  double length(const Vector& v) const { return longest(canonical, v, scaling); }

  /// Right-hand side -rows and solution wanted in the canonical problem's lengths.
  bool solve_scaled(Step& solution) {
    NewtonResidual& rhs = system.rhs();
    for (const Index i : each_variable(canonical)) {
      if (system.is_free(i)) rhs.v[i] = scaling.variable[i] * -rows.v[i];
    }
    for (const Index j : each_constraint(canonical)) {
      if (system.counts(j)) rhs.lambda[j] = scaling.constraint[j] * -rows.lambda[j];
    }
    if (!solve(rhs, system.step())) return false;
    Vector &v = solution.v, &lambda = solution.lambda;
    v = system.step().v.cwiseProduct(scaling.variable);
    lambda = system.step().lambda.cwiseProduct(scaling.constraint);
    for (const Index i : each_variable(canonical)) {
      if (!system.is_free(i)) v[i] = 0.0;
    }
    for (const Index j : each_constraint(canonical)) {
      if (!system.counts(j)) lambda[j] = 0.0;
    }
    return v.allFinite() && lambda.allFinite();
  }

  bool first_step() {
    here.lambda = iterate.lambda;
    for (const Index j : each_constraint(canonical)) {
      if (!system.counts(j) && !set.is_redundant(j)) here.lambda[j] = 0.0;
    }
    Vector& fixed = back.v;  // the way to their bounds
    fixed.setZero(canonical.variables());
    for (const Index i : each_variable(canonical)) {
      if (system.is_fixed(i) && set.side_of(i) != 0)
        fixed[i] = set.side_of(i) * set.distance(canonical, iterate, i);
    }
    Vector& gradient = here.v;
    gradient = evaluation.gradient;
    add_transposed_product(canonical, evaluation, here.lambda, gradient);
    rows.v = gradient;
    add_hessian_product(canonical, evaluation, fixed, rows.v);
    rows.lambda = evaluation.c;
    add_constraint_product(canonical, evaluation, fixed, rows.lambda);
    if (!solve_scaled(newton)) return false;
    newton.v += fixed;
    changes.lambda = evaluation.c;
    add_constraint_product(canonical, evaluation, newton.v, changes.lambda);
    for_each_slack(canonical,
                   [&](Index j, Index slack) {  // of inactive inequalities: follow their constraint
                     if (!system.is_fixed(slack)) newton.v[slack] = changes.lambda[j];
                   });
    add_hessian_product(canonical, evaluation, newton.v, gradient);
    add_transposed_product(canonical, evaluation, newton.lambda, gradient);
    for_each_slack(canonical, [&](Index j, Index slack) {
      gradient[slack] = -(here.lambda[j] + newton.lambda[j]);
    });
    return true;
  }

  void expect(Index i, bool holds) {
    if (!holds && test.changing < 0) test.changing = i;
  }

  /// test.changing: the first bound whose class the step changes.
  void look_at_set() {
    for (const Index i : each_variable(canonical)) {
      const int side = set.side_of(i);
      if (side == 0 || !system.is_fixed(i)) continue;
      const double before = set.multiplier(iterate, i);
      const double after = -side * canonical.sign(i) * here.v[i];
      if (set[i] == BoundClass::Active) {
        expect(i, std::abs(after - before) <= kConfirmed * before);
      } else if (canonical.owned_by_max(i) && after < -before) {  // else zero, as far as is known
        test.released.push_back(i);
        expect(i, false);
      }
    }
    for_each_bound(canonical, iterate.v, [&](Index i, int side, double distance) {
      if (set[i] != BoundClass::Inactive) return;
      // At the model's own bound, to a share of its relaxation, an answer of Max is held by it for
      // some x nearby.
      constexpr double kAtBound = 1e-4;
      const double own = relaxation_of(canonical, i, side, c.options);
      const bool at_bound = set.side_of(i) == side && canonical.owned_by_max(i) &&
                            std::abs(distance - side * newton.v[i] - own) < kAtBound * own;
      expect(i, side * newton.v[i] <= kConfirmed * distance && !at_bound);
    });
  }

  /// What bounds are relaxed by must not be what decides. A linear prediction of multipliers and
  /// distances if all bounds are moved back by their relaxation: those of active bounds and of
  /// Max's inactive ones have to keep half of what they are.
  void look_at_model_bounds() {
    Vector &inside = back.v, &outside = rows.v, &curvature = changes.v;
    for (Vector* v : {&inside, &outside, &curvature}) v->setZero(canonical.variables());
    bool decides = false;  // a bound of a variable without curvature
    // Curvature of its own, of its owner's sign, makes a variable's best value one, whatever its
    // multiplier is.
    for_each_in_hessian(canonical, evaluation, [&](Index i, Index j, double value) {
      if (i == j) curvature[i] += canonical.sign(i) * value;
    });
    curvature = curvature.cwiseMax(0.0);
    // An inequality between variables without any is as a bound.
    for (const auto [row, col] : canonical.jacobian()) {
      if (const Index slack = canonical.slack_of(row); slack >= 0)
        curvature[slack] += std::abs(curvature[col]);
    }
    for_each_bound(canonical, iterate.v, [&](Index i, int side, double distance) {
      const double own = relaxation_of(canonical, i, side, c.options);
      if (!system.is_fixed(i)) {
        if (distance > 2.0 * own) return;
        outside[i] = own;
        // Beyond its model's bound an answer that is not unique counts for nothing.
        const bool of_max = canonical.owned_by_max(i) && set[i] == BoundClass::Inactive;
        decides = decides || (of_max && curvature[i] == 0.0);
      } else if (set.side_of(i) == side) {
        inside[i] = -side * own;
        decides = decides || curvature[i] == 0.0;
      }
    });
    if (!decides) return;
    Vector& moved = changes.v;  // of the gradient, by those that no bound holds
    moved.setZero(canonical.variables());
    for_each_in_hessian(canonical, evaluation, [&](Index i, Index j, double value) {
      moved[i] += std::abs(value) * outside[j];
      if (i != j) moved[j] += std::abs(value) * outside[i];
    });
    Vector &dv = second.v, &change = rows.v;
    change.setZero(canonical.variables());
    rows.lambda.setZero(canonical.constraints());
    add_hessian_product(canonical, evaluation, inside, change);
    add_constraint_product(canonical, evaluation, inside, rows.lambda);
    if (!solve_scaled(second)) return;
    dv += inside;
    change.setZero(canonical.variables());
    add_hessian_product(canonical, evaluation, dv, change);
    add_transposed_product(canonical, evaluation, second.lambda, change);
    for_each_slack(canonical, [&](Index j, Index slack) { change[slack] = -second.lambda[j]; });
    for_each_bound(canonical, iterate.v, [&](Index i, int side, double distance) {
      const bool active = set[i] == BoundClass::Active;
      const bool near = set[i] == BoundClass::Inactive && canonical.owned_by_max(i);
      if (set.side_of(i) != side || !(active || near)) return;
      const double left = active ? set.multiplier(iterate, i) : distance;
      const double lost = active ? side * canonical.sign(i) * change[i] + moved[i]
                                 : relaxation_of(canonical, i, side, c.options) + side * dv[i];
      if (lost <= kConfirmed * left) return;
      if (active) test.released.push_back(i);
      expect(i, false);
    });
  }

  /// The Newton step and a little beyond, so that rounding does not decide.
  void choose_probe_step() {
    const double size = std::max(length(iterate.v), kInTols);
    probe.v = newton.v;
    for (const Index i : indices(probe.v)) {
      if (system.is_fixed(i)) {
        probe.v[i] *= kShareOfWay;
      } else if (!is_slack(canonical, i)) {
        // Beyond what a contraction leaves of the step: W may jump at the solution itself.
        const double own =
            std::min(std::abs(iterate.v[i]), own_size(canonical, iterate.v[i], i, scaling));
        const double farther = kRootOfRounding * own + kConstant * scaling.variable[i] * size +
                               kContraction * std::abs(newton.v[i]);
        probe.v[i] += newton.v[i] < 0.0 ? -farther : farther;
      }
    }
    for_each_bound(canonical, iterate.v, [&](Index i, int side, double distance) {
      const double step = side * newton.v[i], beyond = (1.0 + kContraction) * step;
      const double most = std::max(kShareOfRoom * distance, beyond < distance ? beyond : step);
      if (system.is_free(i) && side * probe.v[i] > most) probe.v[i] = side * most;
    });
    end.v = iterate.v + probe.v;
    probe.lambda = here.lambda + newton.lambda;
  }

  /// Derivatives at the end of the probe step beside what the linearized equations predict there.
  bool compare() {
    Vector& probed = end.lambda;
    probed = probe.lambda;
    constexpr double kFarther = 1e-10;  // of a multiplier, beyond its own step
    for (const Index j : indices(probed))
      probed[j] += (newton.lambda[j] < 0.0 ? -kFarther : kFarther) * std::abs(probed[j]);
    there = evaluation;
    if (!canonical.constraints(end.v, there.c) || !canonical.first_derivatives(end.v, there) ||
        !canonical.second_derivatives(end.v, probed, there)) {
      return false;
    }
    back.v = -probe.v;
    back.lambda = -probe.lambda;
    rows.v = there.gradient - evaluation.gradient;
    add_transposed_product(canonical, there, probe.lambda, rows.v);
    add_transposed_product(canonical, evaluation, back.lambda, rows.v);
    add_hessian_product(canonical, evaluation, back.v, rows.v);
    rows.lambda = there.c - evaluation.c;
    add_constraint_product(canonical, evaluation, back.v, rows.lambda);
    if (!solve_scaled(second)) return false;
    // It grows with the probe step; of rounding nothing is left.
    test.contraction = ratio(length(second.v), length(probe.v)) / (1.0 + kContraction);
    if (test.contraction <= kRounding) test.contraction = 0.0;
    if (second.v.size() > 0)
      second.v.cwiseQuotient(scaling.variable).cwiseAbs().maxCoeff(&test.left_in);
    test.hessian_change.assign(there.hessian.size(), 0.0);
    compare_hessian();
    look_at_inequalities();
    measure_variation();
    look_at_other_side();
    measure_error();
    return test.error.allFinite() && std::isfinite(test.contraction);
  }

  void compare_hessian() {
    for (std::size_t k = 0; k < there.hessian.size(); ++k) {
      const double change = std::abs(there.hessian[k] - evaluation.hessian[k]);
      test.hessian_change[k] = std::max(test.hessian_change[k], change);
    }
  }

  /// If a step is nothing but rounding, here and the end of the probe step may be on one side of
  /// where W jumps: W is compared on the other side of the end as well, in place of what was there.
  /// A model that is undefined there has no other W.
  void look_at_other_side() {
    bool is_there = false;
    for (const Index i : indices(probe.v)) {
      is_there = is_there || (system.is_free(i) &&
                              std::abs(newton.v[i]) <= kStepIsRounding * std::abs(probe.v[i]));
    }
    if (!is_there) return;
    Vector& v = changes.v;
    v = end.v;
    for (const Index i : indices(v)) {
      if (!system.is_fixed(i)) v[i] = iterate.v[i] - probe.v[i] + 2.0 * newton.v[i];
    }
    there = evaluation;
    if (canonical.second_derivatives(v, end.lambda, there)) compare_hessian();
  }

  void measure_error() {
    test.error.setZero(canonical.variables());
    std::vector<double>& counted = there.hessian;
    counted = test.hessian_change;
    for_each_entry(canonical.hessian(), counted, [&](Index i, Index j, double& value) {
      const bool held = set[i] == BoundClass::Active || set[j] == BoundClass::Active;
      value *= held ? 0.0 : 2.0;
    });
    add_row_sums(canonical, counted, scaling.variable, test.error);
  }

  /// Their values at the end of the probe step, where they are not what their gradients predict. A
  /// weakly active one is violated by no more than it is satisfied now.
  void look_at_inequalities() {
    Vector& change = changes.v;
    change.setZero(canonical.variables());
    for_each_slack(canonical, [&](Index j, Index slack) {
      if (!system.is_fixed(slack)) change[slack] = probe.v[slack] + there.c[j];
    });
    for_each_bound(canonical, iterate.v, [&](Index i, int side, double distance) {
      const double most = set[i] == BoundClass::Inactive ? kConfirmed : 2.0;
      expect(i, side * change[i] <= most * distance);
    });
  }

  /// Gradients of equations change over the Newton step alone, for they have second derivatives;
  /// what bounds are relaxed by moves inequalities about as far as the probe step.
  void measure_variation() {
    double share = 0.0;  // the Newton step, with its rounding, over the step that is tried
    for (const Index i : indices(probe.v)) {
      if (!system.is_free(i) || probe.v[i] == 0.0) continue;
      const double step = std::abs(newton.v[i]) + kRounding * std::abs(iterate.v[i]);
      share = std::max(share, step / std::abs(probe.v[i]));
    }
    share = std::min(share, 1.0);
    Vector &all = rows.lambda, &inner = second.lambda;
    all.setZero(canonical.constraints());
    inner.setZero(canonical.constraints());
    for (std::size_t k = 0; k < there.jacobian.size(); ++k) {
      const auto [row, col] = canonical.jacobian()[k];
      if (!system.counts(row) || system.is_fixed(col)) continue;
      const double change = (canonical.slack_of(row) < 0 ? share : 1.0) * scaling.constraint[row] *
                            scaling.variable[col] *
                            std::abs(there.jacobian[k] - evaluation.jacobian[k]);
      all[row] += change;
      if (canonical.max_constraints().contains(row) && canonical.owned_by_max(col))
        inner[row] += change;
    }
    if (all.size() == 0) return;
    test.jacobian_variation = all.maxCoeff(&test.varying_row);
    test.inner_variation = inner.maxCoeff();
  }

  void place_end() {
    Iterate& z = test.end;
    z = iterate;
    z.v += newton.v;
    for (const Index i : indices(newton.v)) {
      if (system.is_fixed(i)) z.v[i] = iterate.v[i] + kShareOfWay * newton.v[i];
    }
    z.lambda = here.lambda + newton.lambda;
    for_each_bound(canonical, iterate.v, [&](Index i, int side, double before) {
      double& multiplier = multiplier_of(z, i, side);
      const double after = distance_to_bound(canonical, z.v, i, side);
      constexpr double kKept = 1e-3;  // of a multiplier that would change its sign
      if (system.is_fixed(i) && set.side_of(i) == side) {
        multiplier = std::max(-side * canonical.sign(i) * here.v[i], kKept * multiplier);
      } else if (after > 0.0) {
        multiplier *= before / after;
      }
    });
  }
};

}  // namespace

bool newton_confirms(TestContext& c, TrialPoint& trial, ActiveSetSystem& system,
                     const KktSolve& solve) {
  ActiveSetNewton newton{c, trial, system, solve};
  NewtonTest& test = trial.newton;
  test.clear();
  if (!newton.first_step()) return false;
  test.step = newton.length(newton.newton.v);
  newton.look_at_set();
  newton.look_at_model_bounds();
  newton.choose_probe_step();
  test.done = newton.compare();
  test.set_holds = test.done && test.changing < 0;
  newton.place_end();
  return test.set_holds && test.contraction <= kContraction;
}

}  // namespace ipminmax
