// Multistart: distinct points, their rank, statuses, threads, limits and exceptions.
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>
#include <support/without_hessian.hpp>

#include "core/multistart.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;
using testing::WithoutHessian;

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

/// The paper's f3: two local minmax points of the same value, one other first-order point.
std::unique_ptr<AutodiffProblem> f3(std::vector<double> start = {0.0, 0.0}) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective((x - 0.5) * (y - 0.5) + exp(-square(x - 0.25) - square(y - 0.75)));
  return std::make_unique<AutodiffProblem>(model, std::move(start));
}

/// min (x^2 - 1)^2 + x/10: local minima near 1 and -1, the lower one near -1.
std::unique_ptr<AutodiffProblem> double_well(double lower = -2.0, double upper = 2.0) {
  Model model;
  const Expression x = model.variable(kMin, "x", lower, upper);
  const Expression y = model.variable(kMax, "y");
  model.objective(square(square(x) - 1.0) + 0.1 * x - square(y - x));
  return std::make_unique<AutodiffProblem>(model, std::vector<double>{1.5, 0.0});
}

Model saddle() {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(square(x) - square(y));
  return model;
}

/// x^2 - y^2 that throws or misbehaves where the test says.
class Hooked final : public AutodiffProblem {
 public:
  explicit Hooked(std::function<void(double x)> hook)
      : AutodiffProblem(saddle(), {1.0, 1.0}), hook_(std::move(hook)) {}
  bool objective(std::span<const double> v, bool fresh, double& f) override {
    hook_(v[0]);
    return AutodiffProblem::objective(v, fresh, f);
  }

 private:
  std::function<void(double)> hook_;
};

SolverOptions starts(int count, double radius = 2.0) {
  SolverOptions options;
  options.minmax_starts = count;
  options.minmax_start_radius = radius;
  return options;
}

Index total(const MultistartResult& result) {
  Index sum = 0;
  for (const auto& [status, count] : result.statuses) sum += count;
  return sum;
}

TEST(Multistart, FindsBothPointsOfF3) {
  const auto problem = f3();
  const MultistartResult result = multistart(*problem, starts(80));
  ASSERT_EQ(result.points.size(), 2U);
  EXPECT_EQ(result.starts, 80);
  EXPECT_EQ(total(result), 80);
  EXPECT_FALSE(result.interrupted);
  Index certified = 0;
  std::set<bool> sides;
  for (const DistinctPoint& point : result.points) {
    const std::vector<double>& v = point.result.v;
    const bool right = v[0] > 0.0;
    sides.insert(right);
    EXPECT_NEAR(v[0], right ? 0.95028 : -0.20028, 1e-5);
    EXPECT_NEAR(v[1], right ? 1.20028 : 0.04972, 1e-5);
    EXPECT_NEAR(point.result.objective, 0.81532, 1e-5);
    EXPECT_EQ(point.result.certificate.kind, PointKind::LocalMinmax);
    EXPECT_GT(point.found, 1);
    certified += point.found;
  }
  EXPECT_EQ(sides.size(), 2U);
  ASSERT_EQ(result.statuses.front().first, Status::Solved);
  EXPECT_EQ(result.statuses.front().second, certified);
  EXPECT_EQ(result.best.status, Status::Solved);
  EXPECT_EQ(result.best.v, result.points.front().result.v);
  EXPECT_EQ(result.best_start, result.points.front().first_start);
}

TEST(Multistart, RanksByTheLocalMinmaxValue) {
  const auto problem = double_well();
  const MultistartResult result = multistart(*problem, starts(20));
  ASSERT_EQ(result.points.size(), 2U);
  EXPECT_LT(result.points[0].result.objective, result.points[1].result.objective);
  EXPECT_NEAR(result.points[0].result.v[0], -1.0, 0.05);
  EXPECT_NEAR(result.points[1].result.v[0], 1.0, 0.05);
  EXPECT_EQ(result.points[1].first_start, 0);  // the model's start is the worse one's basin
  EXPECT_EQ(result.best.v, result.points[0].result.v);
  EXPECT_EQ(result.points[0].found + result.points[1].found, 20);
}

