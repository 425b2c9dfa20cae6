// The application examples against answers computed without the solver.
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include <Eigen/Core>

#include <support/dense_algebra.hpp>
#include <support/judge_result.hpp>

#include "../../examples/interdiction.hpp"
#include "../../examples/riccati.hpp"
#include "../../examples/robust_regression.hpp"
#include "../../examples/shared_dynamics.hpp"
#include "core/multistart.hpp"
#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using shared_dynamics::Game;
using shared_dynamics::System;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

void expect_certified(Problem& problem, const Result& result) {
  EXPECT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax);
  EXPECT_EQ(judge(problem, result).verdict, Verdict::LocalMinmax);
}

// --- Robust model predictive control -------------------------------------------------------------

/// States as linear functions of the moves z = (u, w): x_k = free_k + move_k z.
struct Eliminated {
  MatrixXd h;  ///< f = z'Hz + 2 g'z + c
  VectorXd g;
  double c = 0.0;

  explicit Eliminated(const System& s) {
    const Eigen::Index nu = s.b.cols(), nw = s.e.cols(), t = s.horizon;
    const Eigen::Index n = t * (nu + nw);
    h = MatrixXd::Zero(n, n);
    g = VectorXd::Zero(n);
    VectorXd free = s.x0;
    MatrixXd move = MatrixXd::Zero(s.a.rows(), n);
    for (Eigen::Index k = 0; k < t; ++k) {
      free = s.a * free;
      move = (s.a * move).eval();
      move.middleCols(k * nu, nu) += s.b;
      move.middleCols(t * nu + k * nw, nw) += s.e;
      h += move.transpose() * s.q * move;
      g += move.transpose() * s.q * free;
      c += free.dot(s.q * free);
      h.block(k * nu, k * nu, nu, nu) += s.r;
      h.block(t * nu + k * nw, t * nu + k * nw, nw, nw).diagonal().array() -= s.gamma * s.gamma;
    }
  }
};

TEST(RobustMpc, LinearQuadraticAgreesWithElimination) {
  for (const int horizon : {1, 5, 20, 60}) {
    const System system = shared_dynamics::oscillator(horizon, false);
    Game game(system);
    const Result result = solve(game, {});
    expect_certified(game, result);
    const Eliminated dense(system);
    const VectorXd z = solve_pivoting(dense.h, -dense.g);
    const double value = dense.c + dense.g.dot(z);
    EXPECT_NEAR(result.objective, value, 1e-7 * (1.0 + std::abs(value)));
    for (Eigen::Index i = 0; i < z.size(); ++i) EXPECT_NEAR(result.v[at(Index(i))], z[i], 1e-6);
  }
}

TEST(RobustMpc, BoundedMovesMeetTheOptimalityOfTheEliminatedProblem) {
  // |u| and |w| are bounded and some bounds active. In the moves alone f is convex in u and concave
  // in w, so projected gradients decide.
  System system = shared_dynamics::oscillator(15, false);
  system.u_max = 1.0;
  system.w_max = 0.05;
  system.gamma = 1.0;
  Game game(system);
  SolverOptions options;
  options.bound_relax_factor = 0.0;
  const Result result = solve(game, options);
  expect_certified(game, result);
  const Eliminated dense(system);
  const Eigen::Index n = dense.g.size(), half = n / 2;
  const VectorXd z = Eigen::Map<const VectorXd>(result.v.data(), n);
  const VectorXd gradient = 2.0 * (dense.h * z + dense.g);
  int active_u = 0, active_w = 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double bound = i < half ? system.u_max : system.w_max;
    const double descent = i < half ? -gradient[i] : gradient[i];
    EXPECT_LE(std::abs(z[i]), bound + 1e-9);
    if (std::abs(z[i]) > bound - 1e-6) {
      EXPECT_GE(descent * z[i], -1e-6);  // wants further out
      ++(i < half ? active_u : active_w);
    } else {
      EXPECT_NEAR(descent, 0.0, 1e-5);
    }
  }
  EXPECT_GT(active_u, 0);
  EXPECT_LT(active_u, half);
  EXPECT_GT(active_w, 0);
}

