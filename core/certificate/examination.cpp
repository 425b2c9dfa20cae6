#include "core/certificate/examination.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "core/certificate/refutation.hpp"
#include "core/certificate/reported_point.hpp"
#include "core/certificate/stage.hpp"
#include "core/certificate/vertex.hpp"
#include "core/certificate/weak_maximum.hpp"
#include "core/model/norms.hpp"

namespace ipminmax {
namespace {

using Kind = CertificateReason::Kind;

/// Lengths over those before that are worth another test.
constexpr double kLonger = 10.0;
/// z / s in units at which a bound is guessed to be one or the other, where Newton steps decide.
constexpr double kEitherRatio = 1.0;
/// Newton steps towards the solution of a point that is not clear.
constexpr int kRefinements = 4;
/// The same where each of them contracts by at most this: as towards a zero of high order, where it
/// is 1/4 to 0.37.
constexpr int kMostRefinements = 16;
constexpr double kCreeping = 0.4;
/// Rows of K above which a step costs more than the chance is worth that the next one settles what
/// this one has not changed: change of W, or contraction, over that of the last one.
constexpr Index kLargeSystem = 300;
constexpr double kProgress = 0.5;
/// Error of W over the margin that makes no difference to the test.
constexpr double kLittle = 0.25;
/// How often longer units are tried.
constexpr int kStretches = 2;
/// Of the largest entry of a matrix, by its factorization.
constexpr double kRoundingOfEntry = 1e-15;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// A robust constraint's worst case has to follow x smoothly.
bool reads_both_players(const CanonicalProblem& canonical) {
  return std::ranges::any_of(canonical.jacobian(), [&](const auto& entry) {
    return canonical.min_constraints().contains(entry.row) && canonical.owned_by_max(entry.col);
  });
}

/// Lengths longer than W's own make entries large: whether their rounding in a factorization leaves
/// the inertias what they are. The smallest singular values are the responses' inverses.
bool inertias_are_certain(const ActiveSetSystem& system, const InertiaTest& test) {
  double largest = 1.0;
  for (const double entry : system.derivatives().hessian) {
    largest = std::max(largest, std::abs(entry));
  }
  for (const double entry : system.derivatives().jacobian) {
    largest = std::max(largest, std::abs(entry));
  }
  return kRoundingOfEntry * (largest - 1.0) * std::max(test.inner_response, test.full_response) <=
         kTurn;
}

/// Classes that a Newton step confirms where possible; the stage's point may move along the central
/// path.
bool settle(Case& c, Stage& stage, bool follow) {
  if (follow) {
    const auto most =
        static_cast<int>(c.last_factorization - c.kkt.factorizations() - 2 * kToConfirm);
    stage.classes = c.with_idle_held(follow_barrier(c.canonical, c.kkt, c.options, stage.units,
                                                    stage.classes, most, stage.point, c.mu));
    c.moved = stage.point;
  }
  if (!clean(c.canonical, stage.classes, stage.point)) return false;
  stage.units = certain_units(c.canonical, stage);
  return true;
}

/// False: not asked for again, or nothing can be left out.
bool look_for_dependences(Case& c, Stage& stage, ActiveSetSystem& system) {
  if (stage.dependences || c.canonical.constraints() == 0 || !c.may_factorize(1)) return false;
  system.assemble(ActiveSetSystem::kSufficient);
  stage.dependences = find_dependences(c.canonical, system, stage.point, c.options);
  c.certificate.licq_min = stage.dependences->independent(c.canonical, false);
  c.certificate.licq_max = stage.dependences->independent(c.canonical, true);
  std::vector<bool> rows = droppable(c.canonical, *stage.dependences, !c.has_x());
  if (std::ranges::find(rows, true) == rows.end()) return false;
  stage.classes.redundant = std::move(rows);
  return true;
}

/// Doubtful bounds that Max leaves are none of his active ones. False: there are none.
bool release(CanonicalProblem& canonical, Stage& stage) {
  if (stage.newton.pulled_off.empty()) return false;
  for (const Index i : stage.newton.pulled_off) stage.classes.of[at(i)] = BoundClass::Inactive;
  stage.classes.weak_max -= static_cast<Index>(stage.newton.pulled_off.size());
  return clean(canonical, stage.classes, stage.point);
}

/// Guessed classes that the Newton step contradicts change, and the next one begins at its end.
bool revise(Case& c, Stage& stage) {
  constexpr double kInside = 1e-2;  // of the distance before, from a bound that was crossed
  Iterate& end = stage.newton.end.iterate;
  for (const Index i : stage.newton.contradicted) {
    const bool crossed = stage.classes[i] == BoundClass::Inactive;
    if (crossed) {
      const double distance = stage.classes.distance(c.canonical, stage.point.iterate, i);
      const double move = (1.0 - kInside) * distance;
      end.v[i] = stage.point.iterate.v[i] + stage.classes.side[at(i)] * move;
    }
    stage.classes.of[at(i)] = crossed ? BoundClass::Active : BoundClass::Inactive;
  }
  const auto above = [&](Index i) { return c.canonical.above_lower(i, end.v[i]) > 0.0; };
  const auto below = [&](Index i) { return c.canonical.below_upper(i, end.v[i]) > 0.0; };
  if (!std::ranges::all_of(c.canonical.lower_bounded(), above) ||
      !std::ranges::all_of(c.canonical.upper_bounded(), below)) {
    return false;
  }
  stage.point.iterate = end;
  if (!evaluate(c.canonical, stage.point) || !clean(c.canonical, stage.classes, stage.point)) {
    return false;
  }
  stage.units = certain_units(c.canonical, stage);
  return true;
}

/// The cone of directions into weakly active bounds of Min tells of a solution at these bounds.
/// False: there are none, or they are farther than what is returned may be from the solution.
bool weakly_active_are_near(const Case& c, const Stage& stage) {
  const double near = kNear * size_of_problem(c.canonical, stage.point.iterate, stage.units);
  for (Index i = 0; i < c.canonical.variables(); ++i) {
    if (stage.classes[i] != BoundClass::Doubtful || c.canonical.owned_by_max(i)) continue;
    const double distance = stage.classes.distance(c.canonical, stage.point.iterate, i);
    if (distance > near * stage.units.variable[i]) return false;
  }
  return stage.classes.weak_min > 0;
}

/// Lengths of x are too short where they come from a coupling with a y that its constraints hold.
/// False: no others.
bool measure_answers(Case& c, Stage& stage, ActiveSetSystem& system) {
  if (!c.has_x() || !c.has_y() || stage.answers || !c.may_factorize(1 + kToConfirm)) return false;
  stage.answers = curvature_of_answers(system);
  if (stage.answers->size() == 0) return false;
  Units longer = certain_units(c.canonical, stage);
  const IndexRange x = c.canonical.x();
  bool any = false;
  for (Index i = x.begin; i < x.end; ++i) {
    any = any || longer.variable[i] > kLonger * stage.units.variable[i];
  }
  if (any) {
    stage.units = std::move(longer);
  } else {
    stage.answers->resize(0);
  }
  return any;
}

/// Whether the matrices are right for every W within the error, over the whole step.
bool is_right(Case& c, Stage& stage, ActiveSetSystem& system) {
  Eigen::VectorXd error = stage.error;
  if (stage.stretch) {
    error.array() += c.margin(1.0) * (stage.stretch->array().square() - 1.0);
  }
  const auto holds = [&](ActiveSetSystem& tested) {
    if (!stage.test.both() || !gradients_hold(stage.newton, stage.test) ||
        !inertias_are_certain(tested, stage.test)) {
      return false;
    }
    c.examine_curvature(tested, stage.point,
                        without_inactive(c.canonical, stage.classes, stage.point.iterate.lambda));
    return true;
  };
  if (stage.narrow) {
    ActiveSetSystem narrow(c.canonical, c.kkt, *stage.narrow, stage.units, stage.point.evaluation);
    stage.test = survives_narrowed(system, narrow, error, c.margin(1.0));
    return holds(narrow);
  }
  stage.test = survives(system, error, c.margin(1.0), stage.proximal);
  if (!stage.test.both() && weakly_active_are_near(c, stage) && c.may_factorize(1)) {
    stage.test = survives_in_cone(system, error, c.margin(1.0), stage.test, stage.proximal);
  }
  return holds(system);
}

/// Directions of little curvature lead variables farther than their lengths, where stiff curvature
/// or constraints make others follow: in lengths as long the change of W along them, and how far
/// gradients turn, are seen as small as they are. The margin asked for stays what it was.
bool is_right_in_longer_units(Case& c, Stage& stage, ActiveSetSystem& system) {
  if (!c.may_factorize(2 + kToConfirm)) return false;
  Stage trial = stage;
  trial.stretch = stretch_of_little_curvature(system);
  if (!(max_norm(*trial.stretch) > kLonger)) return false;
  trial.units = certain_units(c.canonical, trial);
  ActiveSetSystem longer(c.canonical, c.kkt, trial.classes, trial.units, trial.point.evaluation);
  if (!confirm(c, trial, longer) || !is_right(c, trial, longer)) return false;
  stage = std::move(trial);
  return true;
}

/// Newton's method does not lead from where an inertia is wrong to the solution near by: over a
/// hill, by chance, to another one. That takes curvature of the other sign at the end of the step.
bool is_attracted_elsewhere(Case& c, const Stage& stage, ActiveSetSystem& system) {
  bool turns = false;
  for (std::size_t k = 0; k < stage.newton.hessian_change.size(); ++k) {
    const auto [i, j] = c.canonical.hessian()[k];
    const double here = std::abs(stage.point.evaluation.hessian[k]);
    turns = turns || (i == j && here > 0.0 && stage.newton.hessian_change[k] >= here);
  }
  if (!turns || stage.guessed || !c.may_factorize(3)) return false;
  return !helped_by_margin(c, system, {}).both();
}

/// Independent Max gradients make the inner maximum follow x; a Min point needs none.
bool independent_or_harmless(Case& c, Stage& stage, ActiveSetSystem& system) {
  const double response = std::max(stage.test.inner_response, stage.test.full_response);
  if (response <= kIndependent || c.canonical.constraints() == 0) {
    if (!stage.dependences) c.certificate.licq_min = c.certificate.licq_max = true;
    return true;
  }
  // What holds with rows that say nothing beside others holds without them.
  static_cast<void>(look_for_dependences(c, stage, system));
  if (c.canonical.max_constraints().size() == 0) return true;
  return stage.dependences && (settled(c.canonical, stage, true) || !c.has_x());
}

/// Whether the Newton step goes no farther than rounding, so that the next one would find the same.
bool ends_here(const Case& c, const Stage& stage) {
  constexpr double kRounding = 1e-13;
  const Iterate& here = stage.point.iterate;
  const Iterate& end = stage.newton.end.iterate;
  return stage.newton.step <= kRounding * size_of_problem(c.canonical, here, stage.units) &&
         max_norm(end.lambda - here.lambda) <= kRounding * (1.0 + max_norm(here.lambda));
}

/// Newton's method towards the solution of the active set's equations, until what W changes by on
/// the way is less than its curvature. False: not seen.
bool refine_and_test(Case& c, Stage& stage) {
  bool steady = true;
  int stretches = stage.proximal > 0.0 ? 0 : kStretches;
  const bool large = c.kkt.layout().dimension() > kLargeSystem;
  double last = std::numeric_limits<double>::infinity();
  bool had_converged = false;
  for (int round = 0;; ++round) {
    if (!c.may_factorize(round == 0 ? 1 : kToConfirm)) return false;
    ActiveSetSystem system(c.canonical, c.kkt, stage.classes, stage.units, stage.point.evaluation);
    static_cast<void>(confirm(c, stage, system));
    if (release(c.canonical, stage)) {
      --round;
      continue;
    }
    if (stage.guessed && !(stage.newton.classes_hold && ends_near(c, stage))) {
      if (!stage.newton.done || round == kRefinements || !revise(c, stage)) return false;
      continue;
    }
    if (stage.converges && is_right(c, stage, system)) {
      return independent_or_harmless(c, stage, system);
    }
    const bool right = stage.converges && stage.test.both();
    if (!stage.guessed && stage.converges && stage.test.inner && !right && stage.proximal == 0.0 &&
        measure_answers(c, stage, system)) {
      --round;
      continue;
    }
    // Other lengths leave the inertias what they are beside the same margin.
    const bool margin_decides =
        !stage.test.both() && max_norm(stage.error) <= kLittle * c.margin(1.0);
    if (stage.converges && stretches > 0 && !margin_decides) {
      --stretches;
      if (is_right_in_longer_units(c, stage, system)) {
        return independent_or_harmless(c, stage, system);
      }
    }
    // Where all but how far the gradients turn is right the next point settles that.
    if (!stage.guessed && !right && look_for_dependences(c, stage, system)) {
      round = -1;
      continue;
    }
    if (!stage.newton.done) return false;
    const bool there =
        max_norm(stage.newton.error) <= c.margin(1.0) && gradients_hold(stage.newton, stage.test);
    // Newton's method creeps to where derivatives nearly vanish together.
    steady = steady && !stage.guessed && !stage.converges && stage.newton.contraction <= kCreeping;
    if (there || !stage.newton.classes_hold) return false;
    if (round == (steady ? kMostRefinements : kRefinements)) return false;
    const double here = stage.converges ? max_norm(stage.newton.error) : stage.newton.contraction;
    if (large && stage.converges == had_converged && !(here <= kProgress * last)) return false;
    had_converged = stage.converges;
    last = here;
    if (round > 0 && ends_here(c, stage)) return false;
    if (is_attracted_elsewhere(c, stage, system)) return false;
    stage.crept = stage.crept || round >= kRefinements;
    stage.point.iterate = stage.newton.end.iterate;
    if (!evaluate(c.canonical, stage.point)) return false;
    stage.units = certain_units(c.canonical, stage);
  }
}

/// Where K_yy is singular but not wrong: phi(x) >= max over y of f - eps |y - y*|^2 / 2, with
/// equality at x*, for any eps > 0 and lengths |.|. That function's answer is unique, and x* is its
/// strict minimum, so one of phi, where K with eps is right.
bool test_with_many_answers(Case& c, Stage& stage) {
  if (!c.has_x() || !c.has_y() || !c.may_factorize(2 + kToConfirm)) return false;
  Stage trial = stage;
  trial.proximal = kProximal;
  trial.units = certain_units(c.canonical, trial);
  ActiveSetSystem system(c.canonical, c.kkt, trial.classes, trial.units, trial.point.evaluation);
  if (inner_survives(system, {}, c.margin(1.0)).inner ||
      !inner_survives(system, {}, c.margin(1.0), kProximal).inner || !refine_and_test(c, trial) ||
      !maximizes_weakly(c, trial)) {
    return false;
  }
  stage = std::move(trial);
  return true;
}

/// Where active gradients depend on each other, the test with one choice of multipliers is enough
/// for Min, and for Max to say that y is strictly best.
bool test_at_vertices(Case& c, Stage& stage) {
  if (c.canonical.constraints() == 0 || !c.may_factorize(1 + kToConfirm)) return false;
  ActiveSetSystem system(c.canonical, c.kkt, stage.classes, stage.units, stage.point.evaluation);
  system.assemble({.min_fixed = true, .max_fixed = true});
  const Dependences dependences = find_dependences(c.canonical, system, stage.point, c.options);
  stage.classes.redundant = droppable(c.canonical, dependences, !c.has_x());
  const bool max = !c.has_x() || (c.has_y() && !dependences.independent(c.canonical, true) &&
                                  !reads_both_players(c.canonical));
  for (Vertex& vertex : vertices_of_multipliers(system, stage.point, dependences, c.options, max)) {
    if (!c.may_factorize(kToConfirm)) return false;
    Stage trial;
    trial.point = stage.point;
    trial.point.iterate = std::move(vertex.iterate);
    trial.classes = std::move(vertex.classes);
    trial.narrow = std::move(vertex.narrow);
    if (!evaluate(c.canonical, trial.point) || !clean(c.canonical, trial.classes, trial.point))
      continue;
    trial.units = certain_units(c.canonical, trial);
    trial.dependences = dependences;
    if (!refine_and_test(c, trial)) continue;
    stage = std::move(trial);
    c.certificate.licq_min = stage.dependences->independent(c.canonical, false);
    c.certificate.licq_max = stage.dependences->independent(c.canonical, true);
    c.certificate.weakly_active_min = stage.classes.weak_min;
    c.certificate.weakly_active_max = stage.classes.weak_max;
    return true;
  }
  return false;
}

SecondOrder certified(Case& c, const Stage& stage, const Point& given) {
  if ((!stage.guessed && !reports_solution(c, stage, given)) ||
      (c.moved && !evaluate_objective(c.canonical, *c.moved))) {
    c.reasons.add(Kind::NotIsolated, Player::Min,
                  "the solution near by is farther than the point's accuracy allows");
    return SecondOrder::Undecided;
  }
  c.certificate.margin = c.margin(1.0);
  c.certificate.weakly_active_max = stage.classes.weak_max;
  c.certificate.answer = stage.classes.weak_max == 0 ? InnerAnswer::Smooth : InnerAnswer::Unique;
  if (stage.narrow) c.certificate.answer = InnerAnswer::StrictlyBest;
  if (stage.proximal > 0.0) {
    c.certificate.answer = InnerAnswer::BestNotUnique;
    c.certificate.least_curvature = 0.0;
    c.certificate.least_curvature_variable = -1;
    c.proximal = Eigen::VectorXd::Zero(c.canonical.variables());
    const IndexRange y = c.canonical.y();
    for (Index i = y.begin; i < y.end; ++i) {
      c.proximal[i] = stage.proximal / (stage.units.variable[i] * stage.units.variable[i]);
    }
    ActiveSetSystem system(c.canonical, c.kkt, stage.classes, stage.units, stage.point.evaluation);
    c.report_inertias(system);
  }
  c.reasons.add_weakly_active(stage.classes);
  if (stage.dependences) c.reasons.add_dependences(*stage.dependences);
  return SecondOrder::Satisfied;
}

}  // namespace

SecondOrder examine(Case& c, const Point& given) {
  c.kkt.begin_pivoting();
  Stage stage;
  stage.point = given;
  stage.units = c.arrays.units.units;  // of the first look
  stage.classes =
      c.with_idle_held(guess_classes(c.canonical, c.options, given.iterate, stage.units));
  const bool bounded = !c.canonical.lower_bounded().empty() || !c.canonical.upper_bounded().empty();
  bool follow = c.is_far || !stage.classes.clear();
  if (follow && !c.is_far) {
    BoundClasses guess = c.with_idle_held(
        guess_classes(c.canonical, c.options, given.iterate, stage.units, kEitherRatio));
    // No guess: bounds of Max no farther than what they were relaxed by, which stay doubtful.
    if (guess.weak_min == 0) {
      stage.classes = std::move(guess);
      stage.guessed = true;
      follow = false;
    }
  }
  const Index before = c.kkt.factorizations();
  Stage start;
  for (;;) {
    if (!settle(c, stage, follow)) return SecondOrder::Undecided;
    start = stage;
    c.certificate.weakly_active_min = stage.classes.weak_min;
    c.certificate.weakly_active_max = stage.classes.weak_max;
    if (refine_and_test(c, stage) && (!stage.guessed || guess_holds(c, stage, given))) {
      return certified(c, stage, given);
    }
    if (stage.guessed) {
      c.last_factorization += c.kkt.factorizations() - before;
      stage.guessed = c.stopped = false;
      stage.units = c.arrays.units.units;
      stage.classes =
          c.with_idle_held(guess_classes(c.canonical, c.options, given.iterate, stage.units));
    } else if (follow || !bounded || (stage.newton.done && stage.newton.classes_hold) ||
               !c.may_factorize(kToConfirm + 1)) {
      break;
    }
    follow = true;
    stage.point = given;
    stage.classes.redundant.clear();
    stage.dependences.reset();
    stage.answers.reset();
    stage.newton = {};
  }
  if (test_with_many_answers(c, start)) return certified(c, start, given);
  const bool too_many = stage.dependences && stage.dependences->too_many;
  if (!too_many && test_at_vertices(c, start)) return certified(c, start, given);
  if (stage.point.iterate.v != given.iterate.v && !evaluate_objective(c.canonical, stage.point)) {
    return SecondOrder::Undecided;
  }
  return judge_without_certificate(c, stage);
}

}  // namespace ipminmax
