#pragma once

#include <Eigen/Core>
#include <Eigen/LU>
#include <memory>
#include <vector>

#include "core/model/iterate.hpp"
#include "core/problem.hpp"

namespace ipminmax {

class CanonicalProblem;

/// B = diag(d) - C M^-1 C', positive definite: a Hessian of few columns.
struct LowRankHessian {
  Eigen::VectorXd diagonal;  ///< d, per canonical variable; 0 for slacks and linear variables
  Eigen::MatrixXd columns;   ///< C, variables in rows; may have none
  Eigen::MatrixXd middle;    ///< M
  Eigen::FullPivLU<Eigen::MatrixXd> inverse_middle;

  /// product -= B v
  void subtract_product(const Eigen::VectorXd& v, Eigen::VectorXd& product) const;
};

/// Limited-memory BFGS in the place of the Hessian of f + lambda' c, for minimizations whose
/// hessian_approximation is limited-memory: Byrd, Nocedal, Schnabel 1994, eq. (2.17), with Ipopt's
/// defaults: six pairs, sigma = s'y / s's of the last one; pairs without curvature are left out,
/// and three in a row forget the others.
class QuasiNewton {
 public:
  /// nonlinear: the canonical variables that f or c is nonlinear in; B is zero in all others.
  QuasiNewton(Index variables, std::vector<Index> nonlinear);

  /// B at v, where gradient and Jacobian have been evaluated; the change of the Lagrangian's
  /// gradient from the last v is that for lambda.
  [[nodiscard]] std::shared_ptr<const LowRankHessian> update(const CanonicalProblem& canonical,
                                                             const Eigen::VectorXd& v,
                                                             const Eigen::VectorXd& lambda,
                                                             const Evaluation& here);

 private:
  struct Pair {
    Eigen::VectorXd s, y;  ///< change of v and of the gradient, over |s|
  };
  [[nodiscard]] Pair change(const CanonicalProblem& canonical, const Eigen::VectorXd& v,
                            const Eigen::VectorXd& lambda, const Evaluation& here) const;
  void take(Pair pair);
  [[nodiscard]] std::shared_ptr<const LowRankHessian> matrix() const;

  Index variables_;
  std::vector<Index> nonlinear_;
  std::vector<Pair> pairs_;  ///< the oldest first
  double sigma_ = 1.0;
  int skipped_ = 0;           ///< in a row
  Eigen::VectorXd v_;         ///< the last one; empty: none yet
  Eigen::VectorXd gradient_;  ///< of f there
  std::vector<double> jacobian_;
  std::shared_ptr<const LowRankHessian> last_;
};

}  // namespace ipminmax
