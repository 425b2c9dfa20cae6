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

}  // namespace

bool maximizes_weakly(TestContext& c, Candidate here) {
  if (!c.may_factorize(2) || !evaluate_objective(c.canonical, here.point)) return false;
  ActiveSetSystem system(c.canonical, c.kkt, here.classes, here.units, here.point.evaluation);
  system.assemble({.min_fixed = true, .max_fixed = false});
  if (here.classes.weak_max > 0 || is_saddle(c.canonical, system)) return false;
  const FlatDirections flat =
      find_flat_directions(c.canonical, system, here.point, c.options, c.margin(1.0), Player::Max);
  if (flat.verdict != FlatDirections::Verdict::Flat) return false;
  if (flat.direction.size() > 0) {
    c.reasons.add_direction(CertificateReason::Kind::FlatDirection, Player::Max, flat.direction,
                            "y is best but not unique: as good along");
  }
  return true;
}

}  // namespace ipminmax
