// What the choosing solver and the dense one promise beyond the common contract.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <ctime>
#include <span>
#include <vector>

#include "linalg/auto_solver.hpp"
#include "linalg/lapack_solver.hpp"
#include "linalg/ldlt_solver.hpp"
#include "linalg/mumps_solver.hpp"
#include "test_matrices.hpp"

namespace ipminmax {
namespace {

using test::chauffeur_kkt;
using test::grid_kkt;
using test::KktMatrix;
using test::MatrixBuilder;
using test::random_kkt;

TEST(AutoSolver, UsesLdltOnChainsAndLeavesItForGood) {
  const KktMatrix chain = chauffeur_kkt(40, 1);
  AutoSolver solver({});
  ASSERT_TRUE(solver.analyze(chain.matrix, chain.signs).ok);
  const Factorization by_ldlt = solver.factorize(chain.matrix);
  EXPECT_FALSE(by_ldlt.trust.pivoted);
  EXPECT_GT(by_ldlt.trust.perturbation, 0.0);
  ASSERT_TRUE(solver.increase_quality());  // pivots of two rows
  EXPECT_FALSE(solver.factorize(chain.matrix).trust.pivoted);
  ASSERT_TRUE(solver.increase_quality());
  for (int run = 0; run < 2; ++run) {
    const Factorization result = solver.factorize(chain.matrix);
    EXPECT_EQ(result.status, FactorizationStatus::Ok);
    EXPECT_EQ(result.inertia, by_ldlt.inertia);
    EXPECT_TRUE(result.trust.pivoted);
    EXPECT_EQ(result.trust.perturbation, 0.0);
  }
  EXPECT_TRUE(solver.increase_quality());  // now the pivot tolerance of MUMPS
}

/// Of a system with a matrix whose factors are at hand.
double residual_of(AutoSolver& solver, const SymmetricMatrix& matrix) {
  const auto n = static_cast<std::size_t>(matrix.dimension());
  std::vector<double> rhs(n), solution(n), product(n);
  for (std::size_t i = 0; i < n; ++i) rhs[i] = solution[i] = 1.0 + static_cast<double>(i % 5);
  solver.solve_in_place(solution);
  matrix.multiply(solution, product);
  double largest = 0.0;
  for (std::size_t i = 0; i < n; ++i) largest = std::max(largest, std::abs(rhs[i] - product[i]));
  return largest;
}

TEST(AutoSolver, PairsOfRowsTakeFewerRefinements) {
  const KktMatrix chain = chauffeur_kkt(40, 1);
  AutoSolver solver({});
  ASSERT_TRUE(solver.analyze(chain.matrix, chain.signs).ok);
  const auto residual = [&] { return residual_of(solver, chain.matrix); };
  const Factorization by_ldlt = solver.factorize(chain.matrix);
  ASSERT_FALSE(by_ldlt.trust.pivoted);
  const double left = residual();
  ASSERT_TRUE(solver.increase_quality());
  const Factorization in_pairs = solver.factorize(chain.matrix);
  EXPECT_FALSE(in_pairs.trust.pivoted);
  EXPECT_EQ(in_pairs.inertia, by_ldlt.inertia);
  EXPECT_LT(residual(), 1e-2 * left);
  solver.reset_quality();
  EXPECT_EQ(solver.factorize(chain.matrix).trust.perturbation, by_ldlt.trust.perturbation);
  EXPECT_EQ(residual(), left);
}

TEST(AutoSolver, PairsThatDoNotSuitAreMadeAnewBeforePivoting) {
  constexpr Index kSteps = 200;
  std::vector<std::int8_t> signs(2 * kSteps, 1);
  std::fill(signs.begin() + kSteps, signs.end(), -1);
  const auto matrix = [](double own, double next) {
    MatrixBuilder builder(2 * kSteps);
    for (Index i = 0; i < kSteps; ++i) {
      builder.add(i, i, 1e-3);
      builder.add(kSteps + i, i, own);
      builder.add(kSteps + i, (i + 1) % kSteps, next);
    }
    return builder.build();
  };
  const SymmetricMatrix first = matrix(1.0, 1e-4), second = matrix(1e-4, 1.0);
  AutoSolver solver({});
  ASSERT_TRUE(solver.analyze(first, signs).ok);
  static_cast<void>(solver.factorize(first, Certainty::Usual));
  ASSERT_TRUE(solver.increase_quality());
  static_cast<void>(solver.factorize(first, Certainty::Usual));
  static_cast<void>(solver.factorize(second, Certainty::Usual));
  EXPECT_GT(residual_of(solver, second), 1e-9);
  ASSERT_TRUE(solver.increase_quality());
  EXPECT_FALSE(solver.factorize(second, Certainty::Usual).trust.pivoted);
  EXPECT_LT(residual_of(solver, second), 1e-11);
}

TEST(AutoSolver, PivotsWhereItIsAskedToAndTheInertiaIsNotTheExpectedOne) {
  int expected = 0, other = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const Index steps = seed % 4 < 2 ? 15 : 40;  // the smaller ones are pivoted as dense matrices
    const KktMatrix chain = chauffeur_kkt(steps, seed, seed % 2 == 0 ? 1e-3 : 10.0);
    AutoSolver solver({});
    ASSERT_TRUE(solver.analyze(chain.matrix, chain.signs).ok);
    MumpsSolver mumps({});
    ASSERT_TRUE(mumps.analyze(chain.matrix, {}).ok);
    const Inertia true_inertia = mumps.factorize(chain.matrix).inertia;
    Inertia by_signs;
    for (const auto sign : chain.signs) ++(sign > 0 ? by_signs.positive : by_signs.negative);
    EXPECT_TRUE(solver.begin_pivoting());
    const Factorization result = solver.factorize(chain.matrix, Certainty::Usual);
    EXPECT_EQ(result.inertia, true_inertia);
    EXPECT_EQ(result.trust.pivoted, true_inertia != by_signs) << seed;
    ++(true_inertia == by_signs ? expected : other);
    EXPECT_FALSE(solver.begin_pivoting());  // as before
    if (!result.trust.pivoted) {
      EXPECT_TRUE(solver.increase_quality());
    }
    EXPECT_TRUE(solver.factorize(chain.matrix).trust.pivoted);
    EXPECT_LT(residual_of(solver, chain.matrix), 1e-6);
    solver.reset_quality();
    EXPECT_FALSE(solver.factorize(chain.matrix, Certainty::Usual).trust.pivoted);
  }
  EXPECT_GT(expected, 0);
  EXPECT_GT(other, 0);
}

/// A - (lambda_i - distance) I: one eigenvalue is the distance, the inertia is known.
struct Shifted {
  SymmetricMatrix matrix;
  Inertia inertia;
};
Shifted shifted(const KktMatrix& kkt, Index i, double distance) {
  const Index n = kkt.matrix.dimension();
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(n, n);
  for (Index j = 0; j < n; ++j) {
    const auto column = static_cast<std::size_t>(j);
    for (Index p = kkt.matrix.column_starts()[column]; p < kkt.matrix.column_starts()[column + 1];
         ++p) {
      const auto entry = static_cast<std::size_t>(p);
      dense(kkt.matrix.rows()[entry], j) = kkt.matrix.values()[entry];
    }
  }
  const Eigen::VectorXd eigenvalues =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(dense, Eigen::EigenvaluesOnly).eigenvalues();
  Shifted result{kkt.matrix, {}};
  const double shift = distance - eigenvalues[i];
  for (Index j = 0; j < n; ++j) {
    result.matrix.values()[static_cast<std::size_t>(kkt.matrix.diagonal_position(j))] += shift;
    ++(eigenvalues[j] + shift > 0.0 ? result.inertia.positive : result.inertia.negative);
  }
  return result;
}

TEST(AutoSolver, InDoubtNoInertiaIsTheExpectedOneByMistake) {
  int in_pairs = 0;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const KktMatrix kkt = seed % 2 == 0 ? random_kkt({{40, 30, 12, 12}, 0.06, 2.0}, seed)
                                        : chauffeur_kkt(10, seed, seed == 1 ? 10.0 : 1e-2);
    const Index n = kkt.matrix.dimension();
    for (const double distance : {1e-4, -1e-4, 1e-8, -1e-8, 1e-11, -1e-11}) {
      const Shifted known = shifted(kkt, n / 2, distance);
      // Signs as the inertia is, and as it is not.
      for (const Index wrong : {0, distance > 0.0 ? -1 : 1}) {
        std::vector<std::int8_t> signs(static_cast<std::size_t>(n), -1);
        std::fill(signs.begin(), signs.begin() + known.inertia.positive + wrong, std::int8_t{1});
        AutoSolver solver({.ldlt_gamma = 1e-11});
        ASSERT_TRUE(solver.analyze(known.matrix, signs).ok);
        EXPECT_EQ(solver.factorize(known.matrix).inertia, known.inertia) << kkt.name << distance;
        static_cast<void>(solver.begin_pivoting());
        const Factorization result = solver.factorize(known.matrix);
        EXPECT_EQ(result.inertia, known.inertia) << kkt.name << " " << distance;
        EXPECT_TRUE(result.trust.pivoted || wrong == 0);
        in_pairs += result.trust.pivoted ? 0 : 1;
      }
    }
  }
  EXPECT_GE(in_pairs, 24);  // most of 36
}

