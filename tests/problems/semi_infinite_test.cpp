// Semi-infinite programs, min f(x) with g(x, t) <= 0 for every t, by solve_robust. The optimum is
// that of a cutting-plane method of the test's own: constraints at values of t, those of its worst
// cases on a grid with local refinement added until none is violated, so that it is a lower bound
// to 1e-8; published and exact values stand beside it.
#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <problems/semi_infinite_programs.hpp>

#include "core/model/forwarding_problem.hpp"
#include "core/robust.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;
using testing::SemiInfinite;
using testing::SemiInfiniteRows;

class SemiInfinitePrograms : public ::testing::TestWithParam<SemiInfinite> {};

TEST_P(SemiInfinitePrograms, AreSolved) {
  const SemiInfinite& p = GetParam();
  const std::vector<double> start = start_of(p);
  AutodiffProblem problem(model_of(p), start);
  SolverOptions options;
  options.minmax_worst_case_starts = 20;
  const RobustResult answer = solve_robust(problem, options);
  const Result& result = answer.result;
  std::printf("%-24s f = %.9f, %zu worst cases, %d solves, %d maximizations, violation %.1e\n",
              p.name.c_str(), result.objective, answer.worst_cases.size(), answer.solves,
              answer.maximizations, answer.largest_violation);
  ASSERT_TRUE(is_success(result.status)) << result.message;
  ASSERT_EQ(result.v.size(), start.size());
  if (!p.weakly_active) {
    EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax) << result.message;
  }
  for (const CertificateReason& reason : result.certificate.reasons) {
    EXPECT_NE(reason.kind, CertificateReason::Kind::VanishingGradient) << reason.text;
  }
  EXPECT_LE(answer.largest_violation, 1e-6);
  const double size = std::max(1.0, std::abs(result.objective));
  if (!std::isnan(p.optimum)) {
    EXPECT_NEAR(result.objective, p.optimum, p.tolerance * size);
  }
  EXPECT_NEAR(result.objective, cutting_plane_bound(p, result.v), 1e-6 * size);

  std::mt19937_64 random(1);
  double worst = -kNoBound;
  SemiInfiniteRows rows(p);
  std::vector<double> t(p.lower.size());
  for (int k = 0; k < 10000; ++k) {
    for (std::size_t i = 0; i < t.size(); ++i) {
      t[i] = std::uniform_real_distribution<double>(p.lower[i], p.upper[i])(random);
    }
    worst = std::max(worst, std::ranges::max(rows.at(result.v, t)));
  }
  for (std::size_t row = 0; row < p.rows.size(); ++row) {
    worst = std::max(worst, rows.largest(result.v, row).first);
  }
  EXPECT_LE(worst, 1e-6);
  for (const RobustWorstCase& found : answer.worst_cases) {
    // Fixed worst cases may lie beside the maximum that they stand for.
    EXPECT_LE(found.multiplier > 1e-4 ? std::abs(found.value) : 0.0, p.weakly_active ? 1e-5 : 1e-6)
        << "an active worst case";
  }
}

TEST(SemiInfinite, ByDefaultNoneIsCertifiedThatIsViolated) {
  int solved = 0, certified = 0, programs = 0;
  for (const SemiInfinite& p : testing::semi_infinite_programs()) {
    SCOPED_TRACE(p.name);
    AutodiffProblem problem(model_of(p), start_of(p));
    const Result result = solve_robust(problem, SolverOptions{}).result;
    const bool claimed = result.certificate.kind == PointKind::LocalMinmax;
    ++programs;
    solved += is_success(result.status) ? 1 : 0;
    certified += claimed ? 1 : 0;
    if (!is_success(result.status)) std::printf("%s: %s\n", p.name.c_str(), result.message.c_str());
    if (!claimed) continue;
    SemiInfiniteRows rows(p);
    for (std::size_t row = 0; row < p.rows.size(); ++row) {
      EXPECT_LE(rows.largest(result.v, row).first, 1e-6);
    }
    if (std::isnan(p.optimum)) continue;
    EXPECT_NEAR(result.objective, p.optimum,
                p.tolerance * std::max(1.0, std::abs(result.objective)));
  }
  std::printf("%d programs, %d solved, %d certified\n", programs, solved, certified);
  EXPECT_EQ(solved, programs);
  EXPECT_GE(certified, 27);
}

