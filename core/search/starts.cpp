#include <algorithm>
#include <utility>

#include "core/kkt/system.hpp"
#include "core/method/parameters.hpp"
#include "core/model/initial_point.hpp"
#include "core/search/random_starts.hpp"
#include "core/search/starts.hpp"

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
  const Index iteration = budget_.iteration;
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
    if (drawn_ % 2 != 0 && is_box(canonical_)) {
      start.rule = Start::Rule::AlgorithmOne;
      start.deadline =
          Deadline{iteration + restart::kIterationsOfAlgorithmOne, Status::NoLocalMinmaxFound};
    }
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

}  // namespace ipminmax
