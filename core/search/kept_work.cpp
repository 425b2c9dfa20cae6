#include <cstddef>

#include "core/search/kept_work.hpp"

namespace ipminmax {

void KeptWork::forget() {
  shape = {};
  scaling.reset();
  analysis.reset();
  shifts = {};
  structure_only = false;
  hessian_pattern.reset();
}

bool KeptWork::fits(const ProblemStructure& s, const SolverOptions& options) {
  const std::size_t n = s.variable_players.size();
  const std::size_t m = s.constraint_players.size();
  const bool complete = s.variable_lower.size() == n && s.variable_upper.size() == n &&
                        s.constraint_lower.size() == m && s.constraint_upper.size() == m;
  const bool same = complete && has_shape(s, options, shape);
  // New ones instead of others in size: one of Eigen's is no more what it was when memory fails.
  if (!same) arrays = {};
  if (structure_only) {
    if (complete && !analysis && !same) shape = shape_of(s, options);
    return complete && (same || !analysis);
  }
  if (same) return true;
  forget();
  if (complete) shape = shape_of(s, options);
  return true;
}

}  // namespace ipminmax
