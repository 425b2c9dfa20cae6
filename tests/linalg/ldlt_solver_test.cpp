// LDL' without pivoting: by columns the same operations in the same order as Eigen's, by panels the
// same factors up to rounding; on any number of threads.
#include <sys/wait.h>
#include <unistd.h>

#include <gtest/gtest.h>

#include <Eigen/SparseCholesky>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>
#include <numeric>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include <support/count_threads.hpp>
#include <support/sanitizer.hpp>

#include "linalg/ldlt_solver.hpp"
#include "test_matrices.hpp"

namespace ipminmax {
namespace {

using test::chauffeur_kkt;
using test::grid_kkt;
using test::KktMatrix;
using test::random_kkt;
using testing::has_threads;
using testing::threads_of_this_process;

std::vector<double> random_vector(std::size_t size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<double> v(size);
  for (double& value : v) value = uniform(random);
  return v;
}

/// Eliminated in the order of the rows, or one of the same fill, by panels where flops is infinite.
OrderingChoice natural_order(const SymmetricMatrix& matrix, double flops) {
  Array<Index> order(matrix.dimension());
  std::iota(order.begin(), order.end(), 0);
  FactorSize size = predict_factor_size(matrix, order);
  size.flops = flops;
  return {Ordering::Amd, std::move(order), size};
}

class BesideEigen : public ::testing::TestWithParam<KktMatrix> {
 protected:
  /// Compares factors and solutions: by_columns bit for bit.
  void expect_the_same(bool by_columns) const;
};

void BesideEigen::expect_the_same(bool by_columns) const {
  // Eigen adds no Gamma: a few diagonals make the matrix quasidefinite.
  SymmetricMatrix matrix = GetParam().matrix;
  for (Index i = 0; i < matrix.dimension(); ++i) {
    matrix.values()[static_cast<std::size_t>(matrix.diagonal_position(i))] +=
        1e-3 * GetParam().signs[static_cast<std::size_t>(i)];
  }
  using Upper = Eigen::SparseMatrix<double, Eigen::ColMajor, Index>;
  std::vector<Eigen::Triplet<double, Index>> entries;
  for (Index j = 0; j < matrix.dimension(); ++j) {
    for (Index p = matrix.column_starts()[static_cast<std::size_t>(j)];
         p < matrix.column_starts()[static_cast<std::size_t>(j) + 1]; ++p) {
      const auto k = static_cast<std::size_t>(p);
      entries.emplace_back(j, matrix.rows()[k], matrix.values()[k]);
    }
  }
  Upper upper(matrix.dimension(), matrix.dimension());
  upper.setFromTriplets(entries.begin(), entries.end());
  Eigen::SimplicialLDLT<Upper, Eigen::Upper, Eigen::NaturalOrdering<Index>> eigen(upper);
  ASSERT_EQ(eigen.info(), Eigen::Success);
  const Eigen::VectorXd pivots = eigen.vectorD();

  SymmetricSolverOptions options;
  options.ldlt_gamma = 0.0;
  LdltSolver solver(options);
  ASSERT_TRUE(
      solver.analyze(matrix, GetParam().signs, natural_order(matrix, by_columns ? 0.0 : kInfinity))
          .ok);
  const Factorization result = solver.factorize(matrix);
  ASSERT_EQ(result.status, FactorizationStatus::Ok);
  const double smallest = pivots.cwiseAbs().minCoeff();
  EXPECT_NEAR(result.smallest_pivot, smallest, by_columns ? 0.0 : 1e-10 * smallest);
  EXPECT_EQ(result.inertia.positive, (pivots.array() > 0.0).count());
  EXPECT_EQ(result.inertia.negative, (pivots.array() < 0.0).count());

  const auto n = static_cast<std::size_t>(matrix.dimension());
  std::vector<double> rhs = random_vector(5 * n, 1);  // four together and one alone
  for (std::size_t i = 0; i < n / 2; ++i) rhs[4 * n + i] = 0.0;
  const std::vector<double> given = rhs;
  solver.solve_in_place(rhs, 5);
  for (std::size_t c = 0; c < 5; ++c) {
    Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(&given[c * n], matrix.dimension());
    eigen.matrixL().solveInPlace(x);
    x.array() /= pivots.array();  // Eigen's solve multiplies by the inverse
    eigen.matrixU().solveInPlace(x);
    if (by_columns) {
      EXPECT_EQ(std::vector<double>(x.begin(), x.end()),
                std::vector<double>(&rhs[c * n], &rhs[c * n] + n))
          << "right-hand side " << c;
    } else {
      const Eigen::Map<const Eigen::VectorXd> ours(&rhs[c * n], matrix.dimension());
      EXPECT_LE((x - ours).norm(), 1e-9 * x.norm()) << "right-hand side " << c;
    }
  }
}

TEST_P(BesideEigen, HasTheSameBitsByColumns) {
#ifdef FP_FAST_FMA
  GTEST_SKIP() << "where compilers may choose which products and sums are rounded once";
#endif
  expect_the_same(/*by_columns=*/true);
}

TEST_P(BesideEigen, HasTheSameFactorsByPanels) { expect_the_same(/*by_columns=*/false); }

INSTANTIATE_TEST_SUITE_P(Of, BesideEigen,
                         ::testing::Values(chauffeur_kkt(60, 1), chauffeur_kkt(7, 2, 1e3),
                                           grid_kkt(9, 3), random_kkt({{30, 30, 10, 10}, 0.1}, 4),
                                           random_kkt({{12, 8, 5, 3}, 0.5, 4.0}, 5)),
                         [](const auto& kkt) { return kkt.param.name; });

TEST(LdltSolver, LeavesNothingBehindAfterAFailure) {
  for (const KktMatrix& kkt : {chauffeur_kkt(20, 1), grid_kkt(20, 3)}) {
    const auto n = static_cast<std::size_t>(kkt.matrix.dimension());
    const auto solved = [&](LdltSolver& solver) {
      EXPECT_EQ(solver.factorize(kkt.matrix).status, FactorizationStatus::Ok);
      std::vector<double> rhs(n, 1.0);
      solver.solve_in_place(rhs);
      return rhs;
    };
    LdltSolver solver({}), fresh({});
    ASSERT_TRUE(solver.analyze(kkt.matrix, kkt.signs).ok);
    ASSERT_TRUE(fresh.analyze(kkt.matrix, kkt.signs).ok);
    // A zero pivot, one that overflows and one that is none at all.
    SymmetricMatrix zero = kkt.matrix, huge = kkt.matrix, none = kkt.matrix;
    zero.set_zero();
    for (double& value : huge.values()) value *= 1e308;
    none.values()[n / 2] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(solver.factorize_with(zero, 0.0).status, FactorizationStatus::Failed);
    EXPECT_EQ(solver.factorize(huge).status, FactorizationStatus::Failed);
    EXPECT_EQ(solver.factorize(none).status, FactorizationStatus::Failed);
    EXPECT_EQ(solved(solver), solved(fresh));
  }
}

/// Matrices side by side, coupled by nothing.
KktMatrix side_by_side(const std::vector<KktMatrix>& blocks) {
  Index dimension = 0;
  for (const KktMatrix& block : blocks) dimension += block.matrix.dimension();
  test::MatrixBuilder builder(dimension);
  KktMatrix all;
  Index first = 0;
  for (const KktMatrix& block : blocks) {
    const SymmetricMatrix& matrix = block.matrix;
    for (Index j = 0; j < matrix.dimension(); ++j) {
      for (Index p = matrix.column_starts()[static_cast<std::size_t>(j)];
           p < matrix.column_starts()[static_cast<std::size_t>(j) + 1]; ++p) {
        const auto k = static_cast<std::size_t>(p);
        builder.add(first + matrix.rows()[k], first + j, matrix.values()[k]);
      }
    }
    all.signs.insert(all.signs.end(), block.signs.begin(), block.signs.end());
    first += matrix.dimension();
  }
  all.matrix = builder.build();
  return all;
}

struct Large {
  std::string name;
  KktMatrix kkt;
  Ordering ordering = Ordering::Best;
};
void PrintTo(const Large& large, std::ostream* out) { *out << large.name; }

SymmetricSolverOptions options_of(const Large& large, int threads) {
  SymmetricSolverOptions options;
  options.ordering = large.ordering;
  options.threads = threads;
  return options;
}

/// What a factorization and solves of it say.
struct Outcome {
  Factorization factorization;
  std::vector<double> solutions;
};

Outcome outcome_of(SymmetricSolver& solver, const SymmetricMatrix& matrix) {
  Outcome outcome{solver.factorize(matrix),
                  random_vector(5 * static_cast<std::size_t>(matrix.dimension()), 1)};
  solver.solve_in_place(outcome.solutions, 5);
  return outcome;
}

void expect_same(const Outcome& a, const Outcome& b) {
  EXPECT_EQ(a.factorization.status, FactorizationStatus::Ok);
  EXPECT_EQ(b.factorization.status, FactorizationStatus::Ok);
  EXPECT_EQ(a.factorization.inertia, b.factorization.inertia);
  EXPECT_EQ(a.factorization.smallest_pivot, b.factorization.smallest_pivot);
  EXPECT_TRUE(a.solutions == b.solutions);
}

class OnThreads : public ::testing::TestWithParam<Large> {};

TEST_P(OnThreads, HasTheBitsOfOne) {
  const KktMatrix& kkt = GetParam().kkt;
  LdltSolver one(options_of(GetParam(), 1));
  EXPECT_EQ(one.analyze(kkt.matrix, kkt.signs).threads, 1);
  const Outcome expected = outcome_of(one, kkt.matrix);
  for (const int threads : {2, 4}) {
    LdltSolver several(options_of(GetParam(), threads));
    const int used = several.analyze(kkt.matrix, kkt.signs).threads;
    EXPECT_TRUE(2 <= used && used <= threads) << used;
    for (int pass = 0; pass < 2; ++pass) {
      expect_same(expected, outcome_of(several, kkt.matrix));
    }
    const auto copy = several.same_analysis(kkt.matrix, kkt.signs);
    ASSERT_TRUE(copy);
    expect_same(expected, outcome_of(*copy, kkt.matrix));
  }
}

TEST_P(OnThreads, FailsAsOneDoesAndGoesOn) {
  const KktMatrix& kkt = GetParam().kkt;
  LdltSolver one(options_of(GetParam(), 1)), two(options_of(GetParam(), 2));
  ASSERT_TRUE(one.analyze(kkt.matrix, kkt.signs).ok);
  ASSERT_EQ(two.analyze(kkt.matrix, kkt.signs).threads, 2);
  for (const Index row : {Index{0}, kkt.matrix.dimension() / 2, kkt.matrix.dimension() - 1}) {
    SymmetricMatrix broken = kkt.matrix;
    broken.values()[static_cast<std::size_t>(broken.diagonal_position(row))] =
        std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(two.factorize(broken).status, FactorizationStatus::Failed);
    EXPECT_EQ(outcome_of(one, broken).factorization.status, FactorizationStatus::Failed);
    expect_same(outcome_of(one, kkt.matrix), outcome_of(two, kkt.matrix));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Of, OnThreads,
    ::testing::Values(Large{"grid_by_metis", grid_kkt(60, 3), Ordering::Metis},
                      Large{"random", side_by_side({random_kkt({{180, 180, 60, 60}, 0.05}, 1),
                                                    random_kkt({{190, 170, 70, 50}, 0.05}, 2),
                                                    random_kkt({{170, 190, 50, 70}, 0.05}, 3),
                                                    random_kkt({{160, 200, 60, 60}, 0.05}, 4)})}),
    [](const auto& large) { return large.param.name; });

TEST(ThreadsOfLdlt, AreMadeWhenNeededAndEndWithTheSolver) {
  if (IPMINMAX_UNDER_SANITIZER) GTEST_SKIP() << "which has threads of its own";
  const KktMatrix large = grid_kkt(60, 3), small = chauffeur_kkt(100, 2);
  const int before = threads_of_this_process();
  for (const int threads : {1, 2, 4}) {
    LdltSolver solver({.ordering = Ordering::Metis, .threads = threads});
    ASSERT_TRUE(solver.analyze(small.matrix, small.signs).ok);
    EXPECT_EQ(solver.factorize(small.matrix).status, FactorizationStatus::Ok);
    EXPECT_TRUE(has_threads(before));
    ASSERT_TRUE(solver.analyze(large.matrix, large.signs).ok);
    EXPECT_TRUE(has_threads(before));
    EXPECT_EQ(solver.factorize(large.matrix).status, FactorizationStatus::Ok);
    EXPECT_TRUE(has_threads(before + threads - 1));
  }
  EXPECT_TRUE(has_threads(before));
}

TEST(ThreadsOfLdlt, AreMadeAnewInAForkedChild) {
  if (IPMINMAX_UNDER_SANITIZER) GTEST_SKIP() << "which makes no threads after a fork";
  const KktMatrix kkt = grid_kkt(60, 3);
  auto solver = std::make_unique<LdltSolver>(
      SymmetricSolverOptions{.ordering = Ordering::Metis, .threads = 2});
  ASSERT_TRUE(solver->analyze(kkt.matrix, kkt.signs).ok);
  const Outcome expected = outcome_of(*solver, kkt.matrix);
  const auto another = solver->same_analysis(kkt.matrix, kkt.signs);
  expect_same(expected, outcome_of(*another, kkt.matrix));
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    alarm(30);
    const Outcome again = outcome_of(*solver, kkt.matrix);
    const bool same = again.solutions == expected.solutions && threads_of_this_process() == 2;
    solver.reset();  // with a thread; the other one, without
    std::_Exit(same ? 0 : 1);
  }
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  expect_same(expected, outcome_of(*solver, kkt.matrix));
}

}  // namespace
}  // namespace ipminmax