TEST(Multistart, OneStartIsASolve) {
  const auto problem = f3();
  const MultistartResult one = multistart(*problem, {});
  const Result alone = solve(*problem, {});
  EXPECT_EQ(one.best.v, alone.v);
  EXPECT_EQ(one.best.status, alone.status);
  EXPECT_EQ(one.best.iterations, alone.iterations);
  EXPECT_EQ(one.starts, 1);
  EXPECT_EQ(one.best_start, 0);
}

TEST(Multistart, AddsUpTheWorkOfAllStarts) {
  const auto problem = f3();
  Index iterations = 0, factorizations = 0, objectives = 0;
  MultistartObserver observer;
  observer.on_result = [&](Index, const Result& result) {
    iterations += result.iterations;
    factorizations += result.factorizations;
    objectives += result.counts.objective;
  };
  const MultistartResult answer = multistart(*problem, starts(10), observer);
  const Result& best = answer.best;
  EXPECT_EQ(best.iterations, iterations);
  EXPECT_EQ(best.factorizations, factorizations);
  // The y of each other start is looked at, too.
  EXPECT_GE(best.counts.objective, objectives);
  EXPECT_LE(best.counts.objective, objectives + answer.starts);
  EXPECT_GE(best.seconds, best.timing.factorization);
}

// --- Starting points -----------------------------------------------------------------------------

/// The points the starts began at, before they are pushed inside the bounds.
std::vector<std::vector<double>> starting_points(
    Problem& problem, SolverOptions options, const std::vector<std::vector<double>>& given = {}) {
  std::vector<std::vector<double>> points;
  options.max_iter = 0;
  options.bound_push = options.bound_frac = 1e-12;
  MultistartObserver observer;
  observer.on_iteration = [&](Index start, const IterationInfo& info) {
    EXPECT_EQ(start, static_cast<Index>(points.size()));
    points.emplace_back(info.v.begin(), info.v.end());
    return true;
  };
  static_cast<void>(multistart(problem, options, observer, given));
  return points;
}

TEST(MultistartPoints, StayInTheirBox) {
  Model model;
  const Expression free = model.variable(kMin, "free");
  const Expression both = model.variable(kMin, "both", 100.0, 101.0);
  const Expression lower = model.variable(kMax, "lower", -1.0);
  const Expression upper = model.variable(kMax, "upper", -kNoBound, 3.0);
  model.objective(square(free) + square(both) - square(lower) - square(upper));
  AutodiffProblem problem(model, {40.0, 100.2, 0.0, 0.5});
  const auto points = starting_points(problem, starts(400, 5.0));
  ASSERT_EQ(points.size(), 400U);
  EXPECT_NEAR(points[0][0], 40.0, 1e-9);
  EXPECT_NEAR(points[0][3], 0.5, 1e-9);
  const std::array<std::pair<double, double>, 4> boxes = {
      {{40.0 - 200.0, 40.0 + 200.0}, {100.0, 101.0}, {-1.0, 5.0}, {-4.5, 3.0}}};
  for (std::size_t i = 0; i < 4; ++i) {
    const auto [low, high] = boxes[i];
    double least = high, largest = low;
    for (const auto& v : points) {
      least = std::min(least, v[i]);
      largest = std::max(largest, v[i]);
    }
    const double width = high - low;
    EXPECT_GE(least, low - 1e-6);
    EXPECT_LE(largest, high + 1e-6);
    EXPECT_LT(least, low + 0.05 * width);  // and fill it
    EXPECT_GT(largest, high - 0.05 * width);
  }
}

