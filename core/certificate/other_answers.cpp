#include <algorithm>
#include <vector>

#include "core/certificate/trial.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// Max's free variables and which of them W ties to themselves or each other.
struct TiedVariables {
  std::vector<bool> free, tied, curved;

  TiedVariables(const CanonicalProblem& canonical, const ActiveSetSystem& system, bool by_value)
      : free(at(canonical.variables()), false), tied(free), curved(free) {
    for (Index i = canonical.y().begin; i < canonical.y().end; ++i)
      free[at(i)] = !system.is_fixed(i);
    for_each_entry(canonical.hessian(), system.derivatives().hessian,
                   [&](Index i, Index j, double value) {
                     if (!free[at(i)] || !free[at(j)] || (by_value && value == 0.0)) return;
                     tied[at(i)] = tied[at(j)] = true;
                     if (i == j) curved[at(i)] = true;
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
  for (Index i = c.canonical.y().begin; i < c.canonical.y().end; ++i) {
    if (is_linear(i)) set.hold(i), any = true;
  }
  if (!any) return false;
  for (const auto& [row, col] : c.canonical.jacobian()) {
    if (is_linear(col)) set.redundant[at(row)] = true;
  }
  ActiveSetSystem rest(c.canonical, c.kkt, set, trial.scaling, trial.point.evaluation);
  const InertiaTest test = second_order_test(rest, trial.error, c.margin(), 0.0, true);
  return test.inner && test.inner_response <= parameters::certificate::kIndependent;
}

/// Whether W ties one of Max's free variables, which no row that counts reads, to another one but
/// not to itself: a saddle however little that is, which lengths may hide.
bool is_saddle(const CanonicalProblem& canonical, const ActiveSetSystem& system) {
  TiedVariables variables(canonical, system, true);
  for (const auto& [row, col] : canonical.jacobian()) {
    if (system.counts(row)) variables.curved[at(col)] = true;
  }
  for (std::size_t i = 0; i < variables.tied.size(); ++i) {
    if (variables.tied[i] && !variables.curved[i]) return true;
  }
  return false;
}

bool maximizes_weakly_at(TestContext& c, Point point, const TrialPoint& trial) {
  if (!c.may_factorize(2) || !c.evaluate_objective(point)) return false;
  ActiveSetSystem system(c.canonical, c.kkt, trial.set, trial.scaling, point.evaluation);
  system.assemble({.min_fixed = true, .max_fixed = false});
  const bool shown = by_structure(c, trial, system);
  if (!shown && (trial.set.weak(c.canonical, Player::Max) > 0 || is_saddle(c.canonical, system)))
    return false;
  const FlatDirections flat = find_flat_directions(c, system, point, c.margin(), Player::Max);
  if (!shown && flat.verdict != FlatDirections::Verdict::Flat) return false;
  if (flat.direction.size() > 0) {
    c.reasons.add_direction(CertificateReason::Kind::FlatDirection, Player::Max, flat.direction,
                            "y is best but not unique: as good along");
  }
  return true;
}

}  // namespace

bool maximizes_weakly(TestContext& c, const TrialPoint& trial) {
  // Off the solution the value changes along y with x's distance to it.
  Point end = trial.point;
  end.iterate = trial.newton.end;
  return (c.evaluate(end) && maximizes_weakly_at(c, std::move(end), trial)) ||
         maximizes_weakly_at(c, trial.point, trial);
}

}  // namespace ipminmax
