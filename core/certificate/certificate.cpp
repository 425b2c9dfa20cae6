#include "core/certificate/certificate.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/certificate/trial.hpp"
#include "core/kkt/block.hpp"
#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"

namespace ipminmax {

namespace {

using namespace parameters::certificate;

using Kind = CertificateReason::Kind;

/// A first look at a point. Wrong: inertias at clear bounds. Far: the solution is near enough for
/// the test but not for the user.
enum class FirstLook : std::uint8_t { Right, Wrong, Far, Unclear };

/// Whether the point is near its solution, or moves there by the Newton step.
bool reaches_solution(TestContext& c, TrialPoint& trial) {
  const Iterate& given = trial.point.iterate;
  if (is_near(c, given.v, trial.newton.end.v, trial.scaling, c.far())) return true;
  Iterate end = trial.newton.end;
  // As far as to the bounds that it ends at: then equations that are linear hold.
  for (const Index i : indices(end.v)) {
    if (trial.set[i] != BoundClass::Active)
      end.v[i] = given.v[i] + kShareOfWay * (end.v[i] - given.v[i]);
  }
  end.lambda = given.lambda + kShareOfWay * (end.lambda - given.lambda);
  const double left = 1.0 - kShareOfWay + trial.newton.contraction;
  const Vector next = end.v + left * (end.v - given.v);
  return is_near(c, end.v, next, trial.scaling, c.far()) &&
         move_to_end(c, trial, end, c.allowed_error(c.given)) && c.evaluate_objective(*trial.moved);
}

/// At most two factorizations of each matrix at a clear point, with the margin in it: right with it
/// is right without.
FirstLook first_look(TestContext& c, TrialPoint& trial) {
  scale_variables(c.canonical, trial.point.iterate.v, trial.point.evaluation, c.parts,
                  trial.scaling);
  guess_active_set(c, kStrictRatio, trial);
  if (!trial.set.is_clear(c.canonical)) return FirstLook::Unclear;
  ActiveSetSystem system = c.system_of(trial);
  const Vector error = c.scaled_hessian_error(trial.scaling);
  double asked = std::max({kInTols * c.options.minmax_curvature_tol, c.margin(),
                           std::min(kInTols * c.options.tol, kMostFar)});
  trial.test = second_order_test(system, error, asked);
  if (!trial.test.both()) {
    // Singular beside the margin, it is so without: gradients depend on each other.
    const KktFactors& last = trial.test.inner ? c.kkt.factors() : c.kkt.inner_factors();
    return last.status == FactorizationStatus::Singular ? FirstLook::Unclear : FirstLook::Wrong;
  }
  if (!(trial.test.inverse_norm() <= kIndependent)) return FirstLook::Unclear;
  constexpr double kAccuracy = 1e-4;  // of the Newton step
  const double share = kAccuracy / std::max(1.0, trial.test.full_inverse_norm);
  // Two references: more would be an allocation of std::function.
  const KktSolve solve = [&](const NewtonResidual& rhs, Step& step) {
    return system.kkt.solve_unshifted(system.assembled(), rhs, step, {.ratio = share});
  };
  if (!newton_confirms(c, trial, system, solve) || !gradients_hold(trial))
    return FirstLook::Unclear;
  const double changes_by = max_norm(trial.newton.error);
  if (!(asked - changes_by >= c.margin())) {  // clear curvature is right beside that, too
    asked = kClearlyWrong * changes_by + c.margin();
    trial.test = second_order_test(system, error, asked);
    if (!trial.test.both() || !gradients_hold(trial)) return FirstLook::Unclear;
  }
  trial.margin = asked - changes_by;
  if (!reaches_solution(c, trial)) return FirstLook::Far;
  c.examine_curvature(trial.point, trial.point.iterate.lambda, &system);
  return FirstLook::Right;
}

/// Inactive copies are held, with the curvature that they have in the limit: else what is left of
/// it by the barrier would give them lengths.
void hold_inactive_copies(TestContext& c, TrialPoint& trial) {
  const Iterate& given = c.given.iterate;
  scale_variables(c.canonical, given.v, c.given.evaluation, c.parts, trial.scaling);
  trial.inactive = inactive_copies(c.canonical, given, trial.scaling);
  Vector& lambda = trial.point.iterate.lambda;
  for (const Index i : trial.inactive.variables)
    lambda[c.canonical.constraint_of_slack(c.canonical.robust_slack(i))] = 0.0;
  for (const auto j : indices(trial.inactive.rows)) {
    if (trial.inactive.rows[j]) lambda[static_cast<Index>(j)] = 0.0;
  }
  if (!trial.inactive.variables.empty() &&
      !c.canonical.second_derivatives(given.v, lambda, trial.point.evaluation)) {
    trial.point = c.given;
  }
}

/// What curvature does not tell: robust rows, and vertices.
SecondOrder test_beyond_curvature(TestContext& c, const TrialPoint& trial) {
  const Point& judged = trial.moved ? *trial.moved : c.given;
  const SecondOrder verdict = test_robust_rows(c, trial, judged);
  if (verdict != SecondOrder::Satisfied) {
    c.reasons.add(Kind::RobustRow, "a robust constraint's worst case is no strict maximum of it",
                  Player::Max);
    return verdict;
  }
  const Index lost = multiplier_lost_inside(c, trial, judged);
  if (lost < 0) return verdict;
  c.reasons.add_about(Kind::Unsteady, lost,
                      "first derivatives jump next to active bounds: a small step inside them the "
                      "gradient has another sign in ");
  return SecondOrder::Undecided;
}

/// The point's verdict; trial: what it is about, the first look's or own.
SecondOrder judge(TestContext& c, TrialPoint*& trial, TrialPoint& own) {
  if (c.hessian_error && !c.hessian_error->allFinite()) {
    c.reasons.add(Kind::Differences, "second derivatives from differences could not be trusted");
    return SecondOrder::Undecided;
  }
  if (c.options.mu_target > 0.0) return judge_barrier_problem(c, *trial);
  if (c.canonical.has_copies()) hold_inactive_copies(c, *trial);
  const FirstLook look = first_look(c, *trial);
  if ((look == FirstLook::Unclear || look == FirstLook::Far) &&
      c.options.minmax_certificate == CertificateEffort::Quick) {
    c.reasons.add(Kind::Effort, "not clear at a quick look (minmax_certificate quick)");
    return SecondOrder::Undecided;
  }
  if (look != FirstLook::Right) {
    trial = &own;
    const SecondOrder verdict = correct_and_test(c, look == FirstLook::Far, own);
    if (verdict != SecondOrder::Satisfied) return verdict;
  }
  return test_beyond_curvature(c, *trial);
}

std::string disagreement(const CanonicalProblem& canonical, const Deviation& found) {
  const double size = std::max(std::abs(found.exact), std::abs(found.difference));
  const double percent = 100.0 * std::abs(found.exact - found.difference) / size;
  return "the second derivatives in " + canonical.column_name(found.index) +
         " disagree with differences of the gradient by " + number_text(percent, 3) +
         " percent, so nothing is certified; derivative_test second-order tells which is wrong";
}

/// The certificate of a verdict about a trial.
Certificate write(TestContext& c, const TrialPoint& trial, SecondOrder verdict, bool disagrees) {
  const auto independent = [&](Player player) {
    const double inverse_norm = trial.test.inverse_norm();
    if (trial.dependences) return trial.dependences->independent(c.canonical, player);
    return c.canonical.constraints() == 0 || (trial.test.both() && inverse_norm <= kIndependent);
  };
  Certificate found;
  found.second_order = verdict;
  found.kind = PointKind::FirstOrderPoint;
  found.inner_expected = c.kkt.layout().expected_inner();
  found.full_expected = c.kkt.layout().expected();
  found.inner = trial.inner.value_or(found.inner_expected);
  found.full = trial.full.value_or(found.full_expected);
  found.licq_min = independent(Player::Min);
  found.licq_max = independent(Player::Max);
  found.weakly_active_min = trial.set.weak(c.canonical, Player::Min);
  found.weakly_active_max = trial.set.weak(c.canonical, Player::Max);
  found.finite_differences = c.hessian_error.has_value();
  if (c.hessian_error) found.hessian_error = max_norm(*c.hessian_error);
  found.hessian_disagrees = disagrees;
  if (verdict == SecondOrder::Satisfied) {
    found.kind = PointKind::LocalMinmax;
    found.margin = trial.margin;
    const LittleCurvature& little = c.arrays.curvature;
    if (trial.proximal > 0.0) {
      found.answer = InnerAnswer::BestNotUnique;
    } else {
      if (c.options.mu_target == 0.0)
        found.answer = found.weakly_active_max == 0 ? InnerAnswer::Smooth : InnerAnswer::Unique;
      if (little.variable >= 0) {
        found.least_curvature = little.least;
        found.least_curvature_variable = c.canonical.model_variable(little.variable);
      }
    }
  }
  found.reasons = c.reasons.take();
  return found;
}

}  // namespace

Finding certify(CanonicalProblem& canonical, KktSystem& kkt, const Point& point, double mu,
                const SolverOptions& options, Index factorizations, CertificateArrays& arrays) {
  const Index last = kkt.factorizations() + factorizations + kToConfirm;
  TestContext c{canonical, kkt, options, arrays, point, Parts(arrays), last};
  c.hessian_error = canonical.hessian_error(point.iterate.v, point.iterate.lambda);
  TrialPoint own, *trial = &arrays.trial;
  Point& room = c.parts.point();
  std::swap(trial->point, room);
  trial->begin(canonical, point, mu);
  SecondOrder verdict = SecondOrder::Undecided;
  try {
    verdict = judge(c, trial, own);
    // Wrong second derivatives may be why nothing could be decided.
    if (verdict == SecondOrder::Undecided || verdict == SecondOrder::Flat)
      c.examine_curvature(point, point.iterate.lambda, nullptr);
  } catch (const FactorsOutOfMemory&) {  // what was solved stays solved
    verdict = SecondOrder::Undecided;
    c.reasons.add(Kind::Effort, "the test ran out of memory");
    trial->moved.reset();
    trial->inner = trial->full = Inertia{};
  }
  Finding finding;
  const bool disagrees = c.wrong_row && verdict != SecondOrder::Violated;
  if (disagrees) {
    verdict = SecondOrder::Undecided;
    finding.remark = disagreement(canonical, *c.wrong_row);
    c.reasons.add(Kind::WrongHessian, finding.remark);
  }
  if (verdict == SecondOrder::Satisfied && options.mu_target == 0.0) {
    const Point& certified = trial->moved ? *trial->moved : point;
    c.reasons.add_relaxed(certified.iterate, trial->scaling, options);
  }
  finding.certificate = write(c, *trial, verdict, disagrees);
  finding.point = std::move(trial->moved);
  finding.mu = trial->mu;
  finding.wrong = std::move(trial->wrong);
  std::swap(arrays.trial.point, room);
  return finding;
}

}  // namespace ipminmax
