#include "core/certificate/candidate.hpp"

#include <algorithm>
#include <vector>

#include "core/certificate/direction.hpp"
#include "core/certificate/parameters.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

bool is_free_of_max(const CanonicalProblem& canonical, const ActiveSetSystem& system, Index i) {
  return canonical.y().contains(i) && !system.is_fixed(i);
}

/// Max's free variables that no entry of W ties to themselves or each other.
std::vector<bool> linear_variables(const CanonicalProblem& canonical,
                                   const ActiveSetSystem& system) {
  std::vector<bool> linear(at(canonical.variables()), false);
  const auto is_free = [&](Index i) { return is_free_of_max(canonical, system, i); };
  for (Index i = canonical.y().begin; i < canonical.y().end; ++i) linear[at(i)] = is_free(i);
  for (const auto& [i, j] : canonical.hessian()) {
    if (is_free(i) && is_free(j)) linear[at(i)] = linear[at(j)] = false;
  }
  return linear;
}

/// The classes with these variables held and the rows that read them left out.
BoundClasses without(const CanonicalProblem& canonical, BoundClasses classes,
                     const std::vector<bool>& held) {
  for (Index i = canonical.y().begin; i < canonical.y().end; ++i) {
    if (held[at(i)]) classes.hold(i);
  }
  classes.redundant.resize(at(canonical.constraints()), false);
  for (const auto& [row, col] : canonical.jacobian()) {
    if (held[at(col)]) classes.redundant[at(row)] = true;
  }
  count_doubtful(canonical, classes);
  return classes;
}

/// Where f is not linear in some of them, the others' curvature has to be right without them.
bool by_structure(TestContext& c, const Candidate& candidate, ActiveSetSystem& system) {
  const std::vector<bool> linear = linear_variables(c.canonical, system);
  if (std::ranges::find(linear, true) == linear.end()) return false;
  const BoundClasses classes = without(c.canonical, candidate.classes, linear);
  ActiveSetSystem rest(c.canonical, c.kkt, classes, candidate.units, candidate.point.evaluation);
  const InertiaTest test = inner_survives(rest, candidate.error, c.margin(1.0));
  return test.inner && test.inner_response <= parameters::certificate::kIndependent;
}

/// Whether W ties one of Max's free variables, which no row that counts reads, to another one but
/// not to itself: a saddle however little that is, which lengths may hide.
bool is_saddle(const CanonicalProblem& canonical, const ActiveSetSystem& system) {
  std::vector<bool> tied(at(canonical.variables()), false), excused = tied;
  const auto is_free = [&](Index i) { return is_free_of_max(canonical, system, i); };
  const std::vector<double>& hessian = system.derivatives().hessian;
  for (std::size_t k = 0; k < hessian.size(); ++k) {
    const auto [i, j] = canonical.hessian()[k];
    if (hessian[k] == 0.0 || !is_free(i) || !is_free(j)) continue;
    if (i == j) {
      excused[at(i)] = true;
    } else {
      tied[at(i)] = tied[at(j)] = true;
    }
  }
  for (const auto& [row, col] : canonical.jacobian()) {
    if (system.counts(row)) excused[at(col)] = true;
  }
  for (std::size_t i = 0; i < tied.size(); ++i) {
    if (tied[i] && !excused[i]) return true;
  }
  return false;
}

bool maximizes_weakly_at(TestContext& c, Candidate here) {
  if (!c.may_factorize(2) || !evaluate_objective(c.canonical, here.point)) return false;
  ActiveSetSystem system(c.canonical, c.kkt, here.classes, here.units, here.point.evaluation);
  system.assemble({.min_fixed = true, .max_fixed = false});
  const bool shown = by_structure(c, here, system);
  if (!shown && (here.classes.weak_max > 0 || is_saddle(c.canonical, system))) return false;
  const FlatDirections flat =
      find_flat_directions(c.canonical, system, here.point, c.options, c.margin(1.0), Player::Max);
  if (!shown && flat.verdict != FlatDirections::Verdict::Flat) return false;
  if (flat.direction.size() > 0) {
    c.reasons.add_direction(CertificateReason::Kind::FlatDirection, Player::Max, flat.direction,
                            "y is best but not unique: as good along");
  }
  return true;
}

}  // namespace

bool maximizes_weakly(TestContext& c, const Candidate& candidate) {
  // Off the solution the value changes along y with x's distance to it.
  Candidate end = candidate;
  end.point.iterate = candidate.newton.end.iterate;
  return (evaluate(c.canonical, end.point) && maximizes_weakly_at(c, end)) ||
         maximizes_weakly_at(c, candidate);
}

}  // namespace ipminmax
