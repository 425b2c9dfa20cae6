#include "core/certificate/critical_cone.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/certificate/parameters.hpp"
#include "core/model/products.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace parameter = parameters::certificate;

namespace {

/// Free variables follow the one that leaves its bound by one unit.
bool follow(ActiveSetSystem& system, Index leaving, bool inner, Eigen::VectorXd& d) {
  const CanonicalProblem& canonical = system.canonical();
  d.setZero(canonical.variables());
  d[leaving] = -system.classes().side[at(leaving)];
  NewtonResidual rhs = zero_step(canonical);
  Step step = zero_step(canonical);
  add_hessian_product(canonical, system.derivatives(), -d, rhs.v);
  add_constraint_product(canonical, system.derivatives(), -d, rhs.lambda);
  for (Index i = 0; i < d.size(); ++i) {
    if (system.is_fixed(i)) rhs.v[i] = 0.0;
  }
  for (Index j = 0; j < canonical.constraints(); ++j) {
    if (!system.counts(j)) rhs.lambda[j] = 0.0;
  }
  const bool solved = inner ? system.kkt().solve_inner(system.assembled(), rhs, step)
                            : system.kkt().solve(system.assembled(), rhs, step);
  if (!solved) return false;
  for (Index i = 0; i < d.size(); ++i) {
    if (system.is_free(i)) d[i] = step.v[i];
  }
  return d.allFinite();
}

}  // namespace

double least_over_cone(const Eigen::MatrixXd& matrix, Eigen::VectorXd& t) {
  const Eigen::Index size = matrix.rows();
  Eigen::VectorXd scale(size);
  for (Eigen::Index i = 0; i < size; ++i) {
    t = Eigen::VectorXd::Unit(size, i);
    if (matrix(i, i) < -parameter::kZero * matrix.cwiseAbs().maxCoeff()) return -1.0;
    if (!(matrix(i, i) > 0.0)) return 0.0;
    scale[i] = 1.0 / std::sqrt(matrix(i, i));
  }
  const Eigen::MatrixXd c = scale.asDiagonal() * matrix * scale.asDiagonal();
  double least = kInfinity;
  for (std::uint32_t face = 1; face < (1U << size); ++face) {
    std::vector<Eigen::Index> rows;
    for (Eigen::Index i = 0; i < size; ++i) {
      if (face >> i & 1U) rows.push_back(i);
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(c(rows, rows));
    for (Eigen::Index e = 0; e < eigen.eigenvalues().size(); ++e) {
      Eigen::VectorXd edge = eigen.eigenvectors().col(e);
      if (edge.sum() < 0.0) edge = -edge;
      if (!(eigen.eigenvalues()[e] < least) || edge.minCoeff() < -parameter::kZero) continue;
      least = eigen.eigenvalues()[e];
      t.setZero(size);
      t(rows) = edge.cwiseMax(0.0);
    }
  }
  t = t.cwiseProduct(scale);
  return least;
}

std::optional<LeastInCone> least_in_cone(ActiveSetSystem& system, const Eigen::VectorXd& added,
                                         Player owner) {
  const CanonicalProblem& canonical = system.canonical();
  const bool inner = owner == Player::Max;
  const BoundClasses& classes = system.classes();
  const Index size = inner ? classes.weak_max : classes.weak_min;
  if (size == 0 || size > parameter::kMostFaces) return {};
  Eigen::MatrixXd edges(canonical.variables(), size), products = edges;
  Index k = 0;
  for (Index i = 0; i < canonical.variables(); ++i) {
    if (classes[i] != BoundClass::Doubtful || canonical.owned_by_max(i) != inner) continue;
    Eigen::VectorXd d;
    if (!follow(system, i, inner, d)) return {};
    Eigen::VectorXd w = added.cwiseProduct(d);
    for (Index other = 0; other < w.size(); ++other) {
      if (system.is_slack(other)) w[other] = 0.0;
    }
    add_hessian_product(canonical, system.derivatives(), d, w);
    edges.col(k) = d;
    products.col(k++) = w;
  }
  const Eigen::MatrixXd curvature = edges.transpose() * products;
  Eigen::VectorXd t;
  const double least =
      least_over_cone((inner ? -0.5 : 0.5) * (curvature + curvature.transpose()), t);
  if (!std::isfinite(least)) return {};
  return LeastInCone{.least = least, .direction = edges * t};
}

}  // namespace ipminmax
