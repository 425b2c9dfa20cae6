#include <algorithm>

#include "core/certificate/trial.hpp"

namespace ipminmax {

namespace {

using Kind = CertificateReason::Kind;

/// Whose necessary conditions the matrices say are violated. A direction has to witness that.
bool refute(TestContext& c, ActiveSetSystem& system, TrialPoint& trial) {
  const KktLayout& layout = c.kkt.layout();
  const bool max = trial.inner->positive > layout.expected_inner().positive;
  if (max || trial.full->negative > layout.expected().negative) {
    trial.wrong = find_refuting_direction(c, system, trial, max ? Player::Max : Player::Min);
  }
  if (trial.wrong) {
    c.reasons.add_direction(Kind::WrongCurvature, trial.wrong->owner, trial.wrong->direction,
                            max ? "Max gains along" : "Min gains along");
  }
  return trial.wrong.has_value();
}

/// Of Min where the inner maximum is strict; of Max where there is no x, else it is a reason alone.
/// trial.wrong: a step to smaller values, if one was seen.
bool is_flat(TestContext& c, ActiveSetSystem& system, TrialPoint& trial) {
  const bool inner =
      !c.has_x() || (c.has_y() && !inner_test(system, trial.error, c.margin()).inner);
  if (inner && !c.may_factorize(1)) return false;
  const Player player = inner ? Player::Max : Player::Min;
  const FlatDirections found = find_flat_directions(c, system, trial.point, c.margin(), player);
  if (found.descent) trial.wrong = WrongCurvature{Player::Min, *found.descent};
  if (found.direction.size() == 0) return false;
  c.reasons.add_direction(
      found.flat ? Kind::FlatDirection : Kind::LittleCurvature, player, found.direction,
      found.flat ? "flat: the value is constant along" : "no curvature is seen along");
  return found.flat && !(inner && c.has_x()) && trial.set.is_strict() &&
         rows_are_left_out(c.canonical, trial, false);
}

/// Why a point that is not refuted gets no certificate.
void explain(TestContext& c, ActiveSetSystem& system, TrialPoint& trial) {
  const NewtonTest& newton = trial.newton;
  if (newton.done && !newton.set_holds) {
    c.reasons.add_about(Kind::NotIsolated, newton.changing,
                        "which bounds are active is undecided: a Newton step changes that of ");
  } else if (!trial.converges && newton.left_in >= 0) {
    c.reasons.add_about(Kind::NotIsolated, newton.left_in,
                        "Newton's method does not converge here, so the solution may not be "
                        "isolated; the slowest variable is ");
  } else if (!trial.converges) {
    c.reasons.add(Kind::NotIsolated,
                  "Newton's method cannot go on from here: its equations are singular, or the "
                  "model is undefined at the end of a step");
  } else if (!gradients_hold(trial)) {
    c.reasons.add_about_row(Kind::Unsteady, newton.varying_row,
                            "gradients of active constraints change too much between this point "
                            "and the solution, most that of ");
  } else if (!c.reasons.has_obstacle() && c.may_factorize(2)) {
    measure_inertias(c, system, trial);
    c.examine_curvature(trial.point, without_inactive(c.canonical, trial.set, newton.end.lambda),
                        &system);
    const Index least = std::max(c.arrays.curvature.variable, 0);
    c.reasons.add_about(
        Kind::LittleCurvature, least,
        "the curvature is neither clearly right nor clearly wrong; it is smallest in ");
  }
  if (c.stopped) {
    c.reasons.add(Kind::Effort, "the test has used up its factorizations");
  }
}

}  // namespace

SecondOrder judge_without_certificate(TestContext& c, TrialPoint& trial) {
  ActiveSetSystem system = c.system_of(trial);
  measure_inertias(c, system, trial);
  c.reasons.add_weakly_active(trial.set);
  // A refutation has no limit of factorizations, once the inertias are measured.
  const bool refuted = refute(c, system, trial);
  const bool flat = !refuted && c.may_factorize(1) && is_flat(c, system, trial);
  if (trial.dependences) c.reasons.add_dependences(*trial.dependences);
  if (refuted) return SecondOrder::Violated;
  explain(c, system, trial);
  return flat ? SecondOrder::Flat : SecondOrder::Undecided;
}

}  // namespace ipminmax
