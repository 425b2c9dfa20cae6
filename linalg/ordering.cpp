#include <metis.h>

#include <Eigen/OrderingMethods>
#include <Eigen/SparseCore>
#include <algorithm>
#include <limits>
#include <new>
#include <numeric>
#include <stdexcept>
#include <type_traits>

#include "linalg/library_lock.hpp"
#include "linalg/numbers.hpp"
#include "linalg/ordering.hpp"
#include "linalg/reproducible_rand.hpp"
#include "linalg/tree_parts.hpp"

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

/// Those of every row that are eliminated after it, or before it.
Lists neighbours(const SymmetricMatrix& matrix, std::span<const Index> new_index, bool later) {
  return collect(matrix.dimension(), [&](auto&& add) {
    matrix.for_each_below([&](Index i, Index j, Index) {
      const auto [early, late] = std::minmax(new_index[at(i)], new_index[at(j)]);
      if (later) {
        add(early, late);
      } else {
        add(late, early);
      }
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

/// parent[j] of every node in the elimination tree, -1 at roots (Liu, with path compression).
/// before[k]: the neighbours of k that are eliminated before it.
Array<Index> parents(const Lists& before, Index n) {
  Array<Index> parent(n, -1);
  Array<Index> ancestor(n, -1);
  for (Index k = 0; k < n; ++k) {
    for (Index i : before[k]) {
      while (i != -1 && i < k) {
        const Index next = ancestor[i];
        ancestor[i] = k;
        if (next == -1) parent[i] = k;
        i = next;
      }
    }
  }
  return parent;
}

/// Entries of every column of L, diagonal included, without forming L: each entry of A adds one to
/// the column where its row subtree starts and takes one away where two of its branches meet
/// (Gilbert, Ng and Peyton 1994). after[j]: the neighbours of j eliminated after it.
Array<Index> column_counts(const Lists& after, const Array<Index>& parent) {
  const std::size_t n = parent.size();
  const Array<Index> post = postorder(parent);
  Array<Index> first(n, -1);  // postorder number of the first descendant
  Array<Index> count(n, 0);
  for (std::size_t k = 0; k < n; ++k) {
    Index j = post[k];
    count[j] = first[j] == -1 ? 1 : 0;  // a leaf of the tree
    for (; j != -1 && first[j] == -1; j = parent[j]) {
      first[j] = static_cast<Index>(k);
    }
  }

  Array<Index> max_first(n, -1);      // of row i: largest first[] of its leaves so far
  Array<Index> previous_leaf(n, -1);  // of row i
  Array<Index> ancestor(n);           // disjoint sets: root of the part already visited
  std::iota(ancestor.begin(), ancestor.end(), 0);
  for (const Index j : post) {
    const Index up = parent[j];
    if (up != -1) --count[up];
    for (const Index i : after[j]) {
      if (first[j] <= max_first[i]) continue;  // j is no leaf of row subtree i
      max_first[i] = first[j];
      ++count[j];
      const Index leaf = previous_leaf[i];
      previous_leaf[i] = j;
      if (leaf == -1) continue;
      Index meet = leaf;
      while (meet != ancestor[meet]) meet = ancestor[meet];
      for (Index s = leaf; s != meet;) {
        const Index next = ancestor[s];
        ancestor[s] = meet;
        s = next;
      }
      --count[meet];
    }
    if (up != -1) ancestor[j] = up;
  }
  for (std::size_t j = 0; j < n; ++j) {  // parent[j] > j
    if (parent[j] != -1) count[parent[j]] += count[j];
  }
  return count;
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
  const Array<Index> parent =
      parents(neighbours(matrix, new_index, /*later=*/false), matrix.dimension());
  FactorSize size;
  for (const Index entries : column_counts(neighbours(matrix, new_index, /*later=*/true), parent)) {
    const double below = entries - 1;
    size.entries += entries;
    size.flops += below * (below + 2.0);  // one division, and below + 1 multiply-adds, per entry
  }
  return size;
}

namespace {

/// In place of an order another one that fills in no more, if its factorization divides in two and
/// takes long enough: whatever the number of threads, which must not change results.
OrderingChoice divided(const SymmetricMatrix& matrix, OrderingChoice choice) {
  constexpr double kMostPerEntry = 150;  // beyond, MUMPS factorizes
  const auto entries = static_cast<double>(choice.size.entries);
  if (choice.size.flops > kMostPerEntry * entries ||
      choice.size.entries > std::numeric_limits<Index>::max() ||
      !is_worth_threads(matrix.dimension(), entries - matrix.dimension(), choice.size.flops)) {
    return choice;
  }
  const Array<Index> place =
      order_for_two_parts(neighbours(matrix, choice.new_index, /*later=*/false));
  if (place.empty()) return choice;
  for (Index& k : choice.new_index) k = place[k];
  choice.size = predict_factor_size(matrix, choice.new_index);
  return choice;
}

}  // namespace

double worthwhile_flops(const SymmetricMatrix& matrix) { return 200.0 * matrix.nonzeros(); }

OrderingChoice choose_ordering(const SymmetricMatrix& matrix, Ordering ordering) {
  const auto measured = [&](Ordering candidate) {
    OrderingChoice choice{candidate, fill_reducing_ordering(matrix, candidate), {}};
    choice.size = predict_factor_size(matrix, choice.new_index);
    return choice;
  };
  if (ordering != Ordering::Best) return divided(matrix, measured(ordering));
  OrderingChoice amd = measured(Ordering::Amd);
  if (amd.size.flops < kWorthComparing * worthwhile_flops(matrix))
    return divided(matrix, std::move(amd));
  OrderingChoice metis = measured(Ordering::Metis);
  return divided(matrix, std::move(metis.size.flops < amd.size.flops ? metis : amd));
}

}  // namespace ipminmax
