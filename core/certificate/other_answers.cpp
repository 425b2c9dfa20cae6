#include <vector>

#include "core/certificate/trial.hpp"
#include "core/model/indices.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

using namespace parameters::certificate;

/// Max's free variables and which of them W ties to themselves or each other.
struct TiedVariables {
  std::vector<bool> free, tied;
  std::vector<double> own;  ///< curvature

  TiedVariables(const CanonicalProblem& canonical, const ActiveSetSystem& system, bool by_value)
      : free(at(canonical.variables()), false), tied(free), own(free.size(), 0.0) {
    for (const Index i : indices(canonical.y())) free[at(i)] = !system.is_fixed(i);
    const Evaluation scaled = system.derivatives();
    for_each_in_hessian(canonical, scaled, [&](Index i, Index j, double value) {
      if (!free[at(i)] || !free[at(j)] || (by_value && value == 0.0)) return;
      tied[at(i)] = tied[at(j)] = true;
      if (i == j) own[at(i)] += value;
    });
  }
};

/// If f is not linear in some of them, the others' curvature has to be right without them: with the
/// former held and the rows that read them left out.
bool by_structure(TestContext& c, const TrialPoint& trial, ActiveSetSystem& system) {
  const TiedVariables variables(c.canonical, system, false);
  ActiveBounds set = trial.set;
  set.redundant.resize(at(c.canonical.constraints()), false);
  const auto is_linear = [&](Index i) { return variables.free[at(i)] && !variables.tied[at(i)]; };
  bool any = false;
  for (const Index i : indices(c.canonical.y())) {
    if (is_linear(i)) set.hold(i), any = true;
  }
  if (!any) return false;
  for (const auto& [row, col] : c.canonical.jacobian()) {
    if (is_linear(col)) set.redundant[at(row)] = true;
  }
  ActiveSetSystem rest(c.canonical, c.kkt, set, trial.scaling, trial.point.evaluation,
                       system.parts);
  const InertiaTest test = inner_test(rest, trial.error, c.margin());
  return test.inner && test.inner_inverse_norm <= kIndependent;
}

/// Whether one of Max's free variables, which no row that counts reads, has curvature of the wrong
/// sign, or none while W ties it to another one: a saddle however little that is, which lengths or
/// the rounding of values may hide.
bool is_saddle(const CanonicalProblem& canonical, const ActiveSetSystem& system) {
  TiedVariables variables(canonical, system, true);
  for (const auto& [row, col] : canonical.jacobian()) {
    if (system.counts(row)) variables.tied[at(col)] = false;
  }
  for (const auto i : indices(variables.tied)) {
    if (variables.tied[i] && !(variables.own[i] < 0.0)) return true;
  }
  return false;
}

bool maximizes_weakly_at(TestContext& c, Point point, const TrialPoint& trial) {
  if (!c.may_factorize(2) || !c.evaluate_objective(point)) return false;
  ActiveSetSystem system(c.canonical, c.kkt, trial.set, trial.scaling, point.evaluation, c.parts);
  system.assemble({.min_fixed = true, .max_fixed = false});
  const bool shown = by_structure(c, trial, system);
  // Curvature below the error of differences and below the rounding of values is seen by neither.
  if (!shown && (c.hessian_error || trial.set.weak(c.canonical, Player::Max) > 0 ||
                 is_saddle(c.canonical, system))) {
    return false;
  }
  const FlatDirections found = find_flat_directions(c, system, point, c.margin(), Player::Max);
  if (!shown && !found.flat) return false;
  if (found.direction.size() > 0) {
    c.reasons.add_direction(CertificateReason::Kind::FlatDirection, Player::Max, found.direction,
                            "y is best but not unique: as good along");
  }
  return true;
}

/// Whether neither f nor a row that counts changes along a step of x: no slope is left along it at
/// places around the point and around the start.
bool is_unread(const TestContext& c, const ActiveSetSystem& system, const TrialPoint& trial,
               const Vector& step) {
  const CanonicalProblem& canonical = c.canonical;
  const Vector &v = trial.point.iterate.v, &start = canonical.starting_point().v;
  const Index n = canonical.variables(), m = canonical.constraints();
  Evaluation there = trial.point.evaluation;
  constexpr Index kPlaces = 6;
  for (Index k = 0; k < kPlaces; ++k) {
    Vector place = k % 2 == 0 ? v : start;
    for (Index i = 0; i < n; ++i) {
      const double size = v[i] != start[i] ? std::abs(v[i] - start[i]) : trial.scaling.variable[i];
      place[i] += kShareOfSize * generic_entry(k * n + i) * size;
    }
    place = place.cwiseMax(canonical.lower()).cwiseMin(canonical.upper());
    if (!c.canonical.first_derivatives(place, there)) return false;
    Vector slope = Vector::Zero(m + 1), terms = slope;  // of the rows, and f
    const auto add = [&](Index row, double value) {
      slope[row] += value;
      terms[row] += std::abs(value);
    };
    for (Index i = 0; i < n; ++i) add(m, there.gradient[i] * step[i]);
    for_each_in_jacobian(canonical, there, [&](Index row, Index col, double value) {
      const Index slack = canonical.slack_of(row);
      if (slack < 0 || system.is_fixed(slack)) add(row, value * step[col]);
    });
    if ((slope.array().abs() > kUnread * terms.array()).any()) return false;
  }
  return true;
}

}  // namespace

bool hold_unread(TestContext& c, TrialPoint& next) {
  ActiveSetSystem system = c.system_of(next);
  std::vector<Vector> found = find_uncurved_directions(c, system, next);
  const IndexRange x = c.canonical.x();
  std::vector<Index> held;
  for (const auto k : indices(found)) {
    Vector& d = found[k];
    d.tail(d.size() - x.end).setZero();
    for (std::size_t l = 0; l < k; ++l) d -= d[held[l]] / found[l][held[l]] * found[l];
    const double least = kUnread * d.cwiseAbs().maxCoeff(&held.emplace_back());
    d = (d.array().abs() > least).select(d, 0.0);  // rounding of the matrix's solutions
    const Vector step = d.cwiseProduct(next.scaling.variable);
    if (!is_unread(c, system, next, step)) return false;
    if (next.unread.size() == 0) next.unread = step;
  }
  for (const Index i : held) next.set.hold(i);
  return !held.empty();
}

bool maximizes_weakly(TestContext& c, const TrialPoint& trial) {
  // Off the solution the value changes along y with x's distance to it.
  Point end = trial.point;
  end.iterate = trial.newton.end;
  return (c.evaluate(end) && maximizes_weakly_at(c, std::move(end), trial)) ||
         maximizes_weakly_at(c, trial.point, trial);
}

}  // namespace ipminmax