TEST(AutoSolver, PivotsOnTinyMatricesAndWithoutSigns) {
  const KktMatrix tiny = random_kkt({{3, 3, 1, 1}, 0.5, 0.0}, 1);
  AutoSolver solver({});
  ASSERT_TRUE(solver.analyze(tiny.matrix, tiny.signs).ok);
  EXPECT_TRUE(solver.factorize(tiny.matrix).trust.pivoted);
  const KktMatrix chain = chauffeur_kkt(40, 1);
  ASSERT_TRUE(solver.analyze(chain.matrix, {}).ok);
  EXPECT_TRUE(solver.factorize(chain.matrix).trust.pivoted);
}

TEST(AutoSolver, PivotsWhereFrontsAreLarge) {
  const KktMatrix filled = random_kkt({{900, 900, 450, 450}, 3.0 / 900.0, 1.0}, 1);
  AutoSolver solver({});
  const Analysis analysis = solver.analyze(filled.matrix, filled.signs);
  ASSERT_TRUE(analysis.ok);
  EXPECT_TRUE(solver.factorize(filled.matrix, Certainty::Usual).trust.pivoted);
  EXPECT_GT(analysis.flops, 400.0 * static_cast<double>(analysis.factor_entries));
}

TEST(AutoSolver, PivotsWhereMatricesAreDense) {
  // No ordering keeps these sparse: dense kernels are faster than LDL', and pivot.
  for (const Index n : {60, 150, 300}) {
    MatrixBuilder builder(n);
    for (Index j = 0; j < n; ++j) {
      for (Index i = j; i < n; ++i) builder.add(i, j, i == j ? 2.0 * n : std::sin(1.0 + i + 3 * j));
    }
    const SymmetricMatrix matrix = builder.build();
    const std::vector<std::int8_t> signs(static_cast<std::size_t>(n), 1);
    AutoSolver solver({});
    ASSERT_TRUE(solver.analyze(matrix, signs).ok);
    const Factorization result = solver.factorize(matrix, Certainty::Usual);
    EXPECT_TRUE(result.trust.pivoted) << n;
    EXPECT_EQ(result.inertia, (Inertia{n, 0, 0})) << n;
  }
}

