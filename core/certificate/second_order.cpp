#include "core/certificate/second_order.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include <Eigen/Dense>

#include "core/certificate/parameters.hpp"
#include "core/model/products.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

namespace {

/// Entries of 1/2 on the average.
const NewtonResidual& generic_right_hand_side(ActiveSetSystem& system) {
  constexpr double kHalved = 2.0 / 3.0;
  const CanonicalProblem& canonical = system.canonical();
  NewtonResidual& rhs = system.rhs();
  set_zero(canonical, rhs);
  for (Index i = 0; i < canonical.variables(); ++i) {
    if (system.is_free(i)) rhs.v[i] = kHalved * generic_entry(i);
  }
  for (Index j = 0; j < canonical.constraints(); ++j) {
    if (system.counts(j)) rhs.lambda[j] = kHalved * generic_entry(canonical.variables() + j);
  }
  return rhs;
}

/// Largest entry of the solution, slacks and bound multipliers apart; infinite where the factors do
/// not reproduce the matrix: without pivoting an inertia is trusted only when they do.
double response(ActiveSetSystem& system, bool inner) {
  const CanonicalProblem& canonical = system.canonical();
  const NewtonResidual& rhs = generic_right_hand_side(system);
  Step& step = system.step();
  set_zero(canonical, step);
  KktSystem& kkt = system.kkt();
  const Accuracy accuracy = kkt.least_accuracy();
  const bool solved = inner ? kkt.solve_inner(system.assembled(), rhs, step, accuracy)
                            : kkt.solve(system.assembled(), rhs, step, accuracy);
  if (!solved) return kInfinity;
  double largest = 0.0;
  for (Index i = inner ? canonical.y().begin : 0; i < canonical.variables(); ++i) {
    if (!system.is_slack(i)) largest = std::max(largest, std::abs(step.v[i]));
  }
  for (Index j = inner ? canonical.max_constraints().begin : 0; j < canonical.constraints(); ++j) {
    largest = std::max(largest, std::abs(step.lambda[j]));
  }
  return largest;
}

/// Curvature to be taken away, in units.
struct Taken {
  double margin;    ///< from both players
  double proximal;  ///< from Max besides
  [[nodiscard]] Regularization inner() const { return {.y = proximal - margin}; }
  [[nodiscard]] Regularization full() const { return {.x = -margin, .y = margin + proximal}; }
};

/// full_follows: K is needed next with the same values.
InertiaTest test_inner(ActiveSetSystem& system, const Eigen::VectorXd& error, const Taken& taken,
                       bool full_follows) {
  KktSystem& kkt = system.kkt();
  InertiaTest test;
  // The worst W for the maximizer has + error in y, and no doubtful bound holds him.
  system.assemble({.min_fixed = false, .max_fixed = false}, error, 0.0, -1.0);
  if (full_follows) kkt.factorize_ahead(taken.inner(), taken.full());
  test.inner = kkt.has_expected_inner_inertia(kkt.factorize_inner(taken.inner()));
  if (!test.inner) return test;
  test.inner_response = response(system, true);
  test.inner = kkt.pivots() || std::isfinite(test.inner_response);
  return test;
}

/// For the minimizer the worst W has - error everywhere, for then phi'' = W_xx - W_xy W_yy^-1 W_yx
/// (on the tangent spaces) is smallest. assembled: already, with these values.
void test_full(ActiveSetSystem& system, const Eigen::VectorXd& error, const Taken& taken,
               bool assembled, InertiaTest& test) {
  KktSystem& kkt = system.kkt();
  if (!assembled) system.assemble(ActiveSetSystem::kSufficient, error, -1.0, 1.0);
  test.full = kkt.has_expected_inertia(kkt.factorize(taken.full()));
  if (!test.full) return;
  test.full_response = response(system, false);
  test.full = kkt.pivots() || std::isfinite(test.full_response);
}

}  // namespace

InertiaTest inner_survives(ActiveSetSystem& system, const Eigen::VectorXd& error, double margin,
                           double proximal) {
  return test_inner(system, error, {margin, proximal}, false);
}

InertiaTest survives(ActiveSetSystem& system, const Eigen::VectorXd& error, double margin,
                     double proximal) {
  const Taken taken{margin, proximal};
  const bool same_values = error.size() == 0 && system.classes().weak_max == 0;
  InertiaTest test = test_inner(system, error, taken, same_values);
  if (test.inner) test_full(system, error, taken, same_values, test);
  return test;
}

InertiaTest survives_narrowed(ActiveSetSystem& system, ActiveSetSystem& narrow,
                              const Eigen::VectorXd& error, double margin) {
  const Taken taken{margin, 0.0};
  InertiaTest test = test_inner(system, error, taken, false);
  if (test.inner) test_full(narrow, error, taken, false, test);
  return test;
}

InertiaTest helped(ActiveSetSystem& system, const Eigen::VectorXd& error, double margin,
                   double multiplier_shift, bool inner_right) {
  KktSystem& kkt = system.kkt();
  const Regularization help{.x = margin,
                            .y = inner_right ? -margin : margin,
                            .lambda_x = multiplier_shift,
                            .lambda_y = multiplier_shift};
  InertiaTest test{.inner = inner_right};
  if (!inner_right) {
    system.assemble({.min_fixed = true, .max_fixed = true}, error, 1.0, 1.0);
    test.inner = kkt.has_expected_inner_inertia(kkt.factorize_inner(help));
    if (!test.inner) return test;
  }
  system.assemble({.min_fixed = true, .max_fixed = false}, error, 1.0, inner_right ? -1.0 : 1.0);
  test.full = kkt.has_expected_inertia(kkt.factorize(help));
  return test;
}

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
