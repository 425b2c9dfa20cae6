#pragma once

#include <cstdint>
#include <map>
#include <memory>

#include <dmumps_c.h>

#include "linalg/mpi/session.hpp"

namespace ipminmax::mpi {

/// What rank 0 tells the ranks of an instance before each job.
struct Command {
  std::int32_t job = 0;  ///< 0: the program ends
  std::int32_t instance = 0;
};

/// Rank 0's side: the instances of the program.
class Instances {
 public:
  static Instances& of_process();

  int create(DMUMPS_STRUC_C& data);
  [[nodiscard]] const char* run(int instance, DMUMPS_STRUC_C& data);

 private:
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
  std::map<int, std::unique_ptr<DMUMPS_STRUC_C>> instances_;
  std::int64_t factorizations_ = 0;
  double seconds_ = 0.0;
};

}  // namespace ipminmax::mpi
