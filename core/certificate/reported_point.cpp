#include "core/certificate/candidate.hpp"

#include <algorithm>
#include <utility>

#include "core/certificate/parameters.hpp"
#include "core/model/norms.hpp"
#include "core/point/residual.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// An iterate on the way of the test's Newton steps, with multipliers of open bounds that are mu /
/// s.
Iterate solution_of(const CanonicalProblem& canonical, const Candidate& candidate, Iterate end,
                    double mu) {
  // Doubtful ones of Max are in the equations, with multipliers of their own.
  const auto in_equations = [&](Index i) {
    return candidate.classes[i] == BoundClass::Active ||
           (candidate.classes[i] == BoundClass::Doubtful && canonical.owned_by_max(i));
  };
  for_each_bound(canonical, end.v, [&](Index i, int side, double distance) {
    const bool open = !in_equations(i) || candidate.classes.side[at(i)] != side;
    if (open && distance > 0.0) (side < 0 ? end.z_lower : end.z_upper)[i] = mu / distance;
  });
  for (Index j = 0; j < canonical.constraints(); ++j) {
    const Index slack = canonical.slack_of(j);
    if (slack < 0 || in_equations(slack)) continue;
    end.lambda[j] = canonical.sign(slack) * (end.z_upper[slack] - end.z_lower[slack]);
  }
  return end;
}

}  // namespace

void report_end(TestContext& c, const Point& given, const NewtonTest& newton) {
  const double scale = std::abs(c.canonical.objective_scale());
  if (max_norm(given.dual) <= parameters::certificate::kSlight * std::min(scale, 1.0)) return;
  Point end = given;
  end.iterate = newton.end.iterate;
  if (!evaluate(c.canonical, end) || !evaluate_objective(c.canonical, end)) return;
  const auto error = [&](const Point& p) {
    return kkt_error(c.canonical, p.iterate, p.evaluation, p.dual, c.options.s_max).total;
  };
  if (max_norm(end.dual) < max_norm(given.dual) && error(end) <= error(given)) {
    c.moved = std::move(end);
  }
}

bool reports_solution(TestContext& c, const Candidate& candidate, const Point& given) {
  const Point& reported = c.moved ? *c.moved : given;
  const Iterate& last = candidate.newton.end.iterate;
  const Eigen::VectorXd step = last.v - candidate.point.iterate.v;
  const bool ends = is_near(c, candidate.point.iterate, candidate.point.iterate.v + step,
                            candidate.units, parameters::certificate::kTrace);
  if (ends && candidate.point.iterate.v == reported.iterate.v) return true;
  const auto error = [&](const Point& p) {
    return kkt_error(c.canonical, p.iterate, p.evaluation, p.dual, c.options.s_max).total;
  };
  Point end = candidate.point;
  const double allowed =
      std::max(error(reported), std::min(c.options.tol, c.options.acceptable_tol));
  double left = 0.0;
  const auto moves_to = [&](const Iterate& reached, double mu) {
    end.iterate = solution_of(c.canonical, candidate, reached, mu);
    if (!evaluate(c.canonical, end)) return false;
    left = error(end);
    if (!(left <= allowed)) return false;
    c.moved = std::move(end);
    c.mu = mu;
    return true;
  };
  if (ends && moves_to(candidate.point.iterate, c.mu)) return true;
  const bool near = !candidate.crept && is_near(c, reported.iterate, last.v, candidate.units,
                                                parameters::certificate::kTrace);
  if (near) return true;
  // The last step has not been taken yet; then multipliers mu / s may be what is left.
  const bool next_is_near = is_near(c, last, last.v + candidate.newton.contraction * step,
                                    candidate.units, parameters::certificate::kTrace);
  return next_is_near &&
         (moves_to(last, c.mu) ||
          (left > 0.0 && moves_to(last, parameters::certificate::kLittle * allowed / left * c.mu)));
}

}  // namespace ipminmax
