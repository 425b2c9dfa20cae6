// Games with variables of Max along which nothing changes, or which enter as a sum: K_yy is singular
// everywhere, and yet there is an inner maximum. They are solved as they are without.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include <problems/small_problems.hpp>
#include <support/autodiff_problem.hpp>
#include <support/mapped_problem.hpp>

#include "core/solver.hpp"

namespace ipminmax::testing {
namespace {

struct Game {
  std::string name;
  Model model{};
  std::vector<double> start{};
};

Game made(const std::string& name, Expression (*f)(const Expression& x, const Expression& y)) {
  Game game{.name = name, .start = {0.7, 0.4}};
  const Expression x = game.model.variable(Player::Min, "x");
  const Expression y = game.model.variable(Player::Max, "y");
  game.model.objective(f(x, y));
  return game;
}

std::vector<Game> games() {
  std::vector<Game> all;
  all.push_back(made("cosine", [](const Expression& x, const Expression& y) {
    return square(x - 1.0) + 3.0 * x * y - square(y) + 0.2 * cos(3.0 * y);
  }));
  all.push_back(made("double_well", [](const Expression& x, const Expression& y) {
    return square(x) + 0.3 * (sin(3.0 * x) + 1.0) * y - pow(y, 4.0) / 4.0 + square(y) / 2.0;
  }));
  all.push_back(made("waves", [](const Expression& x, const Expression& y) {
    return pow(x, 4.0) / 4.0 + x * y - square(y) + 0.1 * sin(5.0 * x);
  }));
  all.push_back(made("exponential", [](const Expression& x, const Expression& y) {
    return exp(x) - x + x * y - exp(y) / 2.0 + y;
  }));
  all.push_back(made("concave_in_x", [](const Expression& x, const Expression& y) {
    return -0.25 * square(x) + 2.0 * x * y - square(y);
  }));
  for (const char* name : {"paper_f1", "paper_f3", "paper_ex3", "tc1", "jin_nash"}) {
    const SmallProblem& known = small_problem(name);
    all.push_back({.name = name, .model = known.model, .start = known.starts.front()});
  }
  return all;
}

/// v = A u, with the players and the start of u.
struct Map {
  Eigen::MatrixXd matrix;
  std::vector<Player> players;
  std::vector<double> start;

