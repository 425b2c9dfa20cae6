// LDL' with pivots of two rows: inertia and solutions beside MUMPS's, and what single pivots lose.
#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include <support/sanitizer.hpp>

#include "linalg/ldlt_solver.hpp"
#include "linalg/mumps_solver.hpp"
#include "linalg/paired_ldlt_solver.hpp"
#include "test_matrices.hpp"

namespace ipminmax {
namespace {

using test::chauffeur_kkt;
using test::KktMatrix;
using test::MatrixBuilder;
using test::random_kkt;

constexpr double kGamma = 1e-16;

std::vector<double> random_vector(Index size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<double> v(static_cast<std::size_t>(size));
  for (double& value : v) value = uniform(random);
  return v;
}

/// |A u - b| / (|A| |u| + |b|), without refinement.
double backward_error(SymmetricSolver& solver, const SymmetricMatrix& matrix) {
  const std::vector<double> b = random_vector(matrix.dimension(), 1);
  std::vector<double> u = b, product(b.size());
  solver.solve_in_place(u);
  matrix.multiply(u, product);
  double error = 0.0, size = 0.0;
  for (std::size_t i = 0; i < u.size(); ++i) {
    error = std::max(error, std::abs(product[i] - b[i]));
    size = std::max(size, std::abs(u[i]));
  }
  return std::isfinite(size) ? error / (matrix.max_norm() * size + 1.0) : INFINITY;
}

TEST(PairedLdlt, HasTheInertiaOfPivotingAndItsAccuracyOnChains) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    for (const double barrier : {10.0, 1.0, 1e-3}) {
      const KktMatrix chain = chauffeur_kkt(40, seed, barrier);
      PairedLdltSolver paired(Ordering::Best, kGamma);
      ASSERT_TRUE(paired.analyze(chain.matrix, chain.signs).ok);
      const Factorization result = paired.factorize(chain.matrix);
      ASSERT_EQ(result.status, FactorizationStatus::Ok);
      MumpsSolver mumps({});
      ASSERT_TRUE(mumps.analyze(chain.matrix, {}).ok);
      EXPECT_EQ(result.inertia, mumps.factorize(chain.matrix).inertia) << chain.name;
      EXPECT_LT(backward_error(paired, chain.matrix), 1e-11) << chain.name;
      EXPECT_GT(result.smallest_pivot, 0.0);
    }
  }
}

TEST(PairedLdlt, HasTheInertiaOfPivotingWhereItsSolutionsAreAccurate) {
  int accurate = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const KktMatrix kkt = random_kkt({{30, 30, 10, 10}, 0.1, 0.0}, seed);
    PairedLdltSolver paired(Ordering::Amd, kGamma);
    ASSERT_TRUE(paired.analyze(kkt.matrix, kkt.signs).ok);
    const Factorization result = paired.factorize(kkt.matrix);
    ASSERT_EQ(result.status, FactorizationStatus::Ok);
    if (backward_error(paired, kkt.matrix) > 1e-12) continue;
    ++accurate;
    MumpsSolver mumps({});
    ASSERT_TRUE(mumps.analyze(kkt.matrix, {}).ok);
    EXPECT_EQ(result.inertia, mumps.factorize(kkt.matrix).inertia) << seed;
  }
  EXPECT_GE(accurate, 30);
}

/// Multipliers of equations between variables without curvature: [0 1; 1 0] again and again.
TEST(PairedLdlt, KeepsSmallEigenvaluesThatSinglePivotsLose) {
  constexpr Index kStages = 200;
  constexpr double kSmall = 1e-9;
  MatrixBuilder builder(2 * kStages + 2);
  for (Index k = 0; k < kStages; ++k) {  // x_{k+1} = x_k + noise, rows kStages + 2 + k
    const Index row = kStages + 2 + k;
    builder.add(row, k + 1, -1.0);
    builder.add(row, k, 1.0 + 0.1 * std::sin(k));
  }
  builder.add(0, 0, kSmall);
  builder.add(kStages + 1, kStages + 1, 1.0);
  const SymmetricMatrix matrix = builder.build();
  std::vector<std::int8_t> signs(2 * kStages + 2, 1);
  std::fill(signs.begin() + kStages + 2, signs.end(), std::int8_t{-1});

  PairedLdltSolver paired(Ordering::Best, kGamma);
  ASSERT_TRUE(paired.analyze(matrix, signs).ok);
  const Factorization result = paired.factorize(matrix);
  ASSERT_EQ(result.status, FactorizationStatus::Ok);
  EXPECT_EQ(result.inertia, (Inertia{kStages + 2, kStages, 0}));
  const double error = backward_error(paired, matrix);
  EXPECT_LT(error, 1e-14);
  LdltSolver single({.ldlt_gamma = 1e-11});
  ASSERT_TRUE(single.analyze(matrix, signs).ok);
  ASSERT_EQ(single.factorize(matrix).status, FactorizationStatus::Ok);
  EXPECT_GT(backward_error(single, matrix), 1e3 * error);
}

