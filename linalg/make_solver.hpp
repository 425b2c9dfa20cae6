#pragma once

#include <memory>

#include "linalg/solver_options.hpp"
#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

/// A solver of the given kind. MumpsMpi throws SolverUnavailable from the first analyze on where it
/// cannot be used. Auto chooses at analyze: LAPACK for tiny and dense matrices, LDL' where the
/// predicted fill is low, MUMPS otherwise; its increase_quality moves from LDL' to a pivoting
/// solver.
[[nodiscard]] std::unique_ptr<SymmetricSolver> make_symmetric_solver(
    LinearSolver kind, const SymmetricSolverOptions& options);

}  // namespace ipminmax
