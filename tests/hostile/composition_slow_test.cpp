// A stop, a limit, a lack of memory or an exception at any place of what is composed of solves.
#include <algorithm>
#include <cmath>
#include <functional>
#include <new>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>
#include <support/consistent_result.hpp>

#include "core/answer.hpp"
#include "core/model/forwarding_problem.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::expect_consistent;
using testing::Expression;
using testing::kNoBound;
using testing::Model;

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

/// Two maxima over y, of which the start sees the lower one.
Model two_branches() {
  Model model;
  const Expression x = model.variable(kMin, "x", -5.0, 5.0);
  const Expression y = model.variable(kMax, "y", -2.0, 2.0);
  model.objective(0.5 * square(x - 1.0) + 0.1 * x * y - square(square(y) - 1.0) + 0.3 * y);
  return model;
}

/// phi has a kink at x = 0, where two maxima over y meet, and is least there.
Model kink() {
  Model model;
  const Expression x = model.variable(kMin, "x", -2.0, 2.0);
  const Expression y = model.variable(kMax, "y", -2.0, 2.0);
  model.objective(square(x - 0.3) - 4.0 * square(square(y) - 1.0) + 3.0 * x * y);
  return model;
}

/// `count` robust rows, each with two worst cases.
Model with_rows(int count) {
  Model model;
  const Expression x = model.variable(kMin, "x", -5.0, 5.0);
  const Expression z = model.variable(kMin, "z", -5.0, 5.0);
  const Expression y = model.variable(kMax, "y", -2.0, 2.0);
  model.objective(square(x - 1.0) + square(z) + x);
  for (int r = 0; r < count; ++r) {
    const double tilt = 0.2 * (r + 1);
    model.constraint(x + tilt * z + 2.0 + square(square(y) - 1.0) - tilt * y, 0.0, kNoBound, kMin);
  }
  return model;
}

/// max_y x y = |x|: with one worst case alone x is not bounded from below.
Model two_sided() {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression t = model.variable(kMin, "t");
  const Expression y = model.variable(kMax, "y", -1.0, 1.0);
  model.objective(t);
  model.constraint((x - 0.3) * y - t, -kNoBound, 0.0, kMin);
  return model;
}

struct Setting {
  std::string name;
  Model model;
  std::vector<double> start;
  SolverOptions options;
};

std::vector<Setting> settings() {
  const auto options = [](int starts, int starts_of_y, bool epigraph = false, bool kinks = false) {
    SolverOptions o;
    o.minmax_starts = starts;
    o.minmax_worst_case_starts = starts_of_y;
    o.minmax_epigraph = epigraph;
    o.minmax_epigraph_at_kinks = kinks;
    return o;
  };
  const std::vector<double> two{1.0, -1.0}, three{2.0, 0.0, 0.3};
  return {{"plain", two_branches(), two, options(1, -1)},
          {"worst cases", two_branches(), two, options(1, 5)},
          {"starts", two_branches(), two, options(4, -1)},
          {"starts and worst cases", two_branches(), two, options(4, 4)},
          {"rows", with_rows(5), three, options(1, 2)},
          {"rows by default", with_rows(2), three, options(1, -1)},
          {"rows, scenarios", two_sided(), {1.0, 1.0, 0.2}, options(1, 4)},
          {"rows and starts", with_rows(2), three, options(3, 2)},
          {"epigraph", kink(), two, options(1, 4, true)},
          {"epigraph and starts", kink(), two, options(2, 3, true)},
          {"kinks", kink(), two, options(1, -1, false, true)},
          {"kinks, starts and worst cases", kink(), two, options(2, 3, false, true)}};
}

/// Calls a function before every call of the model.
class Watched final : public ForwardingProblem {
 public:
  Watched(Problem& model, std::function<void()> watch)
      : ForwardingProblem(model), watch_(std::move(watch)) {}
  [[nodiscard]] bool objective(std::span<const double> v, bool n, double& f) override {
    watch_();
    return ForwardingProblem::objective(v, n, f);
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool n, std::span<double> g) override {
    watch_();
    return ForwardingProblem::gradient(v, n, g);
  }
  [[nodiscard]] bool constraints(std::span<const double> v, bool n, std::span<double> g) override {
    watch_();
    return ForwardingProblem::constraints(v, n, g);
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool n, std::span<double> g) override {
    watch_();
    return ForwardingProblem::jacobian(v, n, g);
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool n, double sigma,
                             std::span<const double> lambda, bool new_lambda,
                             std::span<double> values) override {
    watch_();
    return ForwardingProblem::hessian(v, n, sigma, lambda, new_lambda, values);
  }

 private:
  std::function<void()> watch_;
};

