#include "core/certificate/candidate.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/certificate/parameters.hpp"
#include "core/method/parameters.hpp"
#include "core/model/norms.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace parameter = parameters::certificate;

namespace {

using Kind = CertificateReason::Kind;

// --- What a candidate is -------------------------------------------------------------------------

/// Whether the matrices are right for every W within the error, over the whole step.
bool is_right(TestContext& c, Candidate& here, ActiveSetSystem& system) {
  here.test = survives(system, here.error, c.margin(1.0), here.proximal);
  if (!here.test.both() || !gradients_hold(here.newton, here.test)) return false;
  c.examine_curvature(system, here.point,
                      without_inactive(c.canonical, here.classes, here.point.iterate.lambda));
  return true;
}

void look_for_dependences(TestContext& c, Candidate& here, ActiveSetSystem& system) {
  if (here.dependences || c.canonical.constraints() == 0 || !c.may_factorize(1)) return;
  system.assemble(ActiveSetSystem::kSufficient);
  here.dependences = find_dependences(c.canonical, system, here.point, c.options);
  c.certificate.licq_min = here.dependences->independent(c.canonical, false);
  c.certificate.licq_max = here.dependences->independent(c.canonical, true);
}

/// Independent Max gradients make the inner maximum follow x; a Min point needs none.
bool independent_or_harmless(TestContext& c, Candidate& here, ActiveSetSystem& system) {
  const double response = std::max(here.test.inner_response, here.test.full_response);
  if (response <= parameter::kIndependent || c.canonical.constraints() == 0) {
    if (!here.dependences) c.certificate.licq_min = c.certificate.licq_max = true;
    return true;
  }
  // What holds with rows that say nothing beside others holds without them.
  const bool known = here.dependences.has_value();
  look_for_dependences(c, here, system);
  if (c.canonical.max_constraints().size() == 0) return true;
  // K_yy, which amplifies little, says of Max's gradients what K with Min's does not.
  const bool inner = here.test.inner_response <= parameter::kIndependent;
  if (!here.dependences) return inner;
  if (!known) here.classes.redundant = droppable(c.canonical, *here.dependences);
  return inner || rows_are_left_out(c.canonical, here, true) || !c.has_x();
}

// --- Remedies ------------------------------------------------------------------------------------

/// From a candidate that does not pass another one that may; empty: it does not apply.
using Remedy = std::optional<Candidate> (*)(TestContext& c, const Candidate& here);

/// A bound of Max that is active only since it was relaxed is weakly active; others are not active.
std::optional<Candidate> release_bounds(TestContext& c, const Candidate& here) {
  if (here.newton.released.empty()) return {};
  Candidate next = here;
  for (const Index i : here.newton.released) {
    const bool relaxed = next.classes[i] == BoundClass::Active;
    next.relaxed = next.relaxed || relaxed;
    next.classes.of[at(i)] =
        relaxed && c.canonical.owned_by_max(i) ? BoundClass::Doubtful : BoundClass::Inactive;
  }
  count_doubtful(c.canonical, next.classes);
  if (!drop_inactive_multipliers(c.canonical, next.classes, next.point)) return {};
  return next;
}

/// Rows that say nothing beside others.
std::optional<Candidate> leave_out_rows(TestContext& c, const Candidate& here) {
  const bool right = here.converges && here.test.both();
  if (right || !here.dependences || !here.classes.redundant.empty()) return {};
  std::vector<bool> rows = droppable(c.canonical, *here.dependences);
  if (std::ranges::find(rows, true) == rows.end()) return {};
  Candidate next = here;
  next.classes.redundant = std::move(rows);
  next.steps = 0;
  return next;
}

/// Whether the Newton step goes no farther than rounding, so that the next one would find the same.
bool ends_here(const TestContext& c, const Candidate& candidate) {
  const Iterate& here = candidate.point.iterate;
  const Iterate& end = candidate.newton.end.iterate;
  return candidate.newton.step <=
             parameter::kRounding * size_of_problem(c.canonical, here, candidate.units) &&
         max_norm(end.lambda - here.lambda) <= parameter::kRounding * (1.0 + max_norm(here.lambda));
}

std::optional<Candidate> at_end_of_step(TestContext& c, const Candidate& here) {
  Candidate next = here;
  ++next.steps;
  next.point.iterate = here.newton.end.iterate;
  if (!evaluate(c.canonical, next.point)) return {};
  next.units = certain_units(c.canonical, next);
  return next;
}

/// The end of the Newton step, where W changes by less on the rest of the way.
std::optional<Candidate> take_newton_step(TestContext& c, const Candidate& here) {
  if (!here.newton.done || !here.newton.classes_hold) return {};
  const bool there = here.converges && max_norm(here.newton.error) <= c.margin(1.0) &&
                     gradients_hold(here.newton, here.test);
  // Newton's method creeps to where derivatives nearly vanish together.
  const bool creeps = here.creeps && !here.converges &&
                      here.newton.contraction <= parameter::kCreeping &&
                      c.kkt.layout().dimension() <= parameters::kSmallSystem;
  const int most = creeps ? parameter::kMany : parameter::kFew;
  if (there || here.steps >= most || (here.steps > 0 && ends_here(c, here))) return {};
  auto next = at_end_of_step(c, here);
  if (next) {
    next->creeps = creeps;
    next->crept = here.crept || here.steps >= parameter::kFew;
  }
  return next;
}

/// Lengths of x are too short where they come from a coupling with a y that its constraints hold.
/// Not where W is what changes: rounding of large entries would decide in longer ones.
std::optional<Candidate> measure_min_first(TestContext& c, const Candidate& here) {
  if (here.min_first || !here.converges || !here.test.inner || here.test.full || !c.has_x() ||
      !c.has_y() || max_norm(here.error) > parameter::kLittle) {
    return {};
  }
  Candidate next = here;
  next.min_first = true;
  next.units = certain_units(c.canonical, next);
  return next;
}

constexpr Remedy kRemedies[] = {release_bounds, leave_out_rows, measure_min_first,
                                take_newton_step};

/// Whether the sufficient conditions hold at a candidate, or at one that remedies lead to: Newton's
/// method converges, and W changes by less than its curvature on the way. candidate: the last one.
bool passes(TestContext& c, Candidate& candidate) {
  for (;;) {
    if (!c.may_factorize(candidate.steps == 0 ? 1 : parameter::kToConfirm)) return false;
    ActiveSetSystem system(c.canonical, c.kkt, candidate.classes, candidate.units,
                           candidate.point.evaluation);
    confirm(c, candidate, system);
    if (candidate.newton.released.empty()) {
      if (candidate.converges && is_right(c, candidate, system)) {
        return independent_or_harmless(c, candidate, system);
      }
      // Where all but how far the gradients turn is right the next point settles that.
      if (!candidate.converges || !candidate.test.both()) {
        look_for_dependences(c, candidate, system);
      }
    }
    std::optional<Candidate> next;
    for (const Remedy remedy : kRemedies) {
      next = remedy(c, candidate);
      if (next) break;
    }
    if (!next) return false;
    candidate = std::move(*next);
  }
}

// --- Where candidates come from ------------------------------------------------------------------

/// Classes by z / s at the point, or those that show themselves while mu falls. False: the model is
/// undefined.
bool begin(TestContext& c, const Point& given, const BoundClasses& guess, bool follow,
           Candidate& candidate) {
  candidate = {};
  candidate.point = given;
  candidate.units = c.arrays.units.units;  // of the first look
  candidate.classes = guess;
  if (follow) {
    const auto most =
        static_cast<int>(c.last_factorization - c.kkt.factorizations() - 2 * parameter::kToConfirm);
    candidate.classes = follow_barrier(c.canonical, c.kkt, c.options, candidate.units, guess, most,
                                       candidate.point, c.mu);
    c.idle = idle_copies(c.canonical, candidate.point.iterate, candidate.units);
    c.hold_idle(candidate.classes);
    c.moved = candidate.point;
  }
  if (!drop_inactive_multipliers(c.canonical, candidate.classes, candidate.point)) return false;
  candidate.units = certain_units(c.canonical, candidate);
  return true;
}

/// Where K_yy is singular but not wrong: phi(x) >= max over y of f - eps |y - y*|^2 / 2, with
/// equality at x*, for any eps > 0 and lengths |.|. That function's answer is unique, and x* is its
/// strict minimum, so one of phi, where K with eps is right.
std::optional<Candidate> with_many_answers(TestContext& c, const Candidate& start) {
  if (!c.has_x() || !c.has_y() || !c.may_factorize(2 + parameter::kToConfirm)) return {};
  Candidate trial = start;
  trial.proximal = parameter::kSlight;
  trial.units = certain_units(c.canonical, trial);
  ActiveSetSystem system(c.canonical, c.kkt, trial.classes, trial.units, trial.point.evaluation);
  if (inner_survives(system, {}, c.margin(1.0)).inner ||
      !inner_survives(system, {}, c.margin(1.0), trial.proximal).inner || !passes(c, trial) ||
      !maximizes_weakly(c, trial)) {
    return {};
  }
  return trial;
}

SecondOrder certified(TestContext& c, Candidate found, const Point& given) {
  bool reported = reports_solution(c, found, given);
  // The solution cannot be returned yet: nearer to it.
  while (!reported && found.proximal == 0.0 && found.steps < parameter::kFew) {
    auto next = at_end_of_step(c, found);
    if (!next || !passes(c, *next)) break;
    found = std::move(*next);
    reported = reports_solution(c, found, given);
  }
  c.report_weakly_active(found.classes);
  if (reported && !c.moved) report_end(c, given, found.newton);
  if (!reported || (c.moved && !evaluate_objective(c.canonical, *c.moved))) {
    const Iterate& returned = c.moved ? c.moved->iterate : given.iterate;
    Index most = 0;
    Eigen::VectorXd way = found.newton.end.iterate.v - returned.v;
    way = way.cwiseQuotient(found.units.variable).cwiseAbs();
    for (const IndexRange slacks : {c.canonical.x_slacks(), c.canonical.y_slacks()}) {
      way.segment(slacks.begin, slacks.size()).setZero();
    }
    way.maxCoeff(&most);
    c.reasons.add_about(
        Kind::NotIsolated, most,
        "the solution near by is farther than the point's accuracy allows, most in ");
    return SecondOrder::Undecided;
  }
  c.arrays.classes = found.classes;
  c.certificate.margin = c.margin(1.0);
  c.certificate.answer = found.classes.weak_max == 0 ? InnerAnswer::Smooth : InnerAnswer::Unique;
  if (found.proximal > 0.0) {
    c.certificate.answer = InnerAnswer::BestNotUnique;
    c.certificate.least_curvature = 0.0;
    c.certificate.least_curvature_variable = -1;
    c.proximal = Eigen::VectorXd::Zero(c.canonical.variables());
    const IndexRange y = c.canonical.y();
    c.proximal.segment(y.begin, y.size()) =
        found.proximal * found.units.variable.segment(y.begin, y.size()).cwiseAbs2().cwiseInverse();
    ActiveSetSystem system(c.canonical, c.kkt, found.classes, found.units, found.point.evaluation);
    c.report_inertias(system);
  }
  if (found.dependences) c.reasons.add_dependences(*found.dependences);
  return SecondOrder::Satisfied;
}

}  // namespace

