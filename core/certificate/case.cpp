#include "core/certificate/case.hpp"

#include <algorithm>

#include "core/certificate/hessian_check.hpp"

namespace ipminmax {
namespace {

/// Step to the solution, over the size of the point or of the start, that is worth going: in tols,
/// within limits.
constexpr double kFarInTols = 100.0;
constexpr double kLeastFar = 1e-6, kMostFar = 1e-4;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

Case::Case(CanonicalProblem& its_canonical, KktSystem& its_kkt, double its_mu,
           const SolverOptions& its_options, Index factorizations, CertificateArrays& its_arrays)
    : canonical(its_canonical),
      kkt(its_kkt),
      options(its_options),
      arrays(its_arrays),
      mu(its_mu),
      last_factorization(kkt.factorizations() + factorizations + kToConfirm),
      reasons(canonical) {
  arrays.newton_step.is_there_known = false;
}

double Case::margin(double times) const {
  return std::max(times * options.minmax_curvature_tol, 2.0 * kkt.perturbation());
}

double Case::far() const { return std::clamp(kFarInTols * options.tol, kLeastFar, kMostFar); }

bool Case::may_factorize(Index more) {
  const bool may = kkt.factorizations() + more <= last_factorization;
  stopped = stopped || !may;
  return may;
}

void Case::hold_idle(BoundClasses& classes) const {
  for (const Index i : idle) {
    if (classes[i] == BoundClass::Doubtful) {
      --(canonical.owned_by_max(i) ? classes.weak_max : classes.weak_min);
    }
    classes.of[at(i)] = BoundClass::Active;
    classes.side[at(i)] = 0;
  }
}

BoundClasses Case::with_idle_held(BoundClasses classes) const {
  hold_idle(classes);
  return classes;
}

bool Case::newton_confirms(ActiveSetSystem& system, const Point& point, const KktSolve& solve,
                           Probe probe, NewtonTest& newton) const {
  test_newton(canonical, system, point, {solve, probe}, arrays.newton_step, newton);
  return newton.done && newton.classes_hold && newton.contraction <= kContraction;
}

Eigen::VectorXd Case::hessian_error_in(const Units& units) const {
  if (!hessian_error) return {};
  return hessian_error->cwiseProduct(units.variable.cwiseAbs2());
}

void Case::examine_curvature(const CurvatureTrial& trial, const Point& point,
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

void Case::examine_curvature(ActiveSetSystem& system, const Point& point,
                             const Eigen::VectorXd& lambda) {
  const auto is_held = [&](Index i) { return system.is_slack(i) || system.is_fixed(i); };
  examine_curvature({.units = system.units(), .assembled = &system.assembled(), .is_held = is_held},
                    point, lambda);
}

void Case::examine_curvature(const Point& point, const Evaluation* assembled) {
  const Units& units = units_of(canonical, point.iterate.v, point.evaluation, {}, arrays.units);
  const auto is_held = [&](Index i) {
    return canonical.x_slacks().contains(i) || canonical.y_slacks().contains(i);
  };
  examine_curvature({.units = units, .assembled = assembled, .in_units = false, .is_held = is_held},
                    point, point.iterate.lambda);
}

void Case::report_inertias(ActiveSetSystem& system) {
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
