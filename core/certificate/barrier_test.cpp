#include "core/certificate/barrier_test.hpp"

#include <algorithm>

#include "core/certificate/newton.hpp"
#include "core/model/norms.hpp"

namespace ipminmax {
namespace {

/// Whether pivoted factors show another inertia although each player is given so much curvature.
bool barrier_problem_refuted(Case& c, double spare) {
  const auto shows = [](const KktFactors& f) {
    return f.trust.pivoted &&
           (f.status == FactorizationStatus::Ok || f.status == FactorizationStatus::Singular);
  };
  const KktFactors inner = c.kkt.factorize_inner({.y = spare});
  if (!c.kkt.has_expected_inner_inertia(inner)) return shows(inner);
  const KktFactors full = c.kkt.factorize({.x = spare, .y = spare});
  return !c.kkt.has_expected_inertia(full) && shows(full);
}

bool barrier_newton_contracts(Case& c, const Point& given) {
  constexpr double kTau = 0.99;
  constexpr double kNegligible = 1e-10;
  Point point = given;
  StepLength alpha;
  bool dependent = false;
  Eigen::VectorXd before = point.iterate.v;
  if (!barrier_newton_step(c.canonical, c.kkt, c.mu, kTau, point, alpha, dependent)) return false;
  const double first = max_norm(point.iterate.v - before);
  if (first <= kNegligible * (1.0 + max_norm(before))) return true;
  before = point.iterate.v;
  return barrier_newton_step(c.canonical, c.kkt, c.mu, kTau, point, alpha, dependent) &&
         max_norm(point.iterate.v - before) <= kContraction * first;
}

}  // namespace

SecondOrder judge_barrier_problem(Case& c, const Point& given) {
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
