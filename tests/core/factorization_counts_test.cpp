// Factorizations by cause, and the limit on their number.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <vector>

#include <problems/random_multimodal.hpp>
#include <problems/small_problems.hpp>
#include <support/autodiff_problem.hpp>
#include <support/judge_truth.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

Index sum(const Counts& counts, Index FactorizationCounts::*of) {
  Index total = 0;
  for (std::size_t k = 0; k < kFactorizationCauses; ++k) {
    if (static_cast<FactorizationCause>(k) != FactorizationCause::Restoration) {
      total += counts.by_cause[k].*of;
    }
  }
  return total;
}

template <class Visit>
void for_each_start(Visit&& visit) {
  for (const SmallProblem& known : small_problems()) {
    AutodiffProblem problem(known.model);
    for (const std::vector<double>& start : known.starts) {
      problem.set_start(start);
      visit(known, problem);
    }
  }
}

TEST(FactorizationCauses, AddUpToAllFactorizations) {
  std::array<Index, kFactorizationCauses> seen{};
  const auto add = [&](const Counts& counts) {
    for (std::size_t k = 0; k < seen.size(); ++k) {
      seen[k] += counts.by_cause[k].full + counts.by_cause[k].inner;
    }
  };
  for (const auto globalization : {Globalization::Filter, Globalization::None}) {
    for (const auto schur : {SchurComplementUse::Auto, SchurComplementUse::Yes}) {
      SolverOptions options;
      options.max_iter = 100;
      options.minmax_globalization = globalization;
      options.minmax_schur_complement = schur;
      options.mu_strategy =
          schur == SchurComplementUse::Yes ? BarrierStrategy::Adaptive : BarrierStrategy::Monotone;
      for_each_start([&](const SmallProblem& known, AutodiffProblem& problem) {
        const Result r = solve(problem, options);
        EXPECT_EQ(sum(r.counts, &FactorizationCounts::full), r.counts.factorizations_full)
            << known.name;
        EXPECT_EQ(sum(r.counts, &FactorizationCounts::inner), r.counts.factorizations_inner)
            << known.name;
        add(r.counts);
        const auto& test = r.counts.factorizations_for(FactorizationCause::Certificate);
        if (r.status == Status::Solved) {
          EXPECT_GT(test.full, 0);
        }
      });
    }
  }
  // From a saddle of x.
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y");
  model.objective(square(square(x) - 1.0) - square(y));
  AutodiffProblem saddle(model, {0.0, 0.0});
  const Result left = solve(saddle, SolverOptions{});
  EXPECT_EQ(left.status, Status::Solved);
  EXPECT_GT(left.counts.factorizations_for(FactorizationCause::Curvature).inner, 0);
  add(left.counts);
  const auto many = random_multimodal(MultimodalKind::Constrained, 2, 20, 38);  // restorations
  for (const std::vector<double>& start : many.starts) {
    AutodiffProblem problem(many.model, start);
    add(solve(problem, SolverOptions{}).counts);
  }
  for (std::size_t k = 0; k < seen.size(); ++k) {
    EXPECT_GT(seen[k], 0) << name_of(static_cast<FactorizationCause>(k));
  }
}

TEST(FactorizationLimit, IsNeverExceededAndChangesNothingWhereItIsEnough) {
  Index stopped = 0, solved = 0;
  for_each_start([&](const SmallProblem& known, AutodiffProblem& problem) {
    SolverOptions options;
    options.max_iter = 100;
    std::vector<std::vector<double>> way;
    const Result free = solve(problem, options, [&](const IterationInfo& info) {
      if (!info.restoration) way.emplace_back(info.v.begin(), info.v.end());
      return true;
    });
    const Index restoration = free.counts.factorizations_for(FactorizationCause::Restoration).full;
    for (const Index most : {1, 2, 3, 5, 8, 13, 21, 34}) {
      options.minmax_max_factorizations = most;
      std::size_t step = 0;
      const Result r = solve(problem, options, [&](const IterationInfo& info) {
        // The same way, as far as it goes; restorations and tests may end earlier.
        const bool begun_anew = std::string("wRe").find(info.step_kind) != std::string::npos;
        if (info.restoration || begun_anew || step >= way.size()) {
          step = way.size();
          return true;
        }
        EXPECT_TRUE(std::ranges::equal(info.v, way[step])) << known.name << ' ' << most;
        ++step;
        return true;
      });
      const Index used =
          r.factorizations + r.counts.factorizations_for(FactorizationCause::Restoration).full;
      EXPECT_LE(used, most) << known.name;
      EXPECT_EQ(TruthJudge(problem, options, r, false).untruths(), "") << known.name << ' ' << most;
      if (r.status == Status::MaxIterations && r.iterations < options.max_iter) {
        ++stopped;
        EXPECT_NE(r.message.find("minmax_max_factorizations"), std::string::npos) << r.message;
        EXPECT_NE(r.certificate.kind, PointKind::LocalMinmax);
      }
      if (most < free.factorizations + restoration + 2) continue;
      ++solved;
      EXPECT_EQ(r.v, free.v) << known.name << ' ' << most;
      EXPECT_EQ(r.status, free.status) << known.name;
    }
  });
  EXPECT_GT(stopped, 100);
  EXPECT_GT(solved, 50);
}

