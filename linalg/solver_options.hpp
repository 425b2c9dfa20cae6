#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

#include "inertia.hpp"

namespace IPMINMAX_API ipminmax {

/// Direct solver for symmetric indefinite matrices. Auto chooses by the pattern: LAPACK for tiny
/// matrices, LDL' where the predicted fill is low, MUMPS otherwise. Those from Ma57 on come from
/// libraries of the user's that are loaded at run time: HSL, SPRAL, the Pardiso project's, MKL.
enum class LinearSolver : std::uint8_t {
  Auto,
  Mumps,
  Ldlt,
  Lapack,
  MumpsMpi,
  Ma57,
  Spral,
  Pardiso,
  PardisoMkl,
  Ma97
};

/// Fill-reducing ordering.
enum class Ordering : std::uint8_t { Best, Amd, Pord, Metis };

struct SymmetricSolverOptions {
  Ordering ordering = Ordering::Best;  ///< Best compares the orderings by predicted flops
  /// Signed regularization Gamma of the unpivoted factorization; up to 1e3 times that where entries
  /// between rows of opposite signs are large.
  double ldlt_gamma = 1e-8;
  double mumps_pivot_tolerance = 1e-6;
  double mumps_pivot_tolerance_max = 0.1;
  Index mumps_memory_percent =
      1000;                  ///< extra workspace, percent of the estimate (MUMPS ICNTL(14))
  double max_memory = 1e26;  ///< bytes of the process beyond which MUMPS is not started
  /// For one large factorization by LDL', at most; the results are those of one. Others than the
  /// caller's wait in the solver until its end.
  int threads = 1;
  friend bool operator==(const SymmetricSolverOptions&, const SymmetricSolverOptions&) = default;
};

/// File of the library of Ma57 or Ma97 (libhsl.so unless another is named), Spral (libspral.so),
/// Pardiso (libpardiso.so) or PardisoMkl (libmkl_rt.so), as dlopen takes it, for solves that begin
/// later; one of each for the whole process.
void use_solver_library(LinearSolver kind, const std::string& file);
/// Why the library of a solver cannot be used; empty: it can, or the solver needs none.
[[nodiscard]] std::string missing_solver_library(LinearSolver kind);

/// The linear solver cannot be used here, or not any more, whatever the matrix: a library is
/// missing, another process has died. Thrown by solvers that need more than this process.
class SolverUnavailable : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace ipminmax
