// The line search of minimizations: where it goes on from, and what it says when it ends.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include <hostile/trap_game.hpp>
#include <support/autodiff_problem.hpp>

#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;

constexpr Player kMin = Player::Min;

/// Area of a surface over a square grid whose edge is a plane's: sum over cells of
/// sqrt(1 + a (u^2 + w^2)), u and w the differences along the diagonals.
class Surface final : public Problem {
 public:
  Surface(Index points, double steepness, double rise) : points_(points), steepness_(steepness) {
    structure_.variable_players.assign(at(points * points), kMin);
    const double step = 1.0 / (points - 1);
    for (Index i = 0; i < points; ++i) {
      for (Index j = 0; j < points; ++j) {
        const bool edge = i == 0 || j == 0 || i == points - 1 || j == points - 1;
        const double height = 1.0 + rise * step * (2 * i + j);
        structure_.variable_lower.push_back(edge ? height : -kNoBound);
        structure_.variable_upper.push_back(edge ? height : kNoBound);
        start_.push_back(edge ? height : 0.0);
      }
    }
    visit(start_, [&](const Cell& cell) {
      for (std::size_t row = 0; row < 4; ++row) {
        for (std::size_t col = 0; col <= row; ++col) {
          structure_.hessian.push_back({std::max(cell.nodes[row], cell.nodes[col]),
                                        std::min(cell.nodes[row], cell.nodes[col])});
        }
      }
    });
  }
  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    std::ranges::copy(start_, start.v.begin());
    return true;
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    f = 0.0;
    visit(v, [&](const Cell& cell) { f += scale() * cell.area; });
    return true;
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> g) override {
    std::ranges::fill(g, 0.0);
    visit(v, [&](const Cell& cell) {
      for (std::size_t k = 0; k < 4; ++k) {
        g[at(cell.nodes[k])] +=
            scale() * steepness_ / cell.area * (kU[k] * cell.u + kW[k] * cell.w);
      }
    });
    return true;
  }
  [[nodiscard]] bool constraints(std::span<const double>, bool, std::span<double>) override {
    return true;
  }
  [[nodiscard]] bool jacobian(std::span<const double>, bool, std::span<double>) override {
    return true;
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma, std::span<const double>,
                             bool, std::span<double> values) override {
    std::size_t next = 0;
    visit(v, [&](const Cell& cell) {
      const double first = sigma * scale() * steepness_ / cell.area;
      const double second = first * steepness_ / (cell.area * cell.area);
      const auto along = [&](std::size_t k) { return kU[k] * cell.u + kW[k] * cell.w; };
      for (std::size_t row = 0; row < 4; ++row) {
        for (std::size_t col = 0; col <= row; ++col) {
          values[next++] =
              first * (kU[row] * kU[col] + kW[row] * kW[col]) - second * along(row) * along(col);
        }
      }
    });
    return true;
  }

 private:
  struct Cell {
    std::array<Index, 4> nodes;
    double u, w, area;
  };
  static constexpr std::array<double, 4> kU{-1.0, 1.0, 0.0, 0.0}, kW{0.0, 0.0, -1.0, 1.0};
  [[nodiscard]] static std::size_t at(Index i) { return static_cast<std::size_t>(i); }
  [[nodiscard]] double scale() const { return 1.0 / ((points_ - 1.0) * (points_ - 1.0)); }
  template <class Function>
  void visit(std::span<const double> v, Function function) const {
    for (Index i = 0; i + 1 < points_; ++i) {
      for (Index j = 0; j + 1 < points_; ++j) {
        const Index corner = i * points_ + j;
        Cell cell{.nodes = {corner, corner + points_ + 1, corner + points_, corner + 1},
                  .u = v[at(corner + points_ + 1)] - v[at(corner)],
                  .w = v[at(corner + 1)] - v[at(corner + points_)],
                  .area = 0.0};
        cell.area = std::sqrt(1.0 + steepness_ * (cell.u * cell.u + cell.w * cell.w));
        function(cell);
      }
    }
  }

  Index points_;
  double steepness_;
  ProblemStructure structure_;
  std::vector<double> start_;
};

TEST(MinimizationSearch, AWatchdogThatCannotGoOnReturnsToWhereItBegan) {
  // Its full steps raised the area to 1e19, from where no step leads on.
  Surface surface(24, 5000.0, 20.0);
  SolverOptions options;
  options.linear_solver = LinearSolver::Mumps;
  const Result result = solve(surface, options);
  EXPECT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_LT(result.objective, 200.0);
}

TEST(MinimizationSearch, ALimitOfFactorizationsIsNamedOnlyWhereThereIsOne) {
  // Restoration is what takes the last iterations.
  Model model;
  const Expression x0 = model.variable(kMin, "x0", -1e3, 1e3);
  const Expression x1 = model.variable(kMin, "x1", -1e3, 1e3);
  model.objective(x0 + x1);
  model.constraint(100.0 * square(x1 - square(x0)) + square(1.0 - x0), -kNoBound, -1.0);
  AutodiffProblem problem(model, {-1.2, 1.0});
  SolverOptions options;
  const Result free = solve(problem, options);
  ASSERT_EQ(free.status, Status::LocallyInfeasible) << name_of(free.status);
  const Index all = free.iterations + free.counts.restoration_iterations;
  ASSERT_GT(free.counts.restoration_iterations, 2);
  for (options.max_iter = all / 2; options.max_iter < all; ++options.max_iter) {
    const Result result = solve(problem, options);
    EXPECT_EQ(result.status, Status::MaxIterations) << options.max_iter;
    EXPECT_EQ(result.message.find("minmax_max_factorizations"), std::string::npos)
        << options.max_iter << ": " << result.message;
  }
}

