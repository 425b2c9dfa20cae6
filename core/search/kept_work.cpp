#include <cstddef>
#include <utility>

#include "core/search/kept_work.hpp"

namespace ipminmax {

bool KeptWork::fits(const ProblemStructure& s, const SolverOptions& options) {
  const std::size_t n = s.variable_players.size();
  const std::size_t m = s.constraint_players.size();
  if (s.variable_lower.size() != n || s.variable_upper.size() != n ||
      s.constraint_lower.size() != m || s.constraint_upper.size() != m) {  // a bad model
    if (!structure_only) *this = {};
    return !structure_only;
  }
  ModelShape other = shape_of(s, options);
  if (structure_only) {
    if (!analysis) shape = std::move(other);
    return analysis ? shape == other : true;
  }
  if (shape != other) {
    *this = {};
    shape = std::move(other);
  }
  return true;
}

}  // namespace ipminmax
