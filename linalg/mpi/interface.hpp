#pragma once

#include <cstddef>
#include <cstdint>

/// What libipminmax_mpi.so offers to the library: MUMPS on several MPI ranks, and messages between
/// them. The plugin is linked with the parallel MUMPS and the real MPI and is loaded so that its
/// symbols do not meet those of the sequential MUMPS (mpi_library.hpp). Plain functions and plain
/// data only: nothing of C++ crosses.
namespace ipminmax::mpi {

/// Number of this interface and of the messages between program and workers.
inline constexpr int kInterface = 3;

/// Values of JOB from the MUMPS users' guide.
enum Job : std::int32_t {
  kInitialize = -1,
  kTerminate = -2,
  kAnalyze = 1,
  kFactorize = 2,
  kSolve = 3
};

/// What a process wants from the others of MPI_COMM_WORLD.
enum class Role : std::int32_t {
  Worker,  ///< works for rank 0
  Solver,  ///< has MUMPS run on all ranks; rank 0 only, the others are workers
  Starts   ///< shares the starts of a multistart; all ranks
};

/// Functions that return text return null when they succeeded, else what went wrong; it stays
/// valid. All but request_stop are to be called by one thread at a time.
struct Plugin {
  int interface_number;
  std::size_t mumps_structure_size;  ///< of DMUMPS_STRUC_C

  /// Initializes MPI unless the program has, and finds the other ranks. Any number of times.
  const char* (*join)(Role role, const char* version);
  int (*rank)();
  int (*size)();
  /// Ranks that run programs after a join for Starts, workers after one for Solver. Ends what join
  /// began; called at the end of the program where that did not.
  void (*leave)();

  /// A MUMPS instance; data is its DMUMPS_STRUC_C, whose communicator is set. JOB = -1 follows.
  int (*create)(void* data);
  /// Runs data->job on all ranks.
  const char* (*run)(int instance, void* data);

  /// Messages between the ranks that joined for Starts, in order for each pair of ranks.
  void (*send)(int rank, const char* bytes, std::size_t count);
  /// Size of the next message and its sender; false: none has arrived.
  bool (*poll)(int* rank, std::size_t* count);
  /// The polled message. False: its sender has ended on the way.
  bool (*receive)(char* bytes);

  /// Whether the launcher wants the program to end (SIGTERM: mpirun was interrupted, or another
  /// rank has died).
  bool (*stop_requested)();
  /// Whether that rank's process has ended, as far as can be seen from this machine.
  bool (*gone)(int rank);
  /// That rank is dead: nothing is sent to it, and leave() waits for nobody.
  void (*forget)(int rank);
};

}  // namespace ipminmax::mpi

extern "C" {
/// The plugin's only symbols.
[[gnu::visibility("default")]] const ipminmax::mpi::Plugin* ipminmax_mpi_plugin();
/// The worker: serves rank 0 until the program ends. Returns the process's exit code.
[[gnu::visibility("default")]] int ipminmax_mpi_work(const char* version, bool verbose);
}
