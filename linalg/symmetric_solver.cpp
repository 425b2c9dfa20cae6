#include <algorithm>

#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

namespace {

/// Right-hand sides solved together: enough for dense kernels, few enough for the memory.
constexpr Index kBlockColumns = 32;

}  // namespace

void SymmetricSolver::inverse_product(const SparseColumns& b, std::span<double> product) {
  const auto columns = static_cast<std::size_t>(b.columns());
  const auto n = static_cast<std::size_t>(b.dimension);
  const auto at_once = std::min<std::size_t>(columns, kBlockColumns);
  if (block_.size() != n * at_once) block_.resize(n * at_once);
  for (std::size_t first = 0; first < columns; first += at_once) {
    const std::size_t count = std::min(at_once, columns - first);
    const std::span<double> block(block_.data(), n * count);
    std::fill(block.begin(), block.end(), 0.0);
    for (std::size_t k = 0; k < count; ++k) {
      for (Index p = b.starts[first + k]; p < b.starts[first + k + 1]; ++p) {
        const auto entry = static_cast<std::size_t>(p);
        block[k * n + static_cast<std::size_t>(b.rows[entry])] += b.values[entry];
      }
    }
    solve_in_place(block, static_cast<Index>(count));
    for (std::size_t k = 0; k < count; ++k) {
      for (std::size_t i = first + k; i < columns; ++i) {
        double sum = 0.0;
        for (Index p = b.starts[i]; p < b.starts[i + 1]; ++p) {
          const auto entry = static_cast<std::size_t>(p);
          sum += b.values[entry] * block[k * n + static_cast<std::size_t>(b.rows[entry])];
        }
        product[i + (first + k) * columns] = sum;
      }
    }
  }
}

}  // namespace ipminmax
