#include "core/certificate/trial.hpp"

#include <algorithm>
#include <cmath>

#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/point/point.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace {

using namespace parameters::certificate;

/// Largest entry of the solution for a generic right-hand side, slacks and bound multipliers apart;
/// infinite where the factors do not reproduce the matrix. False: without pivoting an inertia is
/// trusted only when they do.
bool is_trusted(ActiveSetSystem& system, bool inner, double& inverse_norm) {
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
  inverse_norm = kInfinity;
  if (system.solve(inner, rhs, system.step(), system.kkt.least_accuracy())) {
    inverse_norm = max_norm(step.lambda, inner ? canonical.max_constraints().begin : 0,
                            canonical.constraints());
    for (Index i = inner ? canonical.y().begin : 0; i < canonical.variables(); ++i) {
      if (!is_slack(canonical, i)) inverse_norm = std::max(inverse_norm, std::abs(step.v[i]));
    }
  }
  return system.kkt.pivots() || std::isfinite(inverse_norm);
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

Vector without_inactive(const CanonicalProblem& canonical, const ActiveBounds& set, Vector lambda) {
  for (const Index j : each_constraint(canonical)) {
    const Index slack = canonical.slack_of(j);
    const bool inactive = slack >= 0 && set[slack] == BoundClass::Inactive;
    if (inactive || set.is_held(j)) lambda[j] = 0.0;
  }
  return lambda;
}

InertiaTest inner_test(ActiveSetSystem& system, const Vector& error, double margin,
                       double proximal) {
  KktSystem& kkt = system.kkt;
  InertiaTest test;
  // The worst W for the maximizer has + error, and no weakly active bound holds him.
  system.assemble({}, error, 1.0);
  test.inner = kkt.has_expected_inner_inertia(kkt.factorize_inner({.y = proximal - margin})) &&
               is_trusted(system, true, test.inner_inverse_norm);
  return test;
}

InertiaTest second_order_test(ActiveSetSystem& system, const Vector& error, double margin,
                              double proximal) {
  KktSystem& kkt = system.kkt;
  InertiaTest test = inner_test(system, error, margin, proximal);
  if (!test.inner) return test;
  // For the minimizer the worst W has - error everywhere, for then phi'' = W_xx - W_xy W_yy^-1 W_yx
  // (on the tangent spaces) is smallest.
  if (error.size() > 0 || system.set.weak(system.canonical, Player::Max) > 0)
    system.assemble(ActiveSetSystem::kSufficient, error, -1.0);
  test.full = kkt.has_expected_inertia(kkt.factorize({.x = -margin, .y = margin + proximal})) &&
              is_trusted(system, false, test.full_inverse_norm);
  return test;
}

double move_to(TestContext& c, TrialPoint& trial, const Iterate& reached, double mu,
               double allowed) {
  Point end = trial.point;
  Iterate& z = end.iterate = reached;
  // Weakly active ones of Max are in the equations, with multipliers of their own.
  const auto in_equations = [&](Index i) {
    return trial.set[i] == BoundClass::Active ||
           (trial.set[i] == BoundClass::WeaklyActive && c.canonical.owned_by_max(i));
  };
  for_each_bound(c.canonical, z.v, [&](Index i, int side, double distance) {
    const bool open = !in_equations(i) || trial.set.side_of(i) != side;
    if (open && distance > 0.0) multiplier_of(z, i, side) = mu / distance;
  });
  for_each_slack(c.canonical, [&](Index j, Index slack) {
    if (!in_equations(slack))
      z.lambda[j] = c.canonical.sign(slack) * (z.z_upper[slack] - z.z_lower[slack]);
  });
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
  const double mu = kSafety * allowed / left * trial.mu;
  return move_to(c, trial, end, mu, allowed) <= allowed;
}

bool gradients_hold(const TrialPoint& trial) {
  return trial.newton.inner_variation * trial.test.inner_inverse_norm <= kMostVariation &&
         trial.newton.jacobian_variation * trial.test.full_inverse_norm <= kMostVariation;
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