TEST(MultistartPoints, DependOnTheSeedAlone) {
  const auto problem = f3();
  SolverOptions options = starts(5);
  const auto first = starting_points(*problem, options);
  EXPECT_EQ(starting_points(*problem, options), first);
  options.minmax_starts = 3;  // fewer of them: the same ones
  const auto fewer = starting_points(*problem, options);
  EXPECT_TRUE(std::equal(fewer.begin(), fewer.end(), first.begin()));
  options.minmax_starts = 5;
  options.minmax_start_seed = 2;
  const auto other = starting_points(*problem, options);
  EXPECT_EQ(other[0], first[0]);
  for (std::size_t k = 1; k < 5; ++k) EXPECT_NE(other[k], first[k]);
}

TEST(MultistartPoints, GivenOnesComeAfterTheModels) {
  const auto problem = f3({0.5, 0.25});
  const std::vector<std::vector<double>> given = {{1.0, 2.0}, {3.0, 4.0}};
  auto points = starting_points(*problem, {}, given);
  ASSERT_EQ(points.size(), 3U);
  EXPECT_EQ(points[0], (std::vector<double>{0.5, 0.25}));
  EXPECT_EQ(points[1], given[0]);
  EXPECT_EQ(points[2], given[1]);
  points = starting_points(*problem, starts(5), given);
  ASSERT_EQ(points.size(), 5U);
  EXPECT_EQ(points[2], given[1]);
}

TEST(MultistartPoints, WrongLengthOfAGivenOneIsNamed) {
  const auto problem = f3();
  try {
    static_cast<void>(multistart(*problem, {}, {}, {{1.0, 2.0}, {1.0}}));
    FAIL() << "no exception";
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(std::string(error.what()), "given starting point 1 has 1 values for 2 variables");
  }
}

// --- Threads -------------------------------------------------------------------------------------

void expect_same_bits(const MultistartResult& a, const MultistartResult& b) {
  EXPECT_EQ(a.best.v, b.best.v);
  EXPECT_EQ(a.best_start, b.best_start);
  EXPECT_EQ(a.best.iterations, b.best.iterations);
  EXPECT_EQ(a.best.counts.factorizations_inner, b.best.counts.factorizations_inner);
  EXPECT_EQ(a.statuses, b.statuses);
  ASSERT_EQ(a.points.size(), b.points.size());
  for (std::size_t k = 0; k < a.points.size(); ++k) {
    EXPECT_EQ(a.points[k].result.v, b.points[k].result.v);
    EXPECT_EQ(a.points[k].result.lambda, b.points[k].result.lambda);
    EXPECT_EQ(a.points[k].first_start, b.points[k].first_start);
    EXPECT_EQ(a.points[k].found, b.points[k].found);
  }
}

TEST(MultistartThreads, DoNotChangeTheAnswer) {
  const ProblemFactory make = [] { return f3(); };
  for (const LinearSolver solver :
       {LinearSolver::Auto, LinearSolver::Ldlt, LinearSolver::Lapack, LinearSolver::Mumps}) {
    SolverOptions options = starts(60);
    options.linear_solver = solver;
    const MultistartResult one = multistart(make, 1, options);
    ASSERT_EQ(one.points.size(), 2U);
    for (const int threads : {2, 5}) expect_same_bits(one, multistart(make, threads, options));
    expect_same_bits(one, multistart(*f3(), options));
  }
}

TEST(MultistartThreads, WorkAtTheSameTimeAndGetAModelEach) {
  std::atomic<int> made = 0;
  std::mutex mutex;
  std::set<std::thread::id> ids;
  const auto hook = [&](double) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const std::lock_guard lock(mutex);
    ids.insert(std::this_thread::get_id());
  };
  const ProblemFactory make = [&] {
    ++made;
    return std::make_unique<Hooked>(hook);
  };
  SolverOptions options = starts(16);
  const MultistartResult result = multistart(make, 4, options);
  EXPECT_EQ(made, 4);
  EXPECT_EQ(result.starts, 16);
  EXPECT_GT(ids.size(), 1U);
  EXPECT_LE(ids.size(), 4U);
  made = 0;
  options.minmax_starts = 3;  // two starts are left after the first
  static_cast<void>(multistart(make, 100, options));
  EXPECT_EQ(made, 2);
}

