#include "core/certificate/reported_point.hpp"

#include <algorithm>
#include <utility>

#include "core/point/residual.hpp"

namespace ipminmax {
namespace {

/// Of the error allowed, that multipliers mu / s of open bounds may leave.
constexpr double kShareOfError = 0.1;
/// Of a multiplier or distance, left at the solution by which a guess of the bound's class holds:
/// of a weakly active one nothing but rounding is.
constexpr double kShareLeft = 1e-3;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// An iterate on the way of the test's Newton steps, with multipliers of open bounds that are mu /
/// s.
Iterate solution_of(const CanonicalProblem& canonical, const Stage& stage, Iterate end, double mu) {
  const auto is_open = [&](Index i, int side) {
    return stage.classes[i] <= BoundClass::Inactive || stage.classes.side[at(i)] != side;
  };
  for (const Index i : canonical.lower_bounded()) {
    const double distance = canonical.above_lower(i, end.v[i]);
    if (is_open(i, -1) && distance > 0.0) end.z_lower[i] = mu / distance;
  }
  for (const Index i : canonical.upper_bounded()) {
    const double distance = canonical.below_upper(i, end.v[i]);
    if (is_open(i, 1) && distance > 0.0) end.z_upper[i] = mu / distance;
  }
  const auto slack_of = canonical.slack_of_constraint();
  for (Index j = 0; j < canonical.constraints(); ++j) {
    const Index slack = slack_of[at(j)];
    if (slack < 0 || stage.classes[slack] == BoundClass::Active) continue;
    // Doubtful rows of Max are in the equations, with multipliers of their own.
    if (stage.classes[slack] == BoundClass::Doubtful && canonical.owned_by_max(slack)) continue;
    end.lambda[j] = canonical.sign(slack) * (end.z_upper[slack] - end.z_lower[slack]);
  }
  return end;
}

}  // namespace

bool guess_holds(Case& c, const Stage& stage, const Point& given) {
  const Iterate& end = stage.newton.end.iterate;
  for (Index i = 0; i < c.canonical.variables(); ++i) {
    if (stage.classes.side[at(i)] == 0 || stage.classes[i] == BoundClass::Doubtful) continue;
    const bool active = stage.classes[i] == BoundClass::Active;
    const auto left = [&](const Iterate& z) {
      return active ? stage.classes.multiplier(z, i) : stage.classes.distance(c.canonical, z, i);
    };
    if (!(left(end) >= kShareLeft * left(given.iterate))) return false;
  }
  return reports_solution(c, stage, given);
}

bool reports_solution(Case& c, const Stage& stage, const Point& given) {
  const Point& reported = c.moved ? *c.moved : given;
  const Iterate& last = stage.newton.end.iterate;
  const Eigen::VectorXd step = last.v - stage.point.iterate.v;
  const bool ends =
      is_near(c, stage.point.iterate, stage.point.iterate.v + step, stage.units, kNear);
  if (ends && stage.point.iterate.v == reported.iterate.v) return true;
  const auto error = [&](const Point& p) {
    return kkt_error(c.canonical, p.iterate, p.evaluation, p.dual, c.options.s_max).total;
  };
  Point end = stage.point;
  const auto inside = [&](const DroppedBound& dropped) {
    return stage.classes.distance(c.canonical, end.iterate, dropped.variable) > 0.0;
  };
  const double allowed =
      std::max(error(reported), std::min(c.options.tol, c.options.acceptable_tol));
  double left = 0.0;
  const auto moves_to = [&](const Iterate& reached, double mu) {
    end.iterate = solution_of(c.canonical, stage, reached, mu);
    if (!std::ranges::all_of(stage.classes.dropped, inside) || !evaluate(c.canonical, end)) {
      return false;
    }
    left = error(end);
    if (!(left <= allowed)) return false;
    c.moved = std::move(end);
    c.mu = mu;
    return true;
  };
  if (ends && moves_to(stage.point.iterate, c.mu)) return true;
  const bool near = !stage.crept && is_near(c, reported.iterate, last.v, stage.units, kNear);
  if (near && !stage.guessed) return true;
  // The last step has not been taken yet; then multipliers mu / s may be what is left.
  const bool next_is_near =
      is_near(c, last, last.v + stage.newton.contraction * step, stage.units, kNear);
  return (next_is_near &&
          (moves_to(last, c.mu) ||
           (left > 0.0 && moves_to(last, kShareOfError * allowed / left * c.mu)))) ||
         near;
}

}  // namespace ipminmax