  Map(const ProblemStructure& structure, std::vector<double> from)
      : players(structure.variable_players), start(std::move(from)) {
    const auto n = static_cast<Eigen::Index>(players.size());
    matrix = Eigen::MatrixXd::Identity(n, n);
  }
  void add(Player player, const Eigen::VectorXd& column, double value) {
    matrix.conservativeResize(Eigen::NoChange, matrix.cols() + 1);
    matrix.rightCols(1) = column;
    players.push_back(player);
    start.push_back(value);
  }
};

struct Change {
  const char* name;
  void (*apply)(Map& map);
};
void PrintTo(const Change& change, std::ostream* out) { *out << change.name; }

/// The game's y, the last of its variables.
Eigen::VectorXd of_y(const Map& map, double factor) {
  Eigen::VectorXd column = Eigen::VectorXd::Zero(map.matrix.rows());
  column[column.size() - 1] = factor;
  return column;
}

/// The game's x, the first of them.
Eigen::VectorXd of_x(const Map& map, double factor) { return of_y(map, factor).reverse(); }

void add_unread(Map& map, int variables) {
  for (int k = 0; k < variables; ++k) map.add(Player::Max, of_y(map, 0.0), 0.5 + k);
}

const Change kChanges[] = {
    {"unread", [](Map& map) { add_unread(map, 1); }},
    {"three_unread", [](Map& map) { add_unread(map, 3); }},
    {"unread_far", [](Map& map) { map.add(Player::Max, of_y(map, 0.0), 1e6); }},
    {"sum",
     [](Map& map) {
       map.start.back() -= 0.3;
       map.add(Player::Max, of_y(map, 1.0), 0.3);
     }},
    {"sum_in_other_units",
     [](Map& map) {
       map.start.back() -= 0.3;
       map.add(Player::Max, of_y(map, 1e-5), 3e4);
     }},
    {"rotated",
     [](Map& map) {
       const Eigen::Index y = map.matrix.rows() - 1;
       const double value = map.start.back();
       map.matrix(y, y) = std::cos(0.7);
       map.start.back() = std::cos(0.7) * value;
       map.add(Player::Max, of_y(map, std::sin(0.7)), std::sin(0.7) * value);
     }},
};

const Change kChangesOfX[] = {
    {"unread", [](Map& map) { map.add(Player::Min, of_x(map, 0.0), 0.5); }},
    {"three_unread",
     [](Map& map) {
       for (int k = 0; k < 3; ++k) map.add(Player::Min, of_x(map, 0.0), 0.5 + k);
     }},
    {"unread_far", [](Map& map) { map.add(Player::Min, of_x(map, 0.0), 1e6); }},
    {"sum",
     [](Map& map) {
       map.start.front() -= 0.3;
       map.add(Player::Min, of_x(map, 1.0), 0.3);
     }},
    {"sum_in_other_units",
     [](Map& map) {
       map.start.front() -= 0.3;
       map.add(Player::Min, of_x(map, 1e-5), 3e4);
     }},
    {"rotated",
     [](Map& map) {
       const double value = map.start.front();
       map.matrix(0, 0) = std::cos(0.7);
       map.start.front() = std::cos(0.7) * value;
       map.add(Player::Min, of_x(map, std::sin(0.7)), std::sin(0.7) * value);
     }},
    {"of_both",
     [](Map& map) {
       map.add(Player::Min, of_x(map, 1.0), 0.0);
       map.add(Player::Max, of_y(map, 0.0), 0.5);
     }},
};

Index factorizations(const Result& result) {
  return result.counts.factorizations_full + result.counts.factorizations_inner;
}

bool says_that_x_is_not_unique(const Certificate& certificate) {
  return std::ranges::any_of(certificate.reasons, [](const CertificateReason& reason) {
    return reason.kind == CertificateReason::Kind::FlatDirection && reason.player == Player::Min &&
           reason.text.find("not unique") != std::string::npos;
  });
}

class FlatDirections : public ::testing::TestWithParam<Change> {};

TEST_P(FlatDirections, AreSolvedAsWithout) {
  Index with = 0, without = 0;
  for (const Game& game : games()) {
    AutodiffProblem plain(game.model, game.start);
    const Result expected = solve(plain, SolverOptions{});
    ASSERT_EQ(expected.certificate.kind, PointKind::LocalMinmax) << game.name;
    Map map(plain.structure(), game.start);
    GetParam().apply(map);
    MappedProblem flat(plain, map.matrix, map.players, map.start);
    const Result result = solve(flat, SolverOptions{});
    EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax)
        << game.name << ": " << result.message;
    EXPECT_EQ(result.certificate.answer, InnerAnswer::BestNotUnique) << game.name;
    with += factorizations(result);
    without += factorizations(expected);
  }
  std::printf("%s: %d factorizations, %d without\n", GetParam().name, static_cast<int>(with),
              static_cast<int>(without));
  EXPECT_LE(with, 2 * without);
}

INSTANTIATE_TEST_SUITE_P(Of, FlatDirections, ::testing::ValuesIn(kChanges),
                         [](const auto& change) { return std::string(change.param.name); });

class FlatDirectionsOfX : public ::testing::TestWithParam<Change> {};

TEST_P(FlatDirectionsOfX, AreCertifiedAsWithout) {
  Index with = 0, without = 0;
  for (const Game& game : games()) {
    AutodiffProblem plain(game.model, game.start);
    const Result expected = solve(plain, SolverOptions{});
    Map map(plain.structure(), game.start);
    GetParam().apply(map);
    MappedProblem flat(plain, map.matrix, map.players, map.start);
    const Result result = solve(flat, SolverOptions{});
    EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax)
        << game.name << ": " << result.message;
    EXPECT_TRUE(says_that_x_is_not_unique(result.certificate)) << game.name;
    with += factorizations(result);
    without += factorizations(expected);
  }
  std::printf("%s: %d factorizations, %d without\n", GetParam().name, static_cast<int>(with),
              static_cast<int>(without));
  EXPECT_LE(with, 2 * without);
}

