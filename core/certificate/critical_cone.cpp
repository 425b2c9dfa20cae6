#include "core/certificate/critical_cone.hpp"

namespace ipminmax {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

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
    if (!system.is_fixed(i) && !system.is_slack(i)) d[i] = step.v[i];
  }
  return d.allFinite();
}

/// (W + added) d, slacks apart.
Eigen::VectorXd product(const ActiveSetSystem& system, const Eigen::VectorXd& added,
                        const Eigen::VectorXd& d) {
  const CanonicalProblem& canonical = system.canonical();
  const Evaluation& all = system.derivatives();
  Eigen::VectorXd result = Eigen::VectorXd::Zero(d.size());
  for (std::size_t k = 0; k < all.hessian.size(); ++k) {
    const auto [i, j] = canonical.hessian()[k];
    result[i] += all.hessian[k] * d[j];
    if (i != j) result[j] += all.hessian[k] * d[i];
  }
  for (const IndexRange own : {canonical.x(), canonical.y()}) {
    for (Index i = own.begin; i < own.end; ++i) result[i] += added[i] * d[i];
  }
  return result;
}

}  // namespace

std::optional<CriticalCone> critical_cone(ActiveSetSystem& system, const Eigen::VectorXd& added,
                                          Player owner) {
  const CanonicalProblem& canonical = system.canonical();
  const bool inner = owner == Player::Max;
  CriticalCone cone;
  const BoundClasses& classes = system.classes();
  if ((inner ? classes.weak_max : classes.weak_min) > kMostWeaklyActive) return {};
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
    const Eigen::VectorXd w = product(system, added, cone.directions[static_cast<std::size_t>(a)]);
    for (Eigen::Index b = 0; b < size; ++b) {
      cone.curvature(b, a) = cone.directions[static_cast<std::size_t>(b)].dot(w);
    }
  }
  cone.curvature = ((inner ? -0.5 : 0.5) * (cone.curvature + cone.curvature.transpose())).eval();
  return cone;
}

}  // namespace ipminmax
