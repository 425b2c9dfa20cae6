// What a success claims holds for the model as it was given, in whatever units it is written.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>

#include "core/answer.hpp"
#include "core/gap.hpp"
#include "core/robust.hpp"
#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

void expect_certified(const Result& result, const std::string& what) {
  EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax) << what << ": " << result.message;
  EXPECT_TRUE(is_success(result.status)) << what << ": " << result.message;
}

enum class Idle { Read, Fixed, Unread };

/// min x1 + (x0 / size - 2)^2 subject to .2 y - (y^2 - 1)^2 <= x1 for |y| <= 2: two maxima over y,
/// the search begins at the lower one.
Result two_maxima(double size, Idle idle) {
  Model model;
  const Expression x0 =
      idle == Idle::Fixed ? model.variable(kMin, "x0", size, size) : model.variable(kMin, "x0");
  const Expression x1 = model.variable(kMin, "x1");
  const Expression y = model.variable(kMax, "y", -2.0, 2.0);
  model.objective(idle == Idle::Unread ? x1 + 0.0 * x1 : x1 + square(x0 / size - 2.0));
  model.constraint(0.2 * y - square(square(y) - 1.0) - x1, -kNoBound, 0.0, kMin);
  AutodiffProblem problem(model, {size, 0.0, -0.9});
  return solve(problem, {});
}

TEST(Audit, AWorstCaseIsNotTakenForAnotherBesideALargeVariable) {
  for (const double size : {1.0, 1e4, 1e6, 1e9}) {
    for (const Idle idle : {Idle::Read, Idle::Fixed, Idle::Unread}) {
      const Result result = two_maxima(size, idle);
      const std::string what = std::to_string(size) + " " + std::to_string(static_cast<int>(idle));
      EXPECT_TRUE(is_success(result.status)) << what << ": " << result.message;
      ASSERT_EQ(result.v.size(), 3U);
      EXPECT_NEAR(result.v[1], 0.2024404, 1e-6) << what;
    }
  }
}

/// (x1 - 3)^2 + (x2 - 2)^2, x1 (Y^2 + Y)/2 + x2 (Y^2 - Y)/2 <= 1 for Y = (y - center)/size in
/// [-1, 1].
Result small_box(double size, double center) {
  Model model;
  const Expression x1 = model.variable(kMin, "x1");
  const Expression x2 = model.variable(kMin, "x2");
  const Expression y = model.variable(kMax, "y", center - size, center + size);
  const Expression u = (y - center) / size;
  model.objective(square(x1 - 3.0) + square(x2 - 2.0));
  model.constraint(0.5 * x1 * (square(u) + u) + 0.5 * x2 * (square(u) - u), -kNoBound, 1.0, kMin);
  AutodiffProblem problem(model, {0.0, 0.0, center + 0.5 * size});
  return solve(problem, {});
}

TEST(Audit, WorstCasesOfASmallBoxAreTwo) {
  for (const auto& [size, center] :
       {std::pair{1.0, 0.0}, {1e-3, 0.0}, {3e-5, 0.0}, {0.01, 300.0}, {1e4, 0.0}}) {
    const std::string what = std::to_string(size) + " around " + std::to_string(center);
    const Result result = small_box(size, center);
    ASSERT_EQ(result.v.size(), 3U);
    // Within what bound_relax_factor adds to the box, beside its size.
    const double relaxed = 1e-8 * std::max(1.0, center) / size;
    EXPECT_TRUE(is_success(result.status)) << what << ": " << result.message;
    EXPECT_NEAR(result.v[0], 1.0, 1e-6 + 4.0 * relaxed) << what;
    EXPECT_NEAR(result.v[1], 1.0, 1e-6 + 4.0 * relaxed) << what;
  }
}

TEST(Audit, AConstantOnBothSidesOfARowChangesNothing) {
  // max over y of -(y^2 - 1)^2 + .03 y is .030, near y = 1; the search begins near -1.
  for (const double shift : {0.0, 1e3, 1e6}) {
    Model model;
    const Expression x = model.variable(kMin, "x");
    const Expression y = model.variable(kMax, "y", -2.0, 2.0);
    model.objective(x);
    model.constraint(0.03 * y - square(square(y) - 1.0) - x + shift, -kNoBound, shift, kMin);
    AutodiffProblem problem(model, {0.0, -0.9});
    const Result result = solve(problem, {});
    EXPECT_TRUE(is_success(result.status)) << shift << ": " << result.message;
    EXPECT_NEAR(result.v[0], 0.030056, 1e-5) << shift;
  }
}

TEST(Audit, ARowInSmallUnitsHoldsAsClosely) {
  // max over [0, 3] of y sin(3 y) / 3 is .879636.
  for (const double unit : {1.0, 1e-3, 1e-6, 1e6}) {
    Model model;
    const Expression x = model.variable(kMin, "x");
    const Expression y = model.variable(kMax, "y", 0.0, 3.0);
    model.objective(x);
    model.constraint(unit * (y * sin(3.0 * y) / 3.0 - x), -kNoBound, 0.0, kMin);
    AutodiffProblem problem(model, {0.0, 0.5});
    const Result result = solve(problem, {});
    EXPECT_TRUE(is_success(result.status)) << unit << ": " << result.message;
    EXPECT_NEAR(result.v[0], 0.8796364, 1e-6) << unit;
  }
}