TEST(RobustMpc, NonlinearDynamicsAreCertified) {
  System system = shared_dynamics::oscillator(15, true);
  system.x0 = Eigen::Vector2d(2.0, 0.0);
  system.u_max = 3.0;
  Game game(system);
  const Result result = solve(game, {});
  expect_certified(game, result);
  // A pendulum it is: the states follow from the moves.
  Eigen::Vector2d x(2.0, 0.0);
  const double h = 0.2;
  for (Index k = 0; k < 15; ++k) {
    const double force = -std::sin(x[0]) - 0.5 * x[1] + result.v[at(game.u(k, 0))] +
                         0.5 * result.v[at(game.w(k, 0))];
    x = Eigen::Vector2d(x[0] + h * x[1], x[1] + h * force);
    EXPECT_NEAR(result.v[at(game.x(k + 1, 0))], x[0], 1e-6);
    EXPECT_NEAR(result.v[at(game.x(k + 1, 1))], x[1], 1e-6);
  }
  // The linear spring gives another answer.
  System linear = system;
  linear.softening = 0.0;
  Game spring(linear);
  EXPECT_GT(std::abs(solve(spring, {}).objective - result.objective), 1e-2);
}

// --- Finite-horizon H-infinity game --------------------------------------------------------------

System three_states(double gamma_factor) {
  System s;
  s.a = (MatrixXd(3, 3) << 1.0, 0.3, 0.0, -0.2, 0.9, 0.1, 0.05, 0.0, 0.8).finished();
  s.b = (MatrixXd(3, 2) << 0.0, 0.1, 0.4, 0.0, 0.0, 0.5).finished();
  s.e = (MatrixXd(3, 2) << 0.2, 0.0, 0.1, 0.3, 0.0, 0.1).finished();
  s.q = (MatrixXd(3, 3) << 2.0, 0.3, 0.0, 0.3, 1.0, 0.1, 0.0, 0.1, 0.5).finished();
  s.r = (MatrixXd(2, 2) << 1.0, 0.2, 0.2, 0.7).finished();
  s.x0 = Eigen::Vector3d(1.0, -2.0, 0.5);
  s.horizon = 12;
  s.gamma = gamma_factor * shared_dynamics::critical_gamma(s);
  return s;
}

TEST(HInfinity, CriticalGammaIsTheNormOfTheDisturbanceResponse) {
  System s = three_states(1.0);
  s.gamma = 0.0;
  const Eigen::Index w = s.horizon * s.e.cols();
  const MatrixXd block = Eliminated(s).h.bottomRightCorner(w, w);
  const double norm = symmetric_eigenvalues(block).maxCoeff();
  EXPECT_NEAR(shared_dynamics::critical_gamma(s), std::sqrt(norm), 1e-9);
}

TEST(HInfinity, AgreesWithTheRiccatiRecursion) {
  for (const double factor : {1.01, 1.1, 2.0, 10.0}) {
    const System system = three_states(factor);
    Game game(system);
    const Result result = solve(game, {});
    expect_certified(game, result);
    const auto [value, u0, w0] = shared_dynamics::riccati(system);
    EXPECT_NEAR(result.objective, value, 1e-6 * (1.0 + std::abs(value))) << factor;
    for (Index i = 0; i < 2; ++i) {
      EXPECT_NEAR(result.v[at(game.u(0, i))], u0[i], 1e-5) << factor;
      EXPECT_NEAR(result.v[at(game.w(0, i))], w0[i], 1e-5) << factor;
    }
  }
}

TEST(HInfinity, BelowTheCriticalGammaIsRefused) {
  for (const double factor : {0.99, 0.9, 0.5, 0.01}) {
    Game game(three_states(factor));
    SolverOptions options;
    for (const auto globalization : {Globalization::Filter, Globalization::None}) {
      options.minmax_globalization = globalization;
      const Result result = solve(game, options);
      EXPECT_FALSE(is_success(result.status)) << factor << ' ' << name_of(result.status);
      EXPECT_NE(result.certificate.kind, PointKind::LocalMinmax) << factor;
      if (globalization == Globalization::Filter) {
        EXPECT_EQ(result.status, Status::InnerUnbounded) << factor << ' ' << name_of(result.status);
      }
    }
  }
}

