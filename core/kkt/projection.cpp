#include "core/kkt/system.hpp"
#include "core/model/budget.hpp"
#include "core/model/indices.hpp"

// Least-squares multipliers.

namespace ipminmax {

bool KktSystem::solve_projection(const NewtonResidual& rhs, Step& step) {
  for (;;) {
    if (factorize_for_solutions({}, needed(Certainty::Usual)).status != FactorizationStatus::Ok)
      return false;
    {
      const ScopedTimer timer(timed(timing_.solves));
      ++counts_.solves;
      if (solve_reduced(full_, {}, rhs, step, true)) return true;
    }
    if (!increase_quality()) return false;
  }
}

bool KktSystem::least_squares_multipliers(const Iterate& iterate, const Evaluation& evaluation,
                                          Eigen::VectorXd& lambda) {
  // [I A'; A 0] (d, lambda) = (-g, 0) for each player, slacks with curvature 1:
  // first lambda_y from the y-rows, then lambda_x with J_yx' lambda_y on the right-hand side.
  lambda.setZero(canonical_.constraints());
  if (canonical_.constraints() == 0) return true;
  const Counting counting(*this, FactorizationCause::Multipliers);
  full_.assemble_projection(evaluation);
  release_full();
  NewtonResidual& rhs = gradient_;
  Step& step = multipliers_;
  set_zero(canonical_, rhs);
  set_zero(canonical_, step);
  for (const bool max : {true, false}) {
    const IndexRange variables = {max ? canonical_.y().begin : 0,
                                  max ? canonical_.variables() : canonical_.y().begin};
    rhs.v.setZero();
    for (const Index i : indices(variables)) {
      rhs.v[i] =
          -evaluation.gradient[i] - canonical_.sign(i) * (iterate.z_upper[i] - iterate.z_lower[i]);
    }
    if (max && canonical_.has_copies()) {  // what copies maximize
      for (const std::size_t k : canonical_.owners().own_entries) {
        const Index i = canonical_.jacobian()[k].col;
        rhs.v[i] -= evaluation.jacobian[k] *
                    CanonicalProblem::signed_weight(canonical_.robust_slack(i), iterate);
      }
    }
    if (!max) {
      const auto jacobian = canonical_.jacobian();
      for (const auto k : indices(jacobian)) {
        const auto [row, col] = jacobian[k];
        if (canonical_.max_constraints().contains(row) && !canonical_.owned_by_max(col)) {
          rhs.v[col] -= evaluation.jacobian[k] * lambda[row];
        }
      }
    }
    // Where Gamma is the pivot of a multiplier, little of I is left in the factors.
    if (!solve_projection(rhs, step)) return false;
    const IndexRange own = max ? canonical_.max_constraints() : canonical_.min_constraints();
    for (const Index j : indices(own)) lambda[j] = step.lambda[j];
  }
  return lambda.allFinite();
}

}  // namespace ipminmax
