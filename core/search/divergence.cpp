#include "core/search/divergence.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/method/barrier.hpp"
#include "core/method/parameters.hpp"
#include "core/model/norms.hpp"
#include "core/point/residual.hpp"
#include "core/point/step_length.hpp"

namespace ipminmax {

namespace {

namespace divergence = parameters::divergence;

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

bool is_farther(const CanonicalProblem& canonical, const Point& point) {
  return max_norm(point.iterate.v) >
         parameters::kLongStep * (1.0 + max_norm(canonical.starting_point().v));
}

/// Constraints alone, whose multipliers are zero where they hold, have a Hessian of zeros anywhere.
bool has_died_out(const CanonicalProblem& canonical, const Point& point) {
  const auto& hessian = point.evaluation.hessian;
  if (point.iterate.lambda.size() > 0 && max_norm(point.iterate.lambda) == 0.0 &&
      max_norm(point.evaluation.gradient) == 0.0) {
    return false;
  }
  return !hessian.empty() && std::ranges::all_of(hessian, [](double value) {
    return std::abs(value) < parameters::kVanished;
  }) && is_farther(canonical, point);
}

/// A Newton step with this shift, as far as the bounds allow, and the functions but f where it
/// leads.
bool shifted_step(const MethodContext& context, const Regularization& shift, double mu,
                  Point& point, NewtonResidual& rhs, Step& step) {
  CanonicalProblem& canonical = context.canonical;
  newton_residual(canonical, point, mu, rhs);
  context.kkt.assemble(point.iterate, point.evaluation);
  if (context.kkt.factorize(shift, Certainty::Usual).status != FactorizationStatus::Ok ||
      !context.kkt.solve(point.evaluation, rhs, step)) {
    return false;
  }
  advance(canonical, step,
          largest_step(canonical, point.iterate, step, boundary_fraction(mu, context.options)),
          point.iterate);
  if (canonical.constraints(point.iterate.v, point.evaluation.c) != EvaluationStatus::Ok ||
      evaluate_derivatives(canonical, point) != EvaluationStatus::Ok) {
    return false;
  }
  measure(canonical, context.options, point);
  return true;
}

}  // namespace

bool is_far_out(const CanonicalProblem& canonical, const Point& point) {
  return canonical.max_size() == 0 && is_farther(canonical, point);
}

bool step_into_valley(const MethodContext& context, double mu, const FirstOrderTest& test,
                      Point& point) {
  NewtonResidual rhs = zero_step(context.canonical);
  Step step = rhs;
  const Regularization shift{.x = context.options.first_hessian_perturbation};
  for (int k = 0; k < parameters::kPatience && !test.is_met(point.error); ++k)
    if (!shifted_step(context, shift, mu, point, rhs, step)) return false;
  return test.is_met(point.error) &&
         context.canonical.objective(point.iterate.v, point.evaluation.f) == EvaluationStatus::Ok;
}

bool has_run_away(const CanonicalProblem& canonical, const Point& point, IndexRange variables) {
  const double start = std::max(1.0, max_norm(canonical.starting_point().v));
  for (Index i = variables.begin; i < variables.end; ++i) {
    double reference = start;
    for (const double bound : {canonical.lower()[i], canonical.upper()[i]}) {
      if (std::isfinite(bound)) reference = std::max(reference, std::abs(bound));
    }
    if (std::abs(point.iterate.v[i]) >= parameters::kRunaway * reference) return true;
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
    if (max.size() > 0 && multipliers.lpNorm<Eigen::Infinity>() > divergence::kLargeMultiplier) {
      status = Status::InnerInfeasible;
      message =
          "the minimizer leaves the maximizer no feasible point: "
          "the multipliers of the Max constraints grow without bound";
    }
  }
}

bool valley_leads_to_infinity(const MethodContext& context, const Point& bottom, double mu,
                              const FirstOrderTest& test) {
  NewtonResidual rhs = zero_step(context.canonical);
  Step step = rhs;
  Point point = bottom;
  for (int k = 0; k < parameters::kEnough; ++k) {
    const double norm = max_norm(point.iterate.v), f = point.evaluation.f;
    if (!shifted_step(context, {}, mu, point, rhs, step) ||
        !step_into_valley(context, mu, test, point) || !(point.evaluation.f < f) ||
        !(max_norm(point.iterate.v) - norm > divergence::kOutwardStep * (1.0 + norm))) {
      return false;
    }
  }
  return true;
}

bool runs_to_infinity(const MethodContext& context, const Point& from, double mu,
                      const FirstOrderTest& test) {
  CanonicalProblem& canonical = context.canonical;
  if (has_died_out(canonical, from)) return true;
  Point point = from;
  NewtonResidual rhs = zero_step(canonical);
  Step step = rhs;
  double last_growth = 0.0;
  for (int k = 0; k < parameters::kEnough; ++k) {
    const double norm = max_norm(point.iterate.v);
    if (!shifted_step(context, {}, mu, point, rhs, step)) return false;
    const double growth = max_norm(point.iterate.v) - norm;
    if (!(growth > std::max(divergence::kOutwardStep * (1.0 + norm),
                            divergence::kOutwardShare * last_growth)) ||
        !test.is_met(point.error)) {
      return false;
    }
    last_growth = growth;
  }
  return true;
}

namespace {

bool may_be_infeasible(const MethodContext& context, const SearchOutcome& outcome) {
  return search_failed(outcome.status) && context.canonical.max_constraints().size() > 0 &&
         context.canonical.robust_constraints().empty() &&
         max_norm(outcome.point.evaluation.c) > context.options.constr_viol_tol;
}

}  // namespace

void name_infeasibility(const MethodContext& context, const ProblemStructure& structure,
                        const Restorer& restorer, SearchOutcome& outcome) {
  if (!may_be_infeasible(context, outcome)) return;
  CanonicalProblem& canonical = context.canonical;
  const auto feasible = [&](const Eigen::VectorXd&, const Eigen::VectorXd& c) {
    return max_norm(c) <= context.options.constr_viol_tol;
  };
  IterationBudget& budget = context.budget;
  const Index granted = std::max<Index>(0, budget.limit - budget.iteration - budget.restoration);
  Index allowed = granted;
  Point least = outcome.point;
  const RestorationOutcome found = restore_feasibility(canonical, context.options, outcome.mu,
                                                       feasible, restorer, least, allowed);
  budget.restoration += granted - allowed;
  if (found != RestorationOutcome::UserStop && found != RestorationOutcome::LocallyInfeasible)
    return;

  evaluate_where_defined(canonical, least);
  measure(canonical, context.options, least);
  outcome.point = std::move(least);
  outcome.certificate = {};
  outcome.of_iteration.reset();
  outcome.message.clear();
  outcome.status = Status::UserStop;
  if (found == RestorationOutcome::UserStop) return;
  Result here;
  canonical.restore(outcome.point.iterate, here);
  const Index row = canonical.most_violated_constraint(here);
  outcome.message = "the violation of the constraints is at a local minimum, where " +
                    canonical.constraint_name(row) + " is violated most";
  outcome.status = structure.constraint_players[static_cast<std::size_t>(row)] == Player::Max
                       ? Status::InnerInfeasible
                       : Status::LocallyInfeasible;
}

}  // namespace ipminmax