INSTANTIATE_TEST_SUITE_P(Problems, SemiInfinitePrograms,
                         ::testing::ValuesIn(testing::semi_infinite_programs()),
                         [](const auto& problem) { return problem.param.name; });

TEST(RobustConstraints, LinearOverABallIsASecondOrderCone) {
  // (1 + y_0) x_0 + (1 + y_1) x_1 <= 1 for |y| <= 1/2: x_0 + x_1 + |x| / 2 <= 1.
  Model model;
  std::vector<Expression> x, y;
  for (int i = 0; i < 2; ++i) x.push_back(model.variable(Player::Min, "x"));
  for (int i = 0; i < 2; ++i) y.push_back(model.variable(Player::Max, "y"));
  model.objective(-x[0] - x[1]);
  model.constraint((1.0 + y[0]) * x[0] + (1.0 + y[1]) * x[1], -kNoBound, 1.0, Player::Min);
  model.constraint(square(y[0]) + square(y[1]), -kNoBound, 0.25, Player::Max);
  AutodiffProblem problem(model, {0.5, -0.2, 0.1, 0.1});
  SolverOptions options;
  options.minmax_worst_case_starts = 10;
  const RobustResult answer = solve_robust(problem, options);
  EXPECT_EQ(answer.result.certificate.kind, PointKind::LocalMinmax) << answer.result.message;
  EXPECT_NEAR(answer.result.objective, -2.0 / (2.0 + 0.5 * std::sqrt(2.0)), 1e-6);
  EXPECT_NEAR(answer.result.v[2], 0.5 / std::sqrt(2.0), 1e-5);
  EXPECT_LE(answer.largest_violation, 1e-6);
}

TEST(RobustConstraints, AWorstCaseWithoutCurvatureIsReachedAndNotCertified) {
  // x >= 1 + z / 10 - (t - 0.3 - z / 5)^4: the worst t does not depend smoothly on the data.
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression z = model.variable(Player::Min, "z");
  const Expression t = model.variable(Player::Max, "t", 0.0, 1.0);
  model.objective(x + 0.5 * square(z - 0.4));
  model.constraint(1.0 + 0.1 * z - square(square(t - 0.3 - 0.2 * z)) - x, -kNoBound, 0.0,
                   Player::Min);
  AutodiffProblem problem(model, {2.0, 0.0, 0.6});
  SolverOptions options;
  options.minmax_worst_case_starts = 10;
  const RobustResult answer = solve_robust(problem, options);
  EXPECT_TRUE(is_success(answer.result.status)) << answer.result.message;
  EXPECT_EQ(answer.result.certificate.second_order, SecondOrder::Undecided);
  EXPECT_NEAR(answer.result.v[0], 1.03, 1e-6);
  EXPECT_NEAR(answer.result.v[1], 0.3, 1e-6);
  EXPECT_LE(answer.largest_violation, 1e-6);
}

TEST(RobustCopies, SharedYGetsACopyPerConstraint) {
  // f reads y as well: (x - 3)^2 - (y - x)^2 / 10, and x + y <= 2, x - y <= 2 for y in [-1, 1].
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y", -1.0, 1.0);
  model.objective(square(x - 3.0) - 0.1 * square(y - 0.1 * x));
  model.constraint(x + y, -kNoBound, 2.0, Player::Min);
  model.constraint(x - 0.5 * y, -kNoBound, 2.0, Player::Min);
  AutodiffProblem problem(model, {0.0, 0.2});
  const RobustResult answer = solve_robust(problem, {});
  EXPECT_EQ(answer.result.certificate.kind, PointKind::LocalMinmax) << answer.result.message;
  EXPECT_NEAR(answer.result.v[0], 1.0, 1e-6);
  EXPECT_NEAR(answer.result.v[1], 0.1, 1e-5) << "f's own y";
  ASSERT_EQ(answer.worst_cases.size(), 2U);
  EXPECT_NEAR(answer.worst_cases[0].v[1], 1.0, 1e-6);
  EXPECT_NEAR(answer.worst_cases[0].multiplier, answer.result.lambda[0], 1e-12);
  EXPECT_GT(answer.worst_cases[0].multiplier, 1.0);
  EXPECT_LE(answer.solves, 4);
}

