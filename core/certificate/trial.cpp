#include "core/certificate/trial.hpp"

#include <algorithm>
#include <cmath>

#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/model/products.hpp"
#include "core/point/residual.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace {

using namespace parameters::certificate;

Vector sizes_of(const CanonicalProblem& canonical, const Point& point) {
  return point.iterate.v.cwiseAbs().cwiseMax(canonical.starting_point().v.cwiseAbs());
}

/// What multipliers may be off by: residual of the gradient that they balance, and rounding of its
/// terms, over the length of their row.
Vector multiplier_error(const CanonicalProblem& canonical, const TrialPoint& trial,
                        const Vector& lambda) {
  const Evaluation& here = trial.point.evaluation;
  Vector off = Vector::Zero(canonical.constraints()), length = off, left = here.gradient;
  add_transposed_product(canonical, here, lambda, left);
  for_each_in_jacobian(canonical, here, [&](Index row, Index col, double value) {
    length[row] = std::max(length[row], std::abs(value));
    if (value == 0.0 || trial.set[col] != BoundClass::Inactive) return;
    off[row] = std::max(
        {off[row], kResiduals * std::abs(left[col]), kRounding * std::abs(lambda[row] * value)});
  });
  return (length.array() > 0.0).select(off.array() / length.array(), 0.0);
}

/// Of W, scaled: that of differences, and what weakly active inequalities may give or not.
Vector hessian_error_of(TestContext& c, const TrialPoint& trial) {
  Vector error = c.scaled_hessian_error(trial.scaling);
  Vector lambda = trial.point.iterate.lambda;
  bool any = false;
  for_each_slack(c.canonical, [&](Index j, Index slack) {
    if (trial.set[slack] == BoundClass::Active) return;
    any = any || trial.set[slack] == BoundClass::WeaklyActive;
    lambda[j] = 0.0;
  });
  if (error.size() == 0) error.setZero(c.canonical.variables());
  if (!any) return error;
  Evaluation without = trial.point.evaluation;
  if (c.canonical.second_derivatives(trial.point.iterate.v, lambda, without) !=
      EvaluationStatus::Ok) {
    return Vector::Constant(c.canonical.variables(), kInfinity);
  }
  for (const auto k : indices(without.hessian))
    without.hessian[k] -= trial.point.evaluation.hessian[k];
  add_row_sums(c.canonical, without.hessian, trial.scaling.variable, error);
  return error;
}

/// Whether the gradient along Max's free variables vanishes at the end of the Newton step: no step
/// takes the slope away of what f is linear in, and K with it is singular. Along a face of worst
/// cases all that it is a sum of is rounding of other terms, over the variable's whole size.
bool is_stationary_at_end(const CanonicalProblem& canonical, const TrialPoint& trial) {
  const Point& point = trial.point;
  const Iterate& end = trial.newton.end;
  const Vector size = sizes_of(canonical, point);
  Vector left = point.evaluation.gradient, terms = left.cwiseAbs();
  add_hessian_product(canonical, point.evaluation, end.v - point.iterate.v, left);
  add_transposed_product(canonical, point.evaluation,
                         without_inactive(canonical, trial.set, end.lambda), left);
  // What the gradient of L is a sum of.
  for_each_in_hessian(canonical, point.evaluation, [&](Index i, Index j, double value) {
    terms[i] += std::abs(value) * size[j];
    if (i != j) terms[j] += std::abs(value) * size[i];
  });
  for_each_in_jacobian(canonical, point.evaluation, [&](Index row, Index col, double value) {
    terms[col] += std::abs(value * point.iterate.lambda[row]);
  });
  const double none = kRounding * terms.cwiseProduct(size).maxCoeff();
  for (const Index i : indices(canonical.y())) {
    const double slope = std::abs(left[i]);
    if (trial.set[i] == BoundClass::Inactive &&
        !(slope <= kHardly * terms[i] || slope * size[i] <= none)) {
      return false;
    }
  }
  return true;
}

/// Largest entry of the solution for a generic right-hand side, slacks and bound multipliers apart;
/// infinite where the factors do not reproduce the matrix. False: without pivoting an inertia is
/// trusted only when they do.
bool is_trusted(ActiveSetSystem& system, bool inner, double& response) {
  constexpr double kHalved = 2.0 / 3.0;  // entries of 1/2 on the average
  const CanonicalProblem& canonical = system.canonical;
  NewtonResidual& rhs = system.rhs();
  for (const Index i : each_variable(canonical)) {
    if (system.is_free(i)) rhs.v[i] = kHalved * generic_entry(i);
  }
  for (const Index j : each_constraint(canonical)) {
    if (system.counts(j)) rhs.lambda[j] = kHalved * generic_entry(canonical.variables() + j);
  }
  const Step& step = system.step();
  response = kInfinity;
  if (system.solve(inner, rhs, system.step(), system.kkt.least_accuracy())) {
    response = max_norm(step.lambda, inner ? canonical.max_constraints().begin : 0,
                        canonical.constraints());
    for (Index i = inner ? canonical.y().begin : 0; i < canonical.variables(); ++i) {
      if (!is_slack(canonical, i)) response = std::max(response, std::abs(step.v[i]));
    }
  }
  return system.kkt.pivots() || std::isfinite(response);
}

}  // namespace

