// Variables that nothing holds back: slacks that may grow, epigraph variables that nothing presses
// down, soft constraints of weight zero, variables that nothing reads. The barrier pulls them
// outward, but the value does not change on the way: the point is a solution, as Ipopt says.
#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <regression/problem_tnlp.hpp>
#include <support/autodiff_problem.hpp>
#include <support/dice.hpp>

#include "adapter/ipopt/status.hpp"
#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

constexpr Player kMin = Player::Min, kMax = Player::Max;

enum class Kind { Linear, Quadratic, Nonlinear, Game };

struct Flat {
  Model model{};
  std::vector<double> start{};
  std::vector<Expression> x{};
  Expression objective{};

  Expression add(Player player, double lower, double upper, double at) {
    start.push_back(at);
    return model.variable(player, "v" + std::to_string(start.size()), lower, upper);
  }
};

/// The model before anything is free to grow.
void add_base(Kind kind, Dice& dice, Flat& flat) {
  const int n = 2 + dice.below(3);
  Expression sum = 0.0;
  for (int i = 0; i < n; ++i) {
    const Expression x = flat.add(kMin, -1.0, dice.between(0.5, 2.0), dice.between(-0.5, 0.5));
    const double center = dice.between(-1.5, 1.5);
    flat.x.push_back(x);
    sum = sum + x;
    if (kind == Kind::Linear) flat.objective = flat.objective + dice.between(-2.0, 2.0) * x;
    if (kind == Kind::Quadratic) {
      flat.objective = flat.objective + dice.between(0.2, 3.0) * square(x - center);
    }
    if (kind == Kind::Nonlinear) {
      flat.objective = flat.objective + exp(dice.between(-1.0, 1.0) * x) +
                       dice.one_of({pow(x - center, 4.0), sin(2.0 * x), square(x) * x});
    }
    if (kind == Kind::Game) {
      const Expression y = flat.add(kMax, -5.0, 5.0, dice.between(-0.5, 0.5));
      flat.objective = flat.objective + square(x - center) + dice.between(0.3, 2.0) * x * y -
                       dice.between(0.5, 2.0) * square(y);
    }
  }
  flat.model.constraint(sum, -0.5 * n, 0.4 * n);
}

/// A variable that may grow.
void add_free(Kind kind, Dice& dice, Flat& flat) {
  const double start = dice.one_of({0.0, 0.3, 2.0, 30.0});
  const double lower = dice.one_of({0.0, -2.0, -kNoBound});
  const Expression x =
      flat.x[static_cast<std::size_t>(dice.below(static_cast<int>(flat.x.size())))];
  if (kind == Kind::Game && dice.chance(0.5)) {  // unread, of Max
    flat.add(kMax, std::max(lower, -2.0), dice.one_of({100.0, 1e5, kNoBound}), start);
    return;
  }
  const Expression t = flat.add(kMin, lower, dice.one_of({kNoBound, kNoBound, 1e4}), start);
  switch (dice.below(5)) {
    case 0:  // a slack
      flat.model.constraint(t - x, 0.0, kNoBound);
      break;
    case 1:  // an epigraph
      flat.model.constraint(t - square(x) - 0.3 * x, 0.0, kNoBound);
      break;
    case 2:  // a soft constraint
      flat.objective = flat.objective + 0.0 * t;
      flat.model.constraint(2.0 * x - t, -kNoBound, -0.5);
      break;
    case 3:  // beside a slack of the same row
      flat.model.constraint(t + flat.add(kMin, 0.0, kNoBound, start) - exp(x), 0.0, kNoBound);
      break;
    default:  // unread
      break;
  }
}

Flat random_flat(Kind kind, std::uint64_t seed) {
  Dice dice(seed);
  Flat flat;
  add_base(kind, dice, flat);
  const int count = 1 + dice.below(5);
  for (int k = 0; k < count; ++k) add_free(kind, dice, flat);
  flat.model.objective(flat.objective);
  return flat;
}

bool is_divergence(Status status) {
  return status == Status::DivergingIterates || status == Status::OuterUnbounded ||
         status == Status::InnerUnbounded;
}

TEST(FlatDirections, AreSolutionsAsForIpopt) {
  const std::uint64_t runs = number_from("FLAT_DIRECTIONS", 50);
  for (const Kind kind : {Kind::Linear, Kind::Quadratic, Kind::Nonlinear}) {
    int same = 0;
    for (std::uint64_t seed = 1; seed <= runs; ++seed) {
      const Flat flat = random_flat(kind, seed);
      AutodiffProblem problem(flat.model, flat.start);
      const IpoptAnswer ipopt = solve_with_ipopt(problem);
      const Result ours = solve(problem, SolverOptions{});
      const std::string name = std::to_string(static_cast<int>(kind)) + '/' + std::to_string(seed);
      EXPECT_EQ(application_status(ours.status), ipopt.status) << name << ": " << ours.message;
      EXPECT_FALSE(is_divergence(ours.status)) << name << ": " << ours.message;
      same += application_status(ours.status) == ipopt.status ? 1 : 0;
    }
    std::printf("kind %d: %d of %d as Ipopt's\n", static_cast<int>(kind), same,
                static_cast<int>(runs));
  }
}

TEST(FlatDirections, AreSolutionsInGames) {
  const std::uint64_t runs = number_from("FLAT_DIRECTIONS", 50);
  int solved = 0;
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    const Flat flat = random_flat(Kind::Game, seed);
    AutodiffProblem problem(flat.model, flat.start);
    const Result result = solve(problem, SolverOptions{});
    EXPECT_TRUE(is_success(result.status)) << seed << ": " << result.message;
    EXPECT_EQ(result.message.find("unbounded"), std::string::npos) << result.message;
    solved += is_success(result.status) ? 1 : 0;
  }
  std::printf("games: %d of %d solved\n", solved, static_cast<int>(runs));
}

}  // namespace
}  // namespace ipminmax::testing