/// A state s of Max that his equation makes of w and x; f reads w, each row has copies of w and s.
Model with_states(double bound_of_the_idle_row) {
  Model model;
  const Expression x = model.variable(Player::Min, "x", -5.0, 5.0);
  const Expression w1 = model.variable(Player::Max, "w1", -1.0, 1.0);
  const Expression w2 = model.variable(Player::Max, "w2", -1.0, 1.0);
  const Expression s = model.variable(Player::Max, "s");
  model.objective(square(x - 3.0) - square(w1) - square(w2 - 0.1 * x));
  model.constraint(s - w1 - 0.3 * x * w2 - 0.1 * w1 * w2, 0.0, 0.0, Player::Max);
  model.constraint(x + s, -kNoBound, 2.0, Player::Min);
  model.constraint(square(x) + square(s) + x * s, -kNoBound, bound_of_the_idle_row, Player::Min);
  return model;
}

TEST(RobustCopies, InactiveCopiesTiedByEquationsDoNotBlurTheCertificate) {
  // x + s <= 2 at w = (1, 1): 1.3 x + 1.1 = 2.
  AutodiffProblem problem(with_states(50.0), {0.0, 0.2, 0.1, 0.2});
  SolverOptions options;
  for (const int starts : {0, 10}) {
    options.minmax_worst_case_starts = starts;
    const RobustResult answer = solve_robust(problem, options);
    EXPECT_EQ(answer.result.certificate.kind, PointKind::LocalMinmax)
        << answer.result.message << ", " << starts << " starts";
    EXPECT_NEAR(answer.result.v[0], 0.9 / 1.3, 1e-6);
    ASSERT_EQ(answer.worst_cases.size(), 2U);
    EXPECT_TRUE(answer.worst_cases[0].active);
    EXPECT_FALSE(answer.worst_cases[1].active);
    const std::vector<double>& worst = answer.worst_cases[0].v;
    EXPECT_NEAR(worst[1], 1.0, 1e-5);
    EXPECT_NEAR(worst[2], 1.0, 1e-5);
    EXPECT_NEAR(worst[3], 1.1 + 0.3 * worst[0], 1e-6);
    // Without starts no y is looked at: the first solve is certified.
    EXPECT_EQ(std::isnan(answer.largest_violation), starts == 0);
    if (starts > 0) {
      EXPECT_LE(answer.largest_violation, 1e-6);
    }
  }
}

TEST(RobustCopies, ARowThatIsInactiveAtItsOwnYOnlyCounts) {
  // With the bound 3 the second row is violated at the x above: x^2 + s^2 + x s with s up to 1.1 +
  // 0.3 x.
  AutodiffProblem problem(with_states(3.0), {0.0, 0.2, 0.1, 0.2});
  SolverOptions options;
  options.minmax_worst_case_starts = 10;
  const RobustResult answer = solve_robust(problem, options);
  EXPECT_EQ(answer.result.certificate.kind, PointKind::LocalMinmax) << answer.result.message;
  const double x = answer.result.v[0], s = 1.1 + 0.3 * x;
  EXPECT_NEAR(x * x + s * s + x * s, 3.0, 1e-6);
  EXPECT_LT(x, 0.9 / 1.3);
}

TEST(RobustCopies, ARowThatIsKnownToBeViolatedIsNoSuccess) {
  for (const double bound : {1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0}) {
    for (const double w1 : {-0.9, 0.2, 0.9}) {
      AutodiffProblem problem(with_states(bound), {0.0, w1, 0.1, 0.2});
      const RobustResult answer = solve_robust(problem, SolverOptions{});
      if (!is_success(answer.result.status)) continue;
      EXPECT_FALSE(answer.largest_violation > 1e-6)
          << answer.largest_violation << ", bound " << bound << ", start " << w1;
    }
  }
}

