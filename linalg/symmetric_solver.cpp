#include <algorithm>
#include <new>
#include <stdexcept>

#include "linalg/auto_solver.hpp"
#include "linalg/lapack_solver.hpp"
#include "linalg/ldlt_solver.hpp"
#include "linalg/ma57_solver.hpp"
#include "linalg/ma97_solver.hpp"
#include "linalg/mumps_solver.hpp"
#include "linalg/pardiso_solver.hpp"
#include "linalg/spral_solver.hpp"
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

bool work_at_once(SymmetricSolver& first, double first_flops, SymmetricSolver& second,
                  double second_flops) {
  if (!second.move_to(RankPart::SecondHalf, first_flops)) return false;
  if (first.move_to(RankPart::FirstHalf, second_flops)) return true;
  if (!second.move_to(RankPart::All, 0.0)) throw std::bad_alloc();
  return false;
}

std::unique_ptr<SymmetricSolver> make_symmetric_solver(LinearSolver kind,
                                                       const SymmetricSolverOptions& options) {
  switch (kind) {
    case LinearSolver::Auto:
      return std::make_unique<AutoSolver>(options);
    case LinearSolver::Mumps:
      return std::make_unique<MumpsSolver>(options);
    case LinearSolver::MumpsMpi:
      return std::make_unique<MumpsSolver>(options, MumpsSolver::Processes::Ranks);
    case LinearSolver::Ldlt:
      return std::make_unique<LdltSolver>(options);
    case LinearSolver::Lapack:
      return std::make_unique<LapackSolver>();
    case LinearSolver::Ma57:
      return std::make_unique<Ma57Solver>(options);
    case LinearSolver::Ma97:
      return std::make_unique<Ma97Solver>(options);
    case LinearSolver::Spral:
      return std::make_unique<SpralSolver>(options);
    case LinearSolver::Pardiso:
    case LinearSolver::PardisoMkl:
      return std::make_unique<PardisoSolver>(options, kind);
  }
  throw std::invalid_argument("make_symmetric_solver: unknown solver");
}

}  // namespace ipminmax
