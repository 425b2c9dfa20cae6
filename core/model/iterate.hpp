#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include <Eigen/Core>

namespace ipminmax {

class CanonicalProblem;
struct LowRankHessian;

/// Primal-dual point of the canonical problem. Bound multipliers are positive for both players
/// where the bound exists and zero elsewhere.
struct Iterate {
  Eigen::VectorXd v;        ///< canonical variables
  Eigen::VectorXd lambda;   ///< canonical constraints
  Eigen::VectorXd z_lower;  ///< canonical variables
  Eigen::VectorXd z_upper;  ///< canonical variables
};

/// Newton step of an Iterate, same shapes.
struct Step {
  Eigen::VectorXd v, lambda, z_lower, z_upper;
};

/// Right-hand side of the unreduced primal-dual Newton system, same shapes as a Step.
using NewtonResidual = Step;

/// Values of the canonical functions at a point (scaled).
struct Evaluation {
  double f = 0.0;
  Eigen::VectorXd c;             ///< constraints, slacks included: zero when feasible
  Eigen::VectorXd gradient;      ///< of f
  std::vector<double> jacobian;  ///< per triplet of CanonicalProblem::jacobian()
  std::vector<double> hessian;   ///< of f + lambda' c, per triplet of CanonicalProblem::hessian()
  /// To be added to hessian; null: nothing.
  std::shared_ptr<const LowRankHessian> low_rank;
  /// Numbers of the model calls that gave the last two, 0 for none: equal numbers, equal values.
  std::uint64_t jacobian_call = 0, hessian_call = 0;
};

/// product += W d, slacks apart: they have no entries.
void add_hessian_product(const CanonicalProblem& canonical, const Evaluation& evaluation,
                         const Eigen::VectorXd& d, Eigen::VectorXd& product);
/// d'Wd
[[nodiscard]] double curvature_along(const CanonicalProblem& canonical,
                                     const Evaluation& evaluation, const Eigen::VectorXd& d);
/// product += J' lambda, slacks apart.
void add_transposed_product(const CanonicalProblem& canonical, const Evaluation& evaluation,
                            const Eigen::VectorXd& lambda, Eigen::VectorXd& product);
/// product += J d, - d of a constraint's slack included.
void add_constraint_product(const CanonicalProblem& canonical, const Evaluation& evaluation,
                            const Eigen::VectorXd& d, Eigen::VectorXd& product);

/// sums += |change_k| d_i d_j of the entries k of W in each row; change: per entry.
void add_row_sums(const CanonicalProblem& canonical, const std::vector<double>& change,
                  const Eigen::VectorXd& d, Eigen::VectorXd& sums);

}  // namespace ipminmax