TEST(AutoSolver, PivotsWhenGammaDecidesTheInertia) {
  // One eigenvalue of -1e-12, which A + Gamma shows as positive.
  constexpr Index n = 50;
  MatrixBuilder builder(n);
  for (Index i = 0; i < n; ++i) builder.add(i, i, i == 20 ? -1e-12 : 1.0);
  const SymmetricMatrix matrix = builder.build();
  const std::vector<std::int8_t> signs(n, 1);

  LdltSolver ldlt({});
  ASSERT_TRUE(ldlt.analyze(matrix, signs).ok);
  EXPECT_EQ(ldlt.factorize(matrix).inertia, (Inertia{n, 0, 0}));
  AutoSolver solver({});
  ASSERT_TRUE(solver.analyze(matrix, signs).ok);
  const Factorization uncertain = solver.factorize(matrix, Certainty::Usual);
  EXPECT_EQ(uncertain.inertia, (Inertia{n, 0, 0}));
  EXPECT_FALSE(uncertain.trust.pivoted);
  for (const Factorization& certain :
       {solver.make_certain(matrix, uncertain), solver.factorize(matrix)}) {
    EXPECT_EQ(certain.inertia, (Inertia{n - 1, 1, 0}));
    EXPECT_TRUE(certain.trust.pivoted);
  }
}

TEST(AutoSolver, ASmallerGammaSavesThePivoting) {
  // Hidden by Gamma but not by a fraction of it, or not far enough from it.
  for (const double eigenvalue : {-1e-9, -1.2e-8, -3e-8, 2e-9, 2e-8}) {
    constexpr Index n = 50;
    MatrixBuilder builder(n);
    for (Index i = 0; i < n; ++i) builder.add(i, i, i == 20 ? eigenvalue : 1.0);
    const SymmetricMatrix matrix = builder.build();
    AutoSolver solver({});
    ASSERT_TRUE(solver.analyze(matrix, std::vector<std::int8_t>(n, 1)).ok);
    const Index negative = eigenvalue < 0.0 ? 1 : 0;
    const Factorization result = solver.factorize(matrix);
    EXPECT_EQ(result.inertia, (Inertia{n - negative, negative, 0})) << eigenvalue;
    EXPECT_FALSE(result.trust.pivoted) << eigenvalue;
    EXPECT_LT(result.trust.perturbation, std::abs(eigenvalue));
  }
}

TEST(AutoSolver, LdltPausesWhereItsInertiaIsNeverCertain) {
  constexpr Index n = 50;
  MatrixBuilder hopeless(n), clear(n);
  for (Index i = 0; i < n; ++i) {
    hopeless.add(i, i, i == 20 ? -1e-14 : 1.0);
    clear.add(i, i, 1.0);
  }
  const SymmetricMatrix matrix = hopeless.build();
  AutoSolver solver({});
  ASSERT_TRUE(solver.analyze(matrix, std::vector<std::int8_t>(n, 1)).ok);
  for (int run = 0; run < 4; ++run) {
    const Factorization result = solver.factorize(matrix);
    EXPECT_EQ(result.inertia.positive, n - 1);
    EXPECT_TRUE(result.trust.pivoted);
  }
  int pauses = 0;  // then LDL' is back
  for (const SymmetricMatrix easy = clear.build();; ++pauses) {
    ASSERT_LT(pauses, 16);
    const Factorization result = solver.factorize(easy);
    EXPECT_EQ(result.inertia, (Inertia{n, 0, 0}));
    if (result.trust.perturbation > 1e-12) break;
  }
  EXPECT_GT(pauses, 0);
}