TEST(RobustCopies, EpigraphMeansTheSameAtEveryDoor) {
  Model model;
  const Expression x = model.variable(Player::Min, "x", -1.0, 1.0);
  const Expression y = model.variable(Player::Max, "y", -2.0, 2.0);
  model.objective(-square(square(y) - 1.0) + 4.0 * x * y + square(x));
  AutodiffProblem problem(model, {0.3, 0.8});
  for (const bool at_kinks : {false, true}) {
    SolverOptions options;
    (at_kinks ? options.minmax_epigraph_at_kinks : options.minmax_epigraph) = true;
    options.minmax_worst_case_starts = 10;
    const RobustResult robust = solve_robust(problem, options);
    ASSERT_EQ(robust.result.certificate.kind, PointKind::LocalMinmax);
    EXPECT_NEAR(robust.result.v[0], 0.0, 1e-6);
    const Result solved = solve(problem, options);
    EXPECT_EQ(solved.v, robust.result.v);
    EXPECT_EQ(solved.message, robust.result.message);
    EXPECT_EQ(RepeatedSolver().solve(problem, options).v, robust.result.v);
    options.minmax_starts = 4;
    const MultistartResult many = multistart(problem, options);
    EXPECT_EQ(many.best.certificate.kind, PointKind::LocalMinmax);
    EXPECT_NEAR(many.best.v[0], 0.0, 1e-6);
    EXPECT_EQ(many.points.size(), 1U) << "the same x with another y";
    EXPECT_EQ(many.points[0].found, 4);
    const auto make = [&] {
      return std::make_unique<AutodiffProblem>(model, std::vector<double>{0.3, 0.8});
    };
    EXPECT_EQ(multistart(make, 2, options).best.v, many.best.v);
  }
}

TEST(RobustCopies, EpigraphOfAMirroredGameIsRefused) {
  Model model;
  const Expression x = model.variable(Player::Min, "x", -1.0, 1.0);
  const Expression y = model.variable(Player::Max, "y", -2.0, 2.0);
  model.objective(square(y) - x * y - square(x));
  AutodiffProblem problem(model, {0.3, 0.8});
  SolverOptions options;
  options.obj_scaling_factor = -1.0;
  ASSERT_EQ(solve(problem, options).status, Status::Solved);
  for (bool* option : {&options.minmax_epigraph, &options.minmax_epigraph_at_kinks}) {
    *option = true;
    for (const Result& result : {solve(problem, options), solve_robust(problem, options).result,
                                 multistart(problem, options).best}) {
      EXPECT_EQ(result.status, Status::InvalidOption);
      EXPECT_NE(result.message.find("negative factor"), std::string::npos) << result.message;
    }
    *option = false;
  }
}

TEST(RobustCopies, EpigraphOfAMinimizationIsTheMinimization) {
  Model model;
  const Expression x = model.variable(Player::Min, "x", -1.0, 1.0);
  model.objective(square(x - 0.3));
  AutodiffProblem problem(model, {0.9});
  SolverOptions options;
  const Result plain = solve(problem, options);
  options.minmax_epigraph = options.minmax_epigraph_at_kinks = true;
  EXPECT_EQ(solve(problem, options).v, plain.v);
  EXPECT_EQ(solve_robust(problem, options).result.iterations, plain.iterations);
}

TEST(RobustCopies, EpigraphSolvesTheKink) {
  // phi(x) = max_y -(y^2 - 1)^2 + x y + .1 x^2 + .3 x^3 = |x| + ...: least at its kink 0.
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y", -2.0, 2.0);
  model.objective(-square(square(y) - 1.0) + x * y + 0.1 * square(x) + 0.3 * x * square(x));
  AutodiffProblem problem(model, {0.3, 0.8});
  SolverOptions options;
  options.minmax_epigraph = true;
  options.minmax_worst_case_starts = 10;
  const RobustResult answer = solve_robust(problem, options);
  EXPECT_EQ(answer.result.certificate.kind, PointKind::LocalMinmax) << answer.result.message;
  ASSERT_EQ(answer.result.v.size(), 2U);
  EXPECT_NEAR(answer.result.v[0], 0.0, 1e-6);
  EXPECT_NEAR(answer.result.objective, 0.0, 1e-6);
  ASSERT_EQ(answer.worst_cases.size(), 2U);
  EXPECT_NEAR(answer.worst_cases[0].value, 0.0, 1e-6);
  EXPECT_NEAR(answer.worst_cases[0].multiplier + answer.worst_cases[1].multiplier, 1.0, 1e-6);
  EXPECT_LT(answer.worst_cases[0].v[1] * answer.worst_cases[1].v[1], 0.0);
  EXPECT_EQ(answer.branches, 2);
}

