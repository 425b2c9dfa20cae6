#include "core/search/divergence.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/method/barrier.hpp"
#include "core/method/parameters.hpp"
#include "core/model/compare.hpp"
#include "core/model/iterate.hpp"
#include "core/model/norms.hpp"
#include "core/point/point.hpp"

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

/// Whether f is clearly better for a player whose variables alone, those of the range, go on by 10
/// or by 1000 times a step, as far as their bounds. A variable that f does not depend on may be
/// anywhere.
bool gets_better(CanonicalProblem& canonical, const Point& point, const Eigen::VectorXd& step,
                 IndexRange variables) {
  if (variables.size() == 0) return false;
  const Evaluation& here = point.evaluation;
  const Eigen::VectorXd& v = point.iterate.v;
  const double sign = canonical.sign(variables.begin);
  const Eigen::VectorXd slope = here.gradient.cwiseAbs();
  for (const double factor : {10.0, 1000.0}) {
    Eigen::VectorXd far = v;
    part(far, variables) += factor * part(step, variables);
    far = far.cwiseMax(canonical.lower()).cwiseMin(canonical.upper());
    double f = 0.0;
    if (!canonical.objective(far, f)) return true;
    // A step carries the rounding of v and of its linear system, so opposite terms of f cancel no
    // better.
    const ValueRange range{
        .least = 0.0,
        .most = slope.dot((far - v).cwiseAbs()),
        .terms = std::max(std::abs(f), std::abs(here.f)) + factor * slope.dot(v.cwiseAbs())};
    if (clearly_greater(sign * here.f, sign * f, range, parameters::kZero)) return true;
  }
  return false;
}

/// A Newton step as far as the bounds allow, and the functions where it leads.
bool newton_step(const MethodContext& context, double mu, Point& point, NewtonResidual& rhs,
                 Step& step) {
  CanonicalProblem& canonical = context.canonical_;
  newton_residual(canonical, point, mu, rhs);
  context.kkt_.assemble(point.iterate, point.evaluation);
  if (context.kkt_.factorize({}, Certainty::Usual).status != FactorizationStatus::Ok ||
      !context.kkt_.solve(point.evaluation, rhs, step)) {
    return false;
  }
  advance(canonical, step,
          largest_step(canonical, point.iterate, step, boundary_fraction(mu, context.options_)),
          point.iterate);
  if (!evaluate_values(canonical, point) || !evaluate_derivatives(canonical, point)) {
    return false;
  }
  measure(canonical, context.options_, point);
  return true;
}

/// Whether all curvature that there was at the start has vanished, as far out under a Gaussian.
bool has_died_out(CanonicalProblem& canonical, const Point& point) {
  const auto vanishes = [](double value) { return std::abs(value) < parameters::kVanished; };
  const std::vector<double>& here = point.evaluation.hessian;
  if (here.empty() || !std::ranges::all_of(here, vanishes)) return false;
  Evaluation at_start = point.evaluation;
  return canonical.second_derivatives(canonical.starting_point().v, point.iterate.lambda,
                                      at_start) &&
         !std::ranges::all_of(at_start.hessian, vanishes);
}

/// Whether f at a feasible point is far better than its value and slope at the start promise, and
/// still gets better. So does exp(x), whose x itself has not gone far.
bool has_outgrown_start(const MethodContext& context, const Point& point, IndexRange variables) {
  CanonicalProblem& canonical = context.canonical_;
  if (variables.size() == 0 || !(max_norm(point.evaluation.c) <= context.options_.constr_viol_tol))
    return false;
  const Eigen::VectorXd& start = canonical.starting_point().v;
  const Eigen::VectorXd& v = point.iterate.v;
  bool has_room = false;
  for (Index i = variables.begin; i < variables.end; ++i) {
    const double ahead = v[i] > start[i] ? canonical.upper()[i] : canonical.lower()[i];
    has_room = has_room || (v[i] != start[i] && std::isinf(ahead));
  }
  if (!has_room) return false;
  Evaluation first = point.evaluation;
  if (!canonical.objective(start, first.f) || !canonical.first_derivatives(start, first)) {
    return false;
  }
  const double promised = std::abs(first.f) + first.gradient.cwiseAbs().dot((v - start).cwiseAbs());
  const double gain = canonical.sign(variables.begin) * (first.f - point.evaluation.f);
  return promised > 0.0 && gain > parameters::kRunaway * promised &&
         gets_better(canonical, point, v, variables);
}