TEST(MultistartThreads, AnalyseOnceEachAndNotPerStart) {
  std::mutex mutex;
  std::set<std::thread::id> ids;
  const ProblemFactory make = [&] {
    return std::make_unique<Hooked>([&](double) {
      std::this_thread::sleep_for(std::chrono::microseconds(200));
      const std::lock_guard lock(mutex);
      ids.insert(std::this_thread::get_id());
    });
  };
  const Index once = multistart(make, 1, starts(1)).best.counts.analyses;
  EXPECT_GT(once, 0);
  EXPECT_EQ(multistart(make, 1, starts(40)).best.counts.analyses, once);
  for (const int threads : {2, 4}) {
    ids.clear();
    const MultistartResult result = multistart(make, threads, starts(40));
    EXPECT_EQ(result.starts, 40);
    EXPECT_EQ(result.best.counts.analyses, once * static_cast<Index>(ids.size())) << threads;
  }
}

TEST(MultistartThreads, LookForTheEntriesOfTheHessianOnce) {
  const auto model = f3();
  WithoutHessian problem(*model);
  const auto calls_of_detection = [&](int count) {
    Index of_starts = 0;
    MultistartObserver observer;
    observer.on_result = [&](Index, const Result& result) { of_starts += result.counts.gradient; };
    return multistart(problem, starts(count), observer).best.counts.gradient - of_starts;
  };
  const Index once = calls_of_detection(1);
  EXPECT_GT(once, 0);
  // Two more gradients tell how much of a difference between two y the error of x explains.
  EXPECT_LE(calls_of_detection(20), once + 2);
}

TEST(MultistartThreads, AFactoryThatMakesNothingIsRefused) {
  EXPECT_THROW(static_cast<void>(multistart([] { return nullptr; }, 2, starts(3))),
               std::invalid_argument);
}

// --- Exceptions and stops ------------------------------------------------------------------------

struct Broken : std::runtime_error {
  using std::runtime_error::runtime_error;
};

TEST(MultistartExceptions, PassThroughFromEveryThread) {
  // Starts at which x is far out throw; which of them is reported must not depend on threads.
  const auto hook = [](double x) {
    if (std::abs(x) > 3.0) throw Broken("x = " + std::to_string(x));
  };
  const ProblemFactory make = [&] { return std::make_unique<Hooked>(hook); };
  std::set<std::string> messages;
  for (int repetition = 0; repetition < 20; ++repetition) {
    for (const int threads : {1, 2, 6}) {
      try {
        static_cast<void>(multistart(make, threads, starts(50, 4.0)));
        FAIL() << "no exception";
      } catch (const Broken& error) {
        messages.insert(error.what());
      }
    }
  }
  EXPECT_EQ(messages.size(), 1U);
}

TEST(MultistartExceptions, OfTheFirstStartTheObserverAndTheFactoryPass) {
  const ProblemFactory broken = [] {
    return std::make_unique<Hooked>([](double) { throw Broken("model"); });
  };
  EXPECT_THROW(static_cast<void>(multistart(broken, 3, starts(9))), Broken);
  const ProblemFactory good = [] { return f3(); };
  MultistartObserver observer;
  observer.on_result = [](Index start, const Result&) {
    if (start == 4) throw Broken("observer");
  };
  EXPECT_THROW(static_cast<void>(multistart(good, 3, starts(9), observer)), Broken);
  EXPECT_THROW(static_cast<void>(multistart(
                   []() -> std::unique_ptr<Problem> { throw Broken("factory"); }, 3, starts(9))),
               Broken);
}