/// A chain of springs whose ends are held twice: dependent rows in all of many steps.
AutodiffProblem chain_held_twice() {
  Model model;
  std::vector<Expression> x;
  for (int i = 0; i < 12; ++i) x.push_back(model.variable(kMin, "x", -10.0, 10.0));
  Expression energy = 0.0 * x[0];
  for (std::size_t i = 0; i + 1 < x.size(); ++i) energy = energy + square(square(x[i + 1] - x[i]));
  model.objective(energy);
  const auto equal = [&](const Expression& row, double value) {
    model.constraint(row, value, value);
  };
  equal(0.7 * x[0] + 0.1 * x[11], 0.8);
  equal(1.3 * x[0] - 0.3 * x[11], 1.0);
  equal((0.7 + 1.3) * x[0] - 0.2 * x[11], 1.8);
  for (std::size_t i = 1; i < 4; ++i) equal(x[i] * x[11] - x[i] * x[0], 0.0);
  std::vector<double> start(12, 0.0);
  for (std::size_t i = 0; i < start.size(); ++i) start[i] = std::sin(3.0 * static_cast<double>(i));
  return AutodiffProblem(model, start);
}

TEST(MinimizationSearch, DependentRowsOfAConvexModelNeedNoShiftOfTheHessian) {
  for (const LinearSolver solver : {LinearSolver::Mumps, LinearSolver::Auto}) {
    AutodiffProblem problem = chain_held_twice();
    SolverOptions options;
    options.linear_solver = solver;
    const Result result = solve(problem, options, [](const IterationInfo& info) {
      EXPECT_EQ(info.delta_x, 0.0) << info.iteration;
      return true;
    });
    EXPECT_TRUE(is_success(result.status)) << result.message;
    EXPECT_GT(result.iterations, 12);
  }
}

/// A bilevel linear program by its optimality conditions: products of slacks and multipliers that
/// vanish, so that no feasible point has independent gradients.
AutodiffProblem bilevel_program() {
  Model model;
  std::array<Expression, 5> slack, multiplier;
  for (auto& s : slack) s = model.variable(kMin, "slack", 0.0);
  for (auto& m : multiplier) m = model.variable(kMin, "multiplier", 0.0);
  const Expression a = model.variable(kMin, "a"), b = model.variable(kMin, "b");
  const Expression x = model.variable(kMin, "x", 0.0);
  model.objective(2.0 * b - x - 3.0 * a);
  const auto equal = [&](const Expression& row, double value) {
    model.constraint(row, value, value);
  };
  for (std::size_t i = 0; i < slack.size(); ++i) equal(multiplier[i] * slack[i], 0.0);
  equal(slack[0] + a + 4.0 * b - 2.0 * x, 16.0);
  equal(slack[1] + 3.0 * a - 2.0 * b + 8.0 * x, 48.0);
  equal(slack[2] + a - 3.0 * b - 2.0 * x, -12.0);
  equal(slack[3] - a, 0.0);
  equal(slack[4] + a, 4.0);
  equal(multiplier[0] + 3.0 * multiplier[1] + multiplier[2] - multiplier[3] + multiplier[4], 1.0);
  equal(2.0 * multiplier[1] - 3.0 * multiplier[2], 0.0);
  return AutodiffProblem(model, std::vector<double>(13, 0.0));
}

TEST(MinimizationSearch, OneThatIsStuckBeginsAnewWithTheOtherBarrierRule) {
  AutodiffProblem problem = bilevel_program();
  SolverOptions options;
  options.minmax_max_restarts = 0;
  const Result first = solve(problem, options);
  ASSERT_EQ(first.status, Status::TinyStep) << first.message;
  options.minmax_max_restarts = SolverOptions().minmax_max_restarts;
  bool began_anew = false;
  Index last = -1;
  const Result result = solve(problem, options, [&](const IterationInfo& info) {
    began_anew = began_anew || info.step_kind == 'w';
    EXPECT_EQ(info.iteration, ++last);
    return true;
  });
  EXPECT_TRUE(began_anew);
  EXPECT_TRUE(is_success(result.status)) << result.message;
  EXPECT_NEAR(result.objective, -13.0, 1e-6);
  EXPECT_GT(result.iterations, first.iterations);
  // One budget of iterations for both, and the end of the first search where no second one fits.
  options.max_iter = first.iterations + 3;
  EXPECT_EQ(solve(problem, options).iterations, options.max_iter);
}

// First-order points of a wrong curvature that no move along it leaves: with the other mu_strategy
// the search from the model's start ends elsewhere.
TEST(StuckMinimization, AtASaddleBeginsAnew) {
  for (const std::uint64_t seed : {17055, 18742, 25630}) {
    const testing::RandomGame game = testing::trap_game(seed);
    testing::AutodiffProblem problem(game.model, game.start);
    bool anew = false;
    SolveObserver observer;
    observer.message = [&](std::string_view text) {
      anew = anew || text.find("again with mu_strategy") != std::string_view::npos;
    };
    const Result result = solve(problem, game.options, observer);
    EXPECT_TRUE(anew) << "seed " << seed;
    EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax)
        << "seed " << seed << ": " << result.message;
  }
}

}  // namespace
}  // namespace ipminmax
