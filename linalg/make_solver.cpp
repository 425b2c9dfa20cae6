#include "linalg/make_solver.hpp"

#include <stdexcept>

#include "linalg/auto_solver.hpp"
#include "linalg/lapack_solver.hpp"
#include "linalg/ldlt_solver.hpp"
#include "linalg/loaded_solver.hpp"
#include "linalg/mumps_solver.hpp"

namespace ipminmax {

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
      return make_ma57(options);
    case LinearSolver::Ma97:
      return make_ma97(options);
    case LinearSolver::Spral:
      return make_spral(options);
    case LinearSolver::Pardiso:
    case LinearSolver::PardisoMkl:
      return make_pardiso(options, kind);
  }
  throw std::invalid_argument("make_symmetric_solver: unknown solver");
}

}  // namespace ipminmax