SecondOrder examine(TestContext& c, const Point& given) {
  const auto undefined = [&] {
    c.reasons.add(
        Kind::NotIsolated, Player::Min,
        "the model is undefined next to here: where active bounds are held, or at the end "
        "of a Newton step");
    return SecondOrder::Undecided;
  };
  c.kkt.begin_pivoting();
  BoundClasses guess;
  c.guess(given.iterate, parameter::kStrictRatio, guess);
  const bool bounded = !c.canonical.lower_bounded().empty() || !c.canonical.upper_bounded().empty();
  const double mu = c.mu;
  Candidate start, last, first;
  for (bool follow = c.is_far || !guess.clear();; follow = true) {
    if (!begin(c, given, guess, follow, start)) return undefined();
    last = start;
    if (!follow) first = start;
    if (passes(c, last)) return certified(c, last, given);
    if (follow || !bounded || (last.newton.done && last.newton.classes_hold) ||
        !c.may_factorize(parameter::kToConfirm + 1)) {
      break;
    }
  }
  // Smaller barrier parameters go to the end of a face that relaxed bounds prefer.
  const bool back = last.relaxed && !first.classes.of.empty();
  auto followed = std::pair{std::optional<Point>(), mu};
  if (back) std::swap(followed.first, c.moved), std::swap(followed.second, c.mu);
  if (const auto many = with_many_answers(c, back ? first : start))
    return certified(c, *many, given);
  if (back) std::swap(followed.first, c.moved), std::swap(followed.second, c.mu);
  if (last.point.iterate.v != given.iterate.v && !evaluate_objective(c.canonical, last.point)) {
    return undefined();
  }
  return judge_without_certificate(c, last);
}

}  // namespace ipminmax
