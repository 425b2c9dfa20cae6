#pragma once

#include <tuple>
#include <vector>

#include "core/multistart.hpp"

// One order of answers, and one rule for what is clearly worse.
namespace ipminmax {

/// Rank of a result in better(): lexicographic, smaller is better.
using Rank = std::tuple<int, int, double>;

[[nodiscard]] Rank rank_of(const Result& result);

[[nodiscard]] inline bool is_certified(const Result& result) {
  return result.certificate.kind == PointKind::LocalMinmax;
}

/// Max's variables of n values, in their order.
[[nodiscard]] std::vector<double> max_part(const ProblemStructure& structure,
                                           const std::vector<double>& v);

/// Whether nothing is known that speaks against a result's claim: what was asked for was done, and
/// no y refutes it.
[[nodiscard]] bool stands(const Result& result);

}  // namespace ipminmax