/// Whether L's gradient in y changes from a point to the start's y as its second derivatives say:
/// what is flat here is flat on all the way.
bool is_quadratic_in_y(CanonicalProblem& canonical, const Point& from) {
  const IndexRange y = canonical.y();
  const auto of_y = [&](const Eigen::VectorXd& v) { return part(v, y).array(); };
  Eigen::VectorXd way = canonical.starting_point().v - from.iterate.v;
  way.head(y.begin).setZero();
  way.tail(way.size() - y.end).setZero();
  Point there = from;
  there.iterate.v += way;
  if (!evaluate_first_derivatives(canonical, there)) return false;
  Eigen::VectorXd change = Eigen::VectorXd::Zero(way.size());
  add_hessian_product(canonical, from.evaluation, way, change);
  const auto terms = of_y(there.evaluation.gradient).abs() + of_y(change).abs();
  return (of_y(there.dual - from.dual - change).abs() <= parameters::kZero * terms).all();
}

/// With robust constraints, which a search over y may meet elsewhere, only where Max's are not met.
bool may_be_infeasible(const MethodContext& context, const SearchOutcome& outcome) {
  const CanonicalProblem& canonical = context.canonical_;
  const Eigen::VectorXd& c = outcome.point.evaluation.c;
  const IndexRange of_max = canonical.max_constraints();
  if (!search_failed(outcome.status) || of_max.size() == 0) return false;
  const bool robust = !canonical.robust_constraints().empty();
  return max_norm(robust ? part(c, of_max) : c.head(c.size())) > context.options_.constr_viol_tol;
}

}  // namespace

bool has_run_away(CanonicalProblem& canonical, const Point& point, IndexRange variables) {
  const Eigen::VectorXd& v = point.iterate.v;
  const double start = std::max(1.0, max_norm(canonical.starting_point().v));
  bool far = false;
  for (Index i = variables.begin; i < variables.end && !far; ++i) {
    double reference = start;
    for (const double bound : {canonical.lower()[i], canonical.upper()[i]}) {
      if (std::isfinite(bound)) reference = std::max(reference, std::abs(bound));
    }
    far = std::abs(v[i]) >= parameters::kRunaway * reference;
  }
  return far && gets_better(canonical, point, v, variables);
}

void name_divergence(const MethodContext& context, const Point& point, Status& status,
                     std::string& message) {
  if (!can_be_divergence(status)) return;
  CanonicalProblem& canonical = context.canonical_;
  const IndexRange x{0, canonical.y().begin}, y{canonical.y().begin, canonical.variables()};
  const auto looks_unbounded = [&](IndexRange variables) {
    return has_run_away(canonical, point, variables) ||
           (status != Status::MaxIterations && has_outgrown_start(context, point, variables));
  };
  if (looks_unbounded(y)) {
    status = Status::InnerUnbounded;
    message = "the maximization over y looks unbounded";
  } else if (looks_unbounded(x)) {
    status = Status::OuterUnbounded;
    message = "the minimization looks unbounded";
  } else {
    const IndexRange max = canonical.max_constraints();
    const auto multipliers = part(point.iterate.lambda, max);
    if (max.size() > 0 && multipliers.lpNorm<Eigen::Infinity>() > divergence::kLargeMultiplier) {
      status = Status::InnerInfeasible;
      message =
          "the minimizer leaves the maximizer no feasible point, or a single one: "
          "the multipliers of the Max constraints grow without bound";
    }
  }
}

bool runs_to_infinity(const MethodContext& context, const Point& from, double mu,
                      FirstOrderTest& test) {
  CanonicalProblem& canonical = context.canonical_;
  if (has_died_out(canonical, from)) return true;
  Point point = from;
  NewtonResidual rhs = zero_step(canonical);
  Step step = rhs;
  // Steps of the variables that have gone on in their direction, the others zero.
  Eigen::ArrayXd drift;
  for (int k = 0; k < divergence::kOutwardSteps; ++k) {
    const Eigen::ArrayXd before = point.iterate.v;
    if (!newton_step(context, mu, point, rhs, step) || !test.is_met(point)) return false;
    const Eigen::ArrayXd moved = point.iterate.v.array() - before;
    if (k == 0) drift = moved;
    const auto goes_on =
        moved * drift > 0.0 && moved.abs() >= divergence::kOutwardShare * drift.abs();
    drift = goes_on.select(moved, 0.0).eval();
    const auto ahead = (drift > 0.0).select(canonical.upper().array(), canonical.lower().array());
    if (!(ahead.isInf() && drift * before > divergence::kOutwardStep * before.square()).any())
      return false;
  }
  const Index y = canonical.y().begin;
  return gets_better(canonical, point, drift.matrix(), {0, y}) ||
         gets_better(canonical, point, drift.matrix(), {y, canonical.variables()});
}

