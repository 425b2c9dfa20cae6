#include <algorithm>
#include <cmath>

#include "core/certificate/trial.hpp"
#include "core/model/indices.hpp"
#include "core/model/iterate.hpp"
#include "core/model/norms.hpp"
#include "core/point/point.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace {

/// Of a multiplier or distance: less is nothing but rounding.
constexpr double kLeastLeft = 1e-3;

using namespace parameters::certificate;

using Kind = CertificateReason::Kind;

// --- What a trial is -----------------------------------------------------------------------------

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
  if (!c.canonical.second_derivatives(trial.point.iterate.v, lambda, without)) {
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
        !(slope <= kNegligible * terms[i] || slope * size[i] <= none)) {
      return false;
    }
  }
  return true;
}

/// Takes the multipliers of inactive inequalities, which come from the barrier, out of W. False:
/// the model is undefined.
bool drop_inactive_multipliers(TestContext& c, TrialPoint& trial) {
  const Iterate& z = trial.point.iterate;
  const Vector lambda = without_inactive(c.canonical, trial.set, z.lambda);
  return lambda == z.lambda || c.canonical.second_derivatives(z.v, lambda, trial.point.evaluation);
}

/// Returns a scaling from certain entries of W and the Jacobian only: those that rounding of the
/// variables, errors of the multipliers and the last Newton step change by less than their own
/// size.
VariableScaling certain_scaling(TestContext& c, const TrialPoint& trial) {
  const Iterate& z = trial.point.iterate;
  Evaluation certain = trial.point.evaluation, there = certain;
  for (const auto k : indices(trial.newton.hessian_change)) {
    if (std::abs(certain.hessian[k]) < kConfirmed * trial.newton.hessian_change[k])
      certain.hessian[k] = 0.0;
  }
  Vector step = kRounding * sizes_of(c.canonical, trial.point);
  keep_within_bounds(c.canonical, z.v, kShareOfRoom, step);
  step += z.v;
  Vector lambda = without_inactive(c.canonical, trial.set, z.lambda);
  lambda += multiplier_error(c.canonical, trial, lambda);
  if (c.canonical.first_derivatives(step, there) &&
      c.canonical.second_derivatives(step, without_inactive(c.canonical, trial.set, lambda),
                                     there)) {
    const auto keep = [](const std::vector<double>& changed, std::vector<double>& values) {
      for (const auto k : indices(values)) {
        if (!(std::abs(changed[k] - values[k]) <= std::abs(values[k]))) values[k] = 0.0;
      }
    };
    keep(there.hessian, certain.hessian);
    keep(there.jacobian, certain.jacobian);
  }
  VariableScaling scaling;
  scale_variables(c.canonical, z.v, certain, c.parts, scaling, trial.proximal > 0.0);
  return scaling;
}