TEST(Audit, RobustRowsAreSearchedInEpigraphForm) {
  // (x - 3)^2 + x y - y^2, x (y^2 + .2 y) <= 1 for |y| <= 1: x = 1 / 1.2.
  Model model;
  const Expression x = model.variable(kMin, "x", 0.0, 10.0);
  const Expression y = model.variable(kMax, "y", -1.0, 1.0);
  model.objective(square(x - 3.0) + x * y - square(y));
  model.constraint(x * (square(y) + 0.2 * y), -kNoBound, 1.0, kMin);
  AutodiffProblem problem(model, {0.5, -0.3});
  SolverOptions options;
  options.minmax_epigraph = true;
  const Result result = solve(problem, options);
  EXPECT_TRUE(is_success(result.status)) << result.message;
  EXPECT_NEAR(result.v[0], 1.0 / 1.2, 1e-5);
}

TEST(Audit, TheEpigraphSearchesOverY) {
  // (x - y)^2, |y| <= 1: x = 0 with the value 1.
  for (const int starts : {-1, 0}) {
    Model model;
    const Expression x = model.variable(kMin, "x");
    const Expression y = model.variable(kMax, "y", -1.0, 1.0);
    model.objective(square(x - y));
    AutodiffProblem problem(model, {0.3, 0.1});
    SolverOptions options;
    options.minmax_epigraph = true;
    options.minmax_worst_case_starts = starts;
    const Result result = solve(problem, options);
    if (starts < 0) {
      EXPECT_TRUE(is_success(result.status)) << result.message;
      EXPECT_NEAR(result.objective, 1.0, 1e-6);
      EXPECT_NEAR(result.v[0], 0.0, 1e-6);
    } else {  // whatever is found, a minimum over y is no success
      const bool minimum = std::abs(result.v[0] - result.v[1]) < 1e-3;
      EXPECT_FALSE(minimum && is_success(result.status)) << result.message;
    }
  }
}

/// f = unit * ((x - .3)^2 ... two branches of y with values that differ by .66 unit, + shift.
AutodiffProblem two_wells(double unit, double shift) {
  Model model;
  const Expression x = model.variable(kMin, "x", -1.0, 1.0);
  const Expression y = model.variable(kMax, "y", -2.0, 2.0);
  model.objective(unit * (square(x) + 0.33 * y - square(square(y) - 1.0)) + shift);
  return AutodiffProblem(model, {0.5, -0.9});
}

TEST(Audit, AHigherBranchIsHeardBesideAWideBox) {
  // Two wells with peaks at y = 1 and -1 in a box of 200: far ends of it are 6e9 lower.
  Model model;
  const Expression x = model.variable(kMin, "x", -2.0, 2.0);
  const Expression y = model.variable(kMax, "y", -2000.0, 2000.0);
  const Expression u = 0.1 * y;
  model.objective(square(x - 0.3) - 4.0 * square(square(u) - 1.0) + 3.0 * x * u);
  AutodiffProblem problem(model, {1.0, -10.0});
  SolverOptions options;
  options.minmax_epigraph = true;
  const Result result = solve(problem, options);
  ASSERT_EQ(result.v.size(), 2U);
  if (is_success(result.status)) {
    EXPECT_NEAR(result.v[0], 0.0, 1e-4) << result.message;
    EXPECT_NEAR(result.objective, 0.09, 1e-4) << result.message;
  }
}

TEST(Audit, AResultSaysWhereRelaxedBoundsDecideIt) {
  // x >= 0 in a unit of 1e6 and shifted: bound_relax_factor moves the bound of 1e4 by 1e-4.
  Model model;
  const Expression u = model.variable(kMin, "u", 1e4, kNoBound);
  const Expression y = model.variable(kMax, "y");
  const Expression x = 1e6 * (u - 1e4);
  model.objective(1.0 + x + x * y - square(y));
  model.constraint(x + y, -kNoBound, 1e3, kMax);
  AutodiffProblem problem(model, {1e4 + 1e-6, 0.0});
  const Result result = solve(problem, {});
  ASSERT_EQ(result.v.size(), 2U);
  const bool is_named =
      std::ranges::any_of(result.certificate.reasons, [](const CertificateReason& reason) {
        return reason.kind == CertificateReason::Kind::Relaxed;
      });
  EXPECT_TRUE(!is_success(result.status) || result.v[0] >= 1e4 - 1e-8 || is_named)
      << result.message;
}

TEST(Audit, AWorseYOfAnotherStartCountsInAnyUnits) {
  for (const auto& [unit, shift] :
       {std::pair{1.0, 0.0}, {1e-6, 0.0}, {1e6, 0.0}, {1.0, 1e6}, {1e-3, 1.0}}) {
    for (const bool by_starts : {true, false}) {
      const std::string what = std::to_string(unit) + " + " + std::to_string(shift);
      AutodiffProblem problem = two_wells(unit, shift);
      SolverOptions options;
      if (by_starts) {
        options.minmax_starts = 20;
      } else {
        options.minmax_worst_case_starts = 10;
      }
      const Result result = solve(problem, options);
      // A search over y was not asked for with the starts of x: they tell, and refute nothing.
      EXPECT_TRUE(is_success(result.status)) << what << ": " << result.message;
      EXPECT_TRUE(result.v[1] > 0.9 || (by_starts && result.worst_case.higher)) << what;
    }
  }
}

TEST(Audit, TheSameRowTwiceIsOne) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y", -2.0, 2.0);
  model.objective(x + 0.1 * square(x));
  for (int k = 0; k < 2; ++k)
    model.constraint(0.2 * y - square(square(y) - 1.0) - x, -kNoBound, 0.0, kMin);
  AutodiffProblem problem(model, {0.0, -0.9});
  const Result result = solve(problem, {});
  expect_certified(result, "twice");
  EXPECT_NEAR(result.v[0], 0.2024404, 1e-6);
}

