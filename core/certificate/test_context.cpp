#include "core/certificate/test_context.hpp"

#include <algorithm>

#include "core/certificate/hessian_check.hpp"

namespace ipminmax {

namespace parameter = parameters::certificate;

TestContext::TestContext(CanonicalProblem& its_canonical, KktSystem& its_kkt, double its_mu,
                         const SolverOptions& its_options, Index factorizations,
                         CertificateArrays& its_arrays)
    : canonical(its_canonical),
      kkt(its_kkt),
      options(its_options),
      arrays(its_arrays),
      mu(its_mu),
      last_factorization(kkt.factorizations() + factorizations + parameter::kToConfirm),
      reasons(canonical) {}

double TestContext::margin(double times) const {
  return std::max(times * options.minmax_curvature_tol, 2.0 * kkt.perturbation());
}

double TestContext::far() const {
  return std::clamp(parameter::kInTols * options.tol, parameter::kLeastFar, parameter::kMostFar);
}

bool TestContext::may_factorize(Index more) {
  const bool may = kkt.factorizations() + more <= last_factorization;
  stopped = stopped || !may;
  return may;
}

void TestContext::hold_idle(BoundClasses& classes) const {
  for (const Index i : idle.variables) {
    if (classes[i] == BoundClass::Doubtful) {
      --(canonical.owned_by_max(i) ? classes.weak_max : classes.weak_min);
    }
    classes.hold(i);
  }
  classes.held_rows = idle.rows;
}

void TestContext::guess(const Iterate& iterate, double strict_ratio, BoundClasses& classes) const {
  guess_classes(canonical, options, iterate, arrays.units.units, strict_ratio, classes);
  hold_idle(classes);
}

bool TestContext::newton_confirms(ActiveSetSystem& system, const Point& point,
                                  const KktSolve& solve, NewtonTest& newton, bool is_part) const {
  test_newton(canonical, system, point, solve, is_part, options, arrays.newton_step, newton);
  return newton.done && newton.classes_hold && newton.contraction <= parameter::kContraction;
}

Eigen::VectorXd TestContext::hessian_error_in(const Units& units) const {
  if (!hessian_error) return {};
  return hessian_error->cwiseProduct(units.variable.cwiseAbs2());
}

void TestContext::examine_curvature(const CurvatureTrial& trial, const Point& point,
                                    const Eigen::VectorXd& lambda) {
  find_little_curvature(canonical, kkt, trial, arrays.curvature);
  const LittleCurvature& found = arrays.curvature.found;
  if (found.variable >= 0) {
    certificate.least_curvature = found.least;
    certificate.least_curvature_variable = canonical.model_variable(found.variable);
  }
  // Differences have errors of their own, which the tests allow for.
  if (!hessian_error) {
    wrong_row = find_wrong_row(canonical, point, lambda, trial.units, arrays.curvature);
  }
}

void TestContext::examine_curvature(ActiveSetSystem& system, const Point& point,
                                    const Eigen::VectorXd& lambda) {
  const auto is_held = [&](Index i) { return system.is_slack(i) || system.is_fixed(i); };
  examine_curvature({.units = system.units(), .assembled = &system.assembled(), .is_held = is_held},
                    point, lambda);
}

void TestContext::examine_curvature(const Point& point, const Evaluation* assembled) {
  const Units& units = units_of(canonical, point.iterate.v, point.evaluation, arrays.units);
  const auto is_held = [&](Index i) {
    return canonical.x_slacks().contains(i) || canonical.y_slacks().contains(i);
  };
  examine_curvature({.units = units, .assembled = assembled, .in_units = false, .is_held = is_held},
                    point, point.iterate.lambda);
}

void TestContext::report_weakly_active(const BoundClasses& classes) {
  certificate.weakly_active_min = classes.weak_min;
  certificate.weakly_active_max = classes.weak_max;
  reasons.add_weakly_active(classes);
}

void TestContext::report_inertias(ActiveSetSystem& system) {
  if (!may_factorize(has_x() && has_y() ? 2 : 1)) {
    certificate.inner = certificate.full = {};
    return;
  }
  system.assemble(ActiveSetSystem::kSufficient);
  kkt.factorize_ahead({}, {});
  certificate.inner = kkt.factorize_inner({}).inertia;
  certificate.full = kkt.factorize({}).inertia;
}

}  // namespace ipminmax
