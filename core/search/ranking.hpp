#pragma once

#include <tuple>
#include <vector>

#include "core/multistart.hpp"

namespace ipminmax {

/// Rank of a result in better(): lexicographic, smaller is better.
using Rank = std::tuple<int, int, double>;

[[nodiscard]] Rank rank_of(const Result& result);

/// Adds one more certified point, unless it is known: then one more start has found it. by_x: where
/// several y are worst, any of them may stand in v, and points with the same x are one.
void add_distinct(const ProblemStructure& structure, bool by_x, double tol, Index start,
                  Result&& result, std::vector<DistinctPoint>& points);

}  // namespace ipminmax