TEST(Audit, AnInfeasibleYRefutesNothing) {
  // Max's row y <= -.5 (times a unit) excludes the worse y that random starts begin at.
  for (const double unit : {1.0, 1e-5}) {
    Model model;
    const Expression x = model.variable(kMin, "x", -1.0, 1.0);
    const Expression y = model.variable(kMax, "y", -2.0, 2.0);
    model.objective(square(x) + 0.33 * y - square(square(y) - 1.0));
    model.constraint(unit * y, -kNoBound, -0.5 * unit, kMax);
    AutodiffProblem problem(model, {0.5, -0.9});
    SolverOptions options;
    options.minmax_starts = 20;
    const Result result = solve(problem, options);
    EXPECT_TRUE(is_success(result.status)) << unit << ": " << result.message;
    EXPECT_FALSE(result.worst_case.higher) << unit << result.message;
  }
}

TEST(Audit, RowsThatCannotBeMetAreNamedInAnyUnits) {
  for (const double unit : {1.0, 1e-3, 1e-6}) {
    Model model;
    const Expression x = model.variable(kMin, "x", -1.0, 1.0);
    const Expression y = model.variable(kMax, "y", -1.0, 1.0);
    model.objective(x);
    model.constraint(unit * (square(x) + y + 1.0), -kNoBound, 0.0, kMin);
    AutodiffProblem problem(model, {0.5, 0.1});
    const Result result = solve(problem, {});
    EXPECT_EQ(result.status, Status::LocallyInfeasible) << unit << ": " << result.message;
    EXPECT_NE(result.message.find("cannot be met"), std::string::npos)
        << unit << ": " << result.message;
  }
}

TEST(Audit, ARowThatOnlyItsRelaxationCanMeetIsNamed) {
  // x0^2 + x1^2 + least <= 0 has no solution, and its multiplier is zero where it is met best.
  for (const auto& [unit, least] : {std::pair{1e-6, 0.008}, {1e-7, 0.09}, {1e-8, 0.7}}) {
    Model model;
    const Expression x0 = model.variable(kMin, "x0", -9.0, 9.0);
    const Expression x1 = model.variable(kMin, "x1", -9.0, 9.0);
    model.objective(square(x0) + square(x1));
    model.constraint(unit * (square(x0) + square(x1) + least), -kNoBound, 0.0, kMin);
    AutodiffProblem problem(model, {0.1, 0.3});
    const Result result = solve(problem, {});
    const bool is_named =
        std::ranges::any_of(result.certificate.reasons, [](const CertificateReason& reason) {
          return reason.kind == CertificateReason::Kind::Relaxed;
        });
    EXPECT_TRUE(is_named || !is_success(result.status)) << unit << ": " << result.message;
  }
}

TEST(Audit, AnAnswerIsAsAccurateAsTheToleranceInSmallUnits) {
  // Matching pennies: at p = 1/2 all q are as good, a little beside it a vertex is better.
  for (const double unit : {1.0, 1e-2, 1e-4, 1e-5}) {
    Model model;
    const Expression p = model.variable(kMin, "p", 0.0, 1.0);
    const Expression q = model.variable(kMax, "q", 0.0, 1.0);
    model.objective(unit * (2.0 * p - 1.0) * (2.0 * q - 1.0));
    AutodiffProblem problem(model, {0.51, 0.5});
    SolverOptions options;
    options.minmax_worst_case_starts = 8;
    expect_certified(solve(problem, options), std::to_string(unit));
  }
}

TEST(Audit, AWorstCaseThatGrowsWithoutBoundIsNone) {
  // Only x = 0 meets x y <= .5 for every y; and max over y of x^2 + y is infinite.
  for (const double unit : {1.0, 1e5, 1e-5}) {
    for (const bool epigraph : {false, true}) {
      Model model;
      const Expression x = model.variable(kMin, "x", -2.0, 2.0);
      const Expression y = model.variable(kMax, "y");
      model.objective(epigraph ? square(x) + y / unit : square(x - 1.0));
      if (!epigraph) model.constraint(x * y / unit, -kNoBound, 0.5, kMin);
      AutodiffProblem problem(model, {0.9, 0.5 * unit});
      SolverOptions options;
      options.minmax_epigraph = epigraph;
      options.max_iter = 300;
      EXPECT_FALSE(is_success(solve(problem, options).status)) << unit << ", " << epigraph;
    }
  }
}

TEST(Audit, ScenariosBeyondTheirBoundsDecideNothing) {
  // max x0 + x1 with x0 y0^2 + x1 y1^2 <= 1 for y in a box: every x of x0 + x1 = 1 is best.
  for (const double unit : {1.0, 1e-3, 1e-5}) {
    Model model;
    const Expression x0 = model.variable(kMin, "x0", -5.0, 5.0);
    const Expression x1 = model.variable(kMin, "x1", -5.0, 5.0);
    const Expression y0 = model.variable(kMax, "y0", -1.0, 1.0);
    const Expression y1 = model.variable(kMax, "y1", -unit, unit);
    model.objective(-x0 - x1);
    model.constraint(x0 * square(y0) + x1 * square(y1 / unit), -kNoBound, 1.0, kMin);
    AutodiffProblem problem(model, {0.1, 0.1, 0.3, 0.1 * unit});
    const Result result = solve(problem, {});
    const bool says_so =
        std::ranges::any_of(result.certificate.reasons, [](const CertificateReason& reason) {
          return reason.text.find("x is best but not unique") != std::string::npos;
        });
    EXPECT_TRUE(result.certificate.kind != PointKind::LocalMinmax || says_so) << unit;
    EXPECT_NEAR(result.v[0] + result.v[1], 1.0, 1e-4) << unit;
  }
}

