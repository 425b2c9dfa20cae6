// Where maximizations over y begin.
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>

#include "core/global/inner_problem.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
using Starts = std::vector<std::vector<double>>;

/// y0 - 0.9 y1, y0 + z <= 1 and z free, over a box of y.
Model plane() {
  Model model;
  const Expression y0 = model.variable(Player::Max, "y0", -1.0, 1.0);
  const Expression y1 = model.variable(Player::Max, "y1", -1.0, 1.0);
  const Expression z = model.variable(Player::Max, "z");
  model.objective(y0 - 0.9 * y1);
  model.constraint(y0 + z, -kNoBound, 1.0, Player::Max);
  return model;
}

TEST(InnerStarts, StandABoundFromTheMaximum) {
  AutodiffProblem problem(plane());
  Counts counts;
  const std::vector<double> maximum{1.0, -1.0, 0.0};
  const auto starts = [&](const std::vector<double>& lambda, std::size_t most) {
    return next_to({problem, {}, counts}, maximum, lambda, most);
  };
  EXPECT_EQ(starts({0.0}, 4), (Starts{{1.0, 1.0, 0.0}, {-1.0, -1.0, 0.0}}));
  EXPECT_EQ(starts({0.0}, 1), (Starts{{1.0, 1.0, 0.0}}));
  // With its multiplier the constraint is what y0 gains from.
  EXPECT_EQ(starts({-2.0}, 1), (Starts{{-1.0, -1.0, 0.0}}));
  EXPECT_GT(counts.objective, 0);
  EXPECT_GT(counts.constraints, 0);
}

TEST(InnerStarts, LeaveOutWhereTheModelIsUndefined) {
  Model model;
  const Expression y = model.variable(Player::Max, "y", 0.0, 2.0);
  model.objective(log(y) - y);
  AutodiffProblem problem(std::move(model));
  Counts counts;
  EXPECT_EQ(next_to({problem, {}, counts}, {1.0}, {}, 4), (Starts{{2.0}}));
}

}  // namespace
}  // namespace ipminmax
