#include "core/search/random_starts.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <random>

#include "core/method/parameters.hpp"
#include "core/model/indices.hpp"
#include "core/model/initial_point.hpp"
#include "core/model/norms.hpp"
#include "core/model/sampling.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

std::vector<double> starting_values(Problem& model) {
  auto v = model_start(model);
  return v && all_finite(*v) ? std::move(*v) : std::vector<double>{};
}

std::vector<double> random_start(const ProblemStructure& structure,
                                 const std::vector<double>& center, Index start,
                                 const SolverOptions& options) {
  std::seed_seq seed{static_cast<std::uint32_t>(options.minmax_start_seed),
                     static_cast<std::uint32_t>(start)};
  std::mt19937_64 generator(seed);
  // What is narrow, a ball for y, say, is hardly met from far outside.
  constexpr std::array kScales{1.0, 0.1, 0.01};
  const double radius = options.minmax_start_radius * kScales[at(start - 1) % kScales.size()];
  std::vector<double> v(center.size());
  for (const auto i : indices(v)) {
    const bool has_lower = structure.variable_lower[i] > options.nlp_lower_bound_inf;
    const bool has_upper = structure.variable_upper[i] < options.nlp_upper_bound_inf;
    SampledRange box{has_lower ? structure.variable_lower[i] : -kInfinity,
                     has_upper ? structure.variable_upper[i] : kInfinity};
    if (!(has_lower && has_upper)) {
      const double s = std::clamp(center[i], box.lower, box.upper);
      box = box.around(s, radius * std::max(1.0, std::abs(s)));
    }
    v[i] = box.draw(generator);
  }
  return v;
}

void add_work(const Result& part, Result& total) {
  total.iterations += part.iterations;
  total.factorizations += part.factorizations;
  total.counts += part.counts;
  total.timing += part.timing;
  total.over_y.solves += part.over_y.solves;
  total.over_y.maximizations += part.over_y.maximizations;
}

void set_work(const Result& total, Result& answer) {
  answer.iterations = total.iterations;
  answer.factorizations = total.factorizations;
  answer.counts = total.counts;
  answer.timing = total.timing;
  answer.over_y.solves = total.over_y.solves;
  answer.over_y.maximizations = total.over_y.maximizations;
}

namespace restart = parameters::restart;

bool makes_new_starts(const SolverOptions& options) {
  return options.minmax_globalization == Globalization::Filter && !options.minmax_pure_newton &&
         options.minmax_max_restarts > 0;
}

bool is_box(const CanonicalProblem& canonical) {
  const auto has_both = [&](IndexRange range) {
    return (part(canonical.upper(), range) - part(canonical.lower(), range)).allFinite();
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
  const auto pair = at(number - 1) / 2;
  const double factor = restart::kReaches[pair % restart::kReaches.size()];
  for (const IndexRange range : {canonical.x(), canonical.y()}) {
    for (const Index i : indices(range)) {
      const double reach = factor * std::max(1.0, std::abs(start.v[i]));
      SampledRange box{canonical.lower()[i], canonical.upper()[i]};
      constexpr double kWide = 100.0;  // over the reach: only a part of the box is sampled
      if (!(box.upper - box.lower <= kWide * reach)) {
        box = box.around(number % 2 != 0 ? start.v[i] : 0.0, reach);
      }
      constexpr double kEnds = 1e-2;  // of the box
      point.v[i] = box.without_ends(kEnds).draw(generator);
    }
  }
  return point;
}

}  // namespace ipminmax
