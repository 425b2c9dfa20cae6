#include <utility>

#include "core/method/first_multipliers.hpp"
#include "core/model/initial_point.hpp"
#include "core/search/restart.hpp"
#include "core/search/starts.hpp"

namespace ipminmax {

std::optional<Status> evaluate_start(const MethodContext& context, const SolverOptions& options,
                                     Point& point, std::string& message) {
  CanonicalProblem& canonical = context.canonical;
  const auto undefined = [&](EvaluationStatus status) {
    message = canonical.evaluation_error() + " at the starting point";
    return status_of(status);
  };
  auto status = evaluate_values(canonical, point);
  if (status != EvaluationStatus::Ok) return undefined(status);
  canonical.start_slacks(point.iterate, point.evaluation.c);
  for (Index j = 0; j < canonical.constraints(); ++j) {
    if (const Index s = canonical.slack_of_constraint()[static_cast<std::size_t>(j)]; s >= 0) {
      point.evaluation.c[j] -= point.iterate.v[s];
    }
  }
  start_bound_multipliers(canonical, options, point.iterate);
  canonical.keep_distances(point.iterate, options.mu_init);
  status = evaluate_first_derivatives(canonical, point);
  if (status != EvaluationStatus::Ok) return undefined(status);
  if (!options.warm_start_init_point) start_multipliers(canonical, context.kkt, options, point);
  status = evaluate_second_derivatives(canonical, point);
  if (status != EvaluationStatus::Ok) return undefined(status);
  measure(canonical, options, point);
  return std::nullopt;
}

std::optional<Start> OtherStarts::next() {
  const CanonicalProblem& canonical = context_.canonical;
  const Index iteration = context_.budget.iteration;
  context_.correction.remember({});
  context_.kkt.reset_quality();
  SolverOptions cold = context_.options;
  cold.warm_start_init_point = false;
  std::string unused;
  const Index variables = canonical.x().size() + canonical.y().size();
  while (drawn_ < context_.options.minmax_max_restarts &&
         iteration < restart_iterations(variables)) {
    Point point = unevaluated_point(canonical,
                                    restart_point(canonical, canonical.starting_point(), ++drawn_));
    if (evaluate_start(context_, cold, point, unused)) continue;
    return Start{.point = std::move(point), .how = StepKind::NewStart};
  }
  const Index iterations = last_resort_iterations(canonical);
  if (iterations == 0) return std::nullopt;
  Point point = unevaluated_point(canonical, canonical.starting_point());
  if (evaluate_start(context_, context_.options, point, unused)) return std::nullopt;
  return Start{.point = std::move(point),
               .how = StepKind::NewStart,
               .rule = Start::Rule::AlgorithmOne,
               .deadline = Deadline{iteration + iterations, Status::NoLocalMinmaxFound}};
}

}  // namespace ipminmax