TEST(AutoSolver, SingularMatricesAreSeenThroughLdlt) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const KktMatrix kkt = random_kkt({{60, 50, 20, 20}, 0.05, 0.0, true}, seed);
    AutoSolver solver({});
    ASSERT_TRUE(solver.analyze(kkt.matrix, kkt.signs).ok);
    ASSERT_FALSE(solver.factorize(kkt.matrix, Certainty::Usual).trust.pivoted);
    EXPECT_EQ(solver.factorize(kkt.matrix).status, FactorizationStatus::Singular) << seed;
  }
}

TEST(AutoSolver, AZeroPivotIsRepairedAndLdltTriedAgain) {
  const KktMatrix chain = chauffeur_kkt(20, 1);
  SymmetricSolverOptions no_gamma;
  no_gamma.ldlt_gamma = 0.0;  // the zero diagonals of the multipliers are then pivots
  no_gamma.ordering = Ordering::Metis;
  LdltSolver ldlt(no_gamma);
  ASSERT_TRUE(ldlt.analyze(chain.matrix, chain.signs).ok);
  EXPECT_EQ(ldlt.factorize(chain.matrix).status, FactorizationStatus::Failed);

  AutoSolver solver(no_gamma);
  ASSERT_TRUE(solver.analyze(chain.matrix, chain.signs).ok);
  const Factorization result = solver.factorize(chain.matrix);
  EXPECT_EQ(result.status, FactorizationStatus::Ok);
  EXPECT_TRUE(result.trust.pivoted);
  SymmetricMatrix easy = chain.matrix;
  easy.set_zero();
  for (Index i = 0; i < easy.dimension(); ++i) {
    easy.values()[static_cast<std::size_t>(easy.diagonal_position(i))] = i % 3 == 0 ? -1.0 : 2.0;
  }
  const Factorization repaired = solver.factorize(easy);
  EXPECT_EQ(repaired.inertia, (Inertia{200, 100, 0}));
  EXPECT_FALSE(repaired.trust.pivoted);
}

TEST(LdltSolver, NeedsOneSignPerRow) {
  LdltSolver solver({});
  const std::vector<std::int8_t> signs(2, 1);
  EXPECT_THROW((void)solver.analyze(SymmetricMatrix(3, {}), signs), std::invalid_argument);
}

TEST(LdltSolver, GammaGrowsWithTheCouplingOfTheSigns) {
  // [I A'; A 0] with the multiplier's row eliminated first: A'A / gamma must leave digits of I.
  SymmetricSolverOptions options;
  options.ldlt_gamma = 1e-11;
  for (const auto& [coupling, factor] : {std::pair{0.1, 1.0}, {3.0, 9.0}, {200.0, 1e3}}) {
    MatrixBuilder builder(3);
    builder.add(0, 0, 1.0);
    builder.add(1, 1, 500.0);
    builder.add(0, 1, 70.0);  // between rows of one sign
    builder.add(2, 0, coupling);
    const SymmetricMatrix matrix = builder.build();
    LdltSolver ldlt(options);
    ASSERT_TRUE(ldlt.analyze(matrix, std::vector<std::int8_t>{1, 1, -1}).ok);
    EXPECT_DOUBLE_EQ(ldlt.suitable_gamma(matrix), factor * options.ldlt_gamma);
    const Factorization result = ldlt.factorize(matrix);
    ASSERT_EQ(result.status, FactorizationStatus::Ok);
    EXPECT_DOUBLE_EQ(result.trust.perturbation, factor * options.ldlt_gamma);
  }
}

TEST(LdltSolver, ReportsTheSmallestPivot) {
  const std::vector<Triplet> diagonal{{0, 0}, {1, 1}, {2, 2}};
  SymmetricMatrix matrix(3, diagonal);
  const double values[] = {2.0, -0.25, 1.0};
  std::copy(std::begin(values), std::end(values), matrix.values().begin());
  LdltSolver solver({});
  ASSERT_TRUE(solver.analyze(matrix, std::vector<std::int8_t>{1, -1, 1}).ok);
  EXPECT_NEAR(solver.factorize(matrix).smallest_pivot, 0.25, 1e-7);
}

