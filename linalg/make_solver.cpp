#include "linalg/make_solver.hpp"

#include <stdexcept>

#include "linalg/auto_solver.hpp"
#include "linalg/lapack_solver.hpp"
#include "linalg/ldlt_solver.hpp"
#include "linalg/ma57_solver.hpp"
#include "linalg/ma97_solver.hpp"
#include "linalg/mumps_solver.hpp"
#include "linalg/pardiso_solver.hpp"
#include "linalg/spral_solver.hpp"

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