TEST(Audit, ARowOfMaxAtItsBoundCountsWhereverXGoes) {
  // Max's y <= x0 + x1: towards (-1, -1) f falls with the best y, so (0, 0) is no local minmax.
  for (const double x_unit : {1.0, 1e3}) {
    for (const double y_unit : {1.0, 1e-3, 1e-5}) {
      Model model;
      const Expression x0 = model.variable(kMin, "x0", -x_unit, x_unit) / x_unit;
      const Expression x1 = model.variable(kMin, "x1", -x_unit, x_unit) / x_unit;
      const Expression y = model.variable(kMax, "y", -2.0 * y_unit, 2.0 * y_unit) / y_unit;
      model.objective(0.5 * square(x0) + 0.5 * square(x1) - 0.2 * x0 * x1 - square(y));
      model.constraint(y - x0 - x1, -kNoBound, 0.0, kMax);
      AutodiffProblem problem(model, {0.3 * x_unit, 0.3 * x_unit, 0.2 * y_unit});
      SolverOptions options;
      options.minmax_epigraph = true;
      const Result result = solve(problem, options);
      EXPECT_TRUE(result.certificate.kind != PointKind::LocalMinmax || result.objective < -3.0)
          << x_unit << ", " << y_unit;
    }
  }
}

TEST(Audit, NothingRunsAwayInABox) {
  // y on a circle in a box, one side of it much shorter.
  Model model;
  const Expression x = model.variable(kMin, "x", -2.0, 2.0);
  const Expression y0 = model.variable(kMax, "y0", -72.8, 72.8) / 36.4;
  const Expression y1 = model.variable(kMax, "y1", -4.88e-4, 4.88e-4) / 2.44e-4;
  model.objective(1e6 * ((x - 0.5) * y0 + (x + 0.5) * y1 + square(x)));
  model.constraint(square(y0) + square(y1), 1.0, 1.0, kMax);
  AutodiffProblem problem(model, {0.9, 18.2, 4.88e-5});
  SolverOptions options;
  options.minmax_worst_case_starts = 8;
  const Result result = solve(problem, options);
  EXPECT_FALSE(result.worst_case.unbounded);
  EXPECT_TRUE(is_success(result.status)) << result.message;
}

TEST(Audit, ASearchThatFailsAboveAllMaximaLeavesTheRowOpen) {
  // exp(2 x y - y^2 - 4) <= 1 for every y: x <= 2. From y = .1 it overflows, far out it is zero.
  for (const double shift : {0.0, 1e4}) {
    Model model;
    const Expression x = model.variable(kMin, "x") - shift;
    const Expression y = model.variable(kMax, "y") - shift;
    model.objective(-x);
    model.constraint(exp(2.0 * x * y - square(y) - 4.0), -kNoBound, 1.0, kMin);
    AutodiffProblem problem(model, {shift + 0.5, shift + 0.1});
    SolverOptions options;
    options.minmax_epigraph = true;
    const Result result = solve(problem, options);
    EXPECT_TRUE(!is_success(result.status) || std::abs(result.objective + 2.0) < 1e-3)
        << shift << ": " << result.objective;
  }
}

TEST(Audit, HeldWorstCasesBesideTheirBoundsDecideNothing) {
  // p'Aq, every p is as good: how far the second q is from its bound is no reason to prefer one.
  for (const double unit : {1.0, 1e4}) {
    for (const double q_row : {1.0, 1e-6}) {
      Model model;
      const Expression p = model.variable(kMin, "p", 0.0) / unit;
      const Expression r = model.variable(kMin, "r", 0.0);
      const Expression q0 = model.variable(kMax, "q0", 0.0);
      const Expression q1 = model.variable(kMax, "q1", 0.0);
      const Expression q2 = model.variable(kMax, "q2", 0.0);
      model.objective(2.0 * (p + r) * (q0 + q2) - r * q1);
      model.constraint(p + r, 1.0, 1.0, kMin);
      model.constraint(q_row * (q0 + q1 + q2), q_row, q_row, kMax);
      AutodiffProblem problem(model, {0.6 * unit, 0.4, 0.3, 0.3, 0.4});
      SolverOptions options;
      options.minmax_epigraph = true;
      const Result result = solve(problem, options);
      EXPECT_NE(result.certificate.kind, PointKind::LocalMinmax) << unit << ", " << q_row;
    }
  }
}

TEST(Audit, ARowInsideItsRelaxationIsNamedWhereItIsViolatedByMuch) {
  // x + .6 y + .8 w <= 2 over the unit disc: x = 1. In these units the disc is anything.
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y", -2.0, 2.0);
  const Expression w = model.variable(kMax, "w", -2.0, 2.0);
  model.objective(square(x - 4.0));
  model.constraint(1e-6 * (x + 0.6 * y + 0.8 * w) + 1e6, -kNoBound, 2e-6 + 1e6, kMin);
  model.constraint(1e-6 * (square(y) + square(w)) + 1e6, -kNoBound, 1e-6 + 1e6, kMax);
  AutodiffProblem problem(model, {0.0, 0.1, 0.1});
  for (const int starts : {0, 5}) {
    SolverOptions options;
    options.minmax_starts = starts;
    const Result result = solve(problem, options);
    const bool says_so = std::ranges::any_of(result.certificate.reasons, [](const auto& reason) {
      return reason.kind == CertificateReason::Kind::Relaxed;
    });
    EXPECT_TRUE(!is_success(result.status) || says_so || std::abs(result.v[0] - 1.0) < 1e-3)
        << result.v[0];
  }
}

