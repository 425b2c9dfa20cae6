#include <ipminmax/linalg/symmetric_solver.hpp>

#include <stdexcept>

#include <ipminmax/linalg/auto_solver.hpp>
#include <ipminmax/linalg/lapack_solver.hpp>
#include <ipminmax/linalg/ldlt_solver.hpp>
#include <ipminmax/linalg/mumps_solver.hpp>

namespace ipminmax {

std::unique_ptr<SymmetricSolver> make_symmetric_solver(LinearSolver kind,
                                                       const SymmetricSolverOptions& options) {
  switch (kind) {
    case LinearSolver::Auto:
      return std::make_unique<AutoSolver>(options);
    case LinearSolver::Mumps:
      return std::make_unique<MumpsSolver>(options);
    case LinearSolver::Ldlt:
      return std::make_unique<LdltSolver>(options);
    case LinearSolver::Lapack:
      return std::make_unique<LapackSolver>();
  }
  throw std::invalid_argument("make_symmetric_solver: unknown solver");
}

}  // namespace ipminmax
