// hessian_approximation limited-memory: BFGS matrices of minimizations, differences for games.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include <support/autodiff_problem.hpp>
#include <support/without_hessian.hpp>

#include "core/model/canonical_problem.hpp"
#include "core/model/quasi_newton.hpp"
#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Player kMin = Player::Min;

SolverOptions limited_memory() {
  SolverOptions options;
  options.hessian_approximation = HessianApproximation::LimitedMemory;
  return options;
}

Model hs071() {
  Model model;
  std::vector<Expression> x;
  for (const char* name : {"a", "b", "c", "d"}) x.push_back(model.variable(kMin, name, 1.0, 5.0));
  model.objective(x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2]);
  model.constraint(x[0] * x[1] * x[2] * x[3], 25.0, kNoBound);
  model.constraint(square(x[0]) + square(x[1]) + square(x[2]) + square(x[3]), 40.0, 40.0);
  return model;
}

Model rosenbrock(int n) {
  Model model;
  std::vector<Expression> x;
  for (int i = 0; i < n; ++i) x.push_back(model.variable(kMin, "x"));
  Expression f = 0.0 * x[0];
  for (std::size_t i = 0; i + 1 < x.size(); ++i)
    f = f + 100.0 * square(x[i + 1] - square(x[i])) + square(1.0 - x[i]);
  model.objective(f);
  return model;
}

TEST(QuasiNewton, SolvesWithoutSecondDerivativesAndCertifiesNothing) {
  AutodiffProblem exact(hs071(), {1.0, 5.0, 5.0, 1.0});
  for (const bool structure : {false, true}) {
    WithoutHessian problem(exact, structure);
    const Result result = solve(problem, limited_memory());
    EXPECT_EQ(result.status, Status::Solved) << result.message;
    EXPECT_NEAR(result.objective, 17.0140173, 1e-6);
    EXPECT_LT(result.error.total, 1e-8);
    EXPECT_EQ(result.certificate.kind, PointKind::FirstOrderPoint);
    EXPECT_EQ(result.certificate.second_order, SecondOrder::NotTested);
    EXPECT_NE(result.message.find("nothing is certified"), std::string::npos) << result.message;
    EXPECT_EQ(problem.counts().hessian, 0);
    // One evaluation of first derivatives an iteration, and those of scaling and start.
    EXPECT_LE(problem.counts().gradient, result.iterations + 3);
    EXPECT_LE(problem.counts().jacobian, result.iterations + 3);
    EXPECT_LE(result.iterations, 40);
  }
}

TEST(QuasiNewton, TakesTheAdaptiveBarrierUnlessToldOtherwise) {
  AutodiffProblem exact(hs071(), {1.0, 5.0, 5.0, 1.0});
  WithoutHessian problem(exact);
  const auto barriers = [&](BarrierStrategy strategy, BarrierRule rule = BarrierRule::Ipopt) {
    SolverOptions options = limited_memory();
    options.mu_strategy = strategy;
    options.minmax_barrier_rule = rule;
    std::vector<double> mus;
    const Result result = solve(problem, options, [&](const IterationInfo& info) {
      mus.push_back(info.mu);
      return true;
    });
    EXPECT_EQ(result.status, Status::Solved) << result.message;
    return mus;
  };
  const auto unset = barriers(BarrierStrategy::Unset);
  EXPECT_EQ(unset, barriers(BarrierStrategy::Adaptive));
  EXPECT_NE(unset, barriers(BarrierStrategy::Monotone));
  EXPECT_EQ(barriers(BarrierStrategy::Unset, BarrierRule::Paper),
            barriers(BarrierStrategy::Monotone, BarrierRule::Paper));
}

TEST(QuasiNewton, FollowsACurvedValley) {
  for (const int n : {2, 10, 60}) {
    const AutodiffProblem exact(rosenbrock(n),
                                std::vector<double>(static_cast<std::size_t>(n), -1.0));
    AutodiffProblem model = exact;
    WithoutHessian problem(model);
    SolverOptions options = limited_memory();
    options.max_iter = 2000;
    options.acceptable_iter = 0;
    const Result result = solve(problem, options);
    EXPECT_EQ(result.status, Status::Solved) << n << ' ' << result.message;
    EXPECT_LT(result.error.total, 1e-8);
  }
}

