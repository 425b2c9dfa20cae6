#include "core/certificate/second_order.hpp"

#include <algorithm>
#include <cmath>

#include "core/certificate/parameters.hpp"
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

}  // namespace ipminmax
