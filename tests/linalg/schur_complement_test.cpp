// K by way of K_yy against K as a whole.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "linalg/lapack_solver.hpp"
#include "linalg/make_solver.hpp"
#include "linalg/schur_complement.hpp"
#include "test_matrices.hpp"

namespace ipminmax {
namespace {

using test::Blocks;
using test::chauffeur_kkt;
using test::grid_kkt;
using test::KktMatrix;
using test::MatrixBuilder;
using test::random_kkt;

/// K_yy with the places of its rows in K.
struct Inner {
  std::vector<Index> row;  ///< per row of K, -1 outside
  SymmetricMatrix matrix;
  std::vector<std::int8_t> signs;
};

Inner inner_of(const KktMatrix& k, const Blocks& b) {
  Inner inner;
  const Index y = b.x, lambda_y = b.x + b.y + b.lambda_x;
  Index rows = 0;
  for (Index i = 0; i < k.matrix.dimension(); ++i) {
    const bool is_inner = (i >= y && i < y + b.y) || i >= lambda_y;
    inner.row.push_back(is_inner ? rows++ : -1);
    if (is_inner) inner.signs.push_back(k.signs[static_cast<std::size_t>(i)]);
  }
  MatrixBuilder builder(rows);
  for (Index j = 0; j < k.matrix.dimension(); ++j) {
    for (Index p = k.matrix.column_starts()[static_cast<std::size_t>(j)];
         p < k.matrix.column_starts()[static_cast<std::size_t>(j) + 1]; ++p) {
      const Index row =
          inner.row[static_cast<std::size_t>(k.matrix.rows()[static_cast<std::size_t>(p)])];
      const Index column = inner.row[static_cast<std::size_t>(j)];
      if (row < 0 || column < 0) continue;
      builder.add(row, column, k.matrix.values()[static_cast<std::size_t>(p)]);
    }
  }
  inner.matrix = builder.build();
  return inner;
}

std::vector<double> some_vector(Index size) {
  std::vector<double> v;
  for (Index i = 0; i < size; ++i) v.push_back(std::sin(1.0 + 3.0 * i));
  return v;
}

double largest(const std::vector<double>& v) {
  double result = 0.0;
  for (const double value : v) result = std::max(result, std::abs(value));
  return result;
}

class SchurComplementTest : public testing::TestWithParam<LinearSolver> {
 protected:
  /// Inertia of K and |K u - b| / (|K| |u| + |b|) after refinement, against LAPACK's of K.
  void expect_as_the_whole(const KktMatrix& k, const Blocks& blocks) {
    SCOPED_TRACE(k.name);
    const Inner inner = inner_of(k, blocks);
    const auto solver = make_symmetric_solver(GetParam(), {.ldlt_gamma = 1e-10});
    ASSERT_TRUE(solver->analyze(inner.matrix, inner.signs).ok);
    SchurComplement schur(k.matrix, inner.row);
    EXPECT_EQ(schur.outer_dimension(), blocks.x + blocks.lambda_x);
    EXPECT_EQ(schur.inner_dimension(), blocks.y + blocks.lambda_y);
    const double flops = schur.predict_flops(*solver);
    EXPECT_TRUE(std::isfinite(flops) && flops >= 0.0) << flops;

    LapackSolver whole;
    ASSERT_TRUE(whole.analyze(k.matrix, {}).ok);
    const Factorization expected = whole.factorize(k.matrix);
    const Factorization c = solver->factorize(inner.matrix);
    ASSERT_EQ(c.status, FactorizationStatus::Ok);
    ASSERT_TRUE(schur.form(k.matrix, *solver));
    const Factorization s = schur.factorize(k.matrix);
    EXPECT_EQ(s.status, expected.status);
    const Inertia sum{c.inertia.positive + s.inertia.positive,
                      c.inertia.negative + s.inertia.negative, c.inertia.zero + s.inertia.zero};
    EXPECT_EQ(sum, expected.inertia);
    if (expected.status != FactorizationStatus::Ok) return;

    const std::vector<double> b = some_vector(k.matrix.dimension());
    std::vector<double> u(b.size(), 0.0), residual = b, product(b.size());
    for (int step = 0; step < 6; ++step) {
      schur.solve_in_place(*solver, residual);
      for (std::size_t i = 0; i < u.size(); ++i) u[i] += residual[i];
      k.matrix.multiply(u, product);
      for (std::size_t i = 0; i < u.size(); ++i) residual[i] = b[i] - product[i];
    }
    EXPECT_LT(largest(residual), 1e-13 * (k.matrix.max_norm() * largest(u) + largest(b)));
  }