TEST(AutoSolver, PairsOfRowsAreForLittleFill) {
  constexpr Index kSteps = 200;
  MatrixBuilder chain(2 * kSteps - 1);
  std::vector<std::int8_t> signs(2 * kSteps - 1, 1);
  for (Index i = 0; i < kSteps; ++i) chain.add(i, i, 1.0);
  for (Index i = 0; i + 1 < kSteps; ++i) {
    chain.add(kSteps + i, i, 1.0);
    chain.add(kSteps + i, i + 1, -1.0);
    signs[static_cast<std::size_t>(kSteps + i)] = -1;
  }
  // Of little curvature, from each source to each sink: most variables find no partner.
  constexpr Index kPlaces = 30, kFlows = kPlaces * kPlaces, kRows = kFlows + 2 * kPlaces - 1;
  MatrixBuilder transport(kRows);
  std::vector<std::int8_t> transport_signs(kRows, -1);
  for (Index i = 0; i < kFlows; ++i) {
    transport.add(i, i, 1e-4);
    transport_signs[static_cast<std::size_t>(i)] = 1;
    transport.add(kFlows + i / kPlaces, i, 1.0);
    const Index sink = kFlows + kPlaces + i % kPlaces;
    if (sink < kRows) transport.add(sink, i, 1.0);
  }
  const SymmetricSolverOptions options;
  const auto in_doubt = [&](const SymmetricMatrix& matrix, std::span<const std::int8_t> s) {
    AutoSolver solver(options);
    EXPECT_TRUE(solver.analyze(matrix, s).ok);
    EXPECT_TRUE(solver.begin_pivoting());
    return solver.factorize(matrix).trust;
  };
  constexpr double kPairs = 1e-4;  // more than their Gamma is of LDL's
  const Trust of_chain = in_doubt(chain.build(), signs);
  EXPECT_FALSE(of_chain.pivoted);
  EXPECT_LT(of_chain.perturbation, kPairs * options.ldlt_gamma);
  // LDL' serves where its inertia is certain.
  const Trust of_transport = in_doubt(transport.build(), transport_signs);
  EXPECT_FALSE(of_transport.pivoted);
  EXPECT_GT(of_transport.perturbation, kPairs * options.ldlt_gamma);
}

/// Laplace's operator on a square, its smallest eigenvalues well known.
TEST(AutoSolver, InDoubtMatricesThatShouldBeDefiniteNeedNoPivoting) {
  constexpr Index kSide = 30, kRows = kSide * kSide;
  constexpr double kPi = 3.141592653589793;
  const auto eigenvalue = [](Index i) { return 2.0 - 2.0 * std::cos(kPi * i / (kSide + 1)); };
  const std::vector<std::int8_t> signs(kRows, 1);
  for (const double shift : {0.0, 0.5 * eigenvalue(1), 1.5 * (eigenvalue(1) + eigenvalue(2))}) {
    MatrixBuilder builder(kRows);
    Index negative = 0;
    for (Index k = 0; k < kRows; ++k) {
      builder.add(k, k, 4.0 - shift);
      if (k % kSide > 0) builder.add(k, k - 1, -1.0);
      if (k >= kSide) builder.add(k, k - kSide, -1.0);
      negative += eigenvalue(k % kSide + 1) + eigenvalue(k / kSide + 1) < shift ? 1 : 0;
    }
    const SymmetricMatrix matrix = builder.build();
    const SymmetricSolverOptions options;
    AutoSolver solver(options);
    ASSERT_TRUE(solver.analyze(matrix, signs).ok);
    EXPECT_TRUE(solver.begin_pivoting());
    const Factorization result = solver.factorize(matrix);
    EXPECT_EQ(result.status, FactorizationStatus::Ok);
    EXPECT_EQ(result.inertia.negative, negative) << shift;
    EXPECT_FALSE(result.trust.pivoted) << shift;
    EXPECT_LT(result.trust.perturbation, 1e-4 * options.ldlt_gamma);
    std::vector<double> solution(kRows, 1.0), image(kRows);
    solver.solve_in_place(solution);
    matrix.multiply(solution, image);
    for (const double value : image) EXPECT_NEAR(value, 1.0, 1e-9) << shift;
  }
}

struct PairsOfEqualRows {
  static constexpr Index kSteps = 400;
  PairsOfEqualRows() : signs(2 * kSteps, 1) {
    MatrixBuilder builder(2 * kSteps);
    for (Index i = 0; i < kSteps; ++i) {
      builder.add(i, i, 1.0);
      const Index row = kSteps + i;
      signs[static_cast<std::size_t>(row)] = -1;
      for (const Index variable : {i - i % 2, (i - i % 2 + 2) % kSteps}) {
        builder.add(row, variable, variable == i - i % 2 ? 1.0 : -0.5);
      }
    }
    matrix = builder.build();
  }
  SymmetricMatrix matrix;
  std::vector<std::int8_t> signs;
};

/// The difference of two equal rows vanishes under the matrix.
TEST(AutoSolver, ASingularMatrixIsSeenWithoutPivoting) {
  const PairsOfEqualRows kkt;
  AutoSolver solver({.ldlt_gamma = 1e-11});
  ASSERT_TRUE(solver.analyze(kkt.matrix, kkt.signs).ok);
  const Factorization seen = solver.factorize(kkt.matrix);
  EXPECT_EQ(seen.status, FactorizationStatus::Singular);
  EXPECT_EQ(seen.inertia, (Inertia{0, 0, 1}));  // a pivoting one would have counted
  EXPECT_FALSE(seen.trust.pivoted);
}