TEST(Audit, TheEpigraphFormIsSolvedAsAccuratelyAsTheModel) {
  // x + 1/x on x = 2 - w^2: 2 at x = 1. At the start f is 1e6; w = 0 is stationary, and a maximum.
  for (const double width : {1e-6, 1.0}) {
    Model model;
    const Expression x = model.variable(kMin, "x", 0.0);
    const Expression w = model.variable(kMin, "w");
    static_cast<void>(model.variable(kMax, "unread", -width, 2.0 * width));
    model.objective(x + 1.0 / x);
    model.constraint(x + square(w), 2.0, 2.0, kMin);
    AutodiffProblem problem(model, {1e-6, 1.0, 0.0});
    SolverOptions options;
    options.minmax_epigraph = true;
    const Result result = solve(problem, options);
    EXPECT_TRUE(!is_success(result.status) || std::abs(result.objective - 2.0) < 1e-4)
        << width << ": " << result.objective;
  }
}

TEST(Audit, TheEpigraphFormIsAsComplementaryAsTheModel) {
  // (a - 3)^2 + (b - 2)^2, a (Y^2 + Y)/2 + b (Y^2 - Y)/2 <= 1 for |Y| <= 1: 5 at a = b = 1. Units
  // in which f is 1e13 near the start.
  Model model;
  const Expression a = 100.0 * model.variable(kMin, "a");
  const Expression b = 1e6 * (model.variable(kMin, "b") - 1e4);
  const Expression y = 1e3 * model.variable(kMax, "y", -1e-3, 1e-3);
  model.objective(square(a - 3.0) + square(b - 2.0));
  model.constraint(0.5 * a * (square(y) + y) + 0.5 * b * (square(y) - y), -kNoBound, 1.0, kMin);
  AutodiffProblem problem(model, {0.0, 1e4, 1e-4});
  SolverOptions options;
  options.minmax_epigraph = true;
  const Result result = solve(problem, options);
  const bool claims =
      result.status == Status::Solved || result.certificate.kind == PointKind::LocalMinmax;
  EXPECT_TRUE(!claims || std::abs(result.objective - 5.0) < 1e-4)
      << result.message << ": " << result.objective;
  EXPECT_LE(result.error.complementarity, options.acceptable_compl_inf_tol);
}

TEST(Audit, StartsThatAgreeDoNotHideWhatRandomPointsShow) {
  // Waves of which all interior maxima violate the row where three searches end at y = -1.
  Model model;
  const Expression a = model.variable(kMin, "a", -3.0, 3.0);
  const Expression b = model.variable(kMin, "b", -3.0, 3.0);
  const Expression y = model.variable(kMax, "y", -1.0, 1.0);
  model.objective(-a + 0.2 * square(a) - 0.3 * b + 0.3 * square(b));
  model.constraint(a * cos(14.0 * y + 2.48) + b * sin(7.0 * y) + 0.2 * y, -kNoBound, 1.0, kMin);
  AutodiffProblem problem(model, {0.0, 0.0, -0.9});
  const Result result = solve(problem, {});
  EXPECT_TRUE(!is_success(result.status) || std::abs(result.objective + 0.75203) < 1e-4)
      << result.objective;
}

TEST(Audit, AStepIsNoRestBesideAVariableThatHasGoneFar) {
  // The least t with (x - .3) y <= t for |y| <= 1: 0 at x = .3.
  for (const double x_unit : {1.0, 1e-6}) {
    Model model;
    const Expression x = x_unit * model.variable(kMin, "x");
    const Expression t = 10.0 * model.variable(kMin, "t");
    const Expression y = 10.0 * model.variable(kMax, "y", -0.1, 0.1);
    model.objective(t);
    model.constraint((x - 0.3) * y - t, -kNoBound, 0.0, kMin);
    AutodiffProblem problem(model, {1.0 / x_unit, 0.1, 0.02});
    SolverOptions options;
    options.minmax_epigraph = true;
    const Result result = solve(problem, options);
    EXPECT_TRUE(!is_success(result.status) || std::abs(result.objective) < 1e-3)
        << x_unit << ": " << result.objective;
  }
}

TEST(Audit, AStartThatMaxMayNotChooseIsNoWorstCase) {
  // .1 x^2 + x y + y^2, |y| <= 1: 1 at x = 0. -x with x + y^2 <= 2: x = 1.
  for (const double start : {1.01, 1.5, 2.45}) {
    for (const bool as_row : {false, true}) {
      for (const bool robust : {false, true}) {
        Model model;
        const Expression x = model.variable(kMin, "x");
        const double bound = as_row ? 10.0 : 1.0;
        const Expression y = model.variable(kMax, "y", -bound, bound);
        model.objective(robust ? -x : 0.1 * square(x) + x * y + square(y));
        if (robust) model.constraint(x + square(y), -kNoBound, 2.0, kMin);
        if (as_row) model.constraint(square(y), -kNoBound, 1.0, kMax);
        AutodiffProblem problem(model, {1.0, start});
        SolverOptions options;
        options.minmax_epigraph = true;
        const Result result = solve(problem, options);
        EXPECT_TRUE(!is_success(result.status) ||
                    std::abs(result.v[0] - (robust ? 1.0 : 0.0)) < 1e-3)
            << start << ", " << as_row << ", " << robust << ": " << result.v[0];
      }
    }
  }
}

TEST(Audit, AMaximizerThatFRisesBesideIsNone) {
  // x^2 + (y / unit)^power, |y| <= unit, from y = 0, which no derivative below the power shows.
  for (const double unit : {1.0, 1e2, 1e4}) {
    for (const int power : {3, 5}) {
      Model model;
      const Expression x = model.variable(kMin, "x");
      const Expression y = model.variable(kMax, "y", -unit, unit) / unit;
      model.objective(square(x) + (power == 3 ? square(y) * y : square(square(y)) * y));
      AutodiffProblem problem(model, {1.0, 0.0});
      const Result result = solve(problem, SolverOptions());
      EXPECT_TRUE(!is_success(result.status) || result.objective > 0.9) << unit << ", " << power;
      EXPECT_EQ(result.message.find("exact over all"), std::string::npos) << result.message;
    }
  }
}