bool is_on_plateau(const MethodContext& context, const Point& found, double mu) {
  CanonicalProblem& canonical = context.canonical_;
  KktSystem& kkt = context.kkt_;
  Point there = found;
  if (!evaluate_derivatives(canonical, there) || is_quadratic_in_y(canonical, there)) return false;
  const Evaluation matrix = there.evaluation;
  kkt.assemble_inner(there.iterate, matrix);
  const Regularization shift{.proximal_y = kkt.proximal_curvature(matrix, parameters::kZero)};
  if (!kkt.has_expected_inner_inertia(kkt.factorize_inner(shift))) return false;
  NewtonResidual rhs = zero_step(canonical);
  Step way = rhs, along = rhs;
  // Minus the part of d along flat directions: where K_yy has curvature next to nothing is left.
  const auto take_part_along = [&](const Eigen::VectorXd& d, Step& part) {
    set_zero(rhs);
    for (Index i = canonical.y().begin; i < canonical.y().end; ++i)
      rhs.v[i] = (*shift.proximal_y)[i] * d[i];
    return kkt.solve_inner(matrix, rhs, part);
  };
  ValueRange range;
  range.see(found.evaluation.f);
  const auto look_at = [&](const Eigen::VectorXd& v) {
    there.iterate.v = v.cwiseMax(canonical.lower()).cwiseMin(canonical.upper());
    evaluate_where_defined(canonical, there);
    range.see(there.evaluation.f);
    range.terms += there.evaluation.gradient.cwiseAbs().dot(there.iterate.v.cwiseAbs());
  };
  const Eigen::VectorXd& start = canonical.starting_point().v;
  look_at(start);
  if (!take_part_along(found.iterate.v - start, way)) return false;
  const Eigen::VectorXd back = way.v;
  look_at(found.iterate.v + back);
  // What is flat may bend: Newton steps across.
  constexpr int kStepsAcross = 4;
  for (int k = 0; k < kStepsAcross; ++k) {
    newton_residual(canonical, there, mu, rhs);
    if (!kkt.solve_inner(matrix, rhs, way) || !take_part_along(way.v, along)) return false;
    look_at(there.iterate.v + way.v + along.v);
  }
  const double slope = there.dual.dot(back), change = there.evaluation.f - found.evaluation.f;
  // A solve leaves tol in the value, and a start beside the solution shows no range.
  return clearly_greater(std::max(std::abs(change), std::abs(slope)), context.options_.tol, range,
                         parameters::kHardly);
}

void name_infeasibility(const MethodContext& context, const ProblemStructure& structure,
                        const Restorer& restorer, SearchOutcome& outcome) {
  if (!may_be_infeasible(context, outcome)) return;
  CanonicalProblem& canonical = context.canonical_;
  const auto feasible = [&](const Eigen::VectorXd&, const Eigen::VectorXd& c) {
    return max_norm(c) <= context.options_.constr_viol_tol;
  };
  SolveLimit& limit = context.limit_;
  const Index granted = std::max<Index>(0, limit.iterations_left());
  Index allowed = granted;
  Point least = outcome.point;
  const RestorationOutcome found = restore_feasibility(canonical, context.options_, outcome.mu,
                                                       feasible, restorer, least, allowed);
  limit.restoration += granted - allowed;
  if (found != RestorationOutcome::UserStop && found != RestorationOutcome::LocallyInfeasible)
    return;

  evaluate_where_defined(canonical, least);
  measure(canonical, context.options_, least);
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
  outcome.status = structure.constraint_players[at(row)] == Player::Max ? Status::InnerInfeasible
                                                                        : Status::LocallyInfeasible;
}

}  // namespace ipminmax
