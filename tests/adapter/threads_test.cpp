// Threads change nothing but the time: the pursuit over a horizon that is worth them, and robust
// constraints.

#include <algorithm>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include <problems/scalable_problems.hpp>
#include <support/count_threads.hpp>

#include "adapter/control/stages.hpp"
#include "adapter/ipopt/autodiff_tnlp.hpp"
#include "adapter/ipopt/minmax_application.hpp"
#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::has_threads;
using testing::threads_of_this_process;

struct Case {
  const char* name;
  Globalization globalization;
  LinearSolver solver;
};

class TwoThreads : public ::testing::TestWithParam<Case> {};

TEST_P(TwoThreads, GiveTheBitsOfOne) {
  const auto grid = testing::f30_few_min(3, 100);
  SolverOptions options;
  options.tol = 1e-6;
  options.max_iter = 8;
  options.minmax_globalization = GetParam().globalization;
  options.linear_solver = GetParam().solver;
  const int before = threads_of_this_process();
  int most_threads = 0;
  const auto solved = [&](int threads) {
    options.minmax_threads = threads;
    most_threads = 0;
    Result result = solve(*grid.problem, options, [&](const IterationInfo&) {
      most_threads = std::max(most_threads, threads_of_this_process());
      return true;
    });
    EXPECT_TRUE(has_threads(before));
    return result;
  };
  const Result one = solved(1);
  EXPECT_EQ(most_threads, before);
  const Result two = solved(2);
  EXPECT_GT(most_threads, before);
  EXPECT_EQ(one.status, two.status);
  EXPECT_EQ(one.certificate.kind, two.certificate.kind);
  EXPECT_EQ(one.iterations, two.iterations);
  EXPECT_EQ(one.counts.factorizations_full, two.counts.factorizations_full);
  EXPECT_EQ(one.counts.factorizations_inner, two.counts.factorizations_inner);
  EXPECT_TRUE(one.v == two.v);
  EXPECT_TRUE(one.lambda == two.lambda);
  EXPECT_TRUE(one.z_lower == two.z_lower);
  EXPECT_TRUE(one.z_upper == two.z_upper);
}

INSTANTIATE_TEST_SUITE_P(
    Of, TwoThreads,
    ::testing::Values(Case{"Filter", Globalization::Filter, LinearSolver::Auto},
                      Case{"FilterByLdlt", Globalization::Filter, LinearSolver::Ldlt},
                      Case{"AlgorithmOne", Globalization::None, LinearSolver::Auto}),
    [](const auto& one) { return one.param.name; });

/// x within limits for every |y| <= 1, the last one curved.
struct Limits {
  template <class T>
  T objective(std::span<const T> v) const {
    return (v[0] - 2.0) * (v[0] - 2.0) + v[1] * v[1];
  }
  template <class T>
  void constraints(std::span<const T> v, std::span<T> g) const {
    g[0] = v[0] + 0.5 * v[2] - 1.0;
    g[1] = v[1] - v[0] + v[2] * v[0];
    g[2] = sin(3.0 * v[2] + v[1]) + v[0] - 1.4;
  }
};

ModelData data_of_limits() {
  return {.players = {Player::Min, Player::Min, Player::Max},
          .start = {0.0, 0.0, 0.1},
          .lower = {-2e19, -2e19, -1.0},
          .upper = {2e19, 2e19, 1.0},
          .constraint_lower = {-2e19, -2e19, -2e19},
          .constraint_upper = {0.0, 0.0, 0.0},
          .constraint_players = {Player::Min, Player::Min, Player::Min}};
}

/// Counts its clones and the words that it hears of maximizations.
class Counting : public AutodiffTNLP<Limits> {
 public:
  Counting() : AutodiffTNLP({}, data_of_limits()) {}
  [[nodiscard]] Ipopt::SmartPtr<Ipopt::TNLP> clone_model() const override {
    ++clones;
    const auto copy = AutodiffTNLP::clone_model();
    EXPECT_TRUE(IsNull(copy));  // of a derived class
    return new AutodiffTNLP<Limits>({}, data_of_limits());
  }
  bool maximization_callback(Ipopt::Index, double) override { return ++told > 0; }
  mutable int clones = 0;
  int told = 0;
};

TEST(TwoThreadsOverY, MaximizeRobustConstraintsToTheBitsOfOne) {
  for (const bool split : {false, true}) {
    std::vector<double> v;
    int told = 0;
    for (const int threads : {1, 2}) {
      const Ipopt::SmartPtr<Counting> counting = new Counting;
      Ipopt::SmartPtr<Ipopt::TNLP> model = GetRawPtr(counting);
      if (split) model = new SplitTNLP(model, {2}, {}, {0, 1, 2});
      MinMaxApplication application(false);
      application.Options()->SetIntegerValue("print_level", 0);
      application.Options()->SetIntegerValue("minmax_threads", threads);
      ASSERT_EQ(application.Initialize(), Ipopt::Solve_Succeeded);
      EXPECT_EQ(application.OptimizeTNLP(model), Ipopt::Solve_Succeeded);
      EXPECT_EQ(counting->clones, threads > 1 ? 2 : 0);
      const Result& result = application.LastResult();
      if (threads == 1) {
        v = result.v;
        told = counting->told;
      }
      EXPECT_TRUE(v == result.v);
      EXPECT_EQ(counting->told, told);
      EXPECT_EQ(told > 0, !split);
    }
  }
}

struct Pushed {
  static constexpr std::size_t states = 2, controls = 1, disturbances = 1, limits = 2;
  void dynamics(auto s, auto u, auto w, auto rate) const {
    rate[0] = s[1];
    rate[1] = sin(s[0]) + u[0] + w[0];
  }
  auto cost(auto s, auto u, auto) const { return s[0] * s[0] + 0.1 * u[0] * u[0]; }
  void limits_of(auto s, auto, auto g) const {
    g[0] = s[0] - 0.6;
    g[1] = -s[0] - 0.1;
  }
};

TEST(TwoThreadsOverY, MaximizeLimitsOfStagesToTheBitsOfOne) {
  const auto solved = [](int threads) {
    StageGame game(Pushed{}, {.stages = 5,
                              .step = 0.1,
                              .initial = {0.4, 0.5},
                              .disturbance_lower = {-0.3},
                              .disturbance_upper = {0.3}});
    SolverOptions options;
    options.minmax_threads = threads;
    const StageAnswer first = game.solve(options);
    EXPECT_TRUE(first.certified()) << first.result.message;
    return game.solve_next({0.42, 0.3}, options);
  };
  const StageAnswer one = solved(1), two = solved(2);
  EXPECT_TRUE(one.certified()) << one.result.message;
  EXPECT_TRUE(one.result.v == two.result.v);
  EXPECT_EQ(one.result.over_y.maximizations, two.result.over_y.maximizations);
  EXPECT_EQ(one.worst_cases.size(), two.worst_cases.size());
}

TEST(ThreadsOption, IsAnIntegerFromOneOn) {
  MinMaxApplication application(false);
  EXPECT_TRUE(application.Options()->SetIntegerValue("minmax_threads", 2));
  EXPECT_FALSE(application.Options()->SetIntegerValue("minmax_threads", 0, true, true));
  EXPECT_FALSE(application.Options()->SetStringValue("minmax_threads", "two", true, true));
}

}  // namespace
}  // namespace ipminmax
