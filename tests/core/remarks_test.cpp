// What looks like a mistake in who owns what.
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>

#include "core/diagnostics/diagnosis.hpp"
#include "core/solver.hpp"

namespace ipminmax {
namespace {

using testing::AutodiffProblem;
using testing::Expression;
using testing::kNoBound;
using testing::Model;

constexpr Player kMin = Player::Min;
constexpr Player kMax = Player::Max;

/// A controller u, a gust w and a state s with s = u + w, whose owner differs.
AutodiffProblem shared_state(Player gust, double price = 10.0) {
  Model model;
  const Expression u = model.variable(kMin, "u", -5.0, 5.0);
  const Expression w = model.variable(gust, "w[1]", -1.0, 1.0);
  const Expression s = model.variable(kMax, "s");
  model.objective(5.0 * square(u) + square(s - 1.0) - price * square(w));
  model.constraint(s - u - w, 0.0, 0.0);
  return AutodiffProblem(model, {0.0, 0.1, 0.1});
}

std::string first(const std::vector<std::string>& remarks) {
  return remarks.empty() ? std::string() : remarks.front();
}

TEST(SplitRemarks, MaxWithoutAChoice) {
  EXPECT_EQ(first(split_remarks(shared_state(kMax).structure())), "");
  const std::string text = first(split_remarks(shared_state(kMin).structure()));
  EXPECT_NE(text.find("Max has 1 equality constraint for 1 variable: no choice is left"),
            std::string::npos)
      << text;
  // To Min the equation, which reads Max's variables, may not go.
  EXPECT_EQ(text.find("to Min"), std::string::npos) << text;
}

TEST(Remedies, AreInTheUsersTerms) {
  const AutodiffProblem game = shared_state(kMax);
  Result result;
  result.v = {0.0, -0.9999, 7.0};
  result.status = Status::Solved;
  EXPECT_EQ(advice(game.structure(), result), "");
  result.status = Status::NoLocalMinmaxFound;
  std::string text = advice(game.structure(), result);
  for (const char* way : {"price", "find_price", "feedback", "kink", "minmax_epigraph", "starts"})
    EXPECT_NE(text.find(way), std::string::npos) << text;
  EXPECT_EQ(text.find("inequality"), std::string::npos) << text;  // s is a state
  result.status = Status::InnerUnbounded;
  text = advice(game.structure(), result);
  EXPECT_NE(text.find("the disturbance wins: f grows with variable 2 (s)"), std::string::npos)
      << text;
}

// max over |y| = 1 of x'y has a kink at 0, which max over |y| <= 1 has as a saddle of f.
TEST(Remedies, AtAKinkNameAnEquationThatIsMaxsAlone) {
  Model model;
  const Expression x = model.variable(kMin, "x");
  const Expression y = model.variable(kMax, "y"), z = model.variable(kMax, "z");
  model.objective(x * (y + z));
  model.constraint(square(y) + square(z), 1.0, 1.0);
  const AutodiffProblem game(model, {1.0, 0.6, 0.8});
  Result result;
  result.v = {0.0, 0.6, 0.8};
  for (const Status status : {Status::NoLocalMinmaxFound, Status::NotLocalMinmax}) {
    result.status = status;
    const std::string text = advice(game.structure(), result);
    for (const char* way : {"kink", "minmax_epigraph yes", "an inequality in place of"})
      EXPECT_NE(text.find(way), std::string::npos) << text;
  }
}

TEST(Remedies, MistakesOfThePlayersComeFirst) {
  const AutodiffProblem game = shared_state(kMin);
  Result result;
  result.v = {0.0, 0.0, 0.0};
  result.status = Status::NoLocalMinmaxFound;
  const std::string text = advice(game.structure(), result);
  EXPECT_NE(text.find("no choice is left"), std::string::npos) << text;
  EXPECT_EQ(text.find("find_price"), std::string::npos) << text;
}

/// Six stages s_k+1 = 0.9 s_k + u_k + w_k, of which Max owns the first states. Where a design is
/// given, it is an open variable of Min's in all of them, with the states' name.
AutodiffProblem stages(int owned, double gust_bound, bool design = false) {
  constexpr int kStages = 6;
  Model model;
  Expression cost = 0.0, last = 0.5;
  std::vector<Expression> left_over;
  const Expression d = design ? model.variable(kMin, "s") : Expression(0.0);
  for (int k = 0; k < kStages; ++k) {
    const std::string index = "[" + std::to_string(k) + "]";
    const Expression u = model.variable(kMin, "u" + index);
    const Expression w = model.variable(kMax, "w" + index, -gust_bound, gust_bound);
    const Expression s = model.variable(k < owned ? kMax : kMin, "s" + index);
    cost = cost + square(u) + square(s) - 20.0 * square(w);
    left_over.push_back(s - (0.9 + d) * last - u - w);
    last = s;
  }
  model.objective(cost);
  for (const Expression& expression : left_over) model.constraint(expression, 0.0, 0.0, kMax);
  return AutodiffProblem(model, std::vector<double>(3 * kStages + (design ? 1 : 0), 0.1));
}

TEST(SplitRemarks, HalfOfTheStatesForgotten) {
  EXPECT_EQ(first(split_remarks(stages(6, 1.0).structure())), "");
  EXPECT_EQ(first(split_remarks(stages(6, kNoBound).structure())), "");
  const std::string text = first(split_remarks(stages(3, 1.0).structure()));
  EXPECT_NE(text.find("Max has 6 equality constraints for 3 variables without two bounds, and "
                      "2 variables of Min's in several of them (the first: variable 11 (s[3]))"),
            std::string::npos)
      << text;
}

TEST(OnePlayerRemark, SaysWhoHasNoChoice) {
  for (const Player player : {kMin, kMax}) {
    Model model;
    const Expression x = model.variable(player, "x", -1.0, 1.0);
    model.objective(square(x));
    const std::string text = one_player_remark(AutodiffProblem(model, {0.0}).structure());
    EXPECT_NE(text.find(player == kMin ? "Max has no variables" : "Min has no variables"),
              std::string::npos)
        << text;
  }
  Model model;
  const Expression x = model.variable(kMin, "x"), y = model.variable(kMax, "y", 1.0, 1.0);
  model.objective(square(x) + y);
  EXPECT_NE(one_player_remark(AutodiffProblem(model, {0.0, 1.0}).structure()).find("all fixed"),
            std::string::npos);
}

TEST(Structure, ForgottenConstraintPlayersAreNamed) {
  class Forgetful final : public Problem {
   public:
    Forgetful() {
      s_.variable_players = {kMin};
      s_.variable_lower = {-1.0};
      s_.variable_upper = {1.0};
      s_.constraint_lower = {0.0};
      s_.constraint_upper = {1.0};
    }
    const ProblemStructure& structure() const override { return s_; }
    bool starting_point(StartingPoint&) override { return true; }
    bool objective(std::span<const double>, bool, double&) override { return true; }
    bool gradient(std::span<const double>, bool, std::span<double>) override { return true; }
    bool constraints(std::span<const double>, bool, std::span<double>) override { return true; }
    bool jacobian(std::span<const double>, bool, std::span<double>) override { return true; }
    bool hessian(std::span<const double>, bool, double, std::span<const double>, bool,
                 std::span<double>) override {
      return true;
    }

   private:
    ProblemStructure s_;
  };
  Forgetful problem;
  const Result result = solve(problem, {});
  EXPECT_EQ(result.status, Status::InvalidProblem);
  EXPECT_NE(result.message.find("constraint_players is empty for 1 constraints"), std::string::npos)
      << result.message;
}

TEST(Remarks, AnEmptyYIsNamedInPlaceOfPrices) {
  // HS71 with one variable given to Max, whose constraints then leave no y near the start's x.
  Model model;
  const Expression x0 = model.variable(kMin, "x0", 1.0, 5.0);
  const Expression y = model.variable(kMax, "y", 1.0, 5.0);
  const Expression x2 = model.variable(kMin, "x2", 1.0, 5.0);
  const Expression x3 = model.variable(kMin, "x3", 1.0, 5.0);
  model.objective(x0 * x3 * (x0 + y + x2) + x2);
  model.constraint(x0 * y * x2 * x3, 25.0, kNoBound, kMax);
  model.constraint(square(x0) + square(y) + square(x2) + square(x3), 40.0, 40.0, kMax);
  AutodiffProblem problem(model, {1.0, 5.0, 5.0, 1.0});
  const Result result = solve(problem, {});
  EXPECT_FALSE(is_success(result.status)) << result.message;
  EXPECT_NE(result.message.find("Max's constraints are not met"), std::string::npos)
      << result.message;
  for (const char* part : {"price", "kink"})
    EXPECT_EQ(result.message.find(part), std::string::npos) << result.message;
}

TEST(Remarks, ARowOfMaxThatReadsBothPlayersIsNamedUnlessRowsAreRobust) {
  // Left to Max by default, -x0 with 2 x0 y0 - y0^2 <= 4 has the answer x0 = 10 for 2.5.
  Model model;
  const Expression x = model.variable(kMin, "x", 0.0, 10.0);
  const Expression y = model.variable(kMax, "y", -1.0, 1.0);
  model.objective(-x);
  model.constraint(2.0 * x * y - square(y), -kNoBound, 4.0, kMax);
  const AutodiffProblem problem(model, {1.0, 0.0});
  EXPECT_NE(coupled_remark(problem.structure()).find("give it to Min"), std::string::npos);
  model.constraint(x * y, -kNoBound, 4.0, kMin);
  const AutodiffProblem with_robust(model, {1.0, 0.0});
  EXPECT_EQ(coupled_remark(with_robust.structure()), "");
}

}  // namespace
}  // namespace ipminmax