  /// Whether K_yy can be factorized and solved with in double precision.
  static bool is_regular(const KktMatrix& k, const Blocks& blocks) {
    const Inner inner = inner_of(k, blocks);
    LapackSolver solver;
    for (const SymmetricMatrix* matrix : {&k.matrix, &inner.matrix}) {
      EXPECT_TRUE(solver.analyze(*matrix, {}).ok);
      const Factorization f = solver.factorize(*matrix);
      if (f.status != FactorizationStatus::Ok || f.smallest_pivot < 1e-3) return false;
    }
    return true;
  }
};

constexpr const char* kSolvers[] = {"auto", "mumps", "ldlt", "lapack"};
INSTANTIATE_TEST_SUITE_P(Solvers, SchurComplementTest,
                         testing::Values(LinearSolver::Auto, LinearSolver::Mumps,
                                         LinearSolver::Ldlt, LinearSolver::Lapack),
                         [](const auto& test) { return std::string(kSolvers[test.index]); });

TEST_P(SchurComplementTest, RandomKkt) {
  int tested = 0;
  for (unsigned seed = 1; seed <= 60; ++seed) {
    const Index small = static_cast<Index>(seed % 5);
    const Blocks blocks{small, 12, small / 2, 4};
    const KktMatrix k = random_kkt({blocks, 0.3, seed % 3 == 0 ? 2.0 : 0.0}, seed);
    if (!is_regular(k, blocks)) continue;
    ++tested;
    expect_as_the_whole(k, blocks);
  }
  EXPECT_GT(tested, 30);
}

TEST_P(SchurComplementTest, ManyOuterRows) {  // more than one block of right-hand sides
  const Blocks blocks{40, 60, 15, 20};
  int tested = 0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const KktMatrix k = random_kkt({blocks, 0.05, 1.0}, seed);
    if (!is_regular(k, blocks)) continue;
    ++tested;
    expect_as_the_whole(k, blocks);
  }
  EXPECT_GT(tested, 0);
}

TEST_P(SchurComplementTest, Chauffeur) {
  for (const Index steps : {3, 12}) {
    expect_as_the_whole(chauffeur_kkt(steps, 1), {4 * steps, 5 * steps, 3 * steps, 3 * steps});
  }
}

TEST_P(SchurComplementTest, Grid) {
  const Index points = 7 * 7;
  expect_as_the_whole(grid_kkt(7, 1), {2 * points, points, points, 0});
}

TEST_P(SchurComplementTest, SingularComplement) {
  const Blocks blocks{4, 12, 3, 0};
  for (unsigned seed = 1; seed <= 5; ++seed) {
    // A constraint of Min twice: K_yy knows nothing of it.
    const KktMatrix k = random_kkt({blocks, 0.6, 0.0, true}, seed);
    expect_as_the_whole(k, blocks);
  }
}

TEST_P(SchurComplementTest, NearlySingularInnerMatrixIsRefused) {
  // | 1 1 |
  // | 1 t |  with a tiny t
  for (const double t : {1e-9, -1e-12, 0.0}) {
    MatrixBuilder builder(2);
    builder.add(0, 0, 1.0);
    builder.add(1, 0, 1.0);
    builder.add(1, 1, t);
    const KktMatrix k{"tiny", builder.build(), {1, -1}};
    const Inner inner = inner_of(k, {1, 1, 0, 0});
    const auto solver = make_symmetric_solver(GetParam(), {.ldlt_gamma = 1e-12});
    ASSERT_TRUE(solver->analyze(inner.matrix, inner.signs).ok);
    SchurComplement schur(k.matrix, inner.row);
    if (solver->factorize(inner.matrix).status != FactorizationStatus::Ok) continue;
    EXPECT_FALSE(schur.form(k.matrix, *solver)) << t;
  }
}

TEST_P(SchurComplementTest, OnlyTheDiagonalOfTheOuterRowsChanges) {
  const Blocks blocks{4, 20, 1, 6};
  KktMatrix k = random_kkt({blocks, 0.3, 1.0}, 1);
  ASSERT_TRUE(is_regular(k, blocks));
  const Inner inner = inner_of(k, blocks);
  const auto solver = make_symmetric_solver(GetParam(), {});
  ASSERT_TRUE(solver->analyze(inner.matrix, inner.signs).ok);
  const Factorization c = solver->factorize(inner.matrix);
  SchurComplement schur(k.matrix, inner.row);
  ASSERT_TRUE(schur.form(k.matrix, *solver));
  LapackSolver whole;
  ASSERT_TRUE(whole.analyze(k.matrix, {}).ok);
  for (const double shift : {0.0, 0.5, 5.0, 500.0}) {
    for (Index i = 0; i < blocks.x; ++i) {
      k.matrix.values()[static_cast<std::size_t>(k.matrix.diagonal_position(i))] += shift;
    }
    const Factorization s = schur.factorize(k.matrix);
    const Factorization expected = whole.factorize(k.matrix);
    EXPECT_EQ(c.inertia.positive + s.inertia.positive, expected.inertia.positive) << shift;
    EXPECT_EQ(c.inertia.negative + s.inertia.negative, expected.inertia.negative) << shift;
  }
}

TEST_P(SchurComplementTest, NoOuterRows) {
  const Blocks blocks{0, 10, 0, 3};
  const KktMatrix k = random_kkt({blocks, 0.4, 1.0}, 2);
  ASSERT_TRUE(is_regular(k, blocks));
  expect_as_the_whole(k, blocks);
}

}  // namespace
}  // namespace ipminmax
