#include <algorithm>

#include "core/kkt/system.hpp"
#include "core/model/indices.hpp"
#include "linalg/numbers.hpp"

// Least-squares multipliers.

namespace ipminmax {

bool KktSystem::least_squares_multipliers(const Iterate& iterate, const Evaluation& evaluation,
                                          Eigen::VectorXd& lambda) {
  // [I A'; A 0] (d, lambda) = (-g, 0) for each player, slacks with curvature 1:
  // first lambda_y from the y-rows, then lambda_x with J_yx' lambda_y on the right-hand side.
  lambda.setZero(canonical_.constraints());
  if (canonical_.constraints() == 0) return true;
  const Counting counting(*this, FactorizationCause::Multipliers);
  Evaluation& uncoupled = uncoupled_;
  uncoupled = evaluation;
  uncoupled.jacobian_call = uncoupled.hessian_call = 0;
  uncoupled.low_rank = nullptr;
  std::ranges::fill(uncoupled.hessian, 0.0);
  for (const auto k : indices(uncoupled.jacobian)) {
    const auto [row, col] = canonical_.jacobian()[k];
    if (canonical_.owned_by_max(col) != canonical_.max_constraints().contains(row))
      uncoupled.jacobian[k] = 0.0;
  }
  eliminated_.setOnes();
  full_.assemble(uncoupled, eliminated_);
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
                    CanonicalProblem::signed_weight(canonical_.served_slack(i), iterate);
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
    if (!solve_accurately(uncoupled, rhs, step)) return false;
    const IndexRange own = max ? canonical_.max_constraints() : canonical_.min_constraints();
    for (const Index j : indices(own)) lambda[j] = step.lambda[j];
  }
  return lambda.allFinite();
}

}  // namespace ipminmax