TEST(Audit, AGapProvesNothingWhereFIsHigherAtABound) {
  // x^4 - y^4 + y^5: concave near y = 0, and 16 at y = 2.
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y", -2.0, 2.0);
  model.objective(square(square(x)) + square(square(y)) * (y - 1.0));
  AutodiffProblem problem(model, {0.3, 0.3});
  EXPECT_FALSE(duality_gap(problem, std::vector{0.0, 0.0}, {}).saddle_point);
  // A hill of .84 beside y = 0, in a tenth of the box.
  Model hill;
  const Expression u = hill.variable(kMin, "u", -1.0, 1.0);
  const Expression w = hill.variable(kMax, "w", -1.0, 1.0);
  hill.objective(square(square(u)) - square(square(w)) + 0.9 * exp(-50.0 * square(w - 0.5)));
  AutodiffProblem with_hill(hill, {0.3, 0.0});
  EXPECT_FALSE(duality_gap(with_hill, std::vector{0.0, 0.0}, {}).saddle_point);
}

TEST(Audit, WorstCasesAreThoseOfTheAnswersOwnX) {
  // k (b - a^2 / 2) with b - a y + y^2 / 2 >= 0 for |y| <= 3: b >= a^2 / 2, so that f >= 0.
  for (const double k : {1.0, 1e-5, 1e-6}) {
    Model model;
    const Expression a = model.variable(kMin, "a", -1.0, 1.0);
    const Expression b = model.variable(kMin, "b", -5.0, 5.0);
    const Expression y = model.variable(kMax, "y", -3.0, 3.0);
    model.objective(k * (b - 0.5 * square(a)));
    model.constraint(b - a * y + 0.5 * square(y), 0.0, kNoBound, kMin);
    AutodiffProblem problem(model, {0.1, 0.5, 0.01});
    const Result result = solve(problem, SolverOptions());
    EXPECT_TRUE(!is_success(result.status) || result.objective > -1e-3 * k)
        << k << ": " << result.objective;
  }
}

TEST(Audit, NothingGrowsWithoutBoundInALargeBox) {
  // x^2 + (y / most)^2 with 0 <= y <= most, from y = 0, where f does not rise.
  for (const double most : {1e3, 1e6}) {
    Model model;
    const Expression x = model.variable(kMin, "x");
    const Expression y = model.variable(kMax, "y", 0.0, most) / most;
    model.objective(square(x) + square(y));
    AutodiffProblem problem(model, {0.3, 0.0});
    const Result result = solve(problem, SolverOptions());
    EXPECT_NE(result.status, Status::InnerUnbounded) << most << ": " << result.message;
    EXPECT_EQ(result.message.find("unbounded"), std::string::npos) << result.message;
  }
}

TEST(Audit, AStepUnderALargeShiftIsNoRest) {
  // a + 1 / a with a + b^2 = 2, a >= 0: 2 at a = 1, whose slope at the start is 1e12.
  for (const double unit : {1.0, 1e3}) {
    for (const bool epigraph : {false, true}) {
      Model model;
      const Expression a = unit * model.variable(kMin, "a", 0.0, kNoBound);
      const Expression b = model.variable(kMin, "b");
      model.objective(a + 1.0 / a);
      model.constraint(a + square(b), 2.0, 2.0, kMin);
      AutodiffProblem problem(model, {1e-6 / unit, 1.0});
      SolverOptions options;
      options.minmax_epigraph = epigraph;
      const Result result = solve(problem, options);
      EXPECT_TRUE(!is_success(result.status) || std::abs(result.objective - 2.0) < 1e-3)
          << unit << ", " << epigraph << ": " << result.objective;
    }
  }
}

TEST(Audit, ARowIsViolatedBesideWhatXMoves) {
  // max -x with x + y^2 + y >= 0 for all y: x = 1/4, x and y far from the origin in small units.
  constexpr double kUnit = 1e5, kShift = 1e4;
  for (const bool epigraph : {false, true}) {
    Model model;
    const Expression x = kUnit * (model.variable(kMin, "x") + kShift);
    const Expression y = model.variable(kMax, "y") + kShift;
    model.objective(x);
    model.constraint(x + square(y) + y, 0.0, kNoBound, kMin);
    AutodiffProblem problem(model, {3.0 / kUnit - kShift, 0.5 - kShift});
    SolverOptions options;
    options.minmax_epigraph = epigraph;
    const Result result = solve(problem, options);
    EXPECT_TRUE(!is_success(result.status) || result.objective > 0.24) << result.objective;
  }
}

TEST(Audit, AWorstCaseBesideAKnownOneIsAnotherIfItIsHigher) {
  // max x with 2 x y - y^2 <= 4 for all y: x = 2. y = unit (v - 1e4): its maxima differ by less
  // than 1e-6 of v, and far away the row is -1e18 or less.
  for (const double unit : {1e4, 1e5}) {
    Model model;
    const Expression x =
        unit < 1e5 ? model.variable(kMin, "x") + 1e4 : 1e-5 * model.variable(kMin, "x");
    const Expression y = unit * (model.variable(kMax, "y") - 1e4);
    model.objective(-x);
    model.constraint(2.0 * x * y - square(y), -kNoBound, 4.0, kMin);
    AutodiffProblem problem(model, {unit < 1e5 ? 0.5 - 1e4 : 5e4, 1e4 + 0.1 / unit});
    const Result result = solve(problem, {});
    EXPECT_TRUE(!is_success(result.status) || result.objective > -2.01)
        << unit << ": " << result.objective;
  }
}