/// A pivot far below the others may be one of a matrix that is only ill-conditioned.
TEST(MumpsSolver, ASmallPivotIsANullPivotWhereItSolvesNothing) {
  for (const double last : {1.0, 1.0 + 5e-13, 1.0 - 5e-13}) {
    MatrixBuilder builder(2);
    builder.add(0, 0, 1.0);
    builder.add(1, 0, 1.0);
    builder.add(1, 1, last);
    const SymmetricMatrix matrix = builder.build();
    MumpsSolver solver({});
    ASSERT_TRUE(solver.analyze(matrix, {}).ok);
    const Factorization result = solver.factorize(matrix, Certainty::Usual);
    EXPECT_EQ(result.inertia,
              (Inertia{last > 1.0 ? 2 : 1, last < 1.0 ? 1 : 0, last == 1.0 ? 1 : 0}));
  }
}

/// Equations that are solved one after the other, each step larger than the one before: no pivot is
/// small, one eigenvalue is. A shift of the multipliers would cost Newton's method its digits.
TEST(AutoSolver, AnAlmostSingularMatrixIsNotASingularOne) {
  constexpr Index kSteps = 300;
  for (const double growth : {1.07, 1.09, 1.12}) {
    MatrixBuilder builder(2 * kSteps);
    std::vector<std::int8_t> signs(2 * kSteps, 1);
    for (Index i = 0; i < kSteps; ++i) {
      builder.add(i, i, 1e-4);
      builder.add(kSteps + i, i, 1.0);
      if (i > 0) builder.add(kSteps + i, i - 1, -growth);
      signs[static_cast<std::size_t>(kSteps + i)] = -1;
    }
    const SymmetricMatrix matrix = builder.build();
    AutoSolver solver({});
    ASSERT_TRUE(solver.analyze(matrix, signs).ok);
    const Factorization result = solver.factorize(matrix);
    EXPECT_EQ(result.status, FactorizationStatus::Ok) << growth;
    EXPECT_EQ(result.inertia, (Inertia{kSteps, kSteps, 0})) << growth;
  }
}

TEST(AutoSolver, InDoubtASingularMatrixIsSeenWithoutPivotingWhereSolutionsAreWanted) {
  const PairsOfEqualRows kkt;
  AutoSolver solver({.ldlt_gamma = 1e-11});
  ASSERT_TRUE(solver.analyze(kkt.matrix, kkt.signs).ok);
  ASSERT_TRUE(solver.begin_pivoting());
  const Factorization seen = solver.factorize(kkt.matrix, Certainty::Usual);
  EXPECT_EQ(seen.status, FactorizationStatus::Singular);
  EXPECT_EQ(seen.inertia.zero, 1);
  const Factorization counted = solver.factorize(kkt.matrix, Certainty::Certain);
  EXPECT_EQ(counted.status, FactorizationStatus::Singular);
  EXPECT_EQ(counted.inertia.zero, PairsOfEqualRows::kSteps / 2);
}

// Scales of rows that overflowed made entries that are no numbers, and pivots outside the matrix.
TEST(LapackSolver, RowsBesideHugeOnesMayVanish) {
  MatrixBuilder builder(5);
  builder.add(0, 0, 6e270);
  builder.add(3, 0, -4e-278);
  builder.add(1, 1, -2e-3);
  for (const Index i : {2, 4}) {
    builder.add(i, 0, -0.02);
    builder.add(i, i, 1e3);
  }
  const SymmetricMatrix matrix = builder.build();
  LapackSolver solver;
  ASSERT_TRUE(solver.analyze(matrix, {}).ok);
  const Factorization result = solver.factorize(matrix);
  EXPECT_EQ(result.status, FactorizationStatus::Singular);
  EXPECT_EQ(result.inertia, (Inertia{.positive = 3, .negative = 1, .zero = 1}));
}

