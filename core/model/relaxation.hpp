#pragma once

#include <algorithm>
#include <cmath>

#include "core/model/canonical_problem.hpp"

namespace ipminmax {

/// What a bound is relaxed by, in the model's units: Ipopt's rule.
[[nodiscard]] inline double relaxation(double bound, const SolverOptions& options) {
  return std::min(options.bound_relax_factor * std::max(1.0, std::abs(bound)),
                  options.constr_viol_tol);
}

/// The same in canonical units. side: -1 of the lower bound, +1 of the upper one.
[[nodiscard]] inline double relaxation_of(const CanonicalProblem& canonical, Index i, int side,
                                          const SolverOptions& options) {
  const double scale = canonical.variable_scale(i);
  const double bound = side < 0 ? canonical.lower()[i] : canonical.upper()[i];
  return scale * relaxation(bound / scale, options);
}

}  // namespace ipminmax
