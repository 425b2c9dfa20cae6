#include "core/certificate/candidate.hpp"

#include <utility>

#include "core/certificate/direction.hpp"
#include "core/certificate/parameters.hpp"
#include "core/certificate/second_order.hpp"
#include "core/model/norms.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace parameter = parameters::certificate;

namespace {

using Kind = CertificateReason::Kind;

/// The necessary conditions, with the margin given to Max in K where K_yy is right without.
InertiaTest helped_by_margin(TestContext& c, ActiveSetSystem& system,
                             const Eigen::VectorXd& error) {
  system.assemble({.min_fixed = false, .max_fixed = false}, error, 0.0, -1.0);
  const bool inner_right =
      c.kkt.has_expected_inner_inertia(c.kkt.factorize_inner({.y = -c.margin(1.0)}));
  return helped(system, error, c.margin(1.0), c.options.jacobian_regularization_value, inner_right);
}

/// Whose necessary conditions the matrices say are violated; where Newton's method does not
/// converge, those at the point have to do.
std::optional<Player> wrong_player(TestContext& c, ActiveSetSystem& system,
                                   const Candidate& candidate) {
  if (candidate.newton.done && !candidate.converges) {
    if (c.certificate.inner.positive > c.certificate.inner_expected.positive) return Player::Max;
    const bool too_low = c.certificate.full.negative > c.certificate.full_expected.negative;
    return too_low ? std::optional(Player::Min) : std::nullopt;
  }
  const InertiaTest test = helped_by_margin(c, system, candidate.error);
  if (test.both()) return std::nullopt;
  return test.inner ? Player::Min : Player::Max;
}

bool refute(TestContext& c, ActiveSetSystem& system, Candidate& candidate) {
  const std::optional<Player> suspect = wrong_player(c, system, candidate);
  if (suspect) {
    c.wrong = find_refuting_direction(c.canonical, system, candidate.point, c.margin(1.0),
                                      candidate.newton.step, *suspect);
  }
  return c.wrong.has_value();
}

/// Of Min where the inner maximum is strict; of Max where there is no x, else it is a reason alone.
bool is_flat(TestContext& c, ActiveSetSystem& system, const Candidate& candidate) {
  const bool inner =
      !c.has_x() || (c.has_y() && !inner_survives(system, candidate.error, c.margin(1.0)).inner);
  if (inner && !c.may_factorize(1)) return false;
  const Player player = inner ? Player::Max : Player::Min;
  // On the way to where derivatives nearly vanish together curvature is what W changes by.
  const double little = std::max(c.margin(1.0), candidate.crept ? max_norm(candidate.error) : 0.0);
  FlatDirections found =
      find_flat_directions(c.canonical, system, candidate.point, c.options, little, player);
  if (found.verdict == FlatDirections::Verdict::None) return false;
  const bool flat = found.verdict == FlatDirections::Verdict::Flat;
  c.reasons.add_direction(
      flat ? Kind::FlatDirection : Kind::LittleCurvature, player, found.direction,
      flat ? "flat: the value is constant along" : "no curvature is seen along");
  return flat && !(inner && c.has_x()) && candidate.classes.clear() &&
         rows_are_left_out(c.canonical, candidate, false);
}

/// Whether what W changes by on the way is what stands in the way: without it all is right.
bool is_unsteady(TestContext& c, ActiveSetSystem& system, const Candidate& candidate) {
  return max_norm(candidate.newton.error) > c.margin(1.0) && !candidate.test.both() &&
         survives(system, {}, c.margin(1.0)).both();
}

void explain(TestContext& c, ActiveSetSystem& system, const Candidate& candidate) {
  if (candidate.dependences) c.reasons.add_dependences(*candidate.dependences);
  if (c.wrong) return;
  const NewtonTest& newton = candidate.newton;
  if (newton.done && !newton.classes_hold) {
    c.reasons.add_about(Kind::NotIsolated, newton.changing,
                        "which bounds are active is not decided: a Newton step changes that of ");
  } else if (!candidate.converges && newton.left_in >= 0) {
    c.reasons.add_about(Kind::NotIsolated, newton.left_in,
                        "Newton's method does not contract here: no isolated solution is seen, "
                        "least of all in ");
  } else if (!candidate.converges) {
    c.reasons.add(
        Kind::NotIsolated, Player::Min,
        "Newton's method cannot go on from here: its equations are singular, or the model "
        "is undefined at the end of a step");
  } else if (!c.may_factorize(2)) {
    // What stands in the way would take more of them: that is said below.
  } else if (is_unsteady(c, system, candidate)) {
    Index most = 0;
    newton.error.maxCoeff(&most);
    c.reasons.add_about(Kind::Unsteady, most,
                        "second derivatives change by more than the curvature on the way to the "
                        "solution, most in ");
  } else if (!gradients_hold(newton, candidate.test)) {
    c.reasons.add_about_row(Kind::Unsteady, newton.turning,
                            "gradients of active constraints turn by too much on the way to the "
                            "solution, most that of ");
  } else if (!c.reasons.has_obstacle()) {
    c.report_inertias(system);
    c.examine_curvature(
        system, candidate.point,
        without_inactive(c.canonical, candidate.classes, newton.end.iterate.lambda));
    const Index least = std::max(c.arrays.curvature.found.variable, 0);
    c.reasons.add_about(
        Kind::LittleCurvature, least,
        "the curvature is neither clearly right nor clearly wrong, least of all in ");
  }
  if (c.stopped) {
    c.reasons.add(Kind::Effort, Player::Min,
                  "the test was ended after its share of factorizations");
  }
}

}  // namespace

SecondOrder judge_without_certificate(TestContext& c, Candidate& candidate) {
  ActiveSetSystem system(c.canonical, c.kkt, candidate.classes, candidate.units,
                         candidate.point.evaluation);
  c.report_inertias(system);
  c.report_weakly_active(candidate.classes);
  if (c.canonical.constraints() == 0) c.certificate.licq_min = c.certificate.licq_max = true;
  // Then K is singular with any help for W.
  const bool too_many = candidate.dependences && candidate.dependences->too_many;
  const bool vanishing = candidate.dependences &&
                         std::ranges::any_of(candidate.dependences->found, &Dependence::vanishing);
  SecondOrder verdict = SecondOrder::Undecided;
  if (vanishing) {
    explain(c, system, candidate);
    return verdict;
  }
  // What is wrong is left whatever that costs.
  if (refute(c, system, candidate)) {
    verdict = SecondOrder::Violated;
  } else if (!too_many && c.may_factorize(1) && is_flat(c, system, candidate)) {
    verdict = SecondOrder::Flat;
  }
  if (c.wrong && c.wrong->owner == Player::Max) return verdict;
  explain(c, system, candidate);
  return verdict;
}

}  // namespace ipminmax
