// Threads change nothing but the time: the pursuit over a horizon that is worth them.

#include <algorithm>

#include <gtest/gtest.h>

#include <support/count_threads.hpp>

#include "../../examples/chauffeur_tnlp.hpp"
#include "adapter/ipopt/minmax_application.hpp"
#include "adapter/ipopt/tnlp_problem.hpp"
#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::has_threads;
using testing::threads_of_this_process;

constexpr int kHorizon = 6000;

/// Looks at the process's threads whenever it is evaluated.
class Watched : public chauffeur::ChauffeurTNLP {
 public:
  Watched()
      : ChauffeurTNLP(chauffeur::refined(kHorizon), {},
                      {0.2 / kHorizon, 0.04 / kHorizon, 0.02 / kHorizon}) {}
  bool eval_f(Ipopt::Index n, const Ipopt::Number* x, bool new_x, Ipopt::Number& value) override {
    most_threads = std::max(most_threads, threads_of_this_process());
    return ChauffeurTNLP::eval_f(n, x, new_x, value);
  }
  int most_threads = 0;
};

struct Case {
  const char* name;
  Globalization globalization;
  LinearSolver solver;
};

class TwoThreads : public ::testing::TestWithParam<Case> {};

TEST_P(TwoThreads, GiveTheBitsOfOne) {
  const Ipopt::SmartPtr<Watched> model = new Watched;
  SolverOptions options;
  options.tol = 1e-6;
  options.max_iter = 8;
  options.minmax_globalization = GetParam().globalization;
  options.linear_solver = GetParam().solver;
  const int before = threads_of_this_process();
  const auto solved = [&](int threads) {
    options.minmax_threads = threads;
    model->most_threads = 0;
    TnlpProblem problem(model);
    EXPECT_EQ(problem.load(), "");
    Result result = solve(problem, options);
    EXPECT_TRUE(has_threads(before));
    return result;
  };
  const Result one = solved(1);
  EXPECT_EQ(model->most_threads, before);
  const Result two = solved(2);
  EXPECT_GT(model->most_threads, before);
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

TEST(ThreadsOption, IsAnIntegerFromOneOn) {
  MinMaxApplication application(false);
  EXPECT_TRUE(application.Options()->SetIntegerValue("minmax_threads", 2));
  EXPECT_FALSE(application.Options()->SetIntegerValue("minmax_threads", 0, true, true));
  EXPECT_FALSE(application.Options()->SetStringValue("minmax_threads", "two", true, true));
}

}  // namespace
}  // namespace ipminmax