TEST(MultistartStops, TheObserverStopsAllAndTheBestPointStays) {
  for (const int threads : {1, 3}) {
    MultistartObserver observer;
    Index ended = 0;
    observer.on_iteration = [&](Index start, const IterationInfo&) {
      return start < 5 || ended < 4;
    };
    observer.on_result = [&](Index, const Result&) { ++ended; };
    const MultistartResult result =
        multistart([] { return double_well(); }, threads, starts(1000), observer);
    EXPECT_EQ(result.interrupted, Status::UserStop);
    EXPECT_EQ(result.best.status, Status::UserStop);
    // Strict by itself, but what was asked for was not finished.
    EXPECT_EQ(result.best.certificate.kind, PointKind::FirstOrderPoint);
    EXPECT_EQ(result.best.certificate.second_order, SecondOrder::Satisfied);
    ASSERT_FALSE(result.points.empty());
    EXPECT_EQ(result.best.v, result.points.front().result.v);
    EXPECT_EQ(result.points.front().result.status, Status::Solved);
    EXPECT_GE(result.starts, 5);
    EXPECT_LE(result.starts, 12);
    EXPECT_EQ(total(result), result.starts);
  }
}

TEST(MultistartStops, TimeLimitsHoldForAllStartsTogether) {
  const auto slow = [](double) { std::this_thread::sleep_for(std::chrono::milliseconds(5)); };
  SolverOptions options = starts(100000);
  options.max_wall_time = 0.3;
  for (const int threads : {1, 3}) {
    const auto begin = std::chrono::steady_clock::now();
    const MultistartResult result =
        multistart([&] { return std::make_unique<Hooked>(slow); }, threads, options);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    EXPECT_EQ(result.interrupted, Status::MaxWallTime);
    EXPECT_EQ(result.best.status, Status::MaxWallTime);
    EXPECT_LE(result.best.over_x.made, result.starts);
    ASSERT_FALSE(result.points.empty());  // what was found is certified all the same
    EXPECT_EQ(result.points.front().result.status, Status::Solved);
    EXPECT_GT(result.starts, 2);
    EXPECT_LT(result.starts, 1000);
    EXPECT_LT(seconds.count(), 5.0);
  }
  options = starts(100000000);
  options.max_cpu_time = 0.2;
  const auto quick = f3();
  const MultistartResult result = multistart(*quick, options);
  EXPECT_EQ(result.interrupted, Status::MaxCpuTime);
  EXPECT_LT(result.best.cpu_seconds, 2.0);
}

TEST(MultistartStops, TimeLimitWithoutACertifiedPointIsTheStatus) {
  const auto slow = [](double) { std::this_thread::sleep_for(std::chrono::milliseconds(20)); };
  Hooked problem(slow);
  SolverOptions options = starts(10);
  options.max_wall_time = 1e-3;
  const MultistartResult result = multistart(problem, options);
  EXPECT_EQ(result.best.status, Status::MaxWallTime);
  EXPECT_EQ(result.interrupted, Status::MaxWallTime);
  EXPECT_EQ(result.starts, 1);
}

// --- Statuses and what is best -------------------------------------------------------------------

TEST(Multistart, CountsEveryStatus) {
  // (x - 1)^2 + log x is undefined for x <= 0, without lower bound.
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(square(x - 3.0) + 0.1 * log(x) - square(y - x));
  AutodiffProblem problem(model, {1.0, 0.0});
  Index undefined = 0;
  MultistartObserver observer;
  observer.on_result = [&](Index, const Result& result) {
    undefined += result.status == Status::EvaluationFailed ? 1 : 0;
  };
  const MultistartResult result = multistart(problem, starts(40, 5.0), observer);
  EXPECT_GT(undefined, 5);
  EXPECT_EQ(total(result), 40);
  bool found = false;
  for (const auto& [status, count] : result.statuses) {
    EXPECT_GT(count, 0);
    if (status == Status::EvaluationFailed) {
      EXPECT_EQ(count, undefined);
      found = true;
    }
  }
  EXPECT_TRUE(found);
  EXPECT_EQ(result.best.status, Status::Solved);
  EXPECT_NEAR(result.best.v[0], 3.0, 0.1);
}