TEST(Audit, EveryPartOfADisconnectedYIsSearched) {
  // max x with x + y + .3 x y <= 1 for y = -1 or 1: x = 0.
  for (const bool boxed : {false, true}) {
    for (const double start : {-1.0, -0.9, -0.4}) {
      Model model;
      const Expression x = model.variable(kMin, "x");
      const Expression y = boxed ? model.variable(kMax, "y", -1.5, 1.5) : model.variable(kMax, "y");
      model.objective(-x);
      model.constraint(square(y), 1.0, 1.0, kMax);
      model.constraint(x + y + 0.3 * x * y, -kNoBound, 1.0, kMin);
      AutodiffProblem problem(model, {0.1, start});
      const Result result = solve(problem, {});
      EXPECT_TRUE(!is_success(result.status) || result.v[0] < 1e-3)
          << boxed << ", " << start << ": " << result.v[0];
    }
  }
}

TEST(Audit, ARowThatYDoesNotChangeKeepsItsPlace) {
  // -x / k with 2 x y - y^2 <= 4 for all y: x = 2. In epigraph form f is a row without y.
  for (const double k : {1.0, 1e6}) {
    for (const bool twice : {false, true}) {
      if (twice && k != 1.0) continue;
      Model model;
      const Expression x = model.variable(kMin, "x");
      const Expression y = model.variable(kMax, "y");
      model.objective(-x / k);
      model.constraint(2.0 * x * y - square(y), -kNoBound, 4.0, kMin);
      if (twice) model.constraint(2.0 * x * y - square(y), -kNoBound, 4.0, kMin);
      AutodiffProblem problem(model, {0.5, 0.1});
      SolverOptions options;
      options.minmax_epigraph = !twice;
      options.minmax_starts = twice ? 5 : 1;
      const Answer answer = run(problem, options);
      expect_certified(answer.best, std::to_string(k) + (twice ? ", twice" : ""));
      EXPECT_NEAR(answer.best.v[0], 2.0, 1e-4) << k << ", " << twice;
    }
  }
}

TEST(Audit, FMayBeConstantInVariablesWithoutBounds) {
  for (const double bound : {kNoBound, 1.0}) {
    for (const int starts : {0, 8}) {
      Model model;
      const Expression x = model.variable(kMin, "x", -bound, bound);
      const Expression y = model.variable(kMax, "y", -1.0, 1.0);
      const Expression w = model.variable(kMax, "w");
      model.objective(3.0 + 0.0 * (x + y + w));
      AutodiffProblem problem(model, {0.1, 0.2, 0.3});
      SolverOptions options;
      options.minmax_worst_case_starts = starts;
      const Result result = solve(problem, options);
      EXPECT_TRUE(is_success(result.status)) << bound << ", " << starts << ": " << result.message;
    }
  }
}

TEST(Audit, ABoundOfYWrittenAsARowDecidesNothing) {
  // p'A q on simplices, A = [[2, 0, 2], [2, -1, 2]]: every p is as good, with q1 >= 0 as a row,
  // too.
  for (const bool as_row : {false, true}) {
    Model model;
    const Expression p = model.variable(kMin, "p", 0.0, kNoBound);
    const Expression r = model.variable(kMin, "r", 0.0, kNoBound);
    const Expression q0 = model.variable(kMax, "q0", 0.0, kNoBound);
    const Expression q1 = model.variable(kMax, "q1", as_row ? -kNoBound : 0.0, kNoBound);
    const Expression q2 = model.variable(kMax, "q2", 0.0, kNoBound);
    model.objective(2.0 * (p + r) * (q0 + q2) - r * q1);
    model.constraint(p + r, 1.0, 1.0, kMin);
    model.constraint(q0 + q1 + q2, 1.0, 1.0, kMax);
    if (as_row) model.constraint(q1, 0.0, kNoBound, kMax);
    AutodiffProblem problem(model, {0.6, 0.4, 0.3, 0.3, 0.4});
    SolverOptions options;
    options.minmax_epigraph = true;
    const Result result = solve(problem, options);
    const bool strict =
        std::ranges::none_of(result.certificate.reasons, [](const CertificateReason& reason) {
          return reason.text.find("x is best but not unique") != std::string::npos;
        });
    EXPECT_FALSE(result.certificate.kind == PointKind::LocalMinmax && strict) << as_row;
  }
}

TEST(Audit, ARowOfMaxInsideItsRelaxationIsNamedBesideRobustRows) {
  // max x with x + y <= 1 for y <= x, written as m (y - x) + c <= c: x = 1/2, .45 where c is large.
  for (const double c : {0.0, 1e6}) {
    const double m = c > 0.0 ? 1e-3 : 1.0;
    Model model;
    const Expression x = model.variable(kMin, "x");
    const Expression y = model.variable(kMax, "y", -1.0, kNoBound);
    model.objective(-x);
    model.constraint(m * (y - x) + c, -kNoBound, c, kMax);
    model.constraint(m * (y + x) + c, -kNoBound, m + c, kMin);
    AutodiffProblem problem(model, {0.0, -0.3});
    const Result result = solve(problem, {});
    const bool named =
        std::ranges::any_of(result.certificate.reasons, [](const CertificateReason& reason) {
          return reason.kind == CertificateReason::Kind::Relaxed;
        });
    EXPECT_TRUE(!is_success(result.status) || named || std::abs(result.v[0] - 0.5) < 1e-3)
        << c << ": " << result.v[0];
  }
}

