#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include <dmumps_c.h>

#include "linalg/mpi/session.hpp"

namespace ipminmax::mpi {

/// Values of JOB from the MUMPS users' guide.
enum Job : std::int32_t {
  kInitialize = -1,
  kTerminate = -2,
  kAnalyze = 1,
  kFactorize = 2,
  kSolve = 3
};

/// What rank 0 tells the ranks of an instance before each job.
struct Command {
  std::int32_t job = 0;  ///< 0: the program ends
  std::int32_t instance = 0;
  std::int32_t first = 0, count = 0;  ///< ranks
  // For an instance without rank 0, whose host is `first`:
  std::int32_t n = 0, nrhs = 0;
  std::int64_t nnz = 0;
  MUMPS_INT icntl[60] = {};
  DMUMPS_REAL cntl[15] = {};
};

/// What the host of an instance without rank 0 answers.
struct Reply {
  MUMPS_INT icntl[60];
  DMUMPS_REAL cntl[15];
  MUMPS_INT infog[80];
  DMUMPS_REAL rinfog[40];
};

/// Rank 0's side: the instances of the program.
class Instances {
 public:
  static Instances& of_process();

  int create(Part part, DMUMPS_STRUC_C& data);
  [[nodiscard]] const char* start(int instance, DMUMPS_STRUC_C& data);
  [[nodiscard]] const char* finish(int instance, DMUMPS_STRUC_C& data);

 private:
  struct Instance {
    int first = 0, count = 1;
    std::vector<MUMPS_INT> sym_perm;  ///< of a host elsewhere
  };
  void send_command(int id, const Instance& instance, const DMUMPS_STRUC_C& data);
  void send_arrays(int host, const DMUMPS_STRUC_C& data);
  void take_reply(Instance& instance, DMUMPS_STRUC_C& data);

  std::map<int, Instance> instances_;
  int next_ = 1;
};

/// A worker's side.
class WorkerInstances {
 public:
  /// Takes part in one job.
  void run(const Command& command);
  /// One line on the work done.
  void report() const;

 private:
  struct Instance {
    DMUMPS_STRUC_C data{};
    std::vector<MUMPS_INT> rows, columns, order;
    std::vector<double> values, rhs;
  };
  void host(Instance& instance, const Command& command);

  std::map<int, std::unique_ptr<Instance>> instances_;
  std::int64_t factorizations_ = 0;
  double seconds_ = 0.0;
};

}  // namespace ipminmax::mpi