TEST(PairedLdlt, MakesPairsAnewFromOtherValues) {
  // Row 2 is coupled with 0 or with 1, whichever value is there.
  MatrixBuilder builder(3);
  builder.add(2, 0, 1.0);
  builder.add(2, 1, 0.0);
  builder.add(1, 1, 1.0);
  SymmetricMatrix matrix = builder.build();
  PairedLdltSolver solver(Ordering::Amd, 0.0);
  ASSERT_TRUE(solver.analyze(matrix, {}).ok);
  EXPECT_EQ(solver.factorize(matrix).inertia, (Inertia{2, 1, 0}));
  matrix.set_zero();
  const auto set = [&](Index row, Index column, double value) {
    for (Index p = matrix.column_starts()[static_cast<std::size_t>(column)];; ++p) {
      if (matrix.rows()[static_cast<std::size_t>(p)] != row) continue;
      matrix.values()[static_cast<std::size_t>(p)] = value;
      return;
    }
  };
  set(2, 1, 1.0);
  set(0, 0, -1.0);
  EXPECT_EQ(solver.factorize(matrix).status, FactorizationStatus::Failed);  // of the old pairs
  ASSERT_TRUE(solver.analyze(matrix, {}).ok);
  EXPECT_EQ(solver.factorize(matrix).inertia, (Inertia{1, 2, 0}));
  EXPECT_LT(backward_error(solver, matrix), 1e-15);
}

TEST(PairedLdlt, FailsOnSingularMatricesAndNotANumber) {
  MatrixBuilder builder(2);
  builder.add(0, 0, 1.0);
  builder.add(1, 0, 1.0);
  builder.add(1, 1, 1.0);
  SymmetricMatrix matrix = builder.build();
  PairedLdltSolver solver(Ordering::Amd, 0.0);
  ASSERT_TRUE(solver.analyze(matrix, {}).ok);
  EXPECT_EQ(solver.factorize(matrix).status, FactorizationStatus::Failed);
  std::vector<double> x(2, 1.0);
  solver.solve_in_place(x);
  EXPECT_TRUE(std::isnan(x[0]));
  matrix.values()[0] = NAN;
  EXPECT_EQ(solver.factorize(matrix).status, FactorizationStatus::Failed);
  const SymmetricMatrix none(0, {});
  ASSERT_TRUE(solver.analyze(none, {}).ok);
  EXPECT_EQ(solver.factorize(none).status, FactorizationStatus::Ok);
}

// What an analysis predicts may be more than there is.
TEST(PairedLdlt, TheAnalysisMakesNoRoomForTheFactor) {
  if (IPMINMAX_UNDER_SANITIZER) GTEST_SKIP() << "allocator replaced by a sanitizer";
  constexpr Index kPairs = 2000;
  MatrixBuilder builder(2 * kPairs);
  std::mt19937 random(1);
  for (Index i = 0; i < kPairs; ++i) {
    builder.add(i, i, 0.0);
    builder.add(kPairs + i, kPairs + i, 0.0);
    builder.add(kPairs + i, i, 100.0);
    for (int k = 0; k < 3; ++k) {
      const auto j = static_cast<Index>(random() % static_cast<unsigned>(kPairs));
      builder.add(std::max(i, j), std::min(i, j), 1.0);
    }
  }
  const SymmetricMatrix matrix = builder.build();
  const auto in_use = [] {
    const struct mallinfo2 info = mallinfo2();
    return static_cast<double>(info.uordblks) + static_cast<double>(info.hblkhd);
  };
  PairedLdltSolver solver(Ordering::Amd, kGamma);
  const double before = in_use();
  const Analysis analysis = solver.analyze(matrix, {});
  const double made = in_use() - before;
  ASSERT_TRUE(analysis.ok);
  const double factor = sizeof(double) * static_cast<double>(analysis.factor_entries);
  EXPECT_GT(factor, 5e6);
  EXPECT_LT(made, 0.2 * factor);
  EXPECT_EQ(solver.factorize(matrix).status, FactorizationStatus::Ok);
}

}  // namespace
}  // namespace ipminmax
