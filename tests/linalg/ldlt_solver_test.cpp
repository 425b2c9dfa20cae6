// LDL' without pivoting: the same operations in the same order as Eigen's.
#include <gtest/gtest.h>

#include <Eigen/SparseCholesky>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "linalg/ldlt_solver.hpp"
#include "test_matrices.hpp"

namespace ipminmax {
namespace {

using test::chauffeur_kkt;
using test::grid_kkt;
using test::KktMatrix;
using test::random_kkt;

std::vector<double> random_vector(std::size_t size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<double> v(size);
  for (double& value : v) value = uniform(random);
  return v;
}

/// Eliminated in the order of the rows.
OrderingChoice natural_order(const SymmetricMatrix& matrix) {
  std::vector<Index> order(static_cast<std::size_t>(matrix.dimension()));
  std::iota(order.begin(), order.end(), 0);
  const FactorSize size = predict_factor_size(matrix, order);
  return {Ordering::Amd, std::move(order), size};
}

class BesideEigen : public ::testing::TestWithParam<KktMatrix> {};

TEST_P(BesideEigen, HasTheSameBits) {
#ifdef FP_FAST_FMA
  GTEST_SKIP() << "where compilers may choose which products and sums are rounded once";
#endif
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
  ASSERT_TRUE(solver.analyze(matrix, GetParam().signs, natural_order(matrix)).ok);
  const Factorization result = solver.factorize(matrix);
  ASSERT_EQ(result.status, FactorizationStatus::Ok);
  EXPECT_EQ(result.smallest_pivot, pivots.cwiseAbs().minCoeff());
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
    EXPECT_EQ(std::vector<double>(x.begin(), x.end()),
              std::vector<double>(&rhs[c * n], &rhs[c * n] + n))
        << "right-hand side " << c;
  }
}

INSTANTIATE_TEST_SUITE_P(Of, BesideEigen,
                         ::testing::Values(chauffeur_kkt(60, 1), chauffeur_kkt(7, 2, 1e3),
                                           grid_kkt(9, 3), random_kkt({{30, 30, 10, 10}, 0.1}, 4),
                                           random_kkt({{12, 8, 5, 3}, 0.5, 4.0}, 5)),
                         [](const auto& kkt) { return kkt.param.name; });

TEST(LdltSolver, LeavesNothingBehindAfterAFailure) {
  const KktMatrix kkt = chauffeur_kkt(20, 1);
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
  for (double& value : huge.values()) value *= 1e300;
  none.values()[n / 2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(solver.factorize_with(zero, 0.0).status, FactorizationStatus::Failed);
  EXPECT_EQ(solver.factorize(huge).status, FactorizationStatus::Failed);
  EXPECT_EQ(solver.factorize(none).status, FactorizationStatus::Failed);
  EXPECT_EQ(solved(solver), solved(fresh));
}

}  // namespace
}  // namespace ipminmax
