#include <gtest/gtest.h>

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <random>
#include <stdexcept>
#include <vector>

#include "linalg/ordering.hpp"
#include "test_matrices.hpp"

namespace ipminmax {
namespace {

using test::chauffeur_kkt;
using test::grid_kkt;
using test::MatrixBuilder;
using test::random_kkt;

bool is_permutation_of_rows(std::vector<Index> order, Index n) {
  std::sort(order.begin(), order.end());
  std::vector<Index> expected(static_cast<std::size_t>(n));
  std::iota(expected.begin(), expected.end(), 0);
  return order == expected;
}

Array<Index> natural_order(Index n) {
  Array<Index> order(n);
  std::iota(order.begin(), order.end(), 0);
  return order;
}

/// Entries of L with diagonal and operations, from the column counts of Eigen's own symbolic
/// factorization of the permuted matrix.
FactorSize factor_size_by_eigen(const SymmetricMatrix& matrix,
                                const std::vector<Index>& new_index) {
  using Sparse = Eigen::SparseMatrix<double, Eigen::ColMajor, Index>;
  std::vector<Eigen::Triplet<double, Index>> entries;
  for (Index j = 0; j < matrix.dimension(); ++j) {
    for (Index p = matrix.column_starts()[static_cast<std::size_t>(j)];
         p < matrix.column_starts()[static_cast<std::size_t>(j) + 1]; ++p) {
      const Index a =
          new_index[static_cast<std::size_t>(matrix.rows()[static_cast<std::size_t>(p)])];
      const Index b = new_index[static_cast<std::size_t>(j)];
      // Diagonally dominant, so that the numbers do not matter.
      entries.emplace_back(std::min(a, b), std::max(a, b), a == b ? 1e4 : 1.0);
    }
  }
  Sparse upper(matrix.dimension(), matrix.dimension());
  upper.setFromTriplets(entries.begin(), entries.end());
  Eigen::SimplicialLDLT<Sparse, Eigen::Upper, Eigen::NaturalOrdering<Index>> ldlt(upper);
  const Sparse l = ldlt.matrixL().nestedExpression();
  FactorSize size;
  for (Index j = 0; j < l.cols(); ++j) {
    const double below = static_cast<double>(l.col(j).nonZeros());
    size.entries += static_cast<std::int64_t>(below) + 1;
    size.flops += below * (below + 2.0);
  }
  return size;
}

TEST(Ordering, PredictionIsTheFactorOfEigen) {
  std::vector<test::KktMatrix> matrices;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    matrices.push_back(random_kkt({{20, 20, 10, 10}, 0.05, 0.0}, seed));
    matrices.push_back(random_kkt({{3, 2, 1, 1}, 0.5, 0.0}, seed));
  }
  matrices.push_back(chauffeur_kkt(20, 1));
  matrices.push_back(grid_kkt(12, 1));
  for (const auto& [name, matrix, signs] : matrices) {
    for (const auto& order :
         {natural_order(matrix.dimension()), fill_reducing_ordering(matrix, Ordering::Amd),
          fill_reducing_ordering(matrix, Ordering::Metis)}) {
      const FactorSize predicted = predict_factor_size(matrix, order);
      const FactorSize actual = factor_size_by_eigen(matrix, order);
      EXPECT_EQ(predicted.entries, actual.entries) << name;
      EXPECT_DOUBLE_EQ(predicted.flops, actual.flops) << name;
    }
  }
}

TEST(Ordering, IsAPermutationThatReducesFill) {
  const auto grid = grid_kkt(60, 1).matrix;
  const FactorSize natural = predict_factor_size(grid, natural_order(grid.dimension()));
  for (const Ordering ordering : {Ordering::Amd, Ordering::Metis}) {
    const auto order = fill_reducing_ordering(grid, ordering);
    EXPECT_TRUE(is_permutation_of_rows(order, grid.dimension()));
    // The inverse permutation would give no better than a random order.
    EXPECT_LT(2.0 * predict_factor_size(grid, order).flops, natural.flops);
  }
}

TEST(Ordering, IsReproducibleWhateverTheStateOfRand) {
  const auto grid = grid_kkt(30, 1).matrix;
  for (const Ordering ordering : {Ordering::Amd, Ordering::Metis}) {
    const auto first = fill_reducing_ordering(grid, ordering);
    std::srand(12345);
    (void)std::rand();
    EXPECT_EQ(fill_reducing_ordering(grid, ordering), first);
  }
}

TEST(Ordering, LeavesTheCallersRandAlone) {
  const auto grid = grid_kkt(20, 1).matrix;
  std::srand(7);
  const int expected[] = {std::rand(), std::rand()};
  std::srand(7);
  EXPECT_EQ(std::rand(), expected[0]);
  (void)fill_reducing_ordering(grid, Ordering::Metis);
  EXPECT_EQ(std::rand(), expected[1]);
}

TEST(Ordering, HandlesDegenerateGraphs) {
  const std::vector<Triplet> one_edge{{1, 0}};
  for (const Ordering ordering : {Ordering::Amd, Ordering::Metis}) {
    for (Index n = 0; n <= 5; ++n) {
      const SymmetricMatrix diagonal(n, {});
      const auto order = fill_reducing_ordering(diagonal, ordering);
      EXPECT_TRUE(is_permutation_of_rows(order, n));
      EXPECT_EQ(predict_factor_size(diagonal, order).entries, n);
      if (n < 2) continue;
      const SymmetricMatrix edge(n, one_edge);
      EXPECT_TRUE(is_permutation_of_rows(fill_reducing_ordering(edge, ordering), n));
    }
    std::vector<Triplet> dense;
    for (Index i = 0; i < 40; ++i) {
      for (Index j = 0; j < i; ++j) dense.push_back({i, j});
    }
    const SymmetricMatrix full(40, dense);
    const auto order = fill_reducing_ordering(full, ordering);
    EXPECT_TRUE(is_permutation_of_rows(order, 40));
    EXPECT_EQ(predict_factor_size(full, order).entries, 40 * 41 / 2);
  }
}

TEST(Ordering, ArrowIsOrderedWithItsTipLast) {
  std::vector<Triplet> entries;
  for (Index i = 1; i < 500; ++i) entries.push_back({i, 0});
  const SymmetricMatrix arrow(500, entries);
  for (const Ordering ordering : {Ordering::Amd, Ordering::Metis}) {
    EXPECT_EQ(predict_factor_size(arrow, fill_reducing_ordering(arrow, ordering)).entries, 999);
  }
}

TEST(Ordering, PredictionOfHeavyFillIsCheap) {
  std::vector<Triplet> entries;  // arrow pointing the wrong way: L has 2e10 entries
  constexpr Index n = 200'000;
  for (Index i = 1; i < n; ++i) entries.push_back({i, 0});
  const SymmetricMatrix arrow(n, entries);
  EXPECT_EQ(predict_factor_size(arrow, natural_order(n)).entries,
            static_cast<std::int64_t>(n) * (n + 1) / 2);
}

TEST(Ordering, RejectsWhatIsNotAvailableHere) {
  const SymmetricMatrix matrix(3, {});
  EXPECT_THROW((void)fill_reducing_ordering(matrix, Ordering::Pord), std::invalid_argument);
  EXPECT_THROW((void)fill_reducing_ordering(matrix, Ordering::Best), std::invalid_argument);
}

TEST(Ordering, BestIsTheBetterOfTheTwo) {
  constexpr Index kRows = 3000;  // of a random graph, in which all fills in
  std::mt19937 random(1);
  MatrixBuilder builder(kRows);
  for (Index i = 1; i < kRows; ++i) {
    for (int k = 0; k < 4; ++k)
      builder.add(i, static_cast<Index>(random() % static_cast<unsigned>(i)), 1.0);
  }
  const SymmetricMatrix graph = builder.build();
  const OrderingChoice best = choose_ordering(graph, Ordering::Best);
  ASSERT_GT(best.size.flops, kWorthComparing * worthwhile_flops(graph));
  for (const Ordering ordering : {Ordering::Amd, Ordering::Metis}) {
    const OrderingChoice choice = choose_ordering(graph, ordering);
    EXPECT_EQ(choice.ordering, ordering);
    EXPECT_LE(best.size.flops, choice.size.flops);
    if (best.ordering == ordering) {
      EXPECT_EQ(best.new_index, choice.new_index);
    }
  }
}

}  // namespace
}  // namespace ipminmax
