#include "core/search/starts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <utility>

#include "core/kkt/system.hpp"
#include "core/method/parameters.hpp"
#include "core/model/indices.hpp"
#include "core/model/initial_point.hpp"
#include "core/model/norms.hpp"
#include "core/model/sampling.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace {

namespace restart = parameters::restart;

}  // namespace

bool evaluate_start(const MethodContext& context, const SolverOptions& options, Point& point) {
  CanonicalProblem& canonical = context.canonical_;
  if (!evaluate_values(canonical, point)) return false;
  canonical.start_slacks(point.iterate, point.evaluation.c);
  for (Index j = 0; j < canonical.constraints(); ++j) {
    if (const Index s = canonical.slack_of(j); s >= 0) {
      point.evaluation.c[j] -= point.iterate.v[s];
    }
  }
  start_bound_multipliers(canonical, options, point.iterate);
  canonical.keep_distances(point.iterate, options.mu_init);
  if (!evaluate_first_derivatives(canonical, point)) return false;
  if (!options.warm_start_init_point && !context.limit_.expired())
    start_multipliers(canonical, context.kkt_, options, point);
  if (!evaluate_second_derivatives(canonical, point)) return false;
  measure_anew(canonical, options, point);
  return true;
}

std::optional<Start> OtherStarts::next() {
  const Index iteration = limit_.iteration;
  if (drawn_ == 0) {
    first_iteration_ = iteration;
    const bool small = kkt_.layout().dimension() <= parameters::kSmallSystem;
    most_iterations_ = small ? restart::kIterations : std::max<Index>(1, iteration);
  }
  correction_.remember({});
  kkt_.reset_quality();
  SolverOptions cold = options_;
  cold.warm_start_init_point = false;
  while (drawn_ < options_.minmax_max_restarts && iteration - first_iteration_ < most_iterations_) {
    Point point = unevaluated_point(
        canonical_, restart_point(canonical_, canonical_.starting_point(), ++drawn_));
    if (!evaluate_start(*this, cold, point)) continue;
    Start start{.point = std::move(point), .how = StepKind::NewStart};
    // Undirected steps search a box well, and lead to infinity elsewhere.
    if (drawn_ % 2 != 0 && is_box(canonical_))
      start.algorithm_one_until = iteration + restart::kIterationsOfAlgorithmOne;
    return start;
  }
  return std::nullopt;
}

std::string OtherStarts::describe() const {
  const std::string points = drawn_ == 1 ? " other starting point" : " other starting points";
  const std::string why = drawn_ >= options_.minmax_max_restarts
                              ? "minmax_max_restarts allows no more"
                              : "no start is made after " + std::to_string(most_iterations_) +
                                    " iterations; minmax_starts makes more";
  return "failed from " + std::to_string(drawn_) + points + ", too (" + why + ")";
}

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