INSTANTIATE_TEST_SUITE_P(Of, FlatDirectionsOfX, ::testing::ValuesIn(kChangesOfX),
                         [](const auto& change) { return std::string(change.param.name); });

/// x^2 + x y - y^2 and what it has of w, a variable of Min.
Certificate beside(Expression (*of_w)(const Expression& x, const Expression& w,
                                      const Expression& y),
                   double start) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression w = model.variable(Player::Min, "w");
  const Expression y = model.variable(Player::Max, "y");
  model.objective(square(x) + x * y - square(y) + of_w(x, w, y));
  AutodiffProblem problem(model, {0.7, start, 0.4});
  return solve(problem, SolverOptions{}).certificate;
}

TEST(FlatDirectionsOfX, AreThoseThatNothingReads) {
  using E = const Expression&;
  for (const double start : {0.0, 0.3}) {
    for (const auto of_w :
         {+[](E, E w, E) { return pow(w, 4.0); }, +[](E, E w, E) { return -pow(w, 4.0); },
          +[](E, E w, E) { return pow(w, 3.0); }, +[](E x, E w, E) { return x * square(w); },
          +[](E x, E w, E) { return pow(x, 4.0) * w; }, +[](E, E w, E y) { return square(y) * w; },
          +[](E, E w, E y) { return y * square(w); },
          +[](E, E w, E) { return exp(-square(4.0 * w)); },
          +[](E, E w, E) { return exp(-w - 40.0); }}) {
      const Certificate found = beside(of_w, start);
      EXPECT_FALSE(says_that_x_is_not_unique(found)) << start;
    }
  }
}

TEST(FlatDirections, OfRowsThatDefineAVariable) {
  // y = p + q as a row of Max, in other units: p and q have no curvature of their own.
  for (const double unit : {1.0, 1e-3, 1e3}) {
    Model model;
    const Expression x = model.variable(Player::Min, "x");
    const Expression y = model.variable(Player::Max, "y");
    const Expression p = model.variable(Player::Max, "p");
    const Expression q = model.variable(Player::Max, "q");
    model.objective(square(x - 1.0) + 3.0 * x * y - square(y) + 0.2 * cos(3.0 * y));
    model.constraint(y - unit * p - q, 0.0, 0.0);
    AutodiffProblem problem(model, {0.7, 0.4, 0.3 / unit, 0.1});
    const Result result = solve(problem, SolverOptions{});
    EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax) << unit << ": " << result.message;
    EXPECT_LT(factorizations(result), 60) << unit;
  }
}

TEST(FlatDirections, BilinearGamesTakeFullSteps) {
  for (const double factor : {1e-6, 1.0, 1e6}) {
    Model model;
    const Expression x = model.variable(Player::Min, "x");
    const Expression y = model.variable(Player::Max, "y");
    model.objective(factor * x * y);
    AutodiffProblem problem(model, {1.0, 1.0});
    const Result result = solve(problem, SolverOptions{});
    EXPECT_EQ(result.certificate.kind, PointKind::LocalMinmax) << factor << ": " << result.message;
    EXPECT_LE(result.iterations, 3) << factor;
  }
}

/// x^2 + x y - y^2 and what it has of w, a variable of Max.
Result solve_with(Expression (*of_w)(const Expression& w), double start,
                  const SolverOptions& options = {}) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y = model.variable(Player::Max, "y");
  const Expression w = model.variable(Player::Max, "w");
  model.objective(square(x) + x * y - square(y) + of_w(w));
  AutodiffProblem problem(model, {0.7, 0.4, start});
  return solve(problem, options);
}

TEST(FlatDirections, ThatRiseAreNone) {
  EXPECT_EQ(solve_with([](const Expression& w) { return 1.0 * w; }, 0.5).status,
            Status::InnerUnbounded);
  EXPECT_FALSE(
      is_success(solve_with([](const Expression& w) { return 1e-8 * square(w); }, 0.5).status));
  const auto quartic = [](const Expression& w) { return pow(w, 4.0); };
  EXPECT_EQ(solve_with(quartic, 0.5).status, Status::InnerUnbounded);
  // Where it stands still, too.
  EXPECT_NE(solve_with(quartic, 0.0).certificate.kind, PointKind::LocalMinmax);
}

