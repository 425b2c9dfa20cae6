#include <algorithm>

#include "linalg/numbers.hpp"
#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

namespace {

/// Right-hand sides solved together: enough for dense kernels, few enough for the memory.
constexpr Index kBlockColumns = 32;

}  // namespace

void SymmetricSolver::inverse_product(const SparseColumns& b, std::span<double> product) {
  const auto columns = at(b.columns());
  const auto n = at(b.dimension);
  const auto at_once = std::min<std::size_t>(columns, kBlockColumns);
  if (block_.size() != n * at_once) block_.resize(n * at_once);
  for (std::size_t first = 0; first < columns; first += at_once) {
    const std::size_t count = std::min(at_once, columns - first);
    const std::span<double> block(block_.data(), n * count);
    std::fill(block.begin(), block.end(), 0.0);
    for (std::size_t k = 0; k < count; ++k) {
      for (Index p = b.starts[first + k]; p < b.starts[first + k + 1]; ++p) {
        block[k * n + at(b.rows[at(p)])] += b.values[at(p)];
      }
    }
    solve_in_place(block, static_cast<Index>(count));
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t i = first + k; i < columns; ++i) {
        double sum = 0.0;
        for (Index p = b.starts[i]; p < b.starts[i + 1]; ++p) {
          sum += b.values[at(p)] * block[k * n + at(b.rows[at(p)])];
        }
        product[i + (first + k) * columns] = sum;
      }
    }
  }
}

}  // namespace ipminmax
