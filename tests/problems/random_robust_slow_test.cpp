// Random robust programs, min x'x / 2 - p'x with g_r(x, y) <= 0 for every y in Y: what is certified is
// judged by maximizations of every row over y that share nothing with the solver.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include <support/autodiff_problem.hpp>

#include "core/robust.hpp"

namespace ipminmax::testing {
namespace {

using Vector = std::vector<double>;

double dot(const Vector& a, const Vector& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

/// A box [-1, 1]^n, and a ball of radius 1 or half spaces in it.
struct DisturbanceSet {
  std::size_t size = 0;
  bool ball = false;
  std::vector<Vector> normals{};  ///< normal . y <= 1

  [[nodiscard]] bool contains(const Vector& y) const {
    if (std::ranges::any_of(y, [](double value) { return std::abs(value) > 1.0; })) return false;
    if (ball && dot(y, y) > 1.0) return false;
    return std::ranges::none_of(normals, [&](const Vector& a) { return dot(a, y) > 1.0; });
  }
};

/// c'x + offset + a'y + x'By + y'Dy / 2 + sum of amplitudes of sin(frequency . y + x_k).
struct Row {
  Vector c, a, d, amplitudes;
  std::vector<Vector> b, frequencies;
  double offset = -1.0;

  template <class Number>
  [[nodiscard]] Number value(const std::vector<Number>& x, const std::vector<Number>& y) const {
    using std::sin;
    Number sum = offset;
    for (std::size_t i = 0; i < x.size(); ++i) {
      Number slope = c[i];
      for (std::size_t k = 0; k < y.size(); ++k) {
        if (b[i][k] != 0.0) slope += b[i][k] * y[k];
      }
      sum += x[i] * slope;
    }
    for (std::size_t k = 0; k < y.size(); ++k) sum += a[k] * y[k] + 0.5 * d[k] * y[k] * y[k];
    for (std::size_t k = 0; k < amplitudes.size(); ++k) {
      Number phase = x[k % x.size()];
      for (std::size_t i = 0; i < y.size(); ++i) {
        if (frequencies[k][i] != 0.0) phase += frequencies[k][i] * y[i];
      }
      sum += amplitudes[k] * sin(phase);
    }
    return sum;
  }
};

struct Program {
  DisturbanceSet set;
  Vector target;
  std::vector<Row> rows;
};

Program draw(std::mt19937_64& random) {
  const auto uniform = [&](double lower, double upper) {
    return std::uniform_real_distribution<double>(lower, upper)(random);
  };
  const auto vector = [&](std::size_t size, double reach) {
    Vector v(size);
    for (double& value : v) value = uniform(-reach, reach);
    return v;
  };
  const auto whole = [&](std::size_t least, std::size_t most) {
    return std::uniform_int_distribution<std::size_t>(least, most)(random);
  };
  Program p;
  const std::size_t n = whole(1, 5);
  p.set.size = whole(1, 20);
  const std::size_t kind = whole(0, 2);
  p.set.ball = kind == 1;
  for (std::size_t k = 0; kind == 2 && k < 3; ++k) p.set.normals.push_back(vector(p.set.size, 2.0));
  p.target = vector(n, 2.0);
  const bool waves = whole(0, 1) == 1;
  p.rows.resize(whole(1, 10));
  const double small = 1.0 / std::sqrt(static_cast<double>(p.set.size));
  for (Row& row : p.rows) {
    row.c = vector(n, 1.0);
    row.a = vector(p.set.size, 0.3 * small);
    for (std::size_t i = 0; i < n; ++i) row.b.push_back(vector(p.set.size, small));
    row.d = vector(p.set.size, small);
    for (std::size_t k = 0; waves && k < 2; ++k) {
      row.amplitudes.push_back(uniform(0.05, 0.3));
      row.frequencies.push_back(vector(p.set.size, 2.0 * small));
    }
    row.offset = -uniform(1.0, 3.0);
  }
  return p;
}

Model model_of(const Program& p) {
  Model model;
  std::vector<Expression> x, y;
  for (std::size_t i = 0; i < p.target.size(); ++i) {
    x.push_back(model.variable(Player::Min, "x" + std::to_string(i), -3.0, 3.0));
  }
  for (std::size_t i = 0; i < p.set.size; ++i) {
    y.push_back(model.variable(Player::Max, "y" + std::to_string(i), -1.0, 1.0));
  }
  Expression f = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) f += 0.5 * square(x[i]) - p.target[i] * x[i];
  model.objective(f);
  for (const Row& row : p.rows) {
    model.constraint(row.value(x, y), -kNoBound, 0.0, Player::Min);
  }
  Expression norm = 0.0;
  for (const Expression& value : y) norm += square(value);
  if (p.set.ball) model.constraint(norm, -kNoBound, 1.0, Player::Max);
  for (const Vector& normal : p.set.normals) {
    Expression sum = 0.0;
    for (std::size_t i = 0; i < y.size(); ++i) sum += normal[i] * y[i];
    model.constraint(sum, -kNoBound, 1.0, Player::Max);
  }
  return model;
}

/// The largest value of a row over y from `starts` points: steps along coordinates and random
/// directions that stay in Y, each kept while it gains, halved where none does.
double judge(const Program& p, const Row& row, const Vector& x, int starts,
             std::mt19937_64& random) {
  double largest = -kNoBound;
  std::normal_distribution<double> normal;
  const std::size_t n = p.set.size;
  for (int start = 0; start < starts; ++start) {
    Vector y(n), direction(n);
    const double reach = std::uniform_real_distribution<double>(0.0, 1.0)(random);
    for (double& value : y)
      value = reach * (start % 2 == 0 ? normal(random) : (random() % 2 ? 1.0 : -1.0));
    while (!p.set.contains(y)) {
      for (double& value : y) value *= 0.8;
    }
    double best = row.value(x, y);
    for (double length = 0.5; length > 1e-4;) {
      bool gained = false;
      for (std::size_t k = 0; k < 2 * n; ++k) {
        for (std::size_t i = 0; i < n; ++i)
          direction[i] =
              k < n ? (i == k ? 1.0 : 0.0) : normal(random) / std::sqrt(static_cast<double>(n));
        for (const double sign : {length, -length}) {
          Vector moved = y;
          for (std::size_t i = 0; i < n; ++i)
            moved[i] = std::clamp(moved[i] + sign * direction[i], -1.0, 1.0);
          if (!p.set.contains(moved)) continue;
          const double value = row.value(x, moved);
          if (value <= best) continue;
          best = value;
          y = std::move(moved);
          gained = true;
        }
      }
      if (!gained) length *= 0.5;
    }
    largest = std::max(largest, best);
  }
  return largest;
}

struct Counted {
  int programs = 0, solved = 0, certified = 0, violated = 0, false_ones = 0;
};

/// With this many starts of the judge.
Counted count(int programs, int starts, std::uint64_t seed) {
  Counted counted;
  std::mt19937_64 random(seed);
  for (int k = 0; k < programs; ++k) {
    const Program p = draw(random);
    AutodiffProblem problem(model_of(p), Vector(p.target.size() + p.set.size, 0.0));
    SolverOptions options;
    options.minmax_max_factorizations = 20000;
    const Result result = solve_robust(problem, options).result;
    ++counted.programs;
    if (!is_success(result.status)) continue;
    ++counted.solved;
    const bool certified = result.certificate.kind == PointKind::LocalMinmax;
    counted.certified += certified ? 1 : 0;
    const Vector x(result.v.begin(),
                   result.v.begin() + static_cast<std::ptrdiff_t>(p.target.size()));
    double worst = -kNoBound;
    for (const Row& row : p.rows) worst = std::max(worst, judge(p, row, x, starts, random));
    if (worst <= 1e-5) continue;
    ++counted.violated;
    counted.false_ones += certified ? 1 : 0;
    std::printf("program %d of seed %llu: violated by %.2e%s\n", k,
                static_cast<unsigned long long>(seed), worst, certified ? ", certified" : "");
  }
  std::printf("%d programs: %d solved, %d certified, %d violated, %d of these certified\n",
              counted.programs, counted.solved, counted.certified, counted.violated,
              counted.false_ones);
  return counted;
}

TEST(RandomRobustPrograms, NoneIsCertifiedThatIsViolated) {
  const auto seed = static_cast<std::uint64_t>(::testing::GTEST_FLAG(random_seed));
  const Counted counted = count(12, 50, 20261123 + seed);
  EXPECT_EQ(counted.false_ones, 0);
  EXPECT_GE(counted.solved, 8 * counted.programs / 10);
}

// A row over fifteen disturbances, of which no start but one below a climb finds the highest
// maximum, and one over seven, with two active maxima of one value: that is no reason to look no
// longer.
TEST(RandomRobustPrograms, OnceFalse) {
  for (const std::uint64_t seed : {830000588, 833000733}) {
    EXPECT_EQ(count(1, 200, seed).false_ones, 0) << seed;
  }
}

}  // namespace
}  // namespace ipminmax::testing
