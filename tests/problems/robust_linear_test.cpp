// Robust linear programs, max sum of x with sum of (a + s_i y_i) x_i <= 1 for every y in Y, by their
// closed forms: Y a box, a ball, a budget (Bertsimas and Sim 2004) and a simplex.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/robust.hpp"

namespace ipminmax {
namespace {

enum class Set { Box, Ball, Budget, Simplex };

constexpr double kCost = 0.5;                  // a
constexpr double kLeast = 0.001, kMost = 1.0;  // of x in the box's program
constexpr double kUnbounded = 1e20;

/// x_1, ..., x_n of Min, y_1, ..., y_n of Max; the robust row, then Y's.
class RobustLinear final : public Problem {
 public:
  RobustLinear(Set set, int n) : set_(set), n_(static_cast<std::size_t>(n)) {
    for (std::size_t i = 0; i < n_; ++i) spread_.push_back(set == Set::Budget ? 1.0 : spread(i));
    s_.variable_players.assign(n_, Player::Min);
    s_.variable_players.resize(2 * n_, Player::Max);
    const bool box = set == Set::Box, signed_y = box || set == Set::Ball;
    s_.variable_lower.assign(n_, box ? kLeast : 0.0);
    s_.variable_upper.assign(n_, box ? kMost : kUnbounded);
    s_.variable_lower.resize(2 * n_, signed_y ? -1.0 : 0.0);
    s_.variable_upper.resize(2 * n_, 1.0);
    s_.constraint_players = {Player::Min};
    s_.constraint_lower = {-kUnbounded};
    s_.constraint_upper = {1.0};
    const auto columns = [&](Index row, std::size_t begin) {
      for (std::size_t i = begin; i < begin + n_; ++i) {
        s_.jacobian.push_back({row, static_cast<Index>(i)});
      }
    };
    columns(0, 0);
    columns(0, n_);
    for (std::size_t i = 0; i < n_; ++i) {
      s_.hessian.push_back({static_cast<Index>(n_ + i), static_cast<Index>(i)});
    }
    if (box) return;
    s_.constraint_players.push_back(Player::Max);
    s_.constraint_lower.push_back(-kUnbounded);
    s_.constraint_upper.push_back(set == Set::Budget ? budget() : 1.0);
    columns(1, n_);
    for (std::size_t i = n_; set == Set::Ball && i < 2 * n_; ++i) {
      s_.hessian.push_back({static_cast<Index>(i), static_cast<Index>(i)});
    }
  }

  [[nodiscard]] const ProblemStructure& structure() const override { return s_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    std::ranges::fill(start.v, 0.01);
    return !start.needs_multipliers;
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    f = -std::accumulate(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(n_), 0.0);
    return true;
  }
  [[nodiscard]] bool gradient(std::span<const double>, bool, std::span<double> out) override {
    std::ranges::fill(out, 0.0);
    std::ranges::fill(out.first(n_), -1.0);
    return true;
  }
  [[nodiscard]] bool constraints(std::span<const double> v, bool, std::span<double> g) override {
    g[0] = 0.0;
    if (set_ != Set::Box) g[1] = 0.0;
    for (std::size_t i = 0; i < n_; ++i) {
      const double y = v[n_ + i];
      g[0] += (kCost + spread_[i] * y) * v[i];
      if (set_ != Set::Box) g[1] += set_ == Set::Ball ? y * y : y;
    }
    return true;
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool, std::span<double> out) override {
    for (std::size_t i = 0; i < n_; ++i) {
      out[i] = kCost + spread_[i] * v[n_ + i];
      out[n_ + i] = spread_[i] * v[i];
      if (set_ != Set::Box) out[2 * n_ + i] = set_ == Set::Ball ? 2.0 * v[n_ + i] : 1.0;
    }
    return true;
  }
  [[nodiscard]] bool hessian(std::span<const double>, bool, double, std::span<const double> lambda,
                             bool, std::span<double> out) override {
    for (std::size_t i = 0; i < n_; ++i) {
      out[i] = lambda[0] * spread_[i];
      if (set_ == Set::Ball) out[n_ + i] = 2.0 * lambda[1];
    }
    return true;
  }

