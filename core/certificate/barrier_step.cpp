#include "core/certificate/barrier_step.hpp"

#include "core/certificate/parameters.hpp"
#include "core/point/residual.hpp"

namespace ipminmax {

bool solve_accurately(KktSystem& kkt, const Evaluation& evaluation, const NewtonResidual& rhs,
                      Step& step, const Regularization& shift) {
  for (;;) {
    // What the inertia is does not matter, and the solution is tested.
    const KktFactors factors = kkt.factorize_for_solutions(shift, Certainty::Usual);
    if (factors.status != FactorizationStatus::Ok) return false;
    if (kkt.solve(evaluation, rhs, step)) return true;
    if (!kkt.increase_quality()) return false;
  }
}

bool barrier_newton_step(CanonicalProblem& canonical, KktSystem& kkt, double mu, Point& point,
                         StepLength& alpha, bool& dependent) {
  NewtonResidual rhs = zero_step(canonical);
  Step step = zero_step(canonical);
  newton_residual(canonical, point.iterate, point.evaluation, point.dual, mu, rhs);
  kkt.assemble(point.iterate, point.evaluation);
  dependent = dependent || !solve_accurately(kkt, point.evaluation, rhs, step);
  if (dependent) {  // their equations agree, any of the multipliers will do
    const Regularization relaxed{.lambda_x = parameters::certificate::kRootOfRounding,
                                 .lambda_y = parameters::certificate::kRootOfRounding};
    if (kkt.factorize_for_solutions(relaxed, Certainty::Usual).status != FactorizationStatus::Ok ||
        !kkt.solve_unshifted(point.evaluation, rhs, step)) {
      return false;
    }
  }
  alpha = largest_step(canonical, point.iterate, step, parameters::certificate::kTau);
  advance(canonical, step, alpha, point.iterate);
  return canonical.constraints(point.iterate.v, point.evaluation.c) == EvaluationStatus::Ok &&
         evaluate_derivatives(canonical, point) == EvaluationStatus::Ok;
}

}  // namespace ipminmax
