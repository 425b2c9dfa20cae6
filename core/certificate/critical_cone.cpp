#include "core/certificate/critical_cone.hpp"

#include "core/certificate/parameters.hpp"
#include "core/model/products.hpp"

namespace ipminmax {
namespace {

std::size_t at(Eigen::Index i) { return static_cast<std::size_t>(i); }

/// Free variables follow the one that leaves its bound by one unit.
bool follow(ActiveSetSystem& system, Index leaving, bool inner, Eigen::VectorXd& d) {
  const CanonicalProblem& canonical = system.canonical();
  const Evaluation& all = system.derivatives();
  d.setZero(canonical.variables());
  d[leaving] = -system.classes().side[at(leaving)];
  NewtonResidual rhs = zero_step(canonical);
  Step step = zero_step(canonical);
  for (std::size_t k = 0; k < all.hessian.size(); ++k) {
    const auto [i, j] = canonical.hessian()[k];
    if (i == j) continue;
    if (!system.is_fixed(i)) rhs.v[i] -= all.hessian[k] * d[j];
    if (!system.is_fixed(j)) rhs.v[j] -= all.hessian[k] * d[i];
  }
  for (std::size_t k = 0; k < all.jacobian.size(); ++k) {
    const auto [row, col] = canonical.jacobian()[k];
    if (system.counts(row)) rhs.lambda[row] -= all.jacobian[k] * d[col];
  }
  const auto slack_of = canonical.slack_of_constraint();
  for (Index j = 0; j < canonical.constraints(); ++j) {
    if (slack_of[at(j)] == leaving) rhs.lambda[j] += d[leaving];
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

std::optional<CriticalCone> critical_cone(ActiveSetSystem& system, const Eigen::VectorXd& added,
                                          Player owner) {
  const CanonicalProblem& canonical = system.canonical();
  const bool inner = owner == Player::Max;
  CriticalCone cone;
  const BoundClasses& classes = system.classes();
  if ((inner ? classes.weak_max : classes.weak_min) > parameters::certificate::kMostFaces)
    return {};
  for (const IndexRange own : {inner ? canonical.y() : canonical.x(),
                               inner ? canonical.y_slacks() : canonical.x_slacks()}) {
    for (Index i = own.begin; i < own.end; ++i) {
      if (system.classes()[i] != BoundClass::Doubtful) continue;
      cone.directions.emplace_back();
      if (!follow(system, i, inner, cone.directions.back())) return {};
    }
  }
  const auto size = static_cast<Eigen::Index>(cone.directions.size());
  cone.curvature.resize(size, size);
  for (Eigen::Index a = 0; a < size; ++a) {
    const Eigen::VectorXd& d = cone.directions[at(a)];
    Eigen::VectorXd w = added.cwiseProduct(d);
    for (Index i = 0; i < w.size(); ++i) {
      if (system.is_slack(i)) w[i] = 0.0;
    }
    add_hessian_product(canonical, system.derivatives(), d, w);
    for (Eigen::Index b = 0; b < size; ++b) {
      cone.curvature(b, a) = cone.directions[at(b)].dot(w);
    }
  }
  cone.curvature = ((inner ? -0.5 : 0.5) * (cone.curvature + cone.curvature.transpose())).eval();
  return cone;
}

}  // namespace ipminmax
