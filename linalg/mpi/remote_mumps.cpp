#include "linalg/mpi/remote_mumps.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <optional>

#include "linalg/reproducible_rand.hpp"

namespace ipminmax::mpi {
namespace {

void run_mumps(DMUMPS_STRUC_C& data) {
  std::optional<ReproducibleRand> rand;
  if (data.job == kAnalyze) rand.emplace();
  dmumps_c(&data);
}

}  // namespace

// --- Rank 0 --------------------------------------------------------------------------------------

Instances& Instances::of_process() {
  static auto* const process_wide = new Instances;
  return *process_wide;
}

int Instances::create(DMUMPS_STRUC_C& data) {
  data.job = 0;
  return next_++;
}

const char* Instances::run(int id, DMUMPS_STRUC_C& data) {
  Session& session = Session::of_process();
  return session.call([&] {
    const Command command{data.job, id};
    for (int rank = 1; rank < session.size(); ++rank)
      MPI_Send(&command, sizeof command, MPI_BYTE, rank, kCommand, session.communicator());
    if (data.job == kInitialize)
      data.comm_fortran = static_cast<MUMPS_INT>(MPI_Comm_c2f(session.communicator()));
    run_mumps(data);
  });
}

// --- Workers -------------------------------------------------------------------------------------

void WorkerInstances::run(const Command& command) {
  const auto begin = std::chrono::steady_clock::now();
  if (command.job == kInitialize) {
    auto data = std::make_unique<DMUMPS_STRUC_C>();
    data->sym = 2;
    data->par = 1;
    data->comm_fortran = static_cast<MUMPS_INT>(MPI_Comm_c2f(Session::of_process().communicator()));
    instances_[command.instance] = std::move(data);
  }
  DMUMPS_STRUC_C& data = *instances_.at(command.instance);
  data.job = command.job;
  run_mumps(data);
  if (command.job == kInitialize) std::fill_n(data.icntl, 4, 0);  // no output
  if (command.job == kTerminate) instances_.erase(command.instance);
  factorizations_ += command.job == kFactorize ? 1 : 0;
  seconds_ += seconds_since(begin);
}

void WorkerInstances::report() const {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  std::fprintf(
      stderr, "ipminmax-worker rank %d: %lld factorizations, %.2f s in MUMPS, peak memory %ld MB\n",
      Session::of_process().rank(), static_cast<long long>(factorizations_), seconds_,
      usage.ru_maxrss / 1024);
}

}  // namespace ipminmax::mpi
