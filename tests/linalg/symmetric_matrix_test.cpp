#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include "linalg/symmetric_matrix.hpp"

namespace ipminmax {
namespace {

std::vector<Index> to_vector(std::span<const Index> values) {
  return {values.begin(), values.end()};
}

TEST(SymmetricMatrix, SortsMirrorsAndMergesTriplets) {
  const std::vector<Triplet> entries{{2, 0}, {0, 1}, {1, 1}, {1, 0}, {0, 2}, {2, 1}};
  const SymmetricMatrix matrix(3, entries);
  EXPECT_EQ(matrix.dimension(), 3);
  EXPECT_EQ(matrix.nonzeros(), 6);
  EXPECT_EQ(to_vector(matrix.column_starts()), (std::vector<Index>{0, 3, 5, 6}));
  EXPECT_EQ(to_vector(matrix.rows()), (std::vector<Index>{0, 1, 2, 1, 2, 2}));
  EXPECT_EQ(to_vector(matrix.triplet_positions()), (std::vector<Index>{2, 1, 3, 1, 2, 4}));
  for (Index i = 0; i < 3; ++i) {
    const Index p = matrix.diagonal_position(i);
    EXPECT_EQ(matrix.rows()[static_cast<std::size_t>(p)], i);
  }
}

TEST(SymmetricMatrix, HasFullDiagonalWithoutTriplets) {
  const SymmetricMatrix matrix(4, {});
  EXPECT_EQ(matrix.nonzeros(), 4);
  EXPECT_EQ(to_vector(matrix.rows()), (std::vector<Index>{0, 1, 2, 3}));
  EXPECT_EQ(matrix.max_norm(), 0.0);
}

TEST(SymmetricMatrix, MayBeEmpty) {
  const SymmetricMatrix matrix(0, {});
  EXPECT_EQ(matrix.dimension(), 0);
  EXPECT_EQ(matrix.nonzeros(), 0);
  EXPECT_EQ(matrix.column_starts().size(), 1u);
  EXPECT_EQ(SymmetricMatrix().column_starts().size(), 1u);
  matrix.multiply({}, {});
}

TEST(SymmetricMatrix, RejectsIndicesOutside) {
  for (const Triplet bad : {Triplet{3, 0}, Triplet{0, 3}, Triplet{-1, 0}, Triplet{1, -1}}) {
    const std::vector<Triplet> entries{{0, 0}, bad};
    EXPECT_THROW(SymmetricMatrix(3, entries), std::invalid_argument);
  }
  EXPECT_THROW(SymmetricMatrix(-1, {}), std::invalid_argument);
}

TEST(SymmetricMatrix, MultipliesLikeTheDenseMatrix) {
  constexpr int n = 17;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::uniform_int_distribution<Index> index(0, n - 1);
  std::vector<Triplet> entries;
  for (int k = 0; k < 60; ++k) entries.push_back({index(random), index(random)});
  SymmetricMatrix matrix(n, entries);
  std::vector<std::vector<double>> dense(n, std::vector<double>(n, 0.0));
  for (std::size_t k = 0; k < entries.size(); ++k) {
    const double value = uniform(random);
    const auto p = static_cast<std::size_t>(matrix.triplet_positions()[k]);
    const auto i = static_cast<std::size_t>(entries[k].row);
    const auto j = static_cast<std::size_t>(entries[k].col);
    matrix.values()[p] += value;
    dense[i][j] += value;
    if (i != j) dense[j][i] += value;
  }
  std::vector<double> x(n), product(n, 1e300);
  for (double& value : x) value = uniform(random);
  matrix.multiply(x, product);
  double norm = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    double expected = 0.0;
    for (std::size_t j = 0; j < n; ++j) {
      expected += dense[i][j] * x[j];
      norm = std::max(norm, std::abs(dense[i][j]));
    }
    EXPECT_NEAR(product[i], expected, 1e-13);
  }
  EXPECT_DOUBLE_EQ(matrix.max_norm(), norm);
  matrix.set_zero();
  EXPECT_EQ(matrix.max_norm(), 0.0);
}

TEST(SymmetricMatrix, NormShowsNanAndInfinity) {
  SymmetricMatrix matrix(3, {});
  matrix.values()[0] = std::numeric_limits<double>::quiet_NaN();
  matrix.values()[2] = 1.0;
  EXPECT_TRUE(std::isnan(matrix.max_norm()));
  matrix.values()[0] = -std::numeric_limits<double>::infinity();
  EXPECT_TRUE(std::isinf(matrix.max_norm()));
}

TEST(SymmetricMatrix, SharesItsPatternWithCopies) {
  const std::vector<Triplet> entries = {{1, 0}, {2, 2}};
  SymmetricMatrix matrix(3, entries);
  matrix.values()[1] = 5.0;
  SymmetricMatrix copy = matrix;
  EXPECT_EQ(copy.rows().data(), matrix.rows().data());
  copy.values()[1] = 7.0;
  EXPECT_EQ(matrix.values()[1], 5.0);
  copy.drop_values();
  EXPECT_TRUE(copy.values().empty());
  EXPECT_EQ(copy.nonzeros(), 4);
  copy.set_zero();
  EXPECT_EQ(copy.values().size(), 4U);
  EXPECT_EQ(copy.max_norm(), 0.0);
}

TEST(SymmetricMatrix, IsBuiltInLinearTime) {
  constexpr Index n = 200'000;
  std::vector<Triplet> entries;
  for (Index i = 0; i < n; ++i) {  // an arrow and a band: one very long column
    entries.push_back({i, 0});
    entries.push_back({i, std::max(0, i - 1)});
    entries.push_back({n - 1, i});
  }
  const SymmetricMatrix matrix(n, entries);
  EXPECT_EQ(matrix.column_starts()[1], n);
  EXPECT_EQ(matrix.triplet_positions().size(), entries.size());
}

}  // namespace
}  // namespace ipminmax
