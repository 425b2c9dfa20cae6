#include <cmath>

#include "core/kkt/system.hpp"
#include "core/model/timer.hpp"

// Projections on the constraints' gradients: least-squares multipliers, rank.

namespace ipminmax {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// Norm of an active constraint's gradient (scaled problem) that counts as zero.
constexpr double kVanishingGradient = 1e-8;

}  // namespace

bool KktSystem::solve_projection(const NewtonResidual& rhs, Step& step) {
  for (;;) {
    if (factorize_for_solutions({}).status != FactorizationStatus::Ok) return false;
    {
      const ScopedTimer timer(timing_.solves);
      ++counts_.solves;
      if (solve_reduced(full_, rhs, step, true)) return true;
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
  Eigen::VectorXd diagonal = Eigen::VectorXd::Zero(canonical_.constraints());
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    if (const Index slack = canonical_.slack_of_constraint()[at(j)]; slack >= 0) {
      diagonal[j] = -canonical_.sign(slack);
    }
  }
  full_.assemble_projection(evaluation, Eigen::VectorXd::Ones(canonical_.variables()),
                            Eigen::VectorXd::Ones(canonical_.constraints()), diagonal);
  release_full();
  NewtonResidual rhs = zero_step(canonical_);
  Step step = rhs;
  for (const bool max : {true, false}) {
    const IndexRange variables = {max ? canonical_.y().begin : 0,
                                  max ? canonical_.variables() : canonical_.y().begin};
    rhs.v.setZero();
    for (Index i = variables.begin; i < variables.end; ++i) {
      rhs.v[i] =
          -evaluation.gradient[i] - canonical_.sign(i) * (iterate.z_upper[i] - iterate.z_lower[i]);
    }
    if (!max) {
      const auto jacobian = canonical_.jacobian();
      for (std::size_t k = 0; k < jacobian.size(); ++k) {
        const auto [row, col] = jacobian[k];
        if (canonical_.max_constraints().contains(row) && !canonical_.owned_by_max(col)) {
          rhs.v[col] -= evaluation.jacobian[k] * lambda[row];
        }
      }
    }
    // Where Gamma is the pivot of a multiplier, little of I is left in the factors.
    if (!solve_projection(rhs, step)) return false;
    const IndexRange own = max ? canonical_.max_constraints() : canonical_.min_constraints();
    for (Index j = own.begin; j < own.end; ++j) lambda[j] = step.lambda[j];
  }
  return lambda.allFinite();
}

KktSystem::RankFinding KktSystem::active_rank(const Evaluation& evaluation,
                                              const std::vector<bool>& active) {
  // Rows of active constraints normalized, columns at bounds removed: with the diagonal
  // +-tolerance the inertia is the expected one iff A A' > tolerance I. Where Gamma stays in the
  // matrix unchecked, the tolerance has to dominate it.
  const double tolerance =
      options_.linear_solver == LinearSolver::Ldlt ? 4.0 * options_.minmax_ldlt_gamma : 1e-14;
  const auto slack_of = canonical_.slack_of_constraint();
  Eigen::VectorXd columns = Eigen::VectorXd::Ones(canonical_.variables());
  for (Index i = 0; i < canonical_.variables(); ++i) {
    if (active[at(i)]) columns[i] = 0.0;
  }
  Eigen::VectorXd rows = Eigen::VectorXd::Zero(canonical_.constraints());
  const auto jacobian = canonical_.jacobian();
  for (std::size_t k = 0; k < jacobian.size(); ++k) {
    const auto [row, col] = jacobian[k];
    if (canonical_.owned_by_max(col) != canonical_.max_constraints().contains(row)) continue;
    const double value = columns[col] * evaluation.jacobian[k];
    rows[row] += value * value;
  }
  RankFinding finding{.full_min = true, .full_max = true};
  Eigen::VectorXd diagonal(canonical_.constraints());
  bool any_min = false, any_max = false;  // rows whose independence is in question
  for (Index j = 0; j < canonical_.constraints(); ++j) {
    const bool max = canonical_.max_constraints().contains(j);
    const double expected = max ? 1.0 : -1.0;
    const Index slack = slack_of[at(j)];
    if (slack >= 0 && !active[at(slack)]) {
      rows[j] = 0.0;
      diagonal[j] = expected;
    } else if (rows[j] <= kVanishingGradient * kVanishingGradient) {
      (max ? finding.full_max : finding.full_min) = false;
      finding.vanishing = true;
      diagonal[j] = expected;
    } else {
      rows[j] = 1.0 / std::sqrt(rows[j]);
      diagonal[j] = -expected * tolerance;
      (max ? any_max : any_min) = true;
    }
  }
  const auto full_rank = [&](KktBlock& block, Inertia expected) {
    block.assemble_projection(evaluation, columns, rows, diagonal);
    const ScopedTimer timer(timing_.factorization);
    count_factorizations(&block == &full_ ? 1 : 0, &block == &full_ ? 0 : 1);
    KktFactors& at_hand = &block == &full_ ? full_factors_ : inner_factors_;
    at_hand = {};
    if (schur_) schur_->forget_factors();
    const Factorization f = block.factorize({});
    return f.status == FactorizationStatus::Ok && f.inertia == expected;
  };
  // The players are uncoupled here. Max is tested alone: in the whole matrix two equal deficiencies
  // of the players would cancel.
  const Inertia expected_inner{layout_.lambda_y.size(), layout_.y.size(), 0};
  if (any_max && !full_rank(inner_, expected_inner)) {
    return {.full_min = false, .full_max = false, .vanishing = finding.vanishing};
  }
  const Inertia expected{layout_.x.size() + layout_.lambda_y.size(),
                         layout_.y.size() + layout_.lambda_x.size(), 0};
  if (any_min && !full_rank(full_, expected)) {
    finding.full_min = false;
  }
  return finding;
}

}  // namespace ipminmax
