// A stop by the iteration callback returns the iterate that the callback was called for, whatever
// the step before it was.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <problems/random_multimodal.hpp>
#include <problems/small_problems.hpp>
#include <regression/hock_schittkowski.hpp>
#include <regression/not_minima.hpp>
#include <string>
#include <vector>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

struct Case {
  std::string name;
  Model model;
  std::vector<double> start;
};

/// Waechter and Biegler (2000): from this start no line search reaches feasibility.
Model needs_restoration() {
  Model model;
  const Expression a = model.variable(Player::Min, "a");
  const Expression b = model.variable(Player::Min, "b", 0.0);
  const Expression c = model.variable(Player::Min, "c", 0.0);
  model.objective(a);
  model.constraint(square(a) - b - 1.0, 0.0, 0.0);
  model.constraint(a - c - 0.5, 0.0, 0.0);
  return model;
}

/// The restoration ends where the violation is least.
Model infeasible() {
  Model model;
  const Expression a = model.variable(Player::Min, "a");
  const Expression y = model.variable(Player::Max, "y", -2.0, 2.0);
  const Expression b = model.variable(Player::Min, "b");
  model.objective(square(a) + a * y - square(y) + b);
  model.constraint(square(a) + square(b) + exp(b), -kNoBound, -1.0);
  return model;
}

std::vector<Case> cases() {
  std::vector<Case> all = {{"needs_restoration", needs_restoration(), {-2.0, 3.0, 1.0}},
                           {"infeasible", infeasible(), {4.0, 1.0, 3.0}}};
  for (const IllPosed& problem : ill_posed()) {
    all.push_back({problem.name, problem.model, problem.start});
  }
  for (const SmallProblem& problem : small_problems()) {
    for (const auto& start : problem.starts) all.push_back({problem.name, problem.model, start});
  }
  for (const NotMinimum& problem : not_minima()) {
    all.push_back({problem.name, problem.model, problem.start});
  }
  for (const MinimizationProblem& problem : hock_schittkowski()) {
    all.push_back({problem.name, problem.model, problem.start});
  }
  const auto many = random_multimodal(MultimodalKind::Constrained, 2, 20, 5);
  for (const auto& start : many.starts) all.push_back({"random_multimodal", many.model, start});
  return all;
}

/// The kind of a call: the step's letter, or '*' inside a restoration.
char kind_of(const IterationInfo& info) { return info.restoration ? '*' : info.step_kind; }

/// Stops at the given call and compares what came back with what could be seen there.
void stop_at(const Case& c, std::size_t call) {
  AutodiffProblem problem(c.model, c.start);
  Result seen;
  std::vector<double> v;
  double objective = 0.0;
  Index iteration = 0;
  bool restoration = false;
  std::size_t calls = 0;
  const Result result = solve(problem, SolverOptions{}, [&](const IterationInfo& info) {
    if (calls++ < call) return true;
    seen = info.result();
    v.assign(info.v.begin(), info.v.end());
    objective = info.objective;
    iteration = info.iteration;
    restoration = info.restoration;
    return false;
  });
  SCOPED_TRACE(c.name + ", call " + std::to_string(call));
  ASSERT_EQ(calls, call + 1) << "no call after the stop";
  EXPECT_EQ(result.status, Status::UserStop) << result.message;
  EXPECT_EQ(result.message, name_of(Status::UserStop));
  EXPECT_EQ(result.iterations, restoration ? iteration - 1 : iteration);
  EXPECT_EQ(result.v, v);
  EXPECT_EQ(result.v, seen.v);
  EXPECT_EQ(result.lambda, seen.lambda);
  EXPECT_EQ(result.z_lower, seen.z_lower);
  EXPECT_EQ(result.z_upper, seen.z_upper);
  EXPECT_EQ(result.constraints, seen.constraints);
  EXPECT_EQ(result.mu, seen.mu);
  EXPECT_EQ(result.certificate.kind, seen.certificate.kind);
  EXPECT_EQ(result.certificate.second_order, SecondOrder::NotTested);
  EXPECT_EQ(result.error.primal, seen.error.primal);
  EXPECT_EQ(result.error.dual_min, seen.error.dual_min);
  EXPECT_EQ(result.error.dual_max, seen.error.dual_max);
  EXPECT_EQ(result.error.complementarity, seen.error.complementarity);
  EXPECT_EQ(result.error.total, seen.error.total);

  double f = 0.0;
  ASSERT_TRUE(problem.objective(v, true, f));
  EXPECT_EQ(result.objective, f);
  EXPECT_NEAR(objective, f, 1e-12 * (1.0 + std::abs(f)));
  std::vector<double> g(problem.structure().constraint_players.size());
  ASSERT_TRUE(problem.constraints(v, true, g));
  EXPECT_EQ(result.constraints, g);
}

TEST(UserStop, ReturnsTheIterateAfterEveryKindOfStep) {
  constexpr int kStopsPerKind = 6;
  std::map<char, int> stops;
  for (const Case& c : cases()) {
    AutodiffProblem problem(c.model, c.start);
    std::string kinds;
    static_cast<void>(solve(problem, SolverOptions{}, [&](const IterationInfo& info) {
      kinds += kind_of(info);
      return true;
    }));
    for (std::size_t call = 0; call < kinds.size(); ++call) {
      const char kind = kinds[call];
      const bool end = kinds.find(kind) == call || (kind == '*' && kinds.rfind(kind) == call);
      if (end && stops[kind]++ < kStopsPerKind) stop_at(c, call);
    }
  }
  // The start, Newton and filter steps, shifted ones, escapes, new starts, restorations, and the
  // iterations inside these.
  for (const char kind : {' ', 'n', 'f', 's', 'e', 'w', 'R', '*'})
    EXPECT_GT(stops[kind], 0) << kind;
}

TEST(UserStop, ReturnsTheIterateOfAlgorithmOne) {
  for (const SmallProblem& small : small_problems()) {
    AutodiffProblem problem(small.model, small.starts.front());
    SolverOptions options;
    options.minmax_globalization = Globalization::None;
    Result seen;
    const Result result = solve(problem, options, [&](const IterationInfo& info) {
      seen = info.result();
      return info.iteration < 3;
    });
    EXPECT_EQ(result.v, seen.v) << small.name;
    EXPECT_EQ(result.lambda, seen.lambda) << small.name;
    EXPECT_EQ(result.z_lower, seen.z_lower) << small.name;
    EXPECT_EQ(result.z_upper, seen.z_upper) << small.name;
  }
}

// Looking at the iterates does not change them.
TEST(UserStop, WatchingChangesNothing) {
  for (const char* name : {"eq_coupled", "hyperbola", "bolib_tp7", "attack_ball"}) {
    const SmallProblem& small = small_problem(name);
    AutodiffProblem problem(small.model, small.starts.front());
    const Result alone = solve(problem, SolverOptions{});
    const Result watched = solve(problem, SolverOptions{}, [&](const IterationInfo& info) {
      return !info.result().v.empty();
    });
    EXPECT_EQ(alone.v, watched.v) << name;
    EXPECT_EQ(alone.lambda, watched.lambda) << name;
    EXPECT_EQ(alone.iterations, watched.iterations) << name;
    EXPECT_EQ(alone.factorizations, watched.factorizations) << name;
  }
}

}  // namespace
}  // namespace ipminmax::testing