/// Computes the Newton step to the solution with the trial's active set. Sets converges, and error:
/// the change of W over the step.
void test_newton_step(TestContext& c, TrialPoint& trial, ActiveSetSystem& system) {
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

/// Whether the matrices are right for every W within the error, over the whole step.
bool is_right(TestContext& c, TrialPoint& here, ActiveSetSystem& system) {
  here.test = second_order_test(system, here.error, c.margin(), here.proximal);
  if (!here.test.both() || !gradients_hold(here)) return false;
  c.examine_curvature(here.point,
                      without_inactive(c.canonical, here.set, here.point.iterate.lambda), &system);
  return true;
}

void look_for_dependences(TestContext& c, TrialPoint& here, ActiveSetSystem& system) {
  if (here.dependences || c.canonical.constraints() == 0 || !c.may_factorize(1)) return;
  system.assemble(ActiveSetSystem::kSufficient);
  here.dependences = find_dependences(c, system, here.point);
}

/// Independent Max gradients make the inner maximum follow x; a Min point needs none.
bool independent_or_harmless(TestContext& c, TrialPoint& here, ActiveSetSystem& system) {
  const double inverse_norm = here.test.inverse_norm();
  if (inverse_norm <= kIndependent || c.canonical.constraints() == 0) return true;
  // The test that has passed holds without redundant rows, too. If they are found only now, they
  // are left out from now on, so that rows_are_left_out knows them.
  const bool known = here.dependences.has_value();
  look_for_dependences(c, here, system);
  if (c.canonical.max_constraints().size() == 0) return true;
  // K_yy, which amplifies little, says of Max's gradients what K with Min's does not.
  const bool inner = here.test.inner_inverse_norm <= kIndependent;
  if (!here.dependences) return inner;
  if (!known) here.set.redundant = here.dependences->redundant(c.canonical);
  return inner || rows_are_left_out(c.canonical, here, true) || !c.has_x();
}

/// Stop: no correction may be tried.
enum class Look : std::uint8_t { Right, Stop, Unclear };

/// Whether the sufficient conditions hold: Newton's method converges, and W changes by less than
/// its curvature on the way.
Look look_at(TestContext& c, TrialPoint& here) {
  ActiveSetSystem system = c.system_of(here);
  test_newton_step(c, here, system);
  if (!here.newton.released.empty()) return Look::Unclear;
  if (here.converges && is_right(c, here, system))
    return independent_or_harmless(c, here, system) ? Look::Right : Look::Stop;
  // If only gradients change too much, the next point settles that.
  if (!here.converges || !here.test.both()) look_for_dependences(c, here, system);
  return Look::Unclear;
}

// --- Corrections ---------------------------------------------------------------------------------

/// At the point given, as the first look left it.
TrialPoint trial_at_given(const TestContext& c) {
  const TrialPoint& first_look = c.arrays.trial;
  TrialPoint trial;
  trial.point = c.given;
  trial.mu = first_look.mu;
  trial.set = first_look.set;
  trial.scaling = first_look.scaling;
  trial.inactive = first_look.inactive;
  return trial;
}

/// Second derivatives and scaling that belong to the set. False: the model is undefined.
bool take_up_set(TestContext& c, TrialPoint& next) {
  if (!drop_inactive_multipliers(c, next)) return false;
  next.scaling = certain_scaling(c, next);
  return true;
}

/// At the point given, or where its solution leads while mu falls. False: the model is undefined.
bool begin(TestContext& c, bool follow, TrialPoint& next) {
  next = trial_at_given(c);
  if (follow) follow_barrier_path(c, next);
  return take_up_set(c, next);
}

/// A bound of Max that is active only since it was relaxed is weakly active; others are not active.
bool release_bounds(TestContext& c, TrialPoint& next) {
  for (const Index i : next.newton.released) {
    const bool relaxed = next.set[i] == BoundClass::Active;
    next.released_relaxed_bound = next.released_relaxed_bound || relaxed;
    next.set.of[at(i)] =
        relaxed && c.canonical.owned_by_max(i) ? BoundClass::WeaklyActive : BoundClass::Inactive;
  }
  return drop_inactive_multipliers(c, next);
}

/// Rows that say nothing beside others.
bool leave_out_rows(TestContext& c, TrialPoint& next) {
  next.set.redundant = next.dependences->redundant(c.canonical);
  next.steps = 0;
  return std::ranges::find(next.set.redundant, true) != next.set.redundant.end();
}

bool needs_newton_step(TestContext& c, const TrialPoint& here) {
  const bool there = here.converges && max_norm(here.newton.error) <= c.margin() &&
                     gradients_hold(here) && !here.is_far;
  constexpr int kMostSteps = 4;
  return here.newton.set_holds && !there && here.steps < kMostSteps;
}

/// To the end of the Newton step, where W changes by less on the rest of the way.
bool take_newton_step(TestContext& c, TrialPoint& next) {
  ++next.steps;
  next.is_far = false;
  next.point.iterate = next.newton.end;
  if (!c.evaluate(next.point)) return false;
  next.scaling = certain_scaling(c, next);
  return true;
}

bool may_follow_path(TestContext& c, const TrialPoint& here) {
  const bool bounded = !c.canonical.lower_bounded().empty() || !c.canonical.upper_bounded().empty();
  return !here.followed && here.proximal == 0.0 && bounded && !here.newton.set_holds &&
         c.may_factorize(kToConfirm + 1);
}

/// K_yy is singular but not wrong: phi(x) >= max over y of f - eps |y - y*|^2 / 2, with equality at
/// x*, for any eps > 0 and lengths |.|. That function's answer is unique, and x* is its strict
/// minimum, so one of phi, where K with eps is right.
bool allow_other_answers(TestContext& c, TrialPoint& next) {
  constexpr double kEps = 1e-4;
  next.proximal = kEps;
  next.scaling = certain_scaling(c, next);
  ActiveSetSystem system = c.system_of(next);
  return !inner_test(system, {}, c.margin()).inner &&
         inner_test(system, {}, c.margin(), next.proximal).inner;
}

struct Correction {
  bool (*applies)(TestContext& c, const TrialPoint& here);
  bool (*change)(TestContext& c, TrialPoint& next);  ///< false: it changes nothing
  /// The trial goes back to the start: the first point, or the end of the path if it was followed.
  bool restarts = false;
};

constexpr Correction kCorrections[] = {
    {[](TestContext&, const TrialPoint& here) { return !here.newton.released.empty(); },
     release_bounds},
    {[](TestContext&, const TrialPoint& here) {
       return !(here.converges && here.test.both()) && here.dependences &&
              here.set.redundant.empty();
     },
     leave_out_rows},
    {[](TestContext& c, const TrialPoint& here) {
       const bool may_be_singular =
           here.converges ? here.test.inner && !here.test.full : !here.newton.done;
       return c.has_x() && may_be_singular && c.may_factorize(1 + kToConfirm);
     },
     hold_unread},
    {needs_newton_step, take_newton_step},
    {may_follow_path, [](TestContext& c, TrialPoint& next) { return begin(c, true, next); }, true},
    {[](TestContext& c, const TrialPoint& here) {
       return c.has_x() && c.has_y() && here.proximal == 0.0 && c.may_factorize(2 + kToConfirm);
     },
     allow_other_answers, true}};

// --- The point that is returned ------------------------------------------------------------------

/// After Newton steps on the way to the certified solution: whether the point that is returned is
/// that one, or as near as makes no difference. The trial's moved point and mu may move there.
bool reports_solution(TestContext& c, TrialPoint& trial) {
  const Point& reported = trial.moved ? *trial.moved : c.given;
  const Iterate &here = trial.point.iterate, &last = trial.newton.end;
  const auto near = [&](const Vector& from, const Vector& to) {
    constexpr double kNear = 1e-3;  // of the point's size
    return is_near(c, from, to, trial.scaling, kNear);
  };
  const bool ends = near(here.v, last.v);
  if (ends && here.v == reported.iterate.v) return true;
  const double allowed = c.allowed_error(reported);
  if (ends && move_to(c, trial, here, trial.mu, allowed) <= allowed) return true;
  if (near(reported.iterate.v, last.v)) return true;
  // The last step has not been taken yet.
  const Vector next = last.v + trial.newton.contraction * (last.v - here.v);
  return near(last.v, next) && move_to_end(c, trial, last, allowed);
}

SecondOrder certified(TestContext& c, bool reported, TrialPoint& trial) {
  c.reasons.add_weakly_active(trial.set);
  if (!reported || (trial.moved && !c.evaluate_objective(*trial.moved))) {
    c.reasons.add(Kind::NotIsolated,
                  "the solution near by is farther than the point's accuracy allows");
    return SecondOrder::Undecided;
  }
  trial.margin = c.margin();
  if (trial.proximal > 0.0) {
    ActiveSetSystem system = c.system_of(trial);
    measure_inertias(c, system, trial);
  }
  if (trial.unread.size() > 0) {
    c.reasons.add_direction(Kind::FlatDirection, Player::Min, trial.unread,
                            "x is best but not unique: as good along");
  }
  if (trial.dependences) c.reasons.add_dependences(*trial.dependences);
  return SecondOrder::Satisfied;
}

// --- An active set by z / s alone ----------------------------------------------------------------

/// Bounds that the Newton step contradicts change their class, and the next one begins at its end.
/// False: it leaves the bounds.
bool change_set(TestContext& c, TrialPoint& here) {
  Iterate& end = here.newton.end;
  for (const Index i : each_variable(c.canonical)) {
    const int side = here.set.side_of(i);
    if (side == 0) continue;
    const double distance = here.set.distance(c.canonical, here.point.iterate, i);
    const double multiplier = here.set.multiplier(here.point.iterate, i);
    BoundClass& found = here.set.of[at(i)];
    if (found == BoundClass::Inactive && here.set.distance(c.canonical, end, i) <= 0.0) {
      end.v[i] = here.point.iterate.v[i] + side * kShareOfWay * distance;
      found = BoundClass::Active;
    } else if (found == BoundClass::Active &&
               here.set.multiplier(end, i) <= kLeastLeft * multiplier) {
      found = BoundClass::Inactive;  // a negative one is kept above zero
    }
  }
  bool inside = true;
  for_each_bound(c.canonical, end.v,
                 [&](Index, int, double distance) { inside = inside && distance > 0.0; });
  here.point.iterate = end;
  return inside && c.evaluate(here.point) && take_up_set(c, here);
}

/// Whether bounds are clearly what they were guessed to be: of a weakly active one nothing but
/// rounding would be left at the end.
bool guess_holds(const TestContext& c, const TrialPoint& here) {
  for (const Index i : each_variable(c.canonical)) {
    if (here.set.side_of(i) == 0 || here.set[i] == BoundClass::WeaklyActive) continue;
    const auto left = [&](const Iterate& z) {
      return here.set[i] == BoundClass::Active ? here.set.multiplier(z, i)
                                               : here.set.distance(c.canonical, z, i);
    };
    if (!(left(here.newton.end) >= kLeastLeft * left(c.given.iterate))) return false;
  }
  return true;
}

/// By z / s above or below 1, changed as Newton steps show (a primal-dual active-set method): if
/// many bounds are nearly weakly active, as on long horizons, mu would have to fall far to tell.
/// Empty: not all is right with such a set, and nothing is concluded.
std::optional<TrialPoint> with_guessed_set(TestContext& c) {
  TrialPoint here = trial_at_given(c);
  guess_active_set(c, 1.0, here);
  // Of Max those no farther than what they were relaxed by stay weakly active.
  if (here.set.weak(c.canonical, Player::Min) > 0 || here.set.exceeds_variables(c.canonical) ||
      !take_up_set(c, here)) {
    return {};
  }
  for (int steps = 0; c.may_factorize(kToConfirm);) {
    ActiveSetSystem system = c.system_of(here);
    test_newton_step(c, here, system);
    if (!here.newton.released.empty()) {
      if (!release_bounds(c, here)) return {};
      continue;
    }
    const bool near = here.newton.set_holds &&
                      is_near(c, here.point.iterate.v, here.newton.end.v, here.scaling, c.far());
    if (near && here.converges && is_right(c, here, system) &&
        independent_or_harmless(c, here, system) && guess_holds(c, here) &&
        reports_solution(c, here)) {
      return here;
    }
    constexpr int kMostChanges = 4;
    if (!here.newton.done || ++steps > kMostChanges || !change_set(c, here)) break;
  }
  return {};
}

}  // namespace