  /// The largest sum of x.
  [[nodiscard]] double optimum() const {
    double sum = 0.0, inverse = 0.0, inverse_square = 0.0;
    for (const double s : spread_) {
      inverse += 1.0 / s;
      inverse_square += 1.0 / (s * s);
    }
    switch (set_) {
      case Set::Box: {  // a knapsack: the cheapest first
        std::vector<double> prices;
        double left = 1.0;
        for (const double s : spread_) {
          prices.push_back(kCost + s);
          left -= kLeast * prices.back();
          sum += kLeast;
        }
        std::ranges::sort(prices);
        for (const double price : prices) {
          const double more = std::clamp(left / price, 0.0, kMost - kLeast);
          sum += more;
          left -= more * price;
        }
        return sum;
      }
      case Set::Ball:  // a sum + |S x| <= 1, and sum <= |S^-1 1| |S x|
        return 1.0 / (kCost + 1.0 / std::sqrt(inverse_square));
      case Set::Budget:  // the budget's largest x: no less than its share of the sum
        return 1.0 / (kCost + budget() / static_cast<double>(n_));
      case Set::Simplex:  // x_i <= m / s_i with m the largest s_i x_i
        return inverse / (kCost * inverse + 1.0);
    }
    return sum;
  }

 private:
  [[nodiscard]] double spread(std::size_t i) const {
    return 0.2 + 0.3 * static_cast<double>((7 * i) % 11) / 11.0 + 1e-3 * static_cast<double>(i);
  }
  [[nodiscard]] double budget() const { return std::floor(std::sqrt(static_cast<double>(n_))); }

  Set set_;
  std::size_t n_;
  std::vector<double> spread_;
  ProblemStructure s_;
};

class RobustLinearPrograms : public ::testing::TestWithParam<std::pair<Set, int>> {};

TEST_P(RobustLinearPrograms, HaveTheirClosedForms) {
  RobustLinear problem(GetParam().first, GetParam().second);
  SolverOptions options;
  options.minmax_max_factorizations = 5000;
  const RobustResult answer = solve_robust(problem, options);
  const Result& result = answer.result;
  const bool certified = result.certificate.kind == PointKind::LocalMinmax;
  std::printf("%s, error %.1e of %.6f, %s, %d factorizations, %d maximizations\n",
              certified ? "certified" : "not certified", -result.objective - problem.optimum(),
              problem.optimum(), result.message.c_str(), result.factorizations,
              answer.maximizations);
  ASSERT_TRUE(is_success(result.status)) << result.message;
  EXPECT_NEAR(-result.objective, problem.optimum(), 1e-6 * problem.optimum());
}

std::string name_of_program(const ::testing::TestParamInfo<std::pair<Set, int>>& info) {
  constexpr const char* kNames[] = {"Box", "Ball", "Budget", "Simplex"};
  return kNames[static_cast<int>(info.param.first)] + std::to_string(info.param.second);
}

INSTANTIATE_TEST_SUITE_P(Sets, RobustLinearPrograms,
                         ::testing::Values(std::pair(Set::Box, 5), std::pair(Set::Box, 50),
                                           std::pair(Set::Box, 200), std::pair(Set::Ball, 5),
                                           std::pair(Set::Ball, 50), std::pair(Set::Ball, 200),
                                           std::pair(Set::Budget, 5), std::pair(Set::Budget, 50),
                                           std::pair(Set::Budget, 200), std::pair(Set::Simplex, 5),
                                           std::pair(Set::Simplex, 50),
                                           std::pair(Set::Simplex, 200)),
                         name_of_program);

}  // namespace
}  // namespace ipminmax
