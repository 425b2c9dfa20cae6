// A certificate is a statement about second derivatives: wrong ones are noticed.
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>
#include <support/changed_problem.hpp>

#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::ChangedProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

/// Entry (i, j) of the second derivatives multiplied.
ChangedProblem with_entry_times(Problem& right, Index i, Index j, double factor) {
  ChangedProblem changed(right);
  changed.of_hessian = [=, structure = right.structure().hessian](std::span<double> values) {
    for (std::size_t k = 0; k < structure.size(); ++k) {
      const auto [row, col] = structure[k];
      if ((row == i && col == j) || (row == j && col == i)) values[k] *= factor;
    }
  };
  return changed;
}

/// Its local minmax has every entry of W away from zero, constraints of both players among them.
AutodiffProblem game() {
  Model model;
  const Expression x = model.variable(kMin, "design"), z = model.variable(kMin, "size");
  const Expression y = model.variable(kMax, "wind");
  model.objective(square(x - 1.0) + 0.5 * square(z) + x * y + 0.3 * z * y - square(y) +
                  0.1 * exp(x + z));
  model.constraint(square(x) + square(z), 0.25, kNoBound);
  model.constraint(x + square(y), -kNoBound, 2.0);
  return AutodiffProblem(model, {0.5, 0.4, 0.2});
}

TEST(HessianCheck, ExactSecondDerivativesAreCertified) {
  AutodiffProblem problem = game();
  const Result result = solve(problem, {});
  EXPECT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_FALSE(result.certificate.hessian_disagrees);
}

TEST(HessianCheck, WrongEntriesAreNotCertified) {
  struct Case {
    Index i, j;
    double factor;
  };
  for (const auto& [i, j, factor] :
       {Case{0, 0, 2.0}, Case{2, 2, 0.5}, Case{1, 1, 1.3}, Case{1, 0, 0.0}, Case{2, 0, 0.7}}) {
    AutodiffProblem right = game();
    ChangedProblem problem = with_entry_times(right, i, j, factor);
    SolverOptions options;
    options.minmax_max_restarts = 0;
    const Result result = solve(problem, options);
    EXPECT_TRUE(is_success(result.status)) << i << ' ' << j << ' ' << result.message;
    EXPECT_NE(result.status, Status::Solved) << i << ' ' << j << ' ' << result.message;
    EXPECT_EQ(result.certificate.kind, PointKind::FirstOrderPoint);
    EXPECT_TRUE(result.certificate.hessian_disagrees) << i << ' ' << j;
    EXPECT_NE(result.message.find("second derivatives in "), std::string::npos) << result.message;
    EXPECT_NE(result.message.find("derivative_test second-order"), std::string::npos);
  }
}

TEST(HessianCheck, NamesTheRow) {
  AutodiffProblem right = game();
  ChangedProblem problem = with_entry_times(right, 2, 2, 1.5);
  EXPECT_NE(solve(problem, {}).message.find("wind"), std::string::npos);
}

// A small error matters where the curvature that is certified is small, too. From the solution: no
// Newton step goes along it.
TEST(HessianCheck, LittleCurvatureIsComparedWithItsOwnSize) {
  for (const bool changed : {false, true}) {
    Model model;
    const Expression x = model.variable(kMin, "x"), z = model.variable(kMin, "z");
    const Expression y = model.variable(kMax, "y");
    model.objective(0.5 * square(x + z - 2.0) + 5e-5 * square(x - z) + (x + z - 2.0) * (y - 0.5) -
                    square(y - 0.5));
    AutodiffProblem right(model, {1.0, 1.0, 0.5});
    // W = (1.0001, 0.9999; 0.9999, 1.0001): the change more than doubles the curvature along (1, -1).
    ChangedProblem wrong = with_entry_times(right, 1, 0, 0.9997);
    const Result result = solve(changed ? static_cast<Problem&>(wrong) : right, {});
    EXPECT_EQ(result.certificate.hessian_disagrees, changed) << result.message;
    EXPECT_EQ(result.certificate.kind == PointKind::LocalMinmax, !changed);
  }
}

// Steps of the check are far longer than x, so that x^1.1 looks as if it had little curvature.
TEST(HessianCheck, ASingularityNextToThePointIsNoError) {
  constexpr double kSmall = 1e-9;
  const double scale = 1.0 / (0.11 * std::pow(kSmall, -0.9));  // second derivative 1
  Model model;
  const Expression x = model.variable(kMin, "x");
  model.objective(scale * (pow(x, 1.1) - 1.1 * std::pow(kSmall, 0.1) * x));
  AutodiffProblem problem(model, {kSmall});
  const Result result = solve(problem, {});
  EXPECT_TRUE(is_success(result.status)) << result.message;
  EXPECT_FALSE(result.certificate.hessian_disagrees) << result.message;
}

TEST(HessianCheck, MinimizationsToo) {
  Model model;
  const Expression x = model.variable(kMin, "x"), z = model.variable(kMin, "z");
  model.objective(100.0 * square(z - square(x)) + square(1.0 - x));
  AutodiffProblem right(model, {-1.2, 1.0});
  EXPECT_EQ(solve(right, {}).status, Status::Solved);
  ChangedProblem gauss_newton(right);
  gauss_newton.of_hessian = [&right](std::span<double> values) {
    const std::vector<Triplet>& structure = right.structure().hessian;
    for (std::size_t k = 0; k < structure.size(); ++k) {
      if (structure[k].row == structure[k].col) values[k] *= 1.2;
    }
  };
  const Result result = solve(gauss_newton, {});
  EXPECT_TRUE(is_success(result.status)) << result.message;
  EXPECT_NE(result.status, Status::Solved);
  EXPECT_TRUE(result.certificate.hessian_disagrees);
}

// On the central path, where a barrier's curvature counts.
TEST(HessianCheck, OnTheCentralPath) {
  AutodiffProblem right = game();
  ChangedProblem wrong = with_entry_times(right, 0, 0, 2.0);
  for (const double mu : {1e-4, 1e-3, 1e-2}) {
    SolverOptions options;
    options.mu_target = mu;
    const Result result = solve(right, options);
    // Damping of one-sided bounds left 1e-5 mu in the error: exactly tol at 1e-3.
    EXPECT_EQ(result.status, Status::Solved) << mu << ": " << result.message;
    EXPECT_LE(result.error.total, 0.2 * options.tol) << mu;
    EXPECT_TRUE(solve(wrong, options).certificate.hessian_disagrees) << mu;
  }
}

TEST(HessianCheck, DifferencesAnswerForThemselves) {
  AutodiffProblem problem = game();
  SolverOptions options;
  options.hessian_approximation = HessianApproximation::FiniteDifferenceValues;
  const Result result = solve(problem, options);
  EXPECT_EQ(result.status, Status::Solved);
  EXPECT_FALSE(result.certificate.hessian_disagrees);
}

}  // namespace
}  // namespace ipminmax