SecondOrder correct_and_test(TestContext& c, bool is_far, TrialPoint& trial) {
  const auto undefined = [&] {
    c.reasons.add(
        Kind::NotIsolated,
        "the model is undefined next to here: where active bounds are held, or at the end "
        "of a Newton step");
    return SecondOrder::Undecided;
  };
  c.kkt.begin_pivoting();
  trial.begin(c.canonical, c.given, c.arrays.trial.mu);
  const bool clear = c.arrays.trial.set.is_clear(c.canonical);
  if (!is_far && !clear) {
    if (auto guessed = with_guessed_set(c)) {
      trial = std::move(*guessed);
      return certified(c, true, trial);
    }
  }
  TrialPoint start;  // where the trials began, or the end of the path
  if (!begin(c, is_far || !clear, start)) return undefined();
  const TrialPoint first = start;
  TrialPoint here = start;
  std::optional<TrialPoint> right;  // but farther from the point than its accuracy allows
  for (bool corrected = true; corrected;) {
    const bool may = c.may_factorize(here.steps == 0 ? 1 : kToConfirm);
    Look look = may ? look_at(c, here) : Look::Stop;
    if (here.proximal > 0.0 && look == Look::Right && !maximizes_weakly(c, here)) look = Look::Stop;
    if (look == Look::Right) {
      if (reports_solution(c, here)) {
        trial = std::move(here);
        return certified(c, true, trial);
      }
      here.is_far = true;
      right = here;
    }
    if (here.proximal == 0.0 && here.unread.size() == 0) trial = here;
    if (look == Look::Stop || (right && here.proximal > 0.0)) break;
    corrected = false;
    for (const Correction& row : kCorrections) {
      if ((right && row.restarts) || !row.applies(c, here)) continue;
      TrialPoint next = !row.restarts ? here : here.released_relaxed_bound ? first : start;
      if (next.set.of == here.set.of) {
        next.dependences = here.dependences;
        next.set.redundant = here.set.redundant;
      }
      if (!row.change(c, next)) continue;
      if (next.followed && !here.followed) start = next;
      here = std::move(next);
      corrected = true;
      break;
    }
  }
  if (right) {
    trial = std::move(*right);
    return certified(c, false, trial);
  }
  if (trial.point.iterate.v != c.given.iterate.v && !c.evaluate_objective(trial.point))
    return undefined();
  return judge_without_certificate(c, trial);
}

}  // namespace ipminmax
