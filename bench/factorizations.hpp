#pragma once

#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "measure.hpp"

namespace bench {

inline constexpr auto kFactorizationsTitle =
    "Factorizations of K and K_yy per iteration, by what they are for";

/// A table with columns for that; the first names what a row is of.
inline Table factorizations_by_cause(const std::string& first) {
  std::vector<std::string> columns = {first, "contestant", "iterations", "K", "K_yy", "both"};
  for (std::size_t cause = 0; cause < ipminmax::kFactorizationCauses; ++cause) {
    columns.emplace_back(name_of(static_cast<ipminmax::FactorizationCause>(cause)));
  }
  return Table(columns);
}

/// The rest of a row: of all solves together, over their iterations.
inline void add_factorizations(Table& row, std::span<const ipminmax::Result> solves) {
  double iterations = 0.0, full = 0.0, inner = 0.0;
  std::vector<double> causes(ipminmax::kFactorizationCauses, 0.0);
  for (const ipminmax::Result& r : solves) {
    iterations += std::max(r.iterations, 1);
    full += r.counts.factorizations_full;
    inner += r.counts.factorizations_inner;
    for (std::size_t k = 0; k < causes.size(); ++k) {
      causes[k] += r.counts.by_cause[k].full + r.counts.by_cause[k].inner;
    }
  }
  row.number(iterations, 5).number(full / iterations).number(inner / iterations);
  row.number((full + inner) / iterations);
  for (const double cause : causes) row.number(cause / iterations);
}

}  // namespace bench