// Towards a plateau the value changes on the way: it is no maximum, and no step leads there at once.
TEST(FlatDirections, APlateauIsNone) {
  const auto bell = [](const Expression& w) { return exp(-square(w)); };
  for (const double start : {0.7, std::sqrt(0.5), 0.8})
    EXPECT_NEAR(solve_with(bell, start).objective, 1.0, 1e-8) << start;
  const auto wave = [](const Expression& w) { return w * exp(-0.5 * square(w)); };
  EXPECT_NEAR(solve_with(wave, 0.0).objective, std::exp(-0.5), 1e-8);
  for (const double start : {0.0, 0.3}) {
    const auto step = [](const Expression& w) { return w * pow(1.0 + square(w), -0.5); };
    EXPECT_NE(solve_with(step, start).certificate.kind, PointKind::LocalMinmax) << start;
    // Steps without a line search lead far out.
    SolverOptions options;
    options.minmax_globalization = Globalization::None;
    EXPECT_NE(solve_with(step, start, options).certificate.kind, PointKind::LocalMinmax) << start;
    EXPECT_NE(solve_with(wave, start, options).objective, 0.0) << start;
  }
}

// Bent ones stay maxima back to the start.
TEST(FlatDirections, MayBend) {
  for (const double start : {0.3, 1.5}) {
    Model model;
    const Expression x = model.variable(Player::Min, "x");
    const Expression p = model.variable(Player::Max, "p");
    const Expression q = model.variable(Player::Max, "q");
    const Expression y = p - 0.2 * square(q);
    model.objective(square(x - 1.0) + x * y - square(y));
    AutodiffProblem problem(model, {0.7, 0.4, start});
    const Result result = solve(problem, SolverOptions{});
    EXPECT_EQ(result.certificate.answer, InnerAnswer::BestNotUnique) << result.message;
  }
}

/// (x - 0.3)^2 + 2 x y + y with |y| <= 1, whose max over y has a kink at the answer, x = -0.5; x as
/// a sum of so many variables, beside so many that nothing reads.
Result at_a_kink(int terms, int unread, double shift = 0.0) {
  Model model;
  std::vector<double> start;
  Expression x(0.0);
  for (int k = 0; k < terms; ++k) {
    x = x + model.variable(Player::Min, "x" + std::to_string(k)) - shift;
    start.push_back(0.7 / terms + shift);
  }
  for (int k = 0; k < unread; ++k) {
    static_cast<void>(model.variable(Player::Min, "unread" + std::to_string(k)));
    start.push_back(1.0 + k);
  }
  const Expression y = model.variable(Player::Max, "y", -1.0, 1.0);
  start.push_back(0.4);
  model.objective(square(x - 0.3) + 2.0 * x * y + y);
  AutodiffProblem problem(model, start);
  return solve(problem, SolverOptions{});
}

TEST(FlatDirections, OfMinLeaveAKinkInReach) {
  const Result plain = at_a_kink(1, 0);
  ASSERT_EQ(plain.certificate.kind, PointKind::LocalMinmax) << plain.message;
  for (const Result& flat :
       {at_a_kink(1, 1), at_a_kink(1, 3), at_a_kink(2, 0), at_a_kink(3, 1), at_a_kink(2, 0, 1e4)}) {
    EXPECT_TRUE(is_success(flat.status)) << flat.message;
    EXPECT_NEAR(flat.objective, plain.objective, 1e-6);
    EXPECT_LE(factorizations(flat), 2 * factorizations(plain));
  }
}