bool solve_accurately(KktSystem& kkt, const Evaluation& evaluation, const NewtonResidual& rhs,
                      Step& step, const Regularization& shift) {
  for (;;) {
    // What the inertia is does not matter, and the solution is tested.
    const KktFactors factors = kkt.factorize_for_solutions(shift, Certainty::Usual);
    if (factors.status != FactorizationStatus::Ok) return false;
    if (kkt.solve(evaluation, rhs, step)) return true;
    if (!kkt.increase_quality()) return false;
  }
}

void guess_active_set(const TestContext& c, TrialPoint& trial) {
  guess_active_set(c.canonical, c.options, trial.point.iterate, trial.scaling, kStrictRatio,
                   trial.set);
  trial.hold_inactive();
}

Vector without_inactive(const CanonicalProblem& canonical, const ActiveBounds& set, Vector lambda) {
  for (const Index j : each_constraint(canonical)) {
    const Index slack = canonical.slack_of(j);
    const bool inactive = slack >= 0 && set[slack] == BoundClass::Inactive;
    if (inactive || set.is_held(j)) lambda[j] = 0.0;
  }
  return lambda;
}

bool drop_inactive_multipliers(TestContext& c, TrialPoint& trial) {
  const Iterate& z = trial.point.iterate;
  const Vector lambda = without_inactive(c.canonical, trial.set, z.lambda);
  return lambda == z.lambda || c.canonical.second_derivatives(
                                   z.v, lambda, trial.point.evaluation) == EvaluationStatus::Ok;
}

VariableScaling certain_scaling(TestContext& c, const TrialPoint& trial) {
  const Iterate& z = trial.point.iterate;
  Evaluation certain = trial.point.evaluation, there = certain;
  for (const auto k : indices(trial.newton.hessian_change)) {
    if (std::abs(certain.hessian[k]) < kConfirmed * trial.newton.hessian_change[k])
      certain.hessian[k] = 0.0;
  }
  Vector step = kRounding * sizes_of(c.canonical, trial.point);
  keep_within_bounds(c.canonical, z.v, kLittle, step);
  step += z.v;
  Vector lambda = without_inactive(c.canonical, trial.set, z.lambda);
  lambda += multiplier_error(c.canonical, trial, lambda);
  if (c.canonical.first_derivatives(step, there) == EvaluationStatus::Ok &&
      c.canonical.second_derivatives(step, without_inactive(c.canonical, trial.set, lambda),
                                     there) == EvaluationStatus::Ok) {
    const auto keep = [](const std::vector<double>& changed, std::vector<double>& values) {
      for (const auto k : indices(values)) {
        if (!(std::abs(changed[k] - values[k]) <= std::abs(values[k]))) values[k] = 0.0;
      }
    };
    keep(there.hessian, certain.hessian);
    keep(there.jacobian, certain.jacobian);
  }
  return variable_scaling(c.canonical, z.v, certain, c.arrays.scaling, trial.proximal > 0.0);
}

void settle_active_set(TestContext& c, TrialPoint& trial, ActiveSetSystem& system) {
  system.assemble(ActiveSetSystem::kSufficient);
  trial.error = hessian_error_of(c, trial);
  Regularization shift;
  const KktSolve solve = [&](const NewtonResidual& rhs, Step& step) {
    return solve_accurately(c.kkt, system.assembled(), rhs, step, shift);
  };
  trial.converges = newton_confirms(c, trial, system, solve);
  if (trial.proximal > 0.0) {
    if (!trial.converges) {  // to one of several solutions
      shift.y = trial.proximal;
      trial.converges = newton_confirms(c, trial, system, solve);
    }
    trial.converges = trial.converges && is_stationary_at_end(c.canonical, trial);
  }
  if (trial.newton.done) trial.error += trial.newton.error;
}

