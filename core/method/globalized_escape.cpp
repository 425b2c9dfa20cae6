#include "core/method/globalized_block.hpp"
#include "core/method/parameters.hpp"
#include "core/model/norms.hpp"
#include "linalg/numbers.hpp"

// Leaving a first-order point that is no solution.

namespace ipminmax {

StepReport GlobalizedMethod::escape(const Point& from, double mu, const EscapeRequest& request,
                                    Point& to) {
  const KktSystem::Counting counting(kkt_, FactorizationCause::Curvature);
  Run run{.here = &from, .to = to, .mu = mu};
  filter_.reset();
  run.report.kind = StepKind::Escape;
  const bool inner_wrong = has_max() && request.wrong && request.wrong->owner == Player::Max;
  if (has_max() && !outer_.inner.direction(from, mu, outer_.direction)) return {};
  const Regularization& shift = outer_.direction.shift;
  // A direction that looks flat may rise all the same.
  const bool along_y = inner_wrong || shift.y > 0.0 || (shift.proximal_y && !request.wrong);
  run.report.moved = along_y ? escape_inner(run, request, inner_wrong) : escape_outer(run, request);
  return std::move(run.report);
}

bool GlobalizedMethod::escape_inner(Run& run, const EscapeRequest& request, bool along_given) {
  run.to = *run.here;
  InnerMaximizer& inner = outer_.inner;
  if (along_given || outer_.direction.shift.proximal_y) {
    const bool left = along_given ? inner.leave(run.to, run.mu, request.wrong->direction)
                                  : inner.escape(run.to, run.mu, outer_.direction.factors);
    if (!left || !inner.direction(run.to, run.mu, outer_.direction)) return false;
  }
  const auto outcome = inner.maximize(run.to, run.mu, inner_target(run.to, run.mu),
                                      parameters::inner::kSteps, kInfinity, outer_.direction);
  return outcome == InnerMaximizer::Outcome::Maximum ||
         outcome == InnerMaximizer::Outcome::NotFound;
}

bool GlobalizedMethod::escape_outer(Run& run, const EscapeRequest& request) {
  const Point& from = *run.here;
  const Index nx = canonical_.y().begin;
  Regularization shift = has_max() ? outer_.direction.shift : Regularization{};
  if (!outer_.find_step(from, run.mu, shift, false)) return false;
  Step& step = outer_.step;
  if (request.wrong && request.wrong->owner == Player::Min) {
    step.v = request.wrong->direction / request.wrong->direction.head(nx).norm();
  } else {
    const InverseIteration how{.variables = {0, nx}};
    if (!turn_to_curvature(how, outer_.rhs, step, [&](const NewtonResidual& rhs, Step& solution) {
          return kkt_.solve(outer_.factors, from.evaluation, rhs, solution);
        })) {
      return false;
    }
  }
  if (outer_.slope(from, run.mu) > 0.0) step.v = -step.v;

  CurvatureMove move{.from = outer_.estimate(from, run.mu), .size = 1.0 + max_norm(from.iterate.v)};
  // Above the largest multiplier: an exact penalty of |c|_1.
  if (!has_max()) move.penalty = 2.0 * max_norm(from.iterate.lambda);
  Block block{.owner = *this, .run = run};
  if (!move_along_curvature(block, move, step.v, limit_)) return false;
  accept(run);
  run.report.alpha_primal = block.alpha_primal;
  return true;
}

}  // namespace ipminmax
