#include <algorithm>

#include "core/certificate/trial.hpp"
#include "core/model/norms.hpp"
#include "core/point/point.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace {

using namespace parameters::certificate;

/// One Newton step for the equations at mu from a point with all derivatives and dual residual,
/// which is left at its end, without f; dependent: constraints are, as is known before or found
/// out. False: it cannot be computed or evaluated.
bool barrier_newton_step(TestContext& c, double mu, Point& point, StepLength& alpha,
                         bool& dependent) {
  NewtonResidual rhs = zero_step(c.canonical);
  Step step = zero_step(c.canonical);
  newton_residual(c.canonical, point, mu, rhs);
  c.kkt.assemble(point.iterate, point.evaluation);
  dependent = dependent || !solve_accurately(c.kkt, point.evaluation, rhs, step);
  if (dependent) {  // their equations agree, any of the multipliers will do
    const Regularization shift{.lambda_x = kRootOfRounding, .lambda_y = kRootOfRounding};
    if (c.kkt.factorize_for_solutions(shift, Certainty::Usual).status != FactorizationStatus::Ok ||
        !c.kkt.solve_unshifted(point.evaluation, rhs, step)) {
      return false;
    }
  }
  alpha = largest_step(c.canonical, point.iterate, step, kTau);
  advance(c.canonical, step, alpha, point.iterate);
  return c.evaluate(point);
}

bool has_digits(const CanonicalProblem& canonical, const Iterate& z) {
  bool all = true;
  for_each_bound(canonical, z.v, [&](Index i, int side, double distance) {
    const double bound = side < 0 ? canonical.lower()[i] : canonical.upper()[i];
    all = all && distance > kRounding * std::max(std::abs(bound), std::abs(z.v[i]));
  });
  return all;
}

/// From the relative changes over a full step to kDecrease mu. True: all bounds have shown what
/// they are.
bool identify_by_trend(const TestContext& c, const Iterate& before, const Iterate& after,
                       ActiveBounds& set) {
  bool resolved = true;
  set.reset(c.canonical);
  for_each_bound(c.canonical, before.v, [&](Index i, int side, double distance) {
    const double later = distance_to_bound(c.canonical, after.v, i, side);
    const auto change = [](double then, double now) {
      return (1.0 - now / then) / (1.0 - kDecrease);
    };
    const double nearer = change(distance, later);
    const double weaker = change(multiplier_of(before, i, side), multiplier_of(after, i, side));
    const bool active = nearer >= kClearTrend && weaker <= 1.0 - kClearTrend;
    const bool inactive = weaker >= kClearTrend && nearer <= 1.0 - kClearTrend;
    const bool relaxed = c.within_relaxation(i, side, later);
    resolved = resolved && (active || inactive);
    set.include(i, side,
                active                 ? BoundClass::Active
                : inactive && !relaxed ? BoundClass::Inactive
                                       : BoundClass::WeaklyActive);
  });
  return resolved;
}

/// Whether pivoted factors show another inertia although each player is given so much curvature.
bool barrier_problem_refuted(TestContext& c, double spare) {
  const auto shows = [](const KktFactors& f) {
    return f.trust.pivoted &&
           (f.status == FactorizationStatus::Ok || f.status == FactorizationStatus::Singular);
  };
  const KktFactors inner = c.kkt.factorize_inner({.y = spare});
  if (!c.kkt.has_expected_inner_inertia(inner)) return shows(inner);
  const KktFactors full = c.kkt.factorize({.x = spare, .y = spare});
  return !c.kkt.has_expected_inertia(full) && shows(full);
}

bool barrier_newton_contracts(TestContext& c, double mu) {
  Point point = c.given;
  StepLength alpha;
  bool dependent = false;
  double last = kInfinity;
  constexpr double kNone = 1e-10;  // a step of rounding, over the variables
  for (int k = 0; k < 2; ++k) {
    const Vector before = point.iterate.v;
    if (!barrier_newton_step(c, mu, point, alpha, dependent)) return false;
    const double step = max_norm(point.iterate.v - before);
    if (step <= kContraction * last && k > 0) return true;
    if (k == 0 && step <= kNone * (1.0 + max_norm(before))) return true;
    last = step;
  }
  return false;
}

}  // namespace

void follow_barrier_path(TestContext& c, TrialPoint& trial) {
  const auto most = static_cast<int>(std::min<Index>(
      c.last_factorization - c.kkt.factorizations() - 2 * kToConfirm, kMostBarrierSteps));
  Point& point = trial.point;  // the last one on the path
  const double allowed = std::max(c.error(point), c.options.tol);
  const double near = kNearby * size_of_problem(c.canonical, point.iterate.v, trial.scaling);
  Point here = point;
  double here_mu = trial.mu, next = trial.mu;
  bool dependent = false, resolved = true;
  for (int k = 0, decreases = 0; k < most; ++k) {
    Point last = here;
    StepLength alpha;
    if (!barrier_newton_step(c, next, here, alpha, dependent) ||
        !has_digits(c.canonical, here.iterate)) {
      break;
    }
    const bool on_path = alpha.primal == 1.0 && alpha.dual == 1.0 && c.error(here) <= allowed;
    const bool decreased = next < here_mu;
    here_mu = next;
    if (!on_path) continue;
    if (decreased) resolved = identify_by_trend(c, last.iterate, here.iterate, trial.set);
    point = here;
    trial.mu = here_mu;
    next = kDecrease * trial.mu;
    const double moved = longest(c.canonical, here.iterate.v - last.iterate.v, trial.scaling);
    if ((decreased && resolved && moved <= near) || ++decreases > kMostDecreases) break;
  }
  trial.inactive = inactive_copies(c.canonical, point.iterate, trial.scaling);
  trial.hold_inactive();
  trial.moved = point;
  trial.followed = true;
}

SecondOrder judge_barrier_problem(TestContext& c, TrialPoint& trial) {
  c.kkt.assemble(c.given.iterate, c.given.evaluation);
  const double spare = c.margin() * std::max(1.0, c.kkt.hessian_norm());
  if (c.kkt.has_expected_inner_inertia(c.kkt.factorize_inner({.y = -spare})) &&
      c.kkt.has_expected_inertia(c.kkt.factorize({.x = -spare}))) {
    trial.margin = spare;
    c.examine_curvature(c.given, c.given.iterate.lambda, nullptr, &c.given.evaluation);
    return barrier_newton_contracts(c, trial.mu) ? SecondOrder::Satisfied : SecondOrder::Undecided;
  }
  c.kkt.begin_pivoting();
  const bool refuted = barrier_problem_refuted(c, spare);
  trial.inner = c.kkt.factorize_inner({}).inertia;
  trial.full = c.kkt.factorize({}).inertia;
  return refuted ? SecondOrder::Violated : SecondOrder::Undecided;
}

}  // namespace ipminmax