TEST(LapackSolver, TinyAndLargerMatricesAreFactorizedAlike) {
  // Up to 24 rows without LAPACK, whose pivots these are; zeros on the diagonal ask for blocks.
  for (Index n = 1; n <= 26; ++n) {
    for (int share_of_zeros = 0; share_of_zeros <= 2; ++share_of_zeros) {
      const auto entry = [&](Index i, Index j) {
        const bool zero = i == j && (i + n) % 3 < share_of_zeros;
        return zero ? 0.0 : std::sin(1.0 + 7.0 * i * i + 3.0 * j + n) * std::pow(10.0, (i + j) % 4);
      };
      MatrixBuilder builder(n);
      Eigen::MatrixXd dense(n, n);
      for (Index j = 0; j < n; ++j) {
        for (Index i = j; i < n; ++i) {
          builder.add(i, j, entry(i, j));
          dense(i, j) = dense(j, i) = entry(i, j);
        }
      }
      const Eigen::VectorXd eigenvalues =
          Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(dense, Eigen::EigenvaluesOnly)
              .eigenvalues();
      if (!(eigenvalues.cwiseAbs().minCoeff() > 1e-9)) continue;  // one row, zero
      const SymmetricMatrix matrix = builder.build();
      LapackSolver solver;
      ASSERT_TRUE(solver.analyze(matrix, {}).ok);
      const Factorization result = solver.factorize(matrix);
      ASSERT_EQ(result.status, FactorizationStatus::Ok) << n;
      EXPECT_EQ(result.inertia.positive, (eigenvalues.array() > 0.0).count()) << n;
      EXPECT_EQ(result.inertia.negative, (eigenvalues.array() < 0.0).count()) << n;
      Eigen::MatrixXd rhs(n, 2);
      for (Index i = 0; i < n; ++i) rhs.row(i) << std::cos(2.0 + i), 1.0;
      Eigen::MatrixXd u = rhs;
      solver.solve_in_place({u.data(), static_cast<std::size_t>(u.size())}, 2);
      const double size = dense.cwiseAbs().maxCoeff() * u.cwiseAbs().maxCoeff();
      EXPECT_LE((dense * u - rhs).cwiseAbs().maxCoeff(), 1e-12 * size) << n;
    }
  }
}

TEST(LapackSolver, TinySingularMatricesAreSeen) {
  for (Index n = 2; n <= 24; n += 11) {
    MatrixBuilder builder(n);
    for (Index j = 0; j < n; ++j) {
      for (Index i = j; i < n; ++i) builder.add(i, j, (i + 1.0) * (j + 1.0));  // rank 1
    }
    const SymmetricMatrix matrix = builder.build();
    LapackSolver solver;
    ASSERT_TRUE(solver.analyze(matrix, {}).ok);
    const Factorization result = solver.factorize(matrix);
    EXPECT_EQ(result.status, FactorizationStatus::Singular);
    EXPECT_EQ(result.inertia, (Inertia{1, 0, n - 1})) << n;
  }
}

TEST(LapackSolver, SmallRowsAreNotZeroRows) {
  // Late in a barrier method: entries of 1e12 next to a pivot of 1e-6.
  MatrixBuilder builder(4);
  builder.add(0, 0, 1e12);
  builder.add(1, 1, -1e12);
  builder.add(2, 2, 1e-6);
  builder.add(3, 3, -1e-9);
  const SymmetricMatrix matrix = builder.build();
  LapackSolver solver;
  ASSERT_TRUE(solver.analyze(matrix, {}).ok);
  const Factorization result = solver.factorize(matrix);
  EXPECT_EQ(result.inertia, (Inertia{2, 2, 0}));
  EXPECT_DOUBLE_EQ(result.smallest_pivot, 1e-9);
}

TEST(MumpsSolver, OrderingsAreThoseAskedFor) {
  const KktMatrix kkt = grid_kkt(20, 1);
  const KktMatrix full = random_kkt({{150, 0, 0, 0}, 1.1, 0.0}, 1);
  for (const Ordering ordering : {Ordering::Amd, Ordering::Pord, Ordering::Metis}) {
    SymmetricSolverOptions options;
    options.ordering = ordering;
    MumpsSolver solver(options);
    EXPECT_EQ(solver.analyze(kkt.matrix, {}).ordering, ordering);
    // PORD cannot order a full matrix, and would end the process.
    const Ordering expected = ordering == Ordering::Pord ? Ordering::Amd : ordering;
    EXPECT_EQ(solver.analyze(full.matrix, {}).ordering, expected);
    EXPECT_EQ(solver.factorize(full.matrix).status, FactorizationStatus::Ok);
  }
}

TEST(MumpsSolver, MetisPermutationReducesFill) {
  const KktMatrix kkt = grid_kkt(40, 1);
  SymmetricSolverOptions options;
  options.ordering = Ordering::Metis;
  MumpsSolver metis(options);
  options.ordering = Ordering::Amd;
  MumpsSolver amd(options);
  // The inverse permutation would fill in about 13 times.
  EXPECT_LT(metis.analyze(kkt.matrix, {}).factor_entries,
            2 * amd.analyze(kkt.matrix, {}).factor_entries);
}

TEST(MumpsSolver, BestHasTheFewestFlops) {
  const KktMatrix kkt = grid_kkt(60, 1);
  MumpsSolver best({});
  const Analysis analysis = best.analyze(kkt.matrix, {});
  for (const Ordering ordering : {Ordering::Amd, Ordering::Metis}) {
    SymmetricSolverOptions options;
    options.ordering = ordering;
    MumpsSolver solver(options);
    EXPECT_LE(analysis.flops, solver.analyze(kkt.matrix, {}).flops);
  }
}

// Powers of the tolerance come near 1, where they stay.
TEST(MumpsSolver, IncreasesItsPivotToleranceFinitelyOften) {
  for (const double most : {1e-3, 0.95, 1.0}) {
    SymmetricSolverOptions options;
    options.mumps_pivot_tolerance_max = most;
    MumpsSolver solver(options);
    int times = 0;
    while (times < 1000 && solver.increase_quality()) ++times;
    EXPECT_LE(times, 30) << most;
    EXPECT_GE(times, 1) << most;
  }
}

