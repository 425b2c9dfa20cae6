#include <algorithm>
#include <cmath>

#include "core/method/barrier.hpp"
#include "core/method/parameters.hpp"
#include "core/model/norms.hpp"
#include "core/point/residual.hpp"
#include "core/point/step_length.hpp"
#include "core/search/divergence.hpp"

namespace ipminmax {
namespace {

namespace parameter = parameters::divergence;

bool can_be_divergence(Status status) {
  switch (status) {
    case Status::InertiaCorrectionFailed:
    case Status::EvaluationFailed:
    case Status::LinearSolverFailed:
    case Status::TinyStep:
    case Status::MaxIterations:
    case Status::RestorationFailed:
    case Status::OuterUnbounded:
      return true;
    default:
      return false;
  }
}

bool has_died_out(const CanonicalProblem& canonical, const Point& point) {
  const auto& hessian = point.evaluation.hessian;
  return !hessian.empty() &&
         std::ranges::all_of(hessian,
                             [](double value) { return std::abs(value) < parameter::kDiedOut; }) &&
         max_norm(point.iterate.v) >
             parameter::kFarAway * (1.0 + max_norm(canonical.starting_point().v));
}

}  // namespace

bool has_run_away(const CanonicalProblem& canonical, const Point& point, IndexRange variables) {
  const double start = std::max(1.0, max_norm(canonical.starting_point().v));
  for (Index i = variables.begin; i < variables.end; ++i) {
    double reference = start;
    for (const double bound : {canonical.lower()[i], canonical.upper()[i]}) {
      if (std::isfinite(bound)) reference = std::max(reference, std::abs(bound));
    }
    if (std::abs(point.iterate.v[i]) >= parameter::kRunaway * reference) return true;
  }
  return false;
}

void name_divergence(const CanonicalProblem& canonical, const Point& point, Status& status,
                     std::string& message) {
  if (!can_be_divergence(status)) return;
  if (has_run_away(canonical, point, {canonical.y().begin, canonical.variables()})) {
    status = Status::InnerUnbounded;
    message = "the maximization over the Max variables looks unbounded";
  } else if (has_run_away(canonical, point, {0, canonical.y().begin})) {
    status = Status::OuterUnbounded;
    message = "the minimization looks unbounded";
  } else {
    const IndexRange max = canonical.max_constraints();
    const auto multipliers = point.iterate.lambda.segment(max.begin, max.size());
    if (max.size() > 0 && multipliers.lpNorm<Eigen::Infinity>() > parameter::kLargeMultiplier) {
      status = Status::InnerInfeasible;
      message =
          "the minimizer leaves the maximizer no feasible point: "
          "the multipliers of the Max constraints grow without bound";
    }
  }
}

bool runs_to_infinity(const MethodContext& context, const Point& from, double mu,
                      const FirstOrderTest& test) {
  CanonicalProblem& canonical = context.canonical;
  if (has_died_out(canonical, from)) return true;
  Point point = from;
  NewtonResidual rhs = zero_step(canonical);
  Step step = rhs;
  double last_growth = 0.0;
  for (int k = 0; k < parameter::kOutwardSteps; ++k) {
    const double norm = max_norm(point.iterate.v);
    newton_residual(canonical, point, mu, rhs);
    context.kkt.assemble(point.iterate, point.evaluation);
    if (context.kkt.factorize({}, Certainty::Usual).status != FactorizationStatus::Ok ||
        !context.kkt.solve(point.evaluation, rhs, step)) {
      return false;
    }
    advance(step,
            largest_step(canonical, point.iterate, step, boundary_fraction(mu, context.options)),
            point.iterate);
    const double growth = max_norm(point.iterate.v) - norm;
    if (!(growth > std::max(parameter::kOutwardStep * (1.0 + norm),
                            parameter::kOutwardShare * last_growth)) ||
        evaluate_values(canonical, point) != EvaluationStatus::Ok ||
        evaluate_derivatives(canonical, point) != EvaluationStatus::Ok) {
      return false;
    }
    measure(canonical, context.options, point);
    if (!test.is_met(point.error)) return false;
    last_growth = growth;
  }
  return true;
}

}  // namespace ipminmax