struct Outcome {
  Answer answer;
  int calls = 0;       ///< of the model
  int told = 0;        ///< calls of the observer
  bool threw = false;  ///< what the hook threw came through
};

struct Hook {
  int at = 0;  ///< call of the model or of the observer, from 1; 0: none
  enum class Kind { None, Stop, NoMemory, Throw } kind = Kind::None;
};

struct Thrown : std::runtime_error {
  using std::runtime_error::runtime_error;
};

Outcome run_with(const Setting& setting, const SolverOptions& options, Hook hook) {
  Outcome outcome;
  AutodiffProblem model(setting.model, setting.start);
  Watched watched(model, [&] {
    if (++outcome.calls != hook.at) return;
    if (hook.kind == Hook::Kind::NoMemory) throw std::bad_alloc();
    if (hook.kind == Hook::Kind::Throw) throw Thrown("model");
  });
  MultistartObserver observer;
  observer.on_iteration = [&](Index, const IterationInfo&) {
    return !(++outcome.told == hook.at && hook.kind == Hook::Kind::Stop);
  };
  try {
    outcome.answer = run(watched, options, observer);
  } catch (const Thrown&) {
    outcome.threw = true;
  }
  return outcome;
}

/// At most `most` numbers from 1 to last, its ends among them.
std::vector<int> places(int last, int most) {
  std::vector<int> numbers;
  const int step = std::max(1, last / most);
  for (int k = 1; k <= last; k += step) numbers.push_back(k);
  if (numbers.empty() || numbers.back() != last) numbers.push_back(last);
  return numbers;
}

Index factorizations_of(const Result& result) {
  return result.factorizations +
         result.counts.factorizations_for(FactorizationCause::Restoration).full;
}

class Composed : public ::testing::TestWithParam<std::size_t> {
 protected:
  const Setting setting_ = settings()[GetParam()];
  const Outcome free_ = run_with(setting_, setting_.options, {});
};

TEST_P(Composed, IsConsistent) {
  expect_consistent(free_.answer.best);
  EXPECT_EQ(run_with(setting_, setting_.options, {}).answer.best.v, free_.answer.best.v);
}

TEST_P(Composed, EndsWithTheFirstStop) {
  for (const int k : places(free_.told, 120)) {
    const Outcome outcome = run_with(setting_, setting_.options, {k, Hook::Kind::Stop});
    EXPECT_EQ(outcome.told, k) << "called again after it said stop";
    EXPECT_EQ(outcome.answer.best.status, Status::UserStop) << k;
    expect_consistent(outcome.answer.best);
    if (HasFailure()) return;
  }
}

TEST_P(Composed, EndsWhereThereIsNoMemory) {
  for (const int k : places(free_.calls, 200)) {
    const Outcome outcome = run_with(setting_, setting_.options, {k, Hook::Kind::NoMemory});
    EXPECT_EQ(outcome.answer.best.status, Status::OutOfMemory) << k;
    expect_consistent(outcome.answer.best);
    if (HasFailure()) return;
  }
}

TEST_P(Composed, PassesExceptionsOn) {
  for (const int k : places(free_.calls, 100)) {
    const Outcome outcome = run_with(setting_, setting_.options, {k, Hook::Kind::Throw});
    EXPECT_TRUE(outcome.threw) << k << ": " << outcome.answer.best.message;
    if (HasFailure()) return;
  }
}

TEST_P(Composed, KeepsToTheNumberOfFactorizations) {
  const Index needed = factorizations_of(free_.answer.best);
  for (const int limit : places(needed, 60)) {
    SolverOptions options = setting_.options;
    options.minmax_max_factorizations = limit;
    const Outcome outcome = run_with(setting_, options, {});
    EXPECT_LE(factorizations_of(outcome.answer.best), limit);
    expect_consistent(outcome.answer.best);
    if (HasFailure()) return;
  }
}

TEST_P(Composed, LeavesNoVerdictBehindALimitOfTime) {
  for (int place = 1; place <= 20; ++place) {
    SolverOptions options = setting_.options;
    options.max_wall_time = std::max(1e-9, free_.answer.best.seconds * place / 20.0);
    const Outcome outcome = run_with(setting_, options, {});
    expect_consistent(outcome.answer.best);
    const Result& best = outcome.answer.best;
    if (best.status != Status::MaxWallTime) {
      EXPECT_EQ(best.v, free_.answer.best.v) << best.message;  // it was not cut
    }
    if (HasFailure()) return;
  }
}

INSTANTIATE_TEST_SUITE_P(Settings, Composed, ::testing::Range<std::size_t>(0, settings().size()),
                         [](const auto& tested) {
                           std::string name = settings()[tested.param].name;
                           std::erase_if(name, [](char c) { return std::isalpha(c) == 0; });
                           return name;
                         });

}  // namespace
}  // namespace ipminmax