TEST(Multistart, InvalidInputEndsAfterTheFirstStart) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(square(x) - square(y));
  model.constraint(x + y, 0.0, 1.0, kMin);
  AutodiffProblem problem(model, {1.0, 1.0});
  SolverOptions strict = starts(50);
  strict.minmax_robust_constraints = false;
  MultistartResult result = multistart(problem, strict);
  EXPECT_EQ(result.best.status, Status::InvalidProblem);
  EXPECT_EQ(result.starts, 1);
  EXPECT_TRUE(result.points.empty());

  SolverOptions options = starts(50);
  options.minmax_start_radius = std::nan("");
  result = multistart(*f3(), options);
  EXPECT_EQ(result.best.status, Status::InvalidOption);
  EXPECT_EQ(result.best.message, "minmax_start_radius = nan is not in (0, inf)");
  EXPECT_EQ(result.starts, 1);
}

TEST(Multistart, NothingCertifiedIsNotCalledSolved) {
  // Convex in y, without bound: there is no maximum.
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y");
  model.objective(square(x) + square(y) + x * y);
  AutodiffProblem problem(model, {1.0, 1.0});
  SolverOptions options = starts(12);
  const MultistartResult result = multistart(problem, options);
  EXPECT_TRUE(result.points.empty());
  EXPECT_FALSE(is_success(result.best.status));
  EXPECT_NE(result.best.certificate.kind, PointKind::LocalMinmax);
  EXPECT_EQ(total(result), 13);  // the last one as a single solve, which goes on elsewhere
}

Result made(PointKind kind, SecondOrder second_order, Status status, double objective,
            double error = 0.0) {
  Result result;
  result.v = {0.0};
  result.certificate.kind = kind;
  result.certificate.second_order = second_order;
  result.status = status;
  result.objective = objective;
  result.error.total = result.error.primal = error;
  return result;
}

TEST(Better, OrdersByWhatIsKnownOfThePoint) {
  using enum PointKind;
  using enum SecondOrder;
  Result unclear = made(FirstOrderPoint, Undecided, Status::SolvedDegenerate, -9.0);
  unclear.certificate.inner = {1, 0, 1};
  unclear.certificate.inner_expected = {0, 2, 0};
  Result nothing;
  nothing.status = Status::EvaluationFailed;
  const std::vector<Result> ordered = {
      made(LocalMinmax, Satisfied, Status::Solved, 1.0),
      made(LocalMinmax, Satisfied, Status::Solved, 2.0),
      made(FirstOrderPoint, Undecided, Status::SolvedDegenerate, -5.0),
      unclear,
      made(FeasiblePoint, NotTested, Status::MaxIterations, 7.0, 1e-3),
      made(FeasiblePoint, NotTested, Status::InnerUnbounded, -1e9, 1e3),
      made(FirstOrderPoint, Violated, Status::NotLocalMinmax, -8.0, 1e-9),
      made(InfeasiblePoint, NotTested, Status::MaxIterations, -8.0, 0.1),
      made(InfeasiblePoint, NotTested, Status::LocallyInfeasible, -9.0, 0.2),
      nothing};
  for (std::size_t i = 0; i < ordered.size(); ++i) {
    for (std::size_t j = 0; j < ordered.size(); ++j) {
      EXPECT_EQ(better(ordered[i], ordered[j]), i < j) << i << ' ' << j;
    }
  }
}

TEST(Better, NaNIsNeverBetter) {
  const Result nan = made(PointKind::FeasiblePoint, SecondOrder::NotTested, Status::MaxIterations,
                          0.0, std::nan(""));
  const Result number =
      made(PointKind::FeasiblePoint, SecondOrder::NotTested, Status::MaxIterations, 0.0, 1.0);
  EXPECT_TRUE(better(number, nan));
  EXPECT_FALSE(better(nan, number));
  EXPECT_FALSE(better(nan, nan));
}

}  // namespace
}  // namespace ipminmax