// A row that reads a state alone: what x can change of it, through the equation, is its size.
TEST(Audit, ARowOfAStateIsMetWithinItsRelaxation) {
  for (const double unit : {1.0, 1e3, 1e-4}) {  // of the state
    Model model;
    const Expression x = model.variable(kMin, "x");
    const Expression w = model.variable(kMax, "w", -1.0, 1.0);
    const Expression s = model.variable(kMax, "s");
    model.objective(-x);
    model.constraint(s - unit * (x + w), 0.0, 0.0, kMax);
    model.constraint(s, -kNoBound, 3.0 * unit, kMin);
    AutodiffProblem problem(model, {0.0, 0.0, 0.0});
    const Result result = solve(problem, {});
    expect_certified(result, std::to_string(unit));
    EXPECT_NEAR(result.v[0], 2.0, 1e-6) << unit;
  }
}

// s^2 = 3 + w / 2 + x / 5 has two solutions: at the start's, the lower one, s + x <= 2 holds.
TEST(Audit, EveryBranchOfAnEquationIsSearched) {
  Model model;
  const Expression x = model.variable(kMin, "x", -4.0, 4.0);
  const Expression w = model.variable(kMax, "w", -1.0, 1.0);
  const Expression s = model.variable(kMax, "s");
  model.objective(square(x - 2.2));
  model.constraint(square(s) - 3.0 - 0.5 * w - 0.2 * x, 0.0, 0.0, kMax);
  model.constraint(s + x, -kNoBound, 2.0, kMin);
  AutodiffProblem problem(model, {0.0, 0.0, -std::sqrt(3.0)});
  const Result result = solve(problem, {});
  EXPECT_LE(result.v[0] + std::sqrt(3.5 + 0.2 * result.v[0]), 2.0 + 1e-6) << result.message;
}

// s1 = x + mean w, s2^2 = s1 + mean u: -s1 <= .2 does not read u, on which it depends which w have
// an s2.
TEST(Audit, WhatDecidesThatAnEquationCanHoldIsSearched) {
  constexpr int kDisturbances = 5;
  Model model;
  const Expression x = model.variable(kMin, "x", -3.0, 3.0);
  Expression w = 0.0 * x, u = 0.0 * x;
  for (int i = 0; i < kDisturbances; ++i) {
    w = w + model.variable(kMax, "w" + std::to_string(i), -1.0, 1.0) / kDisturbances;
    u = u + model.variable(kMax, "u" + std::to_string(i), -1.0, 1.0) / kDisturbances;
  }
  const Expression s1 = model.variable(kMax, "s1"), s2 = model.variable(kMax, "s2");
  model.objective(square(x));
  model.constraint(s1 - x - w, 0.0, 0.0, kMax);
  model.constraint(square(s2) - s1 - u, 0.0, 0.0, kMax);
  model.constraint(-s1, -kNoBound, 0.2, kMin);
  std::vector<double> start(3 + 2 * kDisturbances, 0.0);
  start[0] = start[start.size() - 2] = 1.5;
  start.back() = std::sqrt(1.5);
  AutodiffProblem problem(model, start);
  const Result result = solve(problem, {});
  EXPECT_GE(result.v[0], 0.8 - 1e-6) << result.message;
}

// A row that reads a state beside a little of x, states of 1e3.
TEST(Audit, WhatXMovesThroughEquationsCountsBesideWhatItMovesAtOnce) {
  for (const double slope : {1e-8, 1e-3}) {
    Model model;
    const Expression x = model.variable(kMin, "x", -4.0, 4.0),
                     z = model.variable(kMin, "z", -4.0, 4.0);
    const Expression w0 = model.variable(kMax, "w0", -1.0, 1.0);
    const Expression w1 = model.variable(kMax, "w1", -1.0, 1.0);
    const Expression s0 = model.variable(kMax, "s0"), s1 = model.variable(kMax, "s1");
    model.objective(square(x - 3.0) + square(z - 1.0));
    model.constraint(s0 - 1e3 - 0.2 - x - 0.4 * w0, 0.0, 0.0, kMax);
    model.constraint(s1 - 1e3 - 0.9 * (s0 - 1e3) - x - 0.4 * w1, 0.0, 0.0, kMax);
    model.constraint(s1 - 1e3 + slope * z, -kNoBound, 1.4, kMin);
    AutodiffProblem problem(model, {0.0, 0.0, 0.0, 0.0, 1e3 + 0.2, 1e3 + 0.2});
    expect_certified(solve(problem, {}), std::to_string(slope));
  }
}

/// (x - 3)^2 subject to x + root(.5 - y) <= 2 over y in [0, 1].
TEST(Audit, AConstraintThatIsUndefinedAtSomeYIsNotMet) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y", 0.0, 1.0);
  model.objective(square(x - 3.0));
  model.constraint(x + sqrt(0.5 - y), -kNoBound, 2.0, kMin);
  AutodiffProblem problem(model, {0.0, 0.1});
  const Result result = solve(problem, {});
  EXPECT_FALSE(is_success(result.status));
  EXPECT_NE(result.message.find("is undefined at another y: variable 1 (y) = "), std::string::npos)
      << result.message;
}

/// The same with y log(y), which is undefined at y = 0 alone.
TEST(Audit, AConstraintMayBeUndefinedAtABoundOfY) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y", 0.0, 1.0);
  model.objective(square(x - 3.0));
  model.constraint(x - y * log(y), -kNoBound, 2.0, kMin);
  AutodiffProblem problem(model, {0.0, 0.1});
  expect_certified(solve(problem, {}), "");
}

}  // namespace
}  // namespace ipminmax