TEST(RobustCopies, SearchThatMeetsAKinkGoesOnOverItsBranches) {
  Model model;
  const Expression x = model.variable(Player::Min, "x", -1.0, 1.0);
  const Expression y = model.variable(Player::Max, "y", -2.0, 2.0);
  model.objective(-square(square(y) - 1.0) + 4.0 * x * y + square(x));  // 4 |x| + ..., one y each
  AutodiffProblem problem(model, {0.3, 0.8});
  SolverOptions options;
  EXPECT_EQ(solve(problem, options).status, Status::NoLocalMinmaxFound);
  options.minmax_epigraph_at_kinks = true;
  const RobustResult answer = solve_robust(problem, options);
  EXPECT_EQ(answer.result.certificate.kind, PointKind::LocalMinmax) << answer.result.message;
  EXPECT_NEAR(answer.result.v[0], 0.0, 1e-6);
  EXPECT_EQ(answer.branches, 2);
  EXPECT_EQ(answer.result.message, "x minimizes the largest of 2 local worst cases");
  EXPECT_NEAR(answer.largest_violation, 0.0, 1e-6);
}

TEST(RobustCopies, EpigraphAtKinksLeavesOtherSearchesAlone) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y");
  model.objective(square(x - 1.0) + x * y - square(y));
  AutodiffProblem problem(model, {0.3, 0.8});
  SolverOptions options;
  const Result plain = solve(problem, options);
  options.minmax_epigraph_at_kinks = true;
  const RobustResult answer = solve_robust(problem, options);
  EXPECT_EQ(answer.result.v, plain.v);
  EXPECT_EQ(answer.result.iterations, plain.iterations);
  EXPECT_EQ(answer.branches, 0);
  EXPECT_TRUE(answer.worst_cases.empty());
}

TEST(RobustConstraints, ManyStartsFindTheBetterOfTwoDesigns) {
  // The double well (x^2 - 1)^2 + 0.3 x, with x <= 1.5 + 0.2 y for every y in [-1, 1]: -1 is
  // better.
  Model model;
  const Expression x = model.variable(Player::Min, "x", -3.0, 3.0);
  const Expression y = model.variable(Player::Max, "y", -1.0, 1.0);
  model.objective(square(square(x) - 1.0) + 0.3 * x);
  model.constraint(x - 0.2 * y, -kNoBound, 1.5, Player::Min);
  AutodiffProblem problem(model, {1.2, 0.0});
  SolverOptions options;
  options.minmax_worst_case_starts = 3;
  const RobustResult one = solve_robust(problem, options);
  EXPECT_GT(one.result.v[0], 0.0);
  EXPECT_EQ(one.starts, 1);
  options.minmax_starts = 8;
  const RobustResult many = solve_robust(problem, options);
  EXPECT_EQ(many.result.certificate.kind, PointKind::LocalMinmax) << many.result.message;
  EXPECT_LT(many.result.v[0], -1.0);
  EXPECT_EQ(many.starts, 8);
  EXPECT_GT(many.best_start, 0);
  ASSERT_EQ(many.points.size(), 2U);
  EXPECT_EQ(many.points[0].result.v, many.result.v);
  EXPECT_NEAR(many.points[1].result.v[0], one.result.v[0], 1e-6);
  EXPECT_EQ(many.points[0].found + many.points[1].found, 8);
  EXPECT_GE(many.solves, 8);
  EXPECT_GT(many.result.iterations, one.result.iterations);
}