TEST(MumpsSolver, RetriesWithMoreWorkspace) {
  SymmetricSolverOptions options;
  options.mumps_memory_percent = 0;
  options.mumps_pivot_tolerance = 0.1;  // many delayed pivots
  MumpsSolver solver(options);
  const KktMatrix kkt = random_kkt({{200, 200, 100, 100}, 0.02, 0.0}, 1);
  ASSERT_TRUE(solver.analyze(kkt.matrix, kkt.signs).ok);
  EXPECT_EQ(solver.factorize(kkt.matrix).status, FactorizationStatus::Ok);
}

TEST(MumpsSolver, NullPivotsThatAreDelayedAgainAndAgainTakeAnotherOrdering) {
  // K of a linear control problem: x1' = x2, x2' = u by the trapezoidal rule, no curvature. As many
  // null pivots as controls; an ordering without values delays them all to the root of its tree,
  // where they took 40 s instead of 0.03 s.
  constexpr Index kSteps = 2000;
  const double inverse = kSteps;
  const auto x1 = [](Index i) { return i; };
  const auto x2 = [](Index i) { return kSteps + i; };
  const auto u = [](Index i) { return 2 * kSteps + i; };
  const Index variables = 3 * kSteps + 1;
  MatrixBuilder k(variables + 2 * kSteps);
  for (Index i = 0; i < kSteps; ++i) {
    const Index first = variables + 2 * i, second = first + 1;
    k.add(first, x1(i), inverse);
    k.add(first, x2(i), -0.5);
    k.add(second, x2(i), inverse);
    k.add(second, u(i), -0.5);
    k.add(second, u(i + 1), -0.5);
    if (i == 0) continue;
    k.add(first, x1(i - 1), -inverse);
    k.add(first, x2(i - 1), -0.5);
    k.add(second, x2(i - 1), -inverse);
  }
  const SymmetricMatrix matrix = k.build();
  MumpsSolver solver({});
  ASSERT_TRUE(solver.analyze(matrix, {}).ok);
  const std::clock_t begin = std::clock();
  const Factorization result = solver.factorize(matrix);
  const std::clock_t end = std::clock();
  EXPECT_EQ(result.status, FactorizationStatus::Singular);
  EXPECT_EQ(result.inertia, (Inertia{2 * kSteps, 2 * kSteps, kSteps + 1}));
  EXPECT_LT(end - begin, 5 * CLOCKS_PER_SEC);
}

TEST(MumpsSolver, NullPivotsThatAnOrderingByValuesDelaysTakeAThirdOrdering) {
  // Chained equations, every third one with the same variable, at a point where many depend on each
  // other: orderings by degree delay all null pivots to where that variable is, which took 3.9 s
  // and then 2.2 s instead of 0.4 and 0.03.
  constexpr Index kBlocks = 2499;
  constexpr double kPoint[] = {2.0, 1.5, -1.0, 0.5};
  constexpr Index kHub = 7498;
  const Index variables = 3 * kBlocks + 1;
  const auto x = [&](Index i) { return kPoint[i % 4]; };
  MatrixBuilder k(variables + 3 * kBlocks);
  for (Index i = 0; i < variables; ++i) k.add(i, i, 1.0);
  for (Index i = 0; i < 3 * kBlocks; i += 3) {
    const Index first = variables + i, second = first + 1, third = first + 2;
    k.add(first, i, 1.0);
    k.add(first, i + 1, 2.0 * x(i + 1));
    k.add(first, i + 2, 2.0 * x(i + 2));
    k.add(second, i + 1, 1.0);
    k.add(second, i + 2, 2.0 * x(i + 2));
    k.add(second, i + 3, 1.0);
    k.add(third, i, x(kHub));
    k.add(third, kHub, x(i));
  }
  const SymmetricMatrix matrix = k.build();
  MumpsSolver solver({});
  ASSERT_TRUE(solver.analyze(matrix, {}).ok);
  const std::clock_t begin = std::clock();
  for (int time = 0; time < 2; ++time) {
    const Factorization result = solver.factorize(matrix);
    EXPECT_EQ(result.status, FactorizationStatus::Singular);
    EXPECT_EQ(result.inertia.zero, 623);
  }
  EXPECT_LT(std::clock() - begin, 3 * CLOCKS_PER_SEC);
}

TEST(MumpsSolver, RetriesWithLessWorkspace) {
  SymmetricSolverOptions options;
  options.mumps_memory_percent = 1'000'000'000;  // of some MB: no machine has it
  MumpsSolver solver(options);
  const KktMatrix kkt = grid_kkt(60, 1);
  ASSERT_TRUE(solver.analyze(kkt.matrix, kkt.signs).ok);
  EXPECT_EQ(solver.factorize(kkt.matrix).status, FactorizationStatus::Ok);
}

}  // namespace
}  // namespace ipminmax
