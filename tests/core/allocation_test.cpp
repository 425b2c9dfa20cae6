// The iteration allocates nothing after its first pass: work vectors are made at the start. What is
// counted is malloc and its kin between two calls of the iteration callback, of Eigen and libraries
// too, without the model's own functions. MUMPS allocates in every factorization; with it only
// operator new is counted, which std containers use. Not counted: the certificate, feasibility
// restorations and new starts, which are solves or tests of their own. A search may go on with a
// plain step from a point that was tested, so steps from first-order points are left out.
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <problems/random_multimodal.hpp>
#include <problems/small_problems.hpp>
#include <support/autodiff_problem.hpp>
#include <support/count_allocations.hpp>
#include <support/forwarding_problem.hpp>

#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::allocation_counter;
using testing::ForwardingProblem;

/// Stops the counter while the model works.
class Uncounted final : public ForwardingProblem {
 public:
  using ForwardingProblem::ForwardingProblem;

  bool objective(std::span<const double> v, bool fresh, double& f) override {
    const Pause pause;
    return ForwardingProblem::objective(v, fresh, f);
  }
  bool gradient(std::span<const double> v, bool fresh, std::span<double> out) override {
    const Pause pause;
    return ForwardingProblem::gradient(v, fresh, out);
  }
  bool constraints(std::span<const double> v, bool fresh, std::span<double> out) override {
    const Pause pause;
    return ForwardingProblem::constraints(v, fresh, out);
  }
  bool jacobian(std::span<const double> v, bool fresh, std::span<double> out) override {
    const Pause pause;
    return ForwardingProblem::jacobian(v, fresh, out);
  }
  bool hessian(std::span<const double> v, bool fresh, double sigma, std::span<const double> lambda,
               bool fresh_lambda, std::span<double> out) override {
    const Pause pause;
    return ForwardingProblem::hessian(v, fresh, sigma, lambda, fresh_lambda, out);
  }

 private:
  struct Pause {
    bool was_on = allocation_counter.on.exchange(false);
    ~Pause() { allocation_counter.on = was_on; }
  };
};

struct Finding {
  std::string kinds;      ///< letters of the steps that were watched
  std::string allocated;  ///< letters of those that allocated
  int allocations = 0;
  int operator_new = 0;
  bool solved = false;
  Index trials = 0, factorizations = 0, iterations = 0;
};

Finding watch(Problem& model, const SolverOptions& options) {
  Uncounted problem(model);
  Finding finding;
  finding.kinds.reserve(1000);
  finding.allocated.reserve(1000);
  bool from_first_order_point = false;
  const Result result = solve(problem, options, [&](const IterationInfo& info) {
    allocation_counter.stop();
    const bool watched = info.iteration > 1 && !info.restoration && info.step_kind != 'w' &&
                         info.step_kind != 'R' && info.step_kind != 'e' && !from_first_order_point;
    from_first_order_point = info.error.total <= options.acceptable_tol;
    if (watched) {
      finding.kinds += info.step_kind;
      if (allocation_counter.all > 0) finding.allocated += info.step_kind;
      finding.allocations += allocation_counter.all;
      finding.operator_new += allocation_counter.operator_new;
      finding.trials = std::max(finding.trials, info.trials);
    }
    allocation_counter.start();
    return true;
  });
  allocation_counter.stop();
  finding.solved = is_success(result.status);
  finding.factorizations = result.factorizations;
  finding.iterations = result.iterations;
  return finding;
}

struct Case {
  const char* name;
  Globalization globalization;
  LinearSolver solver;
  BarrierStrategy barrier = BarrierStrategy::Monotone;
  BarrierOracle oracle = BarrierOracle::QualityFunction;
  bool watchdog = false;
};

class NoAllocation : public ::testing::TestWithParam<Case> {};

