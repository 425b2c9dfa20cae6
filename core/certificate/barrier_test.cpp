#include "core/certificate/candidate.hpp"

#include <algorithm>

#include "core/certificate/bound_classes.hpp"
#include "core/certificate/parameters.hpp"
#include "core/model/norms.hpp"

namespace ipminmax {

namespace parameter = parameters::certificate;

namespace {

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

bool barrier_newton_contracts(TestContext& c, const Point& given) {
  Point point = given;
  StepLength alpha;
  bool dependent = false;
  Eigen::VectorXd before = point.iterate.v;
  if (!barrier_newton_step(c.canonical, c.kkt, c.mu, point, alpha, dependent)) return false;
  const double first = max_norm(point.iterate.v - before);
  if (first <= parameter::kRelaxation * (1.0 + max_norm(before))) return true;
  before = point.iterate.v;
  return barrier_newton_step(c.canonical, c.kkt, c.mu, point, alpha, dependent) &&
         max_norm(point.iterate.v - before) <= parameter::kContraction * first;
}

}  // namespace

SecondOrder judge_barrier_problem(TestContext& c, const Point& given) {
  c.kkt.assemble(given.iterate, given.evaluation);
  const double spare = c.margin(1.0) * std::max(1.0, c.kkt.hessian_norm());
  const auto right = [&](double shift) {
    return c.kkt.has_expected_inner_inertia(c.kkt.factorize_inner({.y = shift})) &&
           c.kkt.has_expected_inertia(c.kkt.factorize({.x = shift, .y = std::max(shift, 0.0)}));
  };
  if (right(-spare)) {
    c.certificate.margin = spare;
    c.examine_curvature(given, &given.evaluation);
    return barrier_newton_contracts(c, given) ? SecondOrder::Satisfied : SecondOrder::Undecided;
  }
  c.kkt.begin_pivoting();
  const bool refuted = barrier_problem_refuted(c, spare);
  c.kkt.factorize_ahead({}, {});
  c.certificate.inner = c.kkt.factorize_inner({}).inertia;
  c.certificate.full = c.kkt.factorize({}).inertia;
  return refuted ? SecondOrder::Violated : SecondOrder::Undecided;
}

}  // namespace ipminmax
