#pragma once

#include "linalg/mpi/interface.hpp"
#include "linalg/symmetric_solver.hpp"
#include "linalg/uncopied.hpp"

namespace ipminmax {

/// The loaded plugin libipminmax_mpi.so (linalg/mpi/interface.hpp). Looked for, in this order: the
/// file that the environment variable IPMINMAX_MPI_LIBRARY names, and no other where it is set;
/// beside this library or program; in ../lib from there; where the loader looks. Throws
/// SolverUnavailable with the reason when it cannot be used.
[[nodiscard]] const mpi::Plugin& mpi_plugin();

/// The version that program, plugin and workers must have in common.
[[nodiscard]] const char* library_version();

/// One MUMPS instance on MPI ranks, from JOB = -1 to JOB = -2, which is the owner's. Each call may
/// throw SolverUnavailable. To be used under a LibraryLock.
class MpiMumps : Uncopied {
 public:
  /// data: a DMUMPS_STRUC_C with sym and par set, which stays where it is; initialized on return.
  MpiMumps(void* data, int initialize);

  /// The job that data names, on all ranks.
  void run();

 private:
  const mpi::Plugin& plugin_;
  void* data_;
  int instance_;
};

}  // namespace ipminmax