TEST_P(NoAllocation, InTheIterationsOfTheSmallProblems) {
  if (!IPMINMAX_COUNTS_ALLOCATIONS) GTEST_SKIP() << "allocator replaced by a sanitizer";
  const Case& c = GetParam();
  SolverOptions options;
  options.minmax_globalization = c.globalization;
  options.linear_solver = c.solver;
  options.mu_strategy = c.barrier;
  options.mu_oracle = c.oracle;
  options.minmax_residual_watchdog = c.watchdog;
  options.max_iter = 200;
  std::string kinds;
  Index solved = 0, trials = 0;
  for (const testing::SmallProblem& problem : testing::small_problems()) {
    for (const std::vector<double>& start : problem.starts) {
      testing::AutodiffProblem model(problem.model, start);
      const Finding finding = watch(model, options);
      const bool is_mumps = c.solver == LinearSolver::Mumps;
      EXPECT_EQ(is_mumps ? finding.operator_new : finding.allocations, 0)
          << problem.name << ": steps " << finding.kinds << ", allocating " << finding.allocated;
      kinds += finding.kinds;
      solved += finding.solved;
      trials = std::max(trials, finding.trials);
    }
  }
  // The cases are there: plain, shifted and corrected steps, line searches.
  EXPECT_GT(solved, 40);
  const bool filter = c.globalization == Globalization::Filter;
  for (const char kind : std::string(filter ? "nfslj" : "nsi")) {
    EXPECT_NE(kinds.find(kind), std::string::npos) << kind;
  }
  if (filter) {
    EXPECT_GT(trials, 3);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Methods, NoAllocation,
    ::testing::Values(Case{"FilterAuto", Globalization::Filter, LinearSolver::Auto},
                      Case{"FilterLdlt", Globalization::Filter, LinearSolver::Ldlt},
                      Case{"FilterLapack", Globalization::Filter, LinearSolver::Lapack},
                      Case{"FilterMumps", Globalization::Filter, LinearSolver::Mumps},
                      Case{"NoneAuto", Globalization::None, LinearSolver::Auto},
                      Case{"NoneLdlt", Globalization::None, LinearSolver::Ldlt},
                      Case{"NoneWatchdog", Globalization::None, LinearSolver::Auto,
                           BarrierStrategy::Monotone, BarrierOracle::QualityFunction, true},
                      Case{"FilterQualityFunction", Globalization::Filter, LinearSolver::Auto,
                           BarrierStrategy::Adaptive},
                      Case{"FilterProbing", Globalization::Filter, LinearSolver::Auto,
                           BarrierStrategy::Adaptive, BarrierOracle::Probing},
                      Case{"FilterLoqo", Globalization::Filter, LinearSolver::Auto,
                           BarrierStrategy::Adaptive, BarrierOracle::Loqo}),
    [](const ::testing::TestParamInfo<Case>& c) { return std::string(c.param.name); });

TEST(NoAllocation, InSecondOrderCorrections) {
  if (!IPMINMAX_COUNTS_ALLOCATIONS) GTEST_SKIP() << "allocator replaced by a sanitizer";
  // Of all steps these are few: 20 starts meet some.
  const auto many = testing::random_multimodal(testing::MultimodalKind::Constrained, 2, 20, 6);
  std::string kinds;
  for (const std::vector<double>& start : many.starts) {
    testing::AutodiffProblem problem(many.model, start);
    const Finding finding = watch(problem, {});
    EXPECT_EQ(finding.allocations, 0) << finding.kinds << ", allocating " << finding.allocated;
    kinds += finding.kinds;
  }
  EXPECT_NE(kinds.find('c'), std::string::npos) << kinds;
}

TEST(NoAllocation, InAMinimization) {
  if (!IPMINMAX_COUNTS_ALLOCATIONS) GTEST_SKIP() << "allocator replaced by a sanitizer";
  using testing::Expression;
  using testing::Model;
  // Hock and Schittkowski 71, and a curve that bends away from the steps (second-order
  // corrections).
  Model hs071;
  std::vector<Expression> x;
  for (const char* name : {"x1", "x2", "x3", "x4"}) {
    x.push_back(hs071.variable(Player::Min, name, 1.0, 5.0));
  }
  hs071.objective(x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2]);
  hs071.constraint(x[0] * x[1] * x[2] * x[3], 25.0, testing::kNoBound);
  hs071.constraint(square(x[0]) + square(x[1]) + square(x[2]) + square(x[3]), 40.0, 40.0);
  Model circle;
  const Expression u = circle.variable(Player::Min, "u");
  const Expression w = circle.variable(Player::Min, "w");
  circle.objective(2.0 * (square(u) + square(w) - 1.0) - u);
  circle.constraint(square(u) + square(w), 1.0, 1.0);

  std::string kinds;
  for (const LinearSolver solver : {LinearSolver::Auto, LinearSolver::Ldlt}) {
    SolverOptions options;
    options.linear_solver = solver;
    testing::AutodiffProblem first(hs071, {1.0, 5.0, 5.0, 1.0});
    testing::AutodiffProblem second(circle, {0.5, std::sqrt(0.75)});
    for (testing::AutodiffProblem* model : {&first, &second}) {
      const Finding finding = watch(*model, options);
      EXPECT_TRUE(finding.solved);
      EXPECT_EQ(finding.allocations, 0) << finding.kinds << ", allocating " << finding.allocated;
      kinds += finding.kinds;
    }
  }
  for (const char kind : std::string("fc")) EXPECT_NE(kinds.find(kind), std::string::npos) << kind;
}

// What is made on first use would keep a child waiting that is forked meanwhile.
TEST(Tables, AreMadeWhenTheLibraryIsLoaded) {
  if (!IPMINMAX_COUNTS_ALLOCATIONS) GTEST_SKIP() << "allocator replaced by a sanitizer";
  allocation_counter.start();
  const std::size_t rows = option_table().size();
  allocation_counter.stop();
  EXPECT_GT(rows, 50U);
  EXPECT_EQ(allocation_counter.all, 0);
}

}  // namespace
}  // namespace ipminmax