// --- Robust regression ---------------------------------------------------------------------------

struct Samples {
  MatrixXd a =
      (MatrixXd(6, 2) << 1.0, 0.0, 1.0, 1.0, 1.0, 2.0, 1.0, 3.0, 1.0, 4.0, 1.0, 5.0).finished();
  VectorXd b = (VectorXd(6) << 2.0, 0.5, 4.5, 2.0, 6.8, 4.2).finished();
};

/// Minimizer of the convex phi(x) by damped Newton; r_i stays away from 0.
VectorXd minimize_worst_case(const Samples& data, double rho) {
  VectorXd x = least_squares(data.a, data.b);
  const auto phi = [&](const VectorXd& point) {
    return ((data.a * point - data.b).array().abs() + rho * point.norm()).square().sum();
  };
  for (int iteration = 0; iteration < 100; ++iteration) {
    VectorXd gradient = VectorXd::Zero(2);
    MatrixXd hessian = MatrixXd::Zero(2, 2);
    const double norm = x.norm();
    const VectorXd unit = x / norm;
    for (Eigen::Index i = 0; i < data.b.size(); ++i) {
      const double r = data.a.row(i).dot(x) - data.b[i];
      const double size = std::abs(r) + rho * norm;
      const VectorXd slope = (r < 0.0 ? -1.0 : 1.0) * data.a.row(i).transpose() + rho * unit;
      gradient += 2.0 * size * slope;
      hessian += 2.0 * slope * slope.transpose() +
                 2.0 * size * rho / norm * (MatrixXd::Identity(2, 2) - unit * unit.transpose());
    }
    const VectorXd step = -solve_dense(hessian, gradient);
    double alpha = 1.0;
    while (alpha > 1e-10 && phi(x + alpha * step) > phi(x)) alpha *= 0.5;
    x += alpha * step;
    if (gradient.norm() < 1e-11) break;
  }
  return x;
}

TEST(RobustRegressionApplication, AgreesWithTheClosedFormOfTheWorstCase) {
  const Samples data;
  for (const double rho : {0.05, 0.1, 0.2}) {
    RobustRegression problem(data.a, data.b, rho);
    const VectorXd known = minimize_worst_case(data, rho);
    const Result result = solve(problem, {});
    expect_certified(problem, result);
    const VectorXd x = Eigen::Map<const VectorXd>(result.v.data(), 2);
    EXPECT_LT((x - known).lpNorm<Eigen::Infinity>(), 1e-5) << rho;
    EXPECT_NEAR(result.objective, problem.worst_case(known), 1e-5) << rho;
    EXPECT_NEAR(result.objective, problem.worst_case(x), 1e-5) << rho;
    EXPECT_GT((x - least_squares(data.a, data.b)).norm(), 1e-3);
  }
}

// --- A set that shrinks with x -------------------------------------------------------------------

TEST(InterdictionApplication, AgreesWithTheFormula) {
  const auto check = [](Interdiction problem, bool bound) {
    const Result result = solve(problem, {});
    expect_certified(problem, result);
    EXPECT_NEAR(result.v[0], problem.best_x(), 1e-6);
    EXPECT_NEAR(result.objective, problem.best_value(), 1e-5);
    const double norm = std::hypot(problem.damage[0], problem.damage[1]);
    const double radius = problem.capacity - problem.best_x();
    EXPECT_NEAR(result.v[1], radius * problem.damage[0] / norm, 1e-5);
    EXPECT_NEAR(result.v[2], radius * problem.damage[1] / norm, 1e-5);
    EXPECT_EQ(result.z_upper[0] > 1e-3, bound);
  };
  check(Interdiction(), false);
  check(Interdiction(3.0, 5.0, {1.0, -2.0}), false);
  check(Interdiction(0.1, 2.0, {3.0, 4.0}), true);
}

}  // namespace
}  // namespace ipminmax::testing
