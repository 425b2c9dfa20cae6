#include "core/certificate/bound_classes.hpp"

#include <algorithm>
#include <cmath>

#include "core/certificate/parameters.hpp"
#include "core/point/residual.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

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

bool barrier_newton_step(CanonicalProblem& canonical, KktSystem& kkt, double mu, Point& point,
                         StepLength& alpha, bool& dependent) {
  NewtonResidual rhs = zero_step(canonical);
  Step step = zero_step(canonical);
  newton_residual(canonical, point.iterate, point.evaluation, point.dual, mu, rhs);
  kkt.assemble(point.iterate, point.evaluation);
  dependent = dependent || !solve_accurately(kkt, point.evaluation, rhs, step);
  if (dependent) {  // their equations agree, any of the multipliers will do
    const Regularization relaxed{.lambda_x = parameters::certificate::kRootOfRounding,
                                 .lambda_y = parameters::certificate::kRootOfRounding};
    if (kkt.factorize_for_solutions(relaxed, Certainty::Usual).status != FactorizationStatus::Ok ||
        !kkt.solve_unshifted(point.evaluation, rhs, step)) {
      return false;
    }
  }
  alpha = largest_step(canonical, point.iterate, step, parameters::certificate::kTau);
  advance(canonical, step, alpha, point.iterate);
  return canonical.constraints(point.iterate.v, point.evaluation.c) == EvaluationStatus::Ok &&
         evaluate_derivatives(canonical, point) == EvaluationStatus::Ok;
}

namespace parameter = parameters::certificate;

namespace {

void set_none(const CanonicalProblem& canonical, BoundClasses& classes) {
  classes.weak_min = classes.weak_max = 0;
  classes.redundant.clear();
  classes.held_rows.clear();
  classes.of.assign(at(canonical.variables()), BoundClass::Inactive);
  classes.side.assign(at(canonical.variables()), 0);
}

void include(BoundClasses& classes, Index i, int side, BoundClass found) {
  if (classes.side[at(i)] != 0 && found <= classes[i]) return;
  classes.of[at(i)] = found;
  classes.side[at(i)] = static_cast<std::int8_t>(side);
}

bool has_digits(const CanonicalProblem& canonical, const Iterate& z) {
  bool all = true;
  for_each_bound(canonical, z.v, [&](Index i, int side, double distance) {
    const double bound = side < 0 ? canonical.lower()[i] : canonical.upper()[i];
    all = all && distance > parameter::kRounding * std::max(std::abs(bound), std::abs(z.v[i]));
  });
  return all;
}

/// Whether a point of the model's own feasible set may lie on the bound: it was relaxed by so much.
bool within_relaxation(const CanonicalProblem& canonical, Index i, int side, double distance,
                       const SolverOptions& options) {
  return distance <= 2.0 * relaxation_of(canonical, i, side, options);
}

/// From the relative changes over a full step to parameter::kDecrease mu. unresolved: how many may
/// yet show what they are.
BoundClasses classes_by_trend(const CanonicalProblem& canonical, const SolverOptions& options,
                              const Iterate& before, const Iterate& after, Index& unresolved) {
  unresolved = 0;
  BoundClasses classes;
  set_none(canonical, classes);
  for_each_bound(canonical, before.v, [&](Index i, int side, double distance) {
    const double z = multiplier_of(before, i, side);
    const double later =
        side < 0 ? canonical.above_lower(i, after.v[i]) : canonical.below_upper(i, after.v[i]);
    const double later_z = multiplier_of(after, i, side);
    const double nearer = (1.0 - later / distance) / (1.0 - parameter::kDecrease);
    const double weaker = (1.0 - later_z / z) / (1.0 - parameter::kDecrease);
    const bool active = nearer >= parameter::kClearTrend && weaker <= 1.0 - parameter::kClearTrend;
    const bool inactive =
        weaker >= parameter::kClearTrend && nearer <= 1.0 - parameter::kClearTrend;
    const bool relaxed = within_relaxation(canonical, i, side, later, options);
    if (!active && !inactive) ++unresolved;
    include(classes, i, side,
            active                 ? BoundClass::Active
            : inactive && !relaxed ? BoundClass::Inactive
                                   : BoundClass::Doubtful);
  });
  count_doubtful(canonical, classes);
  return classes;
}

}  // namespace

void BoundClasses::hold(Index i) {
  of[at(i)] = BoundClass::Active;
  side[at(i)] = 0;
}

void count_doubtful(const CanonicalProblem& canonical, BoundClasses& classes) {
  classes.weak_min = classes.weak_max = 0;
  for (Index i = 0; i < canonical.variables(); ++i) {
    if (classes[i] != BoundClass::Doubtful) continue;
    ++(canonical.owned_by_max(i) ? classes.weak_max : classes.weak_min);
  }
}

double BoundClasses::distance(const CanonicalProblem& canonical, const Iterate& z, Index i) const {
  return side[at(i)] < 0 ? canonical.above_lower(i, z.v[i]) : canonical.below_upper(i, z.v[i]);
}

double BoundClasses::multiplier(const Iterate& z, Index i) const {
  return multiplier_of(z, i, side[at(i)]);
}

void guess_classes(const CanonicalProblem& canonical, const SolverOptions& options,
                   const Iterate& iterate, const Units& units, double strict_ratio,
                   BoundClasses& classes) {
  set_none(canonical, classes);
  for_each_bound(canonical, iterate.v, [&](Index i, int side, double distance) {
    const double unit = units.variable[i];
    const BoundClass found =
        class_of(multiplier_of(iterate, i, side) * unit * unit, distance, strict_ratio);
    const bool relaxed = within_relaxation(canonical, i, side, distance, options);
    include(classes, i, side,
            found == BoundClass::Inactive && relaxed ? BoundClass::Doubtful : found);
  });
  count_doubtful(canonical, classes);
}

BoundClasses follow_barrier(CanonicalProblem& canonical, KktSystem& kkt,
                            const SolverOptions& options, const Units& units,
                            const BoundClasses& guess, int most_steps, Point& point, double& mu) {
  const auto error = [&](const Point& p) {
    return kkt_error(canonical, p.iterate, p.evaluation, p.dual, options.s_max).total;
  };
  const double allowed = std::max(error(point), options.tol);
  const double near = parameter::kHardly * size_of_problem(canonical, point.iterate, units);
  BoundClasses classes = guess;
  Point here = point;  // point: the last one on the path
  double here_mu = mu, next = mu;
  Index unresolved = 0;
  bool dependent = false;
  for (int k = 0, decreases = 0; k < std::min(most_steps, parameter::kMostBarrierSteps); ++k) {
    Point trial = here;
    StepLength alpha;
    if (!barrier_newton_step(canonical, kkt, next, trial, alpha, dependent) ||
        !has_digits(canonical, trial.iterate)) {
      break;
    }
    const bool on_path = alpha.primal == 1.0 && alpha.dual == 1.0 && error(trial) <= allowed;
    const bool decreased = next < here_mu;
    const double moved = longest(canonical, trial.iterate.v - here.iterate.v, units);
    if (on_path && decreased) {
      classes = classes_by_trend(canonical, options, here.iterate, trial.iterate, unresolved);
    }
    std::swap(here, trial);
    here_mu = next;
    if (!on_path) continue;
    point = here;
    mu = here_mu;
    next = parameter::kDecrease * mu;
    const bool shown = decreased && unresolved == 0 && moved <= near;
    if (shown || ++decreases > parameter::kMostDecreases) break;
  }
  return classes;
}

}  // namespace ipminmax
