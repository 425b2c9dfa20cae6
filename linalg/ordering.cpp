#include <metis.h>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <limits>
#include <new>
#include <numeric>
#include <stdexcept>
#include <type_traits>

#include "linalg/elimination_tree.hpp"
#include "linalg/library_lock.hpp"
#include "linalg/numbers.hpp"
#include "linalg/ordering.hpp"
#include "linalg/reproducible_rand.hpp"

namespace ipminmax {

namespace {

static_assert(std::is_same_v<idx_t, Index>, "METIS must be built with 32-bit indices");

/// Neighbours of every row in the graph of the matrix, itself among them on request.
Lists adjacency(const SymmetricMatrix& matrix, bool with_diagonal) {
  const Index n = matrix.dimension();
  if (2 * static_cast<std::int64_t>(matrix.nonzeros()) > std::numeric_limits<Index>::max()) {
    throw std::bad_alloc();
  }
  return collect(n, [&](auto&& add) {
    for (Index j = 0; with_diagonal && j < n; ++j) add(j, j);
    matrix.for_each_below([&](Index i, Index j, Index) {
      add(i, j);
      add(j, i);
    });
  });
}

Array<Index> identity_ordering(Index dimension) {
  Array<Index> new_index(dimension);
  std::iota(new_index.begin(), new_index.end(), 0);
  return new_index;
}

Array<Index> amd_ordering(const SymmetricMatrix& matrix) {
  const Index n = matrix.dimension();
  // With the diagonal: Eigen puts rows without one last.
  const Lists graph = adjacency(matrix, /*with_diagonal=*/true);
  Eigen::SparseMatrix<double, Eigen::ColMajor, Index> pattern(n, n);  // values are never read
  pattern.resizeNonZeros(static_cast<Eigen::Index>(graph.items.size()));
  std::copy(graph.starts.begin(), graph.starts.end(), pattern.outerIndexPtr());
  std::copy(graph.items.begin(), graph.items.end(), pattern.innerIndexPtr());
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, Index> order;
  Eigen::internal::minimum_degree_ordering(pattern, order);  // order[k]: the row eliminated k-th

  Array<Index> new_index(n);
  for (Index k = 0; k < n; ++k) new_index[order.indices()[k]] = k;
  return new_index;
}

Array<Index> metis_ordering(const SymmetricMatrix& matrix) {
  const Index n = matrix.dimension();
  Lists graph = adjacency(matrix, /*with_diagonal=*/false);
  if (graph.items.empty()) return identity_ordering(n);
  Array<Index> order(n);      // order[k]: the row eliminated k-th
  Array<Index> new_index(n);  // METIS calls it iperm
  idx_t options[METIS_NOPTIONS];
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_SEED] = 1;
  idx_t vertices = n;
  const LibraryLock lock;
  const ReproducibleRand rand;
  const int status = METIS_NodeND(&vertices, graph.starts.data(), graph.items.data(), nullptr,
                                  options, order.data(), new_index.data());
  if (status == METIS_ERROR_MEMORY) throw std::bad_alloc();
  if (status != METIS_OK) return identity_ordering(n);
  return new_index;
}

}  // namespace

Array<Index> fill_reducing_ordering(const SymmetricMatrix& matrix, Ordering ordering) {
  if (ordering != Ordering::Amd && ordering != Ordering::Metis) {
    throw std::invalid_argument("fill_reducing_ordering: only Amd and Metis");
  }
  if (matrix.dimension() <= 1) return identity_ordering(matrix.dimension());
  return ordering == Ordering::Amd ? amd_ordering(matrix) : metis_ordering(matrix);
}

FactorSize predict_factor_size(const SymmetricMatrix& matrix, std::span<const Index> new_index) {
  const Lists rows = collect(matrix.dimension(), [&](auto&& add) {
    matrix.for_each_below([&](Index i, Index j, Index) {
      const auto [early, late] = std::minmax(new_index[at(i)], new_index[at(j)]);
      add(late, early);
    });
  });
  Array<Index> parent;
  FactorSize size{.entries = matrix.dimension()};
  for (const double below : column_lengths(rows, parent)) {
    size.entries += static_cast<std::int64_t>(below);
    size.flops += below * (below + 2.0);  // one division, and below + 1 multiply-adds, per entry
  }
  return size;
}

double worthwhile_flops(const SymmetricMatrix& matrix) { return 200.0 * matrix.nonzeros(); }

OrderingChoice choose_ordering(const SymmetricMatrix& matrix, Ordering ordering) {
  const auto measured = [&](Ordering candidate) {
    OrderingChoice choice{candidate, fill_reducing_ordering(matrix, candidate), {}};
    choice.size = predict_factor_size(matrix, choice.new_index);
    return choice;
  };
  if (ordering != Ordering::Best) return measured(ordering);
  OrderingChoice amd = measured(Ordering::Amd);
  if (amd.size.flops < kWorthComparing * worthwhile_flops(matrix)) return amd;
  OrderingChoice metis = measured(Ordering::Metis);
  return metis.size.flops < amd.size.flops ? metis : amd;
}

}  // namespace ipminmax