/// A matrix game on two simplices, with Max's equation so many times.
Result on_simplices(const Eigen::MatrixXd& payoff, int rows) {
  Model model;
  std::vector<Expression> x, y;
  std::vector<double> start;
  const auto add = [&](Player player, Eigen::Index size, std::vector<Expression>& v) {
    Expression sum(0.0);
    for (Eigen::Index i = 0; i < size; ++i) {
      v.push_back(model.variable(player, (player == Player::Min ? "x" : "y") + std::to_string(i),
                                 0.0, kNoBound));
      start.push_back(i == 0 ? 1.0 : 0.0);
      sum = sum + v.back();
    }
    return sum;
  };
  model.constraint(add(Player::Min, payoff.rows(), x), 1.0, 1.0);
  const Expression sum = add(Player::Max, payoff.cols(), y);
  for (int k = 1; k <= rows; ++k) model.constraint(k * sum, k, k);
  Expression value(0.0);
  for (Eigen::Index i = 0; i < payoff.rows(); ++i) {
    for (Eigen::Index j = 0; j < payoff.cols(); ++j)
      value =
          value + payoff(i, j) * x[static_cast<std::size_t>(i)] * y[static_cast<std::size_t>(j)];
  }
  model.objective(value);
  AutodiffProblem problem(model, start);
  return solve(problem, SolverOptions{});
}

TEST(DependentRows, OfMaxAreAsOne) {
  const Eigen::MatrixXd cycle{{0.0, -1.0, 1.0}, {1.0, 0.0, -1.0}, {-1.0, 1.0, 0.0}};
  const Eigen::MatrixXd wide{{0.3, -0.2, 0.9, 0.1}, {-0.5, 0.8, -0.4, 0.2}};
  for (const Eigen::MatrixXd& payoff : {cycle, wide}) {
    const Result once = on_simplices(payoff, 1);
    ASSERT_TRUE(is_success(once.status)) << once.message;
    for (const int rows : {2, 3}) {
      const Result more = on_simplices(payoff, rows);
      EXPECT_TRUE(is_success(more.status)) << more.message;
      EXPECT_NEAR(more.objective, once.objective, 1e-7);
      EXPECT_LE(factorizations(more), 2 * factorizations(once)) << rows;
    }
  }
}

TEST(DependentRows, OfMaxMayStandBesideAnUnreadVariable) {
  Model model;
  const Expression x = model.variable(Player::Min, "x");
  const Expression y0 = model.variable(Player::Max, "y0"), y1 = model.variable(Player::Max, "y1");
  static_cast<void>(model.variable(Player::Max, "unread"));
  model.objective(square(x - 0.3) + x * y0 - square(y0) - square(y1));
  for (const double factor : {1.0, 2.0})
    model.constraint(factor * (y0 + 0.5 * y1 + 0.2 * x), 0.1 * factor, 0.1 * factor);
  AutodiffProblem problem(model, {0.7, 0.4, 0.1, 0.5});
  const Result result = solve(problem, SolverOptions{});
  EXPECT_EQ(result.certificate.answer, InnerAnswer::BestNotUnique) << result.message;
}

/// x'y + |x|^2 with |y| = 1, or |y| <= 1: max over y is |x| + |x|^2.
Result on_the_unit_circle(bool with_interior, bool over_branches) {
  Model model;
  const Expression x0 = model.variable(Player::Min, "x0"), x1 = model.variable(Player::Min, "x1");
  const Expression y0 = model.variable(Player::Max, "y0"), y1 = model.variable(Player::Max, "y1");
  model.objective(x0 * y0 + x1 * y1 + square(x0) + square(x1));
  model.constraint(square(y0) + square(y1), with_interior ? -kNoBound : 1.0, 1.0);
  AutodiffProblem problem(model, {0.7, -0.4, 0.6, 0.5});
  SolverOptions options;
  options.minmax_epigraph = over_branches;
  return solve(problem, options);
}

TEST(FlatDirections, AKinkIsNamedWithWhatGivesTheAnswer) {
  const Result sphere = on_the_unit_circle(false, false);
  EXPECT_FALSE(is_success(sphere.status)) << sphere.message;
  EXPECT_NE(sphere.message.find("kink"), std::string::npos) << sphere.message;
  EXPECT_NE(sphere.message.find("minmax_epigraph"), std::string::npos) << sphere.message;
  EXPECT_NE(sphere.message.find("inequality"), std::string::npos) << sphere.message;
  for (const Result& answer : {on_the_unit_circle(true, false), on_the_unit_circle(false, true)}) {
    EXPECT_TRUE(is_success(answer.status)) << answer.message;
    EXPECT_NEAR(answer.objective, 0.0, 1e-6);
  }
}

}  // namespace
}  // namespace ipminmax::testing
