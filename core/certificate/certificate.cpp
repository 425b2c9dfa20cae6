#include "core/certificate/certificate.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/certificate/candidate.hpp"
#include "core/certificate/corner_check.hpp"
#include "core/certificate/parameters.hpp"
#include "core/certificate/robust_rows.hpp"
#include "core/certificate/test_context.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/point/residual.hpp"

namespace ipminmax {

namespace parameter = parameters::certificate;

namespace {

using Kind = CertificateReason::Kind;

/// A first look at a point. Wrong: inertias at clear bounds.
enum class Look : std::uint8_t { Right, Wrong, Unclear };

std::string percentage(const Deviation& found) {
  const double size = std::max(std::abs(found.exact), std::abs(found.difference));
  const double percent = 100.0 * std::abs(found.exact - found.difference) / size;
  return " by " + number_text(percent, 3) + " percent";
}

/// At most one factorization of each matrix at a clear point, with the margin in it: right with it
/// is right without.
Look first_look(TestContext& c, const Point& point) {
  const Units& units = units_of(c.canonical, point.iterate.v, point.evaluation, c.arrays.units);
  BoundClasses& classes = c.arrays.classes;
  c.guess(point.iterate, parameter::kStrictRatio, classes);
  if (!classes.clear()) return Look::Unclear;
  ActiveSetSystem system(c.canonical, c.kkt, classes, units, point.evaluation, &c.arrays.system);
  const Eigen::VectorXd error = c.hessian_error_in(units);
  const double asked =
      std::max({parameter::kInTols * c.options.minmax_curvature_tol, c.margin(1.0),
                std::min(parameter::kInTols * c.options.tol, parameter::kMostFar)});
  const InertiaTest test = survives(system, error, asked);
  if (!test.both()) {
    // Singular beside the margin, it is so without: gradients depend on each other.
    const KktFactors& last = test.inner ? c.kkt.factors() : c.kkt.inner_factors();
    return last.status == FactorizationStatus::Singular ? Look::Unclear : Look::Wrong;
  }
  if (!(std::max(test.inner_response, test.full_response) <= parameter::kIndependent))
    return Look::Unclear;
  NewtonTest& newton = c.arrays.newton;
  const double response = std::max(1.0, test.full_response);
  // Two references: more would be an allocation of std::function.
  const KktSolve solve = [&](const NewtonResidual& rhs, Step& step, double share) {
    return system.kkt().solve_unshifted(system.assembled(), rhs, step, {.ratio = share / response});
  };
  if (!c.newton_confirms(system, point, solve, newton)) return Look::Unclear;
  if (!gradients_hold(newton, test)) return Look::Unclear;
  c.is_far = !is_near(c, point.iterate, newton.end.iterate.v, units, c.far());
  if (c.is_far) return Look::Unclear;
  const double left = asked - max_norm(newton.error);
  if (!(left >= c.margin(1.0))) return Look::Unclear;
  c.examine_curvature(system, point, point.iterate.lambda);
  report_end(c, point, newton);
  c.certificate.margin = left;
  c.certificate.licq_min = c.certificate.licq_max = true;
  c.certificate.answer = InnerAnswer::Smooth;
  return Look::Right;
}

/// With the curvature that idle copies have in the limit: else what is left of it by the barrier
/// would give them lengths.
Point without_idle(TestContext& c, const Point& given) {
  Point point = given;
  Eigen::VectorXd& lambda = point.iterate.lambda;
  for (const Index i : c.idle.variables) {
    lambda[c.canonical.constraint_of_slack(c.canonical.served_slack(i))] = 0.0;
  }
  for (Index j = 0; j < lambda.size(); ++j) {
    if (c.idle.rows[static_cast<std::size_t>(j)]) lambda[j] = 0.0;
  }
  const bool known = c.canonical.second_derivatives(point.iterate.v, lambda, point.evaluation) ==
                     EvaluationStatus::Ok;
  return known ? point : given;
}

SecondOrder judge(TestContext& c, const Point& given) {
  if (c.canonical.has_copies()) {
    c.idle = idle_copies(c.canonical, given.iterate,
                         units_of(c.canonical, given.iterate.v, given.evaluation, c.arrays.units));
  }
  const Look look =
      c.idle.variables.empty() ? first_look(c, given) : first_look(c, without_idle(c, given));
  if (look == Look::Unclear && c.options.minmax_certificate == CertificateEffort::Quick) {
    c.reasons.add(Kind::Effort, Player::Min,
                  "not clear at a quick look (minmax_certificate quick)");
    return SecondOrder::Undecided;
  }
  SecondOrder verdict = look == Look::Right ? SecondOrder::Satisfied : examine(c, given);
  if (verdict != SecondOrder::Satisfied) return verdict;
  const Point& judged = c.moved ? *c.moved : given;
  verdict = test_robust_rows(c.canonical, c.kkt, judged, c.arrays.classes, c.arrays.units.units,
                             c.idle.variables, c.proximal);
  if (verdict != SecondOrder::Satisfied) {
    c.certificate.answer = InnerAnswer::Unknown;
    c.reasons.add(Kind::RobustRow, Player::Max,
                  "a robust constraint's worst case is no strict maximum of it");
    return verdict;
  }
  const Index lost =
      multiplier_lost_inside(c.canonical, judged, c.arrays.classes, c.arrays.units.units, c.options,
                             c.arrays.newton_step.there, c.arrays.corner);
  if (lost < 0) return verdict;
  c.certificate.answer = InnerAnswer::Unknown;
  c.reasons.add_about(Kind::Unsteady, lost,
                      "first derivatives jump next to active bounds: a small step inside them the "
                      "gradient has another sign in ");
  return SecondOrder::Undecided;
}

Finding run(TestContext& c, const Point& given) {
  c.certificate.inner_expected = c.kkt.layout().expected_inner();
  c.certificate.full_expected = c.kkt.layout().expected();
  c.certificate.inner = c.certificate.inner_expected;
  c.certificate.full = c.certificate.full_expected;
  c.hessian_error = c.canonical.hessian_error(given.iterate.v, given.iterate.lambda);
  c.certificate.finite_differences = c.hessian_error.has_value();
  if (c.hessian_error) c.certificate.hessian_error = max_norm(*c.hessian_error);
  if (c.hessian_error && !c.hessian_error->allFinite()) {
    c.certificate.second_order = SecondOrder::Undecided;
    c.reasons.add(Kind::Differences, Player::Min,
                  "second derivatives from differences could not be trusted");
  } else if (c.options.mu_target > 0.0) {
    c.certificate.second_order = judge_barrier_problem(c, given);
  } else {
    c.certificate.second_order = judge(c, given);
  }
  // Wrong second derivatives may be why nothing could be decided.
  if (c.certificate.second_order == SecondOrder::Undecided ||
      c.certificate.second_order == SecondOrder::Flat) {
    c.examine_curvature(given, nullptr);
  }
  std::string remark;
  if (c.wrong_row && c.certificate.second_order != SecondOrder::Violated) {
    c.certificate.second_order = SecondOrder::Undecided;
    c.certificate.hessian_disagrees = true;
    c.certificate.answer = InnerAnswer::Unknown;
    remark = "the second derivatives in " + c.canonical.column_name(c.wrong_row->index) +
             " disagree with differences of the gradient" + percentage(*c.wrong_row) +
             ": either may be wrong, and no certificate rests on that; try "
             "derivative_test "
             "second-order, which tests both";
    c.reasons.add(Kind::WrongHessian, Player::Min, remark);
  }
  if (c.certificate.second_order != SecondOrder::Satisfied) {
    c.certificate.margin = c.certificate.least_curvature = 0.0;
    c.certificate.least_curvature_variable = -1;
  }
  if (c.wrong) {
    c.reasons.add_direction(Kind::WrongCurvature, c.wrong->owner, c.wrong->direction,
                            c.wrong->owner == Player::Min ? "Min gains along" : "Max gains along");
  }
  if (c.certificate.second_order == SecondOrder::Satisfied && c.options.mu_target == 0.0) {
    const Point& certified = c.moved ? *c.moved : given;
    c.reasons.add_relaxed(certified.iterate, c.arrays.units.units, c.options);
  }
  c.certificate.reasons = c.reasons.take();
  c.certificate.kind = c.certificate.second_order == SecondOrder::Satisfied
                           ? PointKind::LocalMinmax
                           : PointKind::FirstOrderPoint;
  return {.certificate = c.certificate,
          .point = std::move(c.moved),
          .mu = c.mu,
          .wrong = std::move(c.wrong),
          .remark = std::move(remark)};
}

}  // namespace

Finding certify(CanonicalProblem& canonical, KktSystem& kkt, const Point& point, double mu,
                const SolverOptions& options, Index factorizations, CertificateArrays& arrays) {
  TestContext c(canonical, kkt, mu, options, factorizations, arrays);
  return run(c, point);
}

Finding certify(CanonicalProblem& canonical, KktSystem& kkt, const Point& point, double mu,
                const SolverOptions& options, Index factorizations) {
  CertificateArrays arrays;
  return certify(canonical, kkt, point, mu, options, factorizations, arrays);
}

}  // namespace ipminmax
