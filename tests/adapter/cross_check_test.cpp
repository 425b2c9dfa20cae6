// The public comparison with Ipopt: minimizations, maximizations, and the maximizer's part of
// minmax answers.
#include <cmath>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>

#include "adapter/ipopt/cross_check.hpp"
#include "adapter/model.hpp"
#include "core/solver.hpp"
#include "problems/small_problems.hpp"
#include "regression/hock_schittkowski.hpp"
#include "regression/not_minima.hpp"

namespace ipminmax {
namespace {

using Ipopt::SmartPtr;
using testing::AutodiffProblem;
using testing::Expression;
using testing::kNoBound;
using Verdict = CrossCheckVerdict;
constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

AutodiffProblem minimization(const std::string& name) {
  const testing::MinimizationProblem& known = testing::hock_schittkowski(name);
  return AutodiffProblem(known.model, known.start);
}

/// max over y of -(y0 - 2)^2 - y1^2 with y0 + y1 <= 1, y1 >= 0: y = (1, 0), lambda of the row
/// grad f = (2, 0): 2 + lambda = 0.
testing::Model maximization_model() {
  testing::Model model;
  const Expression y0 = model.variable(kMax, "y0");
  const Expression y1 = model.variable(kMax, "y1", 0.0, 5.0);
  model.objective(-square(y0 - 2.0) - square(y1));
  model.constraint(y0 + y1, -kNoBound, 1.0);
  return model;
}

TEST(CrossCheckMinimization, AgreesInEverything) {
  for (const char* name : {"hs071", "hs035", "hs001", "hs043"}) {
    AutodiffProblem problem = minimization(name);
    const CrossCheck check = cross_check_with_ipopt(problem);
    EXPECT_EQ(check.verdict, Verdict::SameSolution) << check.report();
    EXPECT_TRUE(check.ipopt.solved());
    EXPECT_EQ(check.ours.status, Status::Solved);
    EXPECT_EQ(check.ipopt_certificate.second_order, SecondOrder::Satisfied) << name;
    EXPECT_LT(std::abs(check.difference.objective), 1e-7) << check.report();
    EXPECT_LT(check.difference.point, 1e-5) << check.report();
    EXPECT_LT(check.difference.lambda, 1e-4) << check.report();
    EXPECT_LT(check.difference.z_lower, 1e-4) << check.report();
    EXPECT_LT(check.difference.z_upper, 1e-4) << check.report();
    EXPECT_GT(check.ipopt.iterations, 3);
    EXPECT_GE(check.ipopt.counts.objective, check.ipopt.iterations);
    EXPECT_GE(check.ipopt.counts.factorizations_full, check.ipopt.iterations);
    EXPECT_EQ(check.min_variables, check.variables);
  }
}

TEST(CrossCheckMinimization, TheReportShowsBothAnswers) {
  AutodiffProblem problem = minimization("hs071");
  const CrossCheck check = cross_check_with_ipopt(problem);
  const std::string report = check.report();
  for (const char* part : {"minimization, 4 variables (4 Min), 2 constraints", "Solve_Succeeded",
                           "solved", "1.7014017", "Iterations", "Factorizations",
                           "Verdict: both solvers find the same solution."}) {
    EXPECT_TRUE(contains(report, part)) << part << " in\n" << report;
  }
  for (const char c : report) EXPECT_TRUE(c == '\n' || (c >= ' ' && c <= '~'));
}

TEST(CrossCheckMinimization, OptionsReachBothSolvers) {
  AutodiffProblem problem = minimization("hs071");
  CrossCheckSettings settings;
  settings.options = {
      {"max_iter", "2"}, {"minmax_globalization", "filter"}, {"linear_solver", "lapack"}};
  const CrossCheck both = cross_check_with_ipopt(problem, settings);
  EXPECT_EQ(both.verdict, Verdict::NeitherSolved) << both.report();
  EXPECT_EQ(both.ours.status, Status::MaxIterations);
  EXPECT_EQ(both.ipopt.status, Ipopt::Maximum_Iterations_Exceeded);
  EXPECT_EQ(both.ipopt.iterations, 2);

  settings.options.clear();
  settings.ipopt_options = {{"max_iter", "2"}};
  const CrossCheck one = cross_check_with_ipopt(problem, settings);
  EXPECT_EQ(one.verdict, Verdict::OnlyOursSolved) << one.report();

  settings.options = {{"max_iter", "2"}};
  settings.ipopt_options = {{"mu_strategy", "adaptive"}};
  EXPECT_EQ(cross_check_with_ipopt(problem, settings).verdict, Verdict::NeitherSolved);
}

TEST(CrossCheckMinimization, BadOptionsAreNamed) {
  AutodiffProblem problem = minimization("hs071");
  const auto message = [&](CrossCheckSettings settings) {
    const CrossCheck check = cross_check_with_ipopt(problem, settings);
    EXPECT_EQ(check.verdict, Verdict::NotCompared);
    EXPECT_EQ(check.ours.status, Status::InvalidOption);
    EXPECT_TRUE(contains(check.report(), check.message));
    return check.message;
  };
  EXPECT_TRUE(contains(message({.options = {{"mu_int", "1"}}, .ipopt_options = {}}), "mu_int"));
  EXPECT_TRUE(contains(message({.options = {{"tol", "-1"}}, .ipopt_options = {}}), "tol = -1"));
  EXPECT_TRUE(contains(message({.options = {{"print_level", "5"}}, .ipopt_options = {}}),
                       "\"print_level\" has no effect"));
  EXPECT_TRUE(contains(message({.options = {}, .ipopt_options = {{"mu_int", "1"}}}), "Ipopt"));
  EXPECT_THROW(static_cast<void>(check_inner_maximum(
                   problem, {1, 2, 3, 4}, {.options = {{"mu_int", "1"}}, .ipopt_options = {}})),
               std::invalid_argument);
}

TEST(CrossCheckMinimization, IpoptsFalseMinimaAreFound) {
  int second_order = 0;
  for (const testing::NotMinimum& known : testing::not_minima()) {
    AutodiffProblem problem(known.model, known.start);
    const CrossCheck check = cross_check_with_ipopt(problem);
    EXPECT_EQ(check.verdict == Verdict::IpoptRefuted, known.second_order) << known.name << '\n'
                                                                          << check.report();
    EXPECT_EQ(contains(check.report(), "refutes"), known.second_order);
    second_order += known.second_order;
  }
  EXPECT_GT(second_order, 5);
}

TEST(CrossCheckMinimization, NoTrueMinimumIsRefuted) {
  int same = 0, satisfied = 0;
  for (const testing::MinimizationProblem& known : testing::hock_schittkowski()) {
    AutodiffProblem problem(known.model, known.start);
    const CrossCheck check = cross_check_with_ipopt(problem);
    EXPECT_NE(check.verdict, Verdict::NotCompared) << known.name << check.message;
    EXPECT_NE(check.verdict, Verdict::IpoptRefuted) << known.name << '\n' << check.report();
    if (check.verdict != Verdict::SameSolution || check.ours.status != Status::Solved) continue;
    ++same;
    satisfied += check.ipopt_certificate.second_order == SecondOrder::Satisfied;
  }
  EXPECT_GT(same, 100);
  EXPECT_GE(satisfied, 0.94 * same);
}

TEST(CrossCheckMaximization, AgreesInMultipliersToo) {
  AutodiffProblem problem(maximization_model(), {0.0, 1.0});
  const CrossCheck check = cross_check_with_ipopt(problem);
  EXPECT_EQ(check.verdict, Verdict::SameSolution) << check.report();
  EXPECT_EQ(check.min_variables, 0);
  EXPECT_TRUE(contains(check.report(), "maximization"));
  EXPECT_NEAR(check.ipopt.objective, -1.0, 1e-6);
  ASSERT_EQ(check.ipopt.lambda.size(), 1U);
  EXPECT_NEAR(check.ipopt.lambda[0], -2.0, 1e-5);
  EXPECT_NEAR(check.ipopt.z_lower[1], -2.0, 1e-5) << "bounds of a Max variable: <= 0";
  EXPECT_LT(check.difference.lambda, 1e-5);
  EXPECT_LT(check.difference.z_lower, 1e-5);
}

TEST(CrossCheckMaximization, AFalseMaximumIsFound) {
  testing::Model model;
  const Expression y0 = model.variable(kMax, "y0", -1.0, 1.0);
  const Expression y1 = model.variable(kMax, "y1", -1.0, 1.0);
  model.objective(square(y0) - square(y1));
  AutodiffProblem problem(model, {0.0, 0.5});
  EXPECT_EQ(cross_check_with_ipopt(problem).verdict, Verdict::IpoptRefuted);
}

// --- Minmax --------------------------------------------------------------------------------------

TEST(CrossCheckMinmax, CertifiedAnswersAreConfirmed) {
  int certified = 0;
  for (const testing::SmallProblem& known : testing::small_problems()) {
    for (const auto& start : known.starts) {
      AutodiffProblem problem(known.model, start);
      const CrossCheck check = cross_check_with_ipopt(problem);
      if (check.ours.status != Status::Solved) continue;
      ++certified;
      if (check.min_variables == check.variables) {
        EXPECT_EQ(check.verdict, Verdict::SameSolution) << known.name << '\n' << check.report();
      } else {
        EXPECT_EQ(check.verdict, Verdict::MaximumConfirmed) << known.name << '\n' << check.report();
      }
    }
  }
  EXPECT_GT(certified, 30);
}

TEST(CrossCheckMinmax, AnAnswerAtAWrongInnerPointIsImprovable) {
  // f = x^2 + x y - y^2 + y^4 / 4: at x = 0 the maximum near 0 is y = 0; y = 1 is a minimum in y...
  testing::Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y", -3.0, 3.0);
  model.objective(square(x) + x * y - square(y) + 0.25 * pow(y, 4.0));
  AutodiffProblem problem(model, {0.3, 0.2});

  const InnerMaximumCheck right = check_inner_maximum(problem, {0.0, 0.0});
  EXPECT_FALSE(right.improved_near);
  EXPECT_EQ(right.near_solved, right.near_runs);
  EXPECT_EQ(right.near_runs, 4);
  EXPECT_TRUE(right.v_near.empty());

  // ... moved off the maximum, and at the minimum y = sqrt 2, where the gradient vanishes too.
  for (const double wrong : {0.3, -0.05, std::sqrt(2.0)}) {
    const InnerMaximumCheck check = check_inner_maximum(problem, {0.0, wrong});
    EXPECT_TRUE(check.improved_near) << wrong;
    EXPECT_GT(check.best_near, check.objective) << wrong;
    ASSERT_EQ(check.v_near.size(), 2U);
    EXPECT_EQ(check.v_near[0], 0.0) << "x is held";
    EXPECT_LE(std::abs(check.v_near[1] - wrong), 1e-2 * (1.0 + std::abs(wrong)) + 1e-12);
  }

  // A better maximum far away does not refute a local one, and is told.
  CrossCheckSettings settings;
  settings.far_starts = 20;
  const InnerMaximumCheck far = check_inner_maximum(problem, {0.0, 1.999}, settings);
  EXPECT_TRUE(far.improved_far);
  EXPECT_NEAR(far.best_far, 81.0 / 4.0 - 9.0, 1e-4) << "y at a bound";
  EXPECT_THROW(static_cast<void>(check_inner_maximum(problem, {0.0})), std::invalid_argument);
}

TEST(CrossCheckMinmax, AWrongInnerPointIsImprovableInOtherUnits) {
  for (const double unit : {1e-5, 1.0, 1e5}) {
    for (const double of_f : {1e-8, 1.0, 1e6}) {
      testing::Model model;
      const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y", -unit, unit);
      const Expression s = (1.0 / unit) * y;
      model.objective(of_f * (square(x) + x * s - square(s)));
      model.constraint(of_f * square(s), -1e20, 0.5 * of_f);
      AutodiffProblem problem(model, {0.3, 0.2 * unit});
      EXPECT_TRUE(check_inner_maximum(problem, {0.0, 0.3 * unit}).improved_near) << unit << of_f;
      EXPECT_FALSE(check_inner_maximum(problem, {0.0, 0.0}).improved_near) << unit << of_f;
      EXPECT_FALSE(check_inner_maximum(problem, {2.0, std::sqrt(0.5) * unit}).improved_near)
          << unit << of_f;
    }
  }
}

TEST(CrossCheckMinmax, FirstOrderPointsWithAWrongInnerCurvatureAreRefuted) {
  int refuted = 0;
  for (const testing::SmallProblem& known : testing::small_problems()) {
    for (const auto& point : known.not_minmax) {
      AutodiffProblem problem(known.model, point);
      // The dense reference knows whose curvature is wrong; here the smallest test of it: y alone.
      const InnerMaximumCheck check = check_inner_maximum(problem, point);
      refuted += check.improved_near;
    }
    for (const testing::KnownSolution& solution : known.solutions) {
      if (known.expectation == testing::Expectation::Degenerate) continue;
      AutodiffProblem problem(known.model, solution.v);
      EXPECT_FALSE(check_inner_maximum(problem, solution.v).improved_near) << known.name;
    }
  }
  EXPECT_GT(refuted, 3);
}

TEST(CrossCheckMinmax, TakesAnIpoptModelAndLeavesItsStateAlone) {
  const SmartPtr<Model> model = new Model;
  const SmartPtr<Ipopt::TNLP> game = new SplitTNLP(SmartPtr<Ipopt::TNLP>(model), {1});
  const CrossCheck check = cross_check_with_ipopt(game);
  EXPECT_EQ(check.verdict, Verdict::MaximumConfirmed) << check.report();
  EXPECT_NEAR(check.ours.v[0], 4.0 / 21.0, 1e-7);
  EXPECT_TRUE(contains(check.report(), "minmax problem, 3 variables (2 Min), 2 constraints"));
  EXPECT_TRUE(contains(check.report(), "cannot be checked with Ipopt"));
  EXPECT_EQ(model->final.count, 0);
  EXPECT_EQ(model->count("finalize_metadata"), 0);
  EXPECT_TRUE(model->iterations.empty());

  const SmartPtr<Model> plain =
      new Model;  // unbounded below as a minimization: -y^2 with y bounded
  const CrossCheck minimization = cross_check_with_ipopt(SmartPtr<Ipopt::TNLP>(plain));
  EXPECT_EQ(minimization.min_variables, 3);
  EXPECT_NE(minimization.verdict, Verdict::NotCompared) << minimization.report();
}

TEST(CrossCheckMinmax, WithoutAFreeMaxVariableNothingIsRun) {
  testing::Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y", 2.0, 2.0);
  model.objective(square(x - y));
  AutodiffProblem problem(model, {0.0, 2.0});
  const CrossCheck check = cross_check_with_ipopt(problem);
  EXPECT_EQ(check.verdict, Verdict::MaximumConfirmed) << check.report();
  EXPECT_EQ(check.inner.near_runs, 0);
}

TEST(CrossCheckMinmax, RowsOfFixedMaxVariablesAreNotHeldAgainstY) {
  testing::Model model;
  const Expression x = model.variable(kMin, "x", -5.0, 5.0);
  const Expression y = model.variable(kMax, "y", -5.0, 5.0);
  const Expression z = model.variable(kMax, "z", 0.5, 0.5);
  model.objective(square(x) + x * y - square(y) - x);
  for (const double times : {1.0, 2.0, 3.0, 4.0, 5.0})
    model.constraint(times * z, 0.5 * times, 0.5 * times);
  AutodiffProblem problem(model, {0.1, 0.3, 0.5});
  const CrossCheck check = cross_check_with_ipopt(problem);
  EXPECT_EQ(check.verdict, Verdict::MaximumConfirmed) << check.report();
  EXPECT_EQ(check.inner.near_solved, check.inner.near_runs) << check.report();
}

TEST(CrossCheckInput, InvalidModelsAreNotCompared) {
  EXPECT_EQ(cross_check_with_ipopt(SmartPtr<Ipopt::TNLP>()).message, "the model is null");
  const SmartPtr<Model> model = new Model;
  model->on_call = [](const std::string& name) { return name != "get_bounds_info"; };
  const CrossCheck check = cross_check_with_ipopt(SmartPtr<Ipopt::TNLP>(model));
  EXPECT_EQ(check.verdict, Verdict::NotCompared);
  EXPECT_EQ(check.ours.status, Status::InvalidProblem);
  EXPECT_EQ(check.message, "get_bounds_info returned false");

  const SmartPtr<Model> split = new Model;
  const SmartPtr<Ipopt::TNLP> game = new SplitTNLP(SmartPtr<Ipopt::TNLP>(split), {7});
  EXPECT_TRUE(contains(cross_check_with_ipopt(game).message, "7"));
}

TEST(CrossCheckInput, ExceptionsOfTheModelPassThrough) {
  for (const int good_calls : {0, 12}) {  // in this solver's solve, in Ipopt's
    const SmartPtr<Model> model = new Model;
    int calls = 0;
    model->on_call = [&](const std::string& name) {
      if (name == "eval_g" && calls++ >= good_calls) throw std::domain_error("from the model");
      return true;
    };
    EXPECT_THROW(static_cast<void>(cross_check_with_ipopt(SmartPtr<Ipopt::TNLP>(model))),
                 std::domain_error);
  }
}

TEST(CrossCheckThreads, SolvesInOtherThreadsWait) {
  std::vector<std::thread> threads;
  std::vector<Verdict> verdicts(4, Verdict::NotCompared);
  for (Verdict& verdict : verdicts) {
    threads.emplace_back([&verdict] {
      for (int k = 0; k < 5; ++k) {
        AutodiffProblem problem = minimization("hs071");
        CrossCheckSettings settings;
        settings.options = {{"linear_solver", "mumps"}};
        verdict = cross_check_with_ipopt(problem, settings).verdict;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const Verdict verdict : verdicts) EXPECT_EQ(verdict, Verdict::SameSolution);
}

TEST(CrossCheckVerdicts, HaveNames) {
  EXPECT_EQ(name_of(Verdict::IpoptRefuted), "Ipopt refuted");
  EXPECT_EQ(name_of(static_cast<Verdict>(99)), "unknown");
}

}  // namespace
}  // namespace ipminmax