// Two circles that meet in (3/4, +-0.66), from where their gradients are nearly parallel.
TEST(QuasiNewton, RestoresFeasibility) {
  Model model;
  const Expression x = model.variable(kMin, "x"), y = model.variable(kMin, "y");
  model.objective(x + square(y));
  model.constraint(square(x) + square(y), 1.0, 1.0);
  model.constraint(square(x - 1.5) + square(y), 1.0, 1.0);
  AutodiffProblem exact(model, {10.0, 1e-3});
  WithoutHessian problem(exact);
  Index restorations = 0;
  const Result result = solve(problem, limited_memory(), [&](const IterationInfo& info) {
    restorations += info.step_kind == 'R' ? 1 : 0;
    return true;
  });
  EXPECT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_NEAR(result.v[0], 0.75, 1e-6);
  EXPECT_GT(restorations, 0);
}

/// B of the pairs met at the points, by the update formula of BFGS, from sigma I.
MatrixXd dense_bfgs(const std::vector<VectorXd>& s, const std::vector<VectorXd>& y) {
  const double sigma = s.back().dot(y.back()) / s.back().squaredNorm();
  MatrixXd b = sigma * MatrixXd::Identity(s[0].size(), s[0].size());
  for (std::size_t k = 0; k < s.size(); ++k) {
    const VectorXd bs = b * s[k];
    b += y[k] * y[k].transpose() / s[k].dot(y[k]) - bs * bs.transpose() / s[k].dot(bs);
  }
  return b;
}

TEST(QuasiNewton, IsTheMatrixOfTheLastSixPairs) {
  Model model;
  std::vector<Expression> v;
  for (int i = 0; i < 4; ++i) v.push_back(model.variable(kMin, "v"));
  model.objective(exp(v[0]) + square(square(v[1])) + square(v[2] + v[3]) + square(v[3]));
  model.constraint(square(v[0]) + v[1], -kNoBound, 1e6);
  AutodiffProblem problem(model, {0.0, 1.0, 1.0, 1.0});
  SolverOptions options;
  options.nlp_scaling_method = Scaling::None;
  Counts counts;
  Timing timing;
  CanonicalProblem canonical(problem, options, counts, timing);
  ASSERT_EQ(canonical.build(), "");
  const Index n = canonical.variables();  // and a slack
  ASSERT_EQ(n, 5);
  QuasiNewton quasi_newton(n, {0, 1, 2, 3});
  std::vector<VectorXd> s, y;
  VectorXd last, gradient, last_gradient;
  Evaluation e;
  e.gradient.setZero(n);
  e.jacobian.assign(canonical.jacobian().size(), 0.0);
  const VectorXd lambda = VectorXd::Constant(1, 0.5);
  std::shared_ptr<const LowRankHessian> b;
  for (int k = 0; k < 9; ++k) {
    VectorXd at(n);
    for (Index i = 0; i < n; ++i) at[i] = 1.0 + 0.3 * std::sin(1.0 + 2.0 * k + 1.7 * i);
    ASSERT_TRUE(canonical.first_derivatives(at, e));
    b = quasi_newton.update(canonical, at, lambda, e);
    gradient = e.gradient.head(4);
    gradient[0] += 0.5 * 2.0 * at[0];
    gradient[1] += 0.5;
    if (k > 0) {
      const VectorXd step = at.head(4) - last, change = gradient - last_gradient;
      if (step.dot(change) > 1e-8 * step.norm() * change.norm()) {
        s.push_back(step);
        y.push_back(change);
      }
    }
    last = at.head(4);
    last_gradient = gradient;
  }
  ASSERT_GE(s.size(), 6U);
  s.erase(s.begin(), s.end() - 6);
  y.erase(y.begin(), y.end() - 6);
  const MatrixXd expected = dense_bfgs(s, y);
  for (Index i = 0; i < n; ++i) {
    VectorXd product = VectorXd::Zero(n);
    b->subtract_product(VectorXd::Unit(n, i), product);
    const VectorXd column = i < 4 ? VectorXd(expected.col(i)) : VectorXd(VectorXd::Zero(4));
    EXPECT_LT((product.head(4) + column).norm(), 1e-9 * expected.norm()) << i;
    EXPECT_EQ(product[4], 0.0);
  }
}

}  // namespace
}  // namespace ipminmax::testing
