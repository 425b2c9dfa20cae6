#include <algorithm>
#include <cmath>
#include <random>

#include "core/method/parameters.hpp"
#include "core/model/sampling.hpp"
#include "core/search/restart.hpp"

namespace ipminmax {
namespace {

namespace restart = parameters::restart;

}  // namespace

bool makes_new_starts(const SolverOptions& options) {
  return options.minmax_globalization == Globalization::Filter && !options.minmax_pure_newton &&
         options.minmax_max_restarts > 0;
}

bool is_box(const CanonicalProblem& canonical) {
  const auto has_both = [&](IndexRange range) {
    const Index size = range.size();
    return (canonical.upper().segment(range.begin, size) -
            canonical.lower().segment(range.begin, size))
        .allFinite();
  };
  return has_both(canonical.x()) && has_both(canonical.y());
}

Iterate restart_point(const CanonicalProblem& canonical, const Iterate& start, Index number) {
  Iterate point;
  point.v.setZero(canonical.variables());
  point.lambda.setZero(canonical.constraints());
  point.z_lower.setZero(canonical.variables());
  point.z_upper.setZero(canonical.variables());
  std::mt19937_64 generator(static_cast<std::uint64_t>(number));
  const auto pair = static_cast<std::size_t>(number - 1) / 2;
  const double factor = restart::kReaches[pair % restart::kReaches.size()];
  for (const IndexRange range : {canonical.x(), canonical.y()}) {
    for (Index i = range.begin; i < range.end; ++i) {
      const double reach = factor * std::max(1.0, std::abs(start.v[i]));
      SampledRange box{canonical.lower()[i], canonical.upper()[i]};
      if (!(box.upper - box.lower <= parameters::kPlenty * reach)) {
        box = box.around(number % 2 != 0 ? start.v[i] : 0.0, reach);
      }
      point.v[i] = box.without_ends(parameters::kSmall).draw(generator);
    }
  }
  return point;
}

}  // namespace ipminmax
