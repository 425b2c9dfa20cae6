#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>

#include "core/model/model_start.hpp"
#include "core/model/norms.hpp"
#include "core/model/sampling.hpp"
#include "core/search/random_starts.hpp"
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
  const double radius =
      options.minmax_start_radius * kScales[static_cast<std::size_t>(start - 1) % kScales.size()];
  std::vector<double> v(center.size());
  for (std::size_t i = 0; i < v.size(); ++i) {
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

}  // namespace ipminmax