TEST(FactorizationLimit, LeavesTheBestPointSeen) {
  Index earlier = 0;
  for_each_start([&](const SmallProblem& known, AutodiffProblem& problem) {
    for (const Index most : {5, 8, 13, 21}) {
      SolverOptions options;
      options.max_iter = 100;
      options.minmax_max_factorizations = most;
      double least = std::numeric_limits<double>::infinity(), last = least;
      const Result r = solve(problem, options, [&](const IterationInfo& info) {
        last = info.error.total;
        if (info.error.primal <= options.constr_viol_tol) least = std::min(least, last);
        return true;
      });
      if (r.status != Status::MaxIterations || r.iterations >= options.max_iter) continue;
      if (r.error.primal > options.constr_viol_tol) {
        EXPECT_EQ(least, std::numeric_limits<double>::infinity()) << known.name;
        continue;
      }
      // Bounds may have moved since by rounding.
      EXPECT_LE(r.error.total, least * (1.0 + 1e-6) + 1e-12) << known.name << ' ' << most;
      earlier += r.error.total < 0.5 * last ? 1 : 0;
    }
  });
  EXPECT_GT(earlier, 5);
}

TEST(FactorizationLimit, LeavesTheBestPointSeenByAnySearch) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Index of_earlier_search = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    const MultimodalProblem many = random_multimodal(MultimodalKind::Constrained, 5, 4, seed);
    for (const std::vector<double>& start : many.starts) {
      AutodiffProblem problem(many.model, start);
      SolverOptions options;
      options.minmax_max_factorizations = 120;
      // Of all searches, and of the last one.
      double least = kInfinity, least_of_last = kInfinity;
      const Result r = solve(problem, options, [&](const IterationInfo& info) {
        if (info.restoration) return true;
        if (info.step_kind == 'w') least_of_last = kInfinity;
        const double violation = std::max(info.error.primal, options.constr_viol_tol);
        least = std::min(least, violation);
        least_of_last = std::min(least_of_last, violation);
        return true;
      });
      if (r.status != Status::MaxIterations) continue;
      EXPECT_LE(r.error.primal, least * (1.0 + 1e-6) + 1e-7) << seed;
      EXPECT_EQ(TruthJudge(problem, options, r, false).untruths(), "") << seed;
      of_earlier_search += least < 0.5 * least_of_last ? 1 : 0;
    }
  }
  EXPECT_GT(of_earlier_search, 2);
}

/// Calls for second derivatives beyond those of the iterations' points, the last one among these.
Index hessians_of_test(const Model& model, const std::vector<double>& start) {
  AutodiffProblem problem(model);
  problem.set_start(start);
  const Result r = solve(problem, {});
  EXPECT_EQ(r.status, Status::Solved);
  EXPECT_EQ(r.certificate.kind, PointKind::LocalMinmax);
  return r.counts.hessian - r.iterations - 1;
}

// W beyond the end of the Newton step, and where that is nothing but rounding on the other side,
// too.
TEST(HessiansOfTheTest, AreOneOrTwo) {
  Model quadratic;
  {
    const Expression x = quadratic.variable(Player::Min, "x");
    const Expression y = quadratic.variable(Player::Max, "y");
    quadratic.objective(square(x - 1.0) + 3.0 * x * y - square(y + 2.0));
  }
  EXPECT_LE(hessians_of_test(quadratic, {5.0, -7.0}), 2);
  Model other;
  {
    const Expression x = other.variable(Player::Min, "x");
    const Expression y = other.variable(Player::Max, "y");
    other.objective(square(x - 1.0) + 3.0 * x * y - square(y + 2.0) + 0.01 * cos(x));
  }
  EXPECT_LE(hessians_of_test(other, {5.0, -7.0}), 2);
  EXPECT_GE(hessians_of_test(quadratic, {16.0 / 13.0, -2.0 / 13.0}), 1);
}

/// At the optimum four of 102 inequalities are active, where z / s in units that grow with 1 /
/// sqrt(curvature) calls all of them active.
TEST(Certificate, OfAFitAtManyPointsTakesFewFactorizations) {
  Model model;
  const Expression t = model.variable(Player::Min, "t");
  const Expression a = model.variable(Player::Min, "a"), b = model.variable(Player::Min, "b");
  model.objective(t);
  for (int k = 0; k <= 50; ++k) {
    const double w = k / 50.0 - 0.5;
    const Expression error = a * exp(w * b) - 1.0 / (1.0 + w);
    model.constraint(error - t, -kNoBound, 0.0);
    model.constraint(error + t, 0.0, kNoBound);
  }
  AutodiffProblem problem(model, {0.0, 0.0, 0.0});
  const Result result = solve(problem, SolverOptions{});
  EXPECT_EQ(result.status, Status::Solved) << name_of(result.status);
  EXPECT_NEAR(result.objective, 0.08715205, 1e-8);
  EXPECT_LE(result.counts.factorizations_for(FactorizationCause::Certificate).full, 5);
}

}  // namespace
}  // namespace ipminmax::testing
