#include "linalg/mpi/remote_mumps.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <new>
#include <optional>

#include "linalg/reproducible_rand.hpp"

namespace ipminmax::mpi {
namespace {

constexpr int kOrderGiven = 1;        // ICNTL(7)
constexpr MUMPS_INT kNoMemory = -13;  // INFOG(1)

std::size_t as_size(std::int64_t i) { return static_cast<std::size_t>(i); }

void run_mumps(DMUMPS_STRUC_C& data) {
  std::optional<ReproducibleRand> rand;
  if (data.job == kAnalyze) rand.emplace();
  dmumps_c(&data);
}

template <class T>
void send(const T* values, std::int64_t count, int rank) {
  MPI_Send(values, static_cast<int>(count), sizeof(T) == sizeof(double) ? MPI_DOUBLE : MPI_INT,
           rank, kData, Session::of_process().communicator());
}

template <class T>
void receive(T* values, std::int64_t count, int rank) {
  static_assert(sizeof(T) == sizeof(double) || sizeof(T) == sizeof(int));
  MPI_Recv(values, static_cast<int>(count), sizeof(T) == sizeof(double) ? MPI_DOUBLE : MPI_INT,
           rank, kData, Session::of_process().communicator(), MPI_STATUS_IGNORE);
}

/// Room for an array that arrives; where there is none the message is taken and dropped.
template <class T>
bool receive(std::vector<T>& values, std::int64_t count, int rank) {
  bool ok = true;
  try {
    values.resize(as_size(count));
  } catch (const std::bad_alloc&) {
    ok = false;
  }
  if (ok) {
    receive(values.data(), count, rank);
  } else {  // MPI truncates what does not fit and reports an error, which is expected here
    MPI_Comm communicator = Session::of_process().communicator();
    MPI_Errhandler handler;
    MPI_Comm_get_errhandler(communicator, &handler);
    MPI_Comm_set_errhandler(communicator, MPI_ERRORS_RETURN);
    T unused{};
    receive(&unused, 1, rank);
    MPI_Comm_set_errhandler(communicator, handler);
    MPI_Errhandler_free(&handler);
  }
  return ok;
}

}  // namespace

// --- Rank 0 --------------------------------------------------------------------------------------

Instances& Instances::of_process() {
  static auto* const process_wide = new Instances;
  return *process_wide;
}

int Instances::create(Part part, DMUMPS_STRUC_C& data) {
  Session& session = Session::of_process();
  const int size = session.size();
  const int half = (size + 1) / 2;
  Instance instance{0, size, {}};
  if (part != Part::All && size > 1) {
    instance.first = part == Part::FirstHalf ? 0 : half;
    instance.count = part == Part::FirstHalf ? half : size - half;
  }
  data.job = 0;
  instances_.emplace(next_, std::move(instance));
  return next_++;
}

void Instances::send_command(int id, const Instance& instance, const DMUMPS_STRUC_C& data) {
  Command command;
  command.job = data.job;
  command.instance = id;
  command.first = instance.first;
  command.count = instance.count;
  command.n = data.n;
  command.nrhs = data.nrhs;
  command.nnz = data.nnz;
  std::copy(std::begin(data.icntl), std::end(data.icntl), command.icntl);
  std::copy(std::begin(data.cntl), std::end(data.cntl), command.cntl);
  for (int rank = instance.first; rank < instance.first + instance.count; ++rank) {
    if (rank == 0) continue;
    MPI_Send(&command, sizeof command, MPI_BYTE, rank, kCommand,
             Session::of_process().communicator());
  }
}

void Instances::send_arrays(int host, const DMUMPS_STRUC_C& data) {
  if (data.job == kAnalyze) {
    send(data.irn, data.nnz, host);
    send(data.jcn, data.nnz, host);
    if (data.icntl[6] == kOrderGiven) send(data.perm_in, data.n, host);
  } else if (data.job == kFactorize) {
    send(data.a, data.nnz, host);
  } else if (data.job == kSolve) {
    send(data.rhs, std::int64_t{data.n} * data.nrhs, host);
  }
}

const char* Instances::start(int id, DMUMPS_STRUC_C& data) {
  const Instance& instance = instances_.at(id);
  if (instance.first == 0) return Session::of_process().trouble();
  return Session::of_process().call([&] {
    send_command(id, instance, data);
    send_arrays(instance.first, data);
  });
}

const char* Instances::finish(int id, DMUMPS_STRUC_C& data) {
  Session& session = Session::of_process();
  Instance& instance = instances_.at(id);
  const bool ends = data.job == kTerminate;
  const char* error = session.call([&] {
    if (instance.first > 0) {
      take_reply(instance, data);
      return;
    }
    send_command(id, instance, data);
    if (data.job == kInitialize) {
      data.comm_fortran =
          static_cast<MUMPS_INT>(MPI_Comm_c2f(session.group(instance.first, instance.count)));
    }
    run_mumps(data);
  });
  if (ends) instances_.erase(id);
  return error;
}

void Instances::take_reply(Instance& instance, DMUMPS_STRUC_C& data) {
  MPI_Comm communicator = Session::of_process().communicator();
  int waited = 0;
  for (int arrived = 0; arrived == 0;) {
    MPI_Iprobe(instance.first, kReply, communicator, &arrived, MPI_STATUS_IGNORE);
    if (arrived == 0) Session::pause(waited);
  }
  Reply reply;
  MPI_Recv(&reply, sizeof reply, MPI_BYTE, instance.first, kReply, communicator, MPI_STATUS_IGNORE);
  if (data.job == kInitialize) {
    std::copy(std::begin(reply.icntl), std::end(reply.icntl), data.icntl);
    std::copy(std::begin(reply.cntl), std::end(reply.cntl), data.cntl);
  }
  std::copy(std::begin(reply.infog), std::end(reply.infog), data.infog);
  std::copy(std::begin(reply.rinfog), std::end(reply.rinfog), data.rinfog);
  if (data.infog[0] < 0) return;
  if (data.job == kAnalyze) {
    instance.sym_perm.resize(as_size(data.n));
    receive(instance.sym_perm.data(), data.n, instance.first);
    data.sym_perm = instance.sym_perm.data();
  } else if (data.job == kSolve) {
    receive(data.rhs, std::int64_t{data.n} * data.nrhs, instance.first);
  }
}

// --- Workers -------------------------------------------------------------------------------------

void WorkerInstances::run(const Command& command) {
  const auto begin = std::chrono::steady_clock::now();
  Session& session = Session::of_process();
  if (command.job == kInitialize) {
    auto instance = std::make_unique<Instance>();
    instance->data.sym = 2;
    instance->data.par = 1;
    instance->data.comm_fortran =
        static_cast<MUMPS_INT>(MPI_Comm_c2f(session.group(command.first, command.count)));
    instances_[command.instance] = std::move(instance);
  }
  Instance& instance = *instances_.at(command.instance);
  instance.data.job = command.job;
  if (session.rank() == command.first) {
    host(instance, command);
  } else {
    run_mumps(instance.data);
    if (command.job == kInitialize) std::fill_n(instance.data.icntl, 4, 0);  // no output
  }
  if (command.job == kTerminate) instances_.erase(command.instance);
  factorizations_ += command.job == kFactorize ? 1 : 0;
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
  seconds_ += spent.count();
}

void WorkerInstances::host(Instance& instance, const Command& command) {
  DMUMPS_STRUC_C& data = instance.data;
  bool ok = true;
  if (command.job == kAnalyze) {
    ok = receive(instance.rows, command.nnz, 0);
    ok = receive(instance.columns, command.nnz, 0) && ok;
    if (command.icntl[6] == kOrderGiven) ok = receive(instance.order, command.n, 0) && ok;
    data.n = ok ? command.n : 0;  // refused by MUMPS, on all ranks
    data.nnz = command.nnz;
    data.irn = instance.rows.data();
    data.jcn = instance.columns.data();
    data.perm_in = instance.order.data();
  } else if (command.job == kFactorize) {
    ok = receive(instance.values, command.nnz, 0);
    data.a = ok ? instance.values.data() : nullptr;
  } else if (command.job == kSolve) {
    ok = receive(instance.rhs, std::int64_t{command.n} * command.nrhs, 0);
    data.rhs = ok ? instance.rhs.data() : nullptr;
    data.nrhs = command.nrhs;
    data.lrhs = command.n;
  }
  if (command.job > 0) {
    std::copy(std::begin(command.icntl), std::end(command.icntl), data.icntl);
    std::copy(std::begin(command.cntl), std::end(command.cntl), data.cntl);
  }
  run_mumps(data);
  if (!ok) data.infog[0] = kNoMemory;

  Reply reply;
  std::copy(std::begin(data.icntl), std::end(data.icntl), reply.icntl);
  std::copy(std::begin(data.cntl), std::end(data.cntl), reply.cntl);
  std::copy(std::begin(data.infog), std::end(data.infog), reply.infog);
  std::copy(std::begin(data.rinfog), std::end(data.rinfog), reply.rinfog);
  MPI_Send(&reply, sizeof reply, MPI_BYTE, 0, kReply, Session::of_process().communicator());
  if (data.infog[0] < 0) return;
  if (command.job == kAnalyze) send(data.sym_perm, data.n, 0);
  if (command.job == kSolve) send(data.rhs, std::int64_t{command.n} * command.nrhs, 0);
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
