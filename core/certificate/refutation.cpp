#include "core/certificate/refutation.hpp"

#include <utility>
#include <vector>

#include "core/certificate/copositive.hpp"
#include "core/certificate/critical_cone.hpp"
#include "core/certificate/newton.hpp"
#include "core/certificate/valley.hpp"
#include "core/certificate/witness.hpp"
#include "core/model/norms.hpp"

namespace ipminmax {
namespace {

using Kind = CertificateReason::Kind;

/// Factorizations that may refute a point.
constexpr Index kToRefute = 3;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Whose necessary conditions the matrices say are violated; where Newton's method does not
/// converge, those at the point have to do.
std::optional<Player> wrong_player(Case& c, ActiveSetSystem& system, const Stage& stage) {
  if (stage.newton.done && !stage.converges) {
    if (c.certificate.inner.positive > c.certificate.inner_expected.positive) return Player::Max;
    const bool too_low = c.certificate.full.negative > c.certificate.full_expected.negative;
    return too_low ? std::optional(Player::Min) : std::nullopt;
  }
  const InertiaTest test = helped_by_margin(c, system, stage.error);
  if (test.both()) return std::nullopt;
  return test.inner ? Player::Min : Player::Max;
}

/// A direction of one player into weakly active bounds. Of Min after wrong_player, which leaves K
/// with all help in it.
bool refute_in_cone(Case& c, ActiveSetSystem& system, const Stage& stage, Player owner) {
  const bool inner = owner == Player::Max;
  Eigen::VectorXd added =
      stage.error + Eigen::VectorXd::Constant(c.canonical.variables(), c.margin(1.0));
  if (inner) {
    if (!c.may_factorize(1)) return false;
    system.assemble({.min_fixed = true, .max_fixed = true}, stage.error, 0.0, 1.0);
    const KktFactors factors = c.kkt.factorize_inner({.y = c.margin(1.0)});
    if (!c.kkt.has_expected_inner_inertia(factors)) return false;
    added = -added;
  }
  const auto cone = critical_cone(system, added, owner);
  if (!cone) return false;
  const Copositivity found = copositivity(cone->curvature);
  if (found.verdict != Copositivity::Verdict::Not) return false;
  Eigen::VectorXd direction = Eigen::VectorXd::Zero(c.canonical.variables());
  for (std::size_t k = 0; k < cone->directions.size(); ++k) {
    direction += found.direction[static_cast<Eigen::Index>(k)] * cone->directions[k];
  }
  c.wrong = try_witness(c.canonical, system, stage.point, direction, stage.newton.step, owner);
  return c.wrong.has_value();
}

bool refute(Case& c, ActiveSetSystem& system, Stage& stage) {
  const std::optional<Player> suspect = wrong_player(c, system, stage);
  if (suspect) {
    c.wrong =
        find_witness(c.canonical, system, stage.point, c.margin(1.0), stage.newton.step, *suspect);
    if (c.wrong) return true;
  }
  if (stage.classes.weak_max > 0) return refute_in_cone(c, system, stage, Player::Max);
  return !suspect && stage.converges && stage.classes.weak_min > 0 &&
         refute_in_cone(c, system, stage, Player::Min);
}

/// Of Min where the inner maximum is strict; of Max where there is no x, else it is a reason alone.
bool is_valley(Case& c, ActiveSetSystem& system, const Stage& stage) {
  const bool inner =
      !c.has_x() || (c.has_y() && !inner_survives(system, stage.error, c.margin(1.0)).inner);
  if (inner && !c.may_factorize(1)) return false;
  const Player player = inner ? Player::Max : Player::Min;
  Valley valley = explore_valley(c.canonical, system, stage.point, c.margin(1.0),
                                 kFlatTimes * c.margin(1.0), inner);
  c.descent = std::move(valley.descent);
  if (valley.verdict == Valley::Verdict::None) return false;
  const bool flat = valley.verdict == Valley::Verdict::Flat;
  c.reasons.add_direction(
      flat ? Kind::FlatDirection : Kind::LittleCurvature, player, valley.direction,
      flat ? "flat: the value is constant along" : "no curvature is seen along");
  return flat && !(inner && c.has_x()) && stage.classes.clear() &&
         settled(c.canonical, stage, false);
}

/// Whether what W changes by on the way is what stands in the way: without it all is right.
bool is_unsteady(Case& c, ActiveSetSystem& system, const Stage& stage) {
  return max_norm(stage.newton.error) > c.margin(1.0) &&
         (!c.may_factorize(2) || survives(system, {}, c.margin(1.0)).both());
}

void explain(Case& c, ActiveSetSystem& system, const Stage& stage) {
  c.reasons.add_weakly_active(stage.classes);
  if (stage.dependences) c.reasons.add_dependences(*stage.dependences);
  if (c.wrong) return;
  if (stage.newton.done && !stage.newton.classes_hold) {
    c.reasons.add(Kind::NotIsolated, Player::Min,
                  "which bounds are active is not settled: a Newton step changes it");
  } else if (!stage.converges) {
    c.reasons.add(Kind::NotIsolated, Player::Min,
                  "Newton's method does not contract here: no isolated solution is seen");
  } else if (is_unsteady(c, system, stage)) {
    c.reasons.add(
        Kind::Unsteady, Player::Min,
        "second derivatives change by more than the curvature on the way to the solution");
  }
  if (c.stopped) {
    c.reasons.add(Kind::Effort, Player::Min,
                  "the test was ended after its share of factorizations");
  }
}

/// What is known of y at this x alone.
InnerAnswer answer_alone(Case& c, const Stage& stage) {
  if (!c.may_factorize(2)) return InnerAnswer::Unknown;
  Stage alone;
  alone.point = stage.point;
  alone.units = stage.units;
  alone.classes = stage.classes;
  for (const IndexRange own : {c.canonical.x(), c.canonical.x_slacks()}) {
    for (Index i = own.begin; i < own.end; ++i) {
      if (alone.classes[i] == BoundClass::Doubtful) --alone.classes.weak_min;
      alone.classes.of[at(i)] = BoundClass::Active;
      alone.classes.side[at(i)] = 0;
    }
  }
  std::vector<bool>& held = alone.classes.redundant;
  held.assign(at(c.canonical.constraints()), false);
  bool smooth = true;
  if (stage.dependences) {
    held = droppable(c.canonical, *stage.dependences, true);
    smooth = held == droppable(c.canonical, *stage.dependences, false);
  }
  const IndexRange min_rows = c.canonical.min_constraints();
  for (Index j = min_rows.begin; j < min_rows.end; ++j) held[at(j)] = true;
  ActiveSetSystem system(c.canonical, c.kkt, alone.classes, alone.units, alone.point.evaluation);
  system.assemble(ActiveSetSystem::kSufficient);
  alone.error = error_of(c, alone.point, stage.classes, alone.units);
  const KktSolve solve = [&](const NewtonResidual& rhs, Step& step, double /*share*/) {
    return solve_accurately(c.kkt, system.assembled(), rhs, step);
  };
  if (!c.newton_confirms(system, alone.point, solve, Probe::EndAndBeyond, alone.newton)) {
    return InnerAnswer::Unknown;
  }
  alone.error += alone.newton.error;
  const InertiaTest test = inner_survives(system, alone.error, c.margin(1.0));
  if (alone.newton.inner_turn * test.inner_response > kTurn) return InnerAnswer::Unknown;
  if (!test.inner || !(test.inner_response <= kIndependent)) return InnerAnswer::Unknown;
  if (!smooth) return InnerAnswer::StrictlyBest;
  return alone.classes.weak_max == 0 ? InnerAnswer::Smooth : InnerAnswer::Unique;
}

}  // namespace

InertiaTest helped_by_margin(Case& c, ActiveSetSystem& system, const Eigen::VectorXd& error) {
  system.assemble({.min_fixed = false, .max_fixed = false}, error, 0.0, -1.0);
  const bool inner_right =
      c.kkt.has_expected_inner_inertia(c.kkt.factorize_inner({.y = -c.margin(1.0)}));
  return helped(system, error, c.margin(1.0), c.options.jacobian_regularization_value, inner_right);
}

SecondOrder judge_without_certificate(Case& c, Stage& stage) {
  ActiveSetSystem system(c.canonical, c.kkt, stage.classes, stage.units, stage.point.evaluation);
  c.report_inertias(system);
  if (c.canonical.constraints() == 0) c.certificate.licq_min = c.certificate.licq_max = true;
  // Then K is singular with any help for W.
  const bool too_many = stage.dependences && stage.dependences->too_many;
  const bool vanishing =
      stage.dependences && std::ranges::any_of(stage.dependences->found, &Dependence::vanishing);
  SecondOrder verdict = SecondOrder::Undecided;
  if (vanishing) {
    explain(c, system, stage);
    return verdict;
  }
  if (c.may_factorize(kToRefute) && refute(c, system, stage)) {
    verdict = SecondOrder::Violated;
  } else if (!too_many && c.may_factorize(1) && is_valley(c, system, stage)) {
    verdict = SecondOrder::Flat;
  }
  if (c.wrong && c.wrong->owner == Player::Max) return verdict;
  explain(c, system, stage);
  if (c.has_x() && c.has_y()) c.certificate.answer = answer_alone(c, stage);
  return verdict;
}

}  // namespace ipminmax
