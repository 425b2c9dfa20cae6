// Which of Max's variables a robust constraint involves, and which of them it does not depend on.
#include <initializer_list>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "core/robust/robust_scope.hpp"

namespace ipminmax {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
using Indices = std::vector<Index>;

/// All of Max but the constraint `robust`.
class Structure {
 public:
  Index free() { return variable(-kInfinity, kInfinity); }
  Index in_box() { return variable(-1.0, 1.0); }
  Index equation(std::initializer_list<Index> reads) { return row(Player::Max, 0.0, reads); }
  Index inequality(std::initializer_list<Index> reads) {
    return row(Player::Max, -kInfinity, reads);
  }
  Index robust(std::initializer_list<Index> reads) { return row(Player::Min, -kInfinity, reads); }
  [[nodiscard]] RobustScope scope_of(Index constraint) const {
    return RobustScopes(structure_).of(constraint);
  }
  /// All equations are linear in all that they read.
  [[nodiscard]] RobustScope explicit_scope_of(Index constraint) const {
    return RobustScopes(structure_, std::vector<bool>(structure_.jacobian.size(), true))
        .of(constraint);
  }

 private:
  Index variable(double lower, double upper) {
    structure_.variable_players.push_back(Player::Max);
    structure_.variable_lower.push_back(lower);
    structure_.variable_upper.push_back(upper);
    return static_cast<Index>(structure_.variable_players.size()) - 1;
  }
  Index row(Player player, double lower, std::initializer_list<Index> reads) {
    const auto j = static_cast<Index>(structure_.constraint_players.size());
    structure_.constraint_players.push_back(player);
    structure_.constraint_lower.push_back(lower);
    structure_.constraint_upper.push_back(0.0);
    for (const Index i : reads) structure_.jacobian.push_back({j, i});
    return j;
  }
  ProblemStructure structure_;
};

/// s_0 in a box, s_{k+1} = F(s_k, w_k), two states, the equations in both.
struct Trajectory : Structure {
  std::vector<Index> s, w;
  explicit Trajectory(int stages) {
    s = {in_box(), in_box()};
    for (int k = 0; k < stages; ++k) {
      w.push_back(in_box());
      const Index a = s[s.size() - 2], b = s[s.size() - 1];
      const Index c = free(), d = free();
      equation({a, b, w.back(), c, d});
      equation({d, c, b, a, w.back()});
      s.insert(s.end(), {c, d});
    }
  }
};

TEST(RobustScope, WhatFollowsAStageIsIrrelevantToItsConstraint) {
  Trajectory t(5);
  const Index third = t.robust({t.s[6]});
  const RobustScope scope = t.scope_of(third);
  EXPECT_EQ(scope.variables.size(), t.s.size() + t.w.size());
  EXPECT_EQ(scope.constraints.size(), 10U);
  EXPECT_EQ(scope.irrelevant, (Indices{t.w[3], t.w[4]}));
  const Index last = t.robust({t.s[10]});
  EXPECT_EQ(t.scope_of(last).irrelevant, Indices{});
}

TEST(RobustScope, WhatIsRestrictedTogetherMatters) {
  Trajectory energy(3);  // of all disturbances
  energy.inequality({energy.w[0], energy.w[1], energy.w[2]});
  EXPECT_EQ(energy.scope_of(energy.robust({energy.s[2]})).irrelevant, Indices{});

  Trajectory apart(3);  // of those behind the constraint alone
  apart.inequality({apart.w[1], apart.w[2]});
  EXPECT_EQ(apart.scope_of(apart.robust({apart.s[2]})).irrelevant,
            (Indices{apart.w[1], apart.w[2]}));

  Trajectory end(3);  // a state behind the constraint, so all disturbances up to it
  end.inequality({end.s[4]});
  EXPECT_EQ(end.scope_of(end.robust({end.s[2]})).irrelevant, Indices{end.w[2]});

  Trajectory met(3);  // an equation that determines nothing new
  met.equation({met.s[6]});
  met.equation({met.s[7]});
  EXPECT_EQ(met.scope_of(met.robust({met.s[2]})).irrelevant, Indices{});
}

TEST(RobustScope, OneStateWithBoundsMakesAllMatter) {
  Structure s;
  const Index w = s.in_box(), later = s.in_box(), first = s.free(), second = s.in_box();
  s.equation({w, first});
  s.equation({first, later, second});  // second stays in its box by the choice of later
  EXPECT_EQ(s.scope_of(s.robust({first})).irrelevant, Indices{});
}

TEST(RobustScope, TheOrderOfEquationsDoesNotMatter) {
  Structure s;
  const Index a = s.free(), b = s.free(), c = s.free();
  const Index w0 = s.in_box(), w1 = s.in_box(), w2 = s.in_box();
  s.equation({b, c, w2});  // takes b first, which the others need
  s.equation({a, b, w1});
  s.equation({a, w0});
  EXPECT_EQ(s.scope_of(s.robust({a})).irrelevant, (Indices{w1, w2}));
  EXPECT_EQ(s.scope_of(s.robust({b})).irrelevant, Indices{w2});
  EXPECT_EQ(s.scope_of(s.robust({c})).irrelevant, Indices{});
}

/// s_{k+1} = F(s_k, w_k), each equation in one new state.
struct ExplicitTrajectory : Structure {
  std::vector<Index> s, w;
  explicit ExplicitTrajectory(int stages) : s{in_box()} {
    for (int k = 0; k < stages; ++k) {
      w.push_back(in_box());
      s.push_back(free());
      equation({s.end()[-2], w.back(), s.back()});
    }
  }
};

TEST(RobustScope, StatesBehindAStageAreLeftBehind) {
  ExplicitTrajectory t(4);
  const Index second = t.robust({t.s[2]});
  const RobustScope scope = t.explicit_scope_of(second);
  EXPECT_EQ(scope.variables, (Indices{t.s[0], t.w[0], t.s[1], t.w[1], t.s[2]}));
  EXPECT_EQ(scope.constraints, (Indices{0, 1}));
  EXPECT_EQ(scope.dependent, (Indices{t.s[1], t.s[2]}));
  EXPECT_EQ(scope.irrelevant, (Indices{t.w[2], t.w[3]}));
  ASSERT_EQ(scope.follows.size(), 4U);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_EQ(scope.follows[k].variable, t.s[k + 1]);
    EXPECT_EQ(scope.follows[k].constraint, static_cast<Index>(k));
  }
  EXPECT_EQ(t.explicit_scope_of(t.robust({t.s[4]})).variables.size(), 9U);
}

TEST(RobustScope, NothingThatRestrictsYIsLeftBehind) {
  ExplicitTrajectory end(4);
  end.inequality({end.s[3]});
  const RobustScope scope = end.explicit_scope_of(end.robust({end.s[1]}));
  EXPECT_EQ(scope.variables,
            (Indices{end.s[0], end.w[0], end.s[1], end.w[1], end.s[2], end.w[2], end.s[3]}));
  EXPECT_EQ(scope.follows.size(), 4U);

  ExplicitTrajectory unknown(4);  // the equations may have no solution
  EXPECT_TRUE(unknown.scope_of(unknown.robust({unknown.s[1]})).follows.empty());

  Trajectory implicit(4);  // two equations at a time
  EXPECT_TRUE(implicit.explicit_scope_of(implicit.robust({implicit.s[2]})).follows.empty());
}

}  // namespace
}  // namespace ipminmax