TEST(RobustConstraints, TimeLimitHoldsForAllSolvesTogether) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y", -1.0, 1.0);
  model.objective(square(x - 3.0));
  model.constraint(x + y, -kNoBound, 2.0, Player::Min);
  AutodiffProblem problem(model, {0.0, 0.2});
  SolverOptions options;
  options.minmax_starts = 100000000;
  options.minmax_worst_case_starts = 5;
  options.max_cpu_time = 0.2;
  const RobustResult answer = solve_robust(problem, options);
  EXPECT_LT(answer.starts, 100000000);
  EXPECT_NEAR(answer.result.v[0], 1.0, 1e-6) << "the best start that ended in time";
}

TEST(RobustConstraints, ScenariosMeetMaxConstraints) {
  // y in the disc |y| <= 1 although its box is larger: starts of maximizations outside are no
  // scenarios. max_y of 4 y_0 y_1 - x is 2 - x; the first y maximizes only -x, and its branch
  // leaves x unbounded.
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression a = model.variable(Player::Max, "a", -3.0, 3.0);
  const Expression b = model.variable(Player::Max, "b", -3.0, 3.0);
  model.objective(x + 0.1 * square(x));
  model.constraint(4.0 * a * b - x, -kNoBound, 0.0, Player::Min);
  model.constraint(square(a) + square(b), -kNoBound, 1.0, Player::Max);
  AutodiffProblem problem(model, {0.0, 0.5, -0.5});
  SolverOptions options;
  options.minmax_worst_case_starts = 10;
  const RobustResult answer = solve_robust(problem, options);
  EXPECT_TRUE(is_success(answer.result.status)) << answer.result.message;
  EXPECT_NEAR(answer.result.v[0], 2.0, 1e-6);
}

/// Writes its start's multipliers whether they are wanted or not, as models of Ipopt may.
class CarelessStart final : public ForwardingProblem {
 public:
  using ForwardingProblem::ForwardingProblem;
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    ++asked;
    const ProblemStructure& s = structure();
    complete = complete && start.lambda.size() == s.constraint_players.size();
    for (const std::span<double> z : {start.z_lower, start.z_upper}) {
      complete = complete && z.size() == s.variable_players.size();
    }
    for (const std::span<double> all : {start.lambda, start.z_lower, start.z_upper}) {
      std::ranges::fill(all, 1.0);
    }
    return ForwardingProblem::starting_point(start);
  }
  int asked = 0;
  bool complete = true;  ///< whether there was room for all multipliers, every time
};

TEST(RobustCopies, AStartHasRoomForMultipliersThatAreNotWanted) {
  const SemiInfinite program = testing::semi_infinite_programs().front();
  AutodiffProblem problem(model_of(program), start_of(program));
  for (const int starts : {1, 2}) {
    for (const bool epigraph : {false, true}) {
      SCOPED_TRACE(std::to_string(starts) + (epigraph ? " starts, epigraph" : " starts"));
      CarelessStart careless(problem);
      SolverOptions options;
      options.minmax_starts = starts;
      options.minmax_epigraph = epigraph;
      options.minmax_worst_case_starts = 2;
      static_cast<void>(solve_robust(careless, options));
      EXPECT_GT(careless.asked, 0);
      EXPECT_TRUE(careless.complete);
    }
  }
}

TEST(RobustCopies, BrokenModelsAreNamed) {
  class Broken final : public AutodiffProblem {
   public:
    using AutodiffProblem::AutodiffProblem;
    [[nodiscard]] const ProblemStructure& structure() const override { return broken; }
    ProblemStructure broken;
  };
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y");
  model.objective(square(x) - square(y));
  model.constraint(x + y, -kNoBound, 1.0, Player::Min);
  Broken problem(model, {0.0, 0.0});
  problem.broken = problem.AutodiffProblem::structure();
  problem.broken.jacobian.push_back({7, 0});
  EXPECT_FALSE(has_robust_constraints(problem.broken));
  const RobustResult answer = solve_robust(problem, {});
  EXPECT_EQ(answer.result.status, Status::InvalidProblem);
}

}  // namespace
}  // namespace ipminmax
