// Robust constraints are maximized one at a time: of the others nothing is evaluated.
#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include <gtest/gtest.h>

#include "core/formulas/autodiff_problem.hpp"
#include "core/robust.hpp"
#include "core/robust/row_over_y.hpp"
#include "core/search/one_start.hpp"

namespace ipminmax {
namespace {

/// (x - 3)^2 subject to x + a_k y_0 <= 2 for |y| <= 1, and y_0^2 + y_1^2 <= 1 last; counts
/// evaluations of each row, the objective behind them.
struct Rows {
  std::vector<Index>* calls;

  template <class T>
  T objective(std::span<const T> v) const {
    ++calls->back();
    return square(v[0] - 3.0);
  }
  template <class T>
  T constraint(std::size_t j, std::span<const T> v) const {
    ++(*calls)[j];
    if (j + 2 == calls->size()) return square(v[1]) + square(v[2]);
    return v[0] + slope(j) * v[1];
  }
  static double slope(std::size_t j) { return 0.2 + 0.8 * static_cast<double>(j % 7) / 6.0; }
};

AutodiffProblem<Rows> make(std::size_t rows, std::vector<Index>& calls) {
  calls.assign(rows + 2, 0);
  std::vector<Player> owners(rows + 1, Player::Min);
  owners.back() = Player::Max;
  std::vector<double> upper(rows + 1, 2.0);
  upper.back() = 1.0;
  AutodiffProblem problem(Rows{&calls}, {.players = {Player::Min, Player::Max, Player::Max},
                                         .start = {0.0, 0.1, 0.1},
                                         .constraint_lower = std::vector<double>(rows + 1, -2e19),
                                         .constraint_upper = std::move(upper),
                                         .constraint_players = std::move(owners)});
  std::ranges::fill(calls, 0);
  return problem;
}

TEST(ConstraintRows, MaximizingARowEvaluatesItAndMaxsConstraints) {
  std::vector<Index> calls;
  auto problem = make(5, calls);
  RowOverY row(problem, 2, 1.0, {0.0, 0.1, 0.1}, RobustScopes(problem.structure()).of(2));
  SolverOptions options;
  Budget budget(options);
  const Result result = solve_from_start(row, options, budget, {}, nullptr);
  EXPECT_EQ(result.status, Status::Solved) << result.message;
  EXPECT_NEAR(result.objective, Rows::slope(2), 1e-6);
  for (const std::size_t other : {0, 1, 3, 4, 6}) EXPECT_EQ(calls[other], 0) << other;
  EXPECT_GT(calls[2], 0);
  EXPECT_GT(calls[5], 0);
}

TEST(ConstraintRows, CallsPerRowDoNotGrowWithTheirNumber) {
  double of_ten = 0.0;  // with one row there is no copy
  for (const std::size_t rows : {1, 10, 60}) {
    std::vector<Index> calls;
    auto problem = make(rows, calls);
    const Result result = solve_robust(problem, {}).result;
    EXPECT_TRUE(is_success(result.status)) << rows << ": " << result.message;
    EXPECT_NEAR(result.v[0], 2.0 - Rows::slope(std::min<std::size_t>(rows - 1, 6)), 1e-6) << rows;
    const auto most = static_cast<double>(*std::max_element(calls.begin(), calls.end() - 2));
    if (rows == 10) of_ten = most;
    EXPECT_LE(rows > 10 ? most : 0.0, 1.2 * of_ten) << rows;
  }
}

struct Payoff {
  template <class T>
  T objective(std::span<const T> v) const {
    return v[0] * v[1] + exp(v[2]);
  }
};
struct Together : Payoff {
  template <class T>
  void constraints(std::span<const T> v, std::span<T> g) const {
    g[0] = sin(v[0]) * v[2];
    g[1] = v[1] * v[1];
  }
};
struct Alone : Payoff {
  template <class T>
  T constraint(std::size_t j, std::span<const T> v) const {
    return j == 0 ? sin(v[0]) * v[2] : v[1] * v[1];
  }
};

TEST(ConstraintRows, FormulasByRowGiveWhatThoseOfAllGive) {
  const ModelData data{.players = {Player::Min, Player::Max, Player::Max},
                       .start = {0.3, 0.5, 0.7},
                       .constraint_lower = {0.0, 0.0},
                       .constraint_upper = {1.0, 1.0}};
  AutodiffProblem together(Together{}, data);
  AutodiffProblem alone(Alone{}, data);
  ASSERT_EQ(together.structure().jacobian, alone.structure().jacobian);
  ASSERT_EQ(together.structure().hessian, alone.structure().hessian);
  const auto values = [&](Problem& problem) {
    const std::vector<double> v{0.4, 0.2, 0.6}, lambda{0.5, -2.0};
    std::vector<double> all(3 + 2, 0.0), j(problem.structure().jacobian.size()),
        h(problem.structure().hessian.size());
    EXPECT_TRUE(problem.gradient(v, true, std::span(all).first(3)));
    EXPECT_TRUE(problem.constraints(v, true, std::span(all).subspan(3)));
    EXPECT_TRUE(problem.jacobian(v, true, j));
    EXPECT_TRUE(problem.hessian(v, true, 1.5, lambda, true, h));
    all.insert(all.end(), j.begin(), j.end());
    all.insert(all.end(), h.begin(), h.end());
    return all;
  };
  const std::vector<double> expected = values(together), found = values(alone);
  for (std::size_t k = 0; k < expected.size(); ++k) EXPECT_DOUBLE_EQ(found[k], expected[k]) << k;
}

/// sum v_i^3, and v_j v_{j+1} for each pair of neighbours.
struct Chain {
  template <class T>
  T objective(std::span<const T> v) const {
    T f = 0.0;
    for (const T& value : v) f += value * value * value;
    return f;
  }
  template <class T>
  T constraint(std::size_t j, std::span<const T> v) const {
    return v[j] * v[j + 1];
  }
};

/// With memory for all variables in each row this would take gigabytes. Points alternate between
/// calls: rows know which they have recorded.
TEST(ConstraintRows, ThousandsTakeMemoryForWhatTheyRead) {
  constexpr std::size_t kSize = 10'000;
  AutodiffProblem problem(Chain{}, {.players = std::vector<Player>(kSize, Player::Min),
                                    .start = std::vector<double>(kSize, 0.5),
                                    .constraint_lower = std::vector<double>(kSize - 1),
                                    .constraint_upper = std::vector<double>(kSize - 1, 1.0)});
  EXPECT_EQ(problem.structure().hessian.size(), 2 * kSize - 1);
  const std::vector<double> lambda(kSize - 1, 2.0);
  std::vector<double> slopes(2 * (kSize - 1)), bends(2 * kSize - 1), one(slopes.size());
  for (const double at : {1.0, 3.0, 1.0}) {
    const std::vector<double> v(kSize, at), other(kSize, at + 1.0);
    ASSERT_TRUE(problem.jacobian(v, true, slopes));
    EXPECT_EQ(slopes.front(), at);
    ASSERT_TRUE(problem.jacobian_rows(std::vector<Index>{7}, other, true, one));
    EXPECT_EQ(one[14], at + 1.0);
    ASSERT_TRUE(problem.hessian(v, true, 1.0, lambda, true, bends));
    EXPECT_EQ(bends.front(), 6.0 * at);
    EXPECT_EQ(bends[1], 2.0);
    EXPECT_EQ(bends.back(), 6.0 * at);
  }
}

}  // namespace
}  // namespace ipminmax