InertiaTest second_order_test(ActiveSetSystem& system, const Vector& error, double margin,
                              double proximal, bool inner_alone) {
  KktSystem& kkt = system.kkt;
  const Regularization inner{.y = proximal - margin}, full{.x = -margin, .y = margin + proximal};
  const bool same_values = error.size() == 0 && system.set.weak(system.canonical, Player::Max) == 0;
  InertiaTest test;
  // The worst W for the maximizer has + error in y, and no weakly active bound holds him.
  system.assemble({}, error, 0.0, -1.0);
  test.inner = kkt.has_expected_inner_inertia(kkt.factorize_inner(inner)) &&
               is_trusted(system, true, test.inner_response);
  if (!test.inner || inner_alone) return test;
  // For the minimizer the worst W has - error everywhere, for then phi'' = W_xx - W_xy W_yy^-1 W_yx
  // (on the tangent spaces) is smallest.
  if (!same_values) system.assemble(ActiveSetSystem::kSufficient, error, -1.0, 1.0);
  test.full = kkt.has_expected_inertia(kkt.factorize(full)) &&
              is_trusted(system, false, test.full_response);
  return test;
}

namespace {

/// An iterate on the way of the test's Newton steps, with multipliers of open bounds that are
/// mu / s.
Iterate solution_of(const CanonicalProblem& canonical, const TrialPoint& trial, Iterate end,
                    double mu) {
  // Weakly active ones of Max are in the equations, with multipliers of their own.
  const auto in_equations = [&](Index i) {
    return trial.set[i] == BoundClass::Active ||
           (trial.set[i] == BoundClass::WeaklyActive && canonical.owned_by_max(i));
  };
  for_each_bound(canonical, end.v, [&](Index i, int side, double distance) {
    const bool open = !in_equations(i) || trial.set.side_of(i) != side;
    if (open && distance > 0.0) multiplier_of(end, i, side) = mu / distance;
  });
  for_each_slack(canonical, [&](Index j, Index slack) {
    if (!in_equations(slack))
      end.lambda[j] = canonical.sign(slack) * (end.z_upper[slack] - end.z_lower[slack]);
  });
  return end;
}

}  // namespace

double move_to(TestContext& c, TrialPoint& trial, const Iterate& reached, double mu,
               double allowed) {
  Point end = trial.point;
  end.iterate = solution_of(c.canonical, trial, reached, mu);
  const double error = c.evaluate(end) ? c.error(end) : kInfinity;
  if (!(error <= allowed)) return error;
  trial.moved = std::move(end);
  trial.mu = mu;
  return error;
}

bool move_to_end(TestContext& c, TrialPoint& trial, const Iterate& end, double allowed) {
  const double left = move_to(c, trial, end, trial.mu, allowed);
  if (left <= allowed || !std::isfinite(left)) return left <= allowed;
  // Multipliers mu / s may be what is left.
  const double mu = kLittle * allowed / left * trial.mu;
  return move_to(c, trial, end, mu, allowed) <= allowed;
}

bool gradients_hold(const TrialPoint& trial) {
  return trial.newton.inner_turn * trial.test.inner_response <= kTurn &&
         trial.newton.turn * trial.test.full_response <= kTurn;
}

void measure_inertias(TestContext& c, ActiveSetSystem& system, TrialPoint& trial) {
  trial.inner = trial.full = Inertia{};
  if (!c.may_factorize(c.has_x() && c.has_y() ? 2 : 1)) return;
  system.assemble(ActiveSetSystem::kSufficient);
  trial.inner = c.kkt.factorize_inner({}).inertia;
  trial.full = c.kkt.factorize({}).inertia;
}

bool rows_are_left_out(const CanonicalProblem& canonical, const TrialPoint& trial, bool of_max) {
  if (!trial.dependences) return true;
  const auto open = [&](const Dependence& d) {
    const bool max = canonical.max_constraints().contains(d.row);
    return (max || !of_max) && !trial.set.is_redundant(d.row);
  };
  return trial.dependences->complete && std::ranges::none_of(trial.dependences->found, open);
}

bool is_near(const TestContext& c, const Vector& from, const Vector& to,
             const VariableScaling& scaling, double share) {
  const double size = size_of_problem(c.canonical, from, scaling);
  const Vector& start = c.canonical.starting_point().v;
  for (const IndexRange own : {c.canonical.x(), c.canonical.y()}) {
    for (const Index i : indices(own)) {
      const double length = std::abs(to[i] - from[i]), unit = size * scaling.variable[i];
      if (!(length <= share * unit)) return false;
      const double own_size = std::max(std::abs(from[i]), std::abs(start[i]));
      constexpr double kFar = 1e-3;  // beside the variable's own size, and in the problem's units
      if (length > kFar * own_size && (length > kFar || length > c.far() * unit)) return false;
    }
  }
  return true;
}

}  // namespace ipminmax
