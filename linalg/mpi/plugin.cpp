// libipminmax_mpi.so: see interface.hpp.
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <list>
#include <memory>
#include <thread>
#include <vector>

#include "linalg/mpi/interface.hpp"
#include "linalg/mpi/remote_mumps.hpp"
#include "linalg/mpi/session.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax::mpi {
namespace {

Session& session() { return Session::of_process(); }

DMUMPS_STRUC_C& mumps(void* data) { return *static_cast<DMUMPS_STRUC_C*>(data); }

// --- Messages between programs -------------------------------------------------------------------

using Clock = std::chrono::steady_clock;

/// Seconds that the ranks still alive get to take the last messages when another is dead.
constexpr double kLongestDelivery = 10.0;

/// Messages on their way; they are whole numbers of doubles, so that MPI's counts suffice.
struct Sent {
  int rank = 0;
  std::vector<double> data;
  MPI_Request request = MPI_REQUEST_NULL;
};

/// Never destroyed: a dead rank's messages stay for ever.
std::list<Sent>& sent() {
  static auto* const process_wide = new std::list<Sent>;
  return *process_wide;
}

MPI_Status polled;

/// Whether messages to living ranks are left.
bool drop_delivered() {
  bool left = false;
  for (auto message = sent().begin(); message != sent().end();) {
    int done = 0;
    if (!session().is_forgotten(message->rank)) {
      MPI_Test(&message->request, &done, MPI_STATUS_IGNORE);
      left = left || done == 0;
    }
    message = done != 0 ? sent().erase(message) : std::next(message);
  }
  return left;
}

void send(int rank, const char* bytes, std::size_t count) {
  if (session().is_forgotten(rank)) return;
  Sent& message = sent().emplace_back();
  message.rank = rank;
  message.data.resize((count + sizeof(double) - 1) / sizeof(double));
  std::memcpy(message.data.data(), bytes, count);
  MPI_Isend(message.data.data(), static_cast<int>(message.data.size()), MPI_DOUBLE, rank, kMessage,
            session().communicator(), &message.request);
}

bool poll(int* rank, std::size_t* count) {
  static_cast<void>(drop_delivered());
  int arrived = 0;
  MPI_Iprobe(MPI_ANY_SOURCE, kMessage, session().communicator(), &arrived, &polled);
  if (arrived == 0) return false;
  int doubles = 0;
  MPI_Get_count(&polled, MPI_DOUBLE, &doubles);
  *rank = polled.MPI_SOURCE;
  *count = at(doubles) * sizeof(double);
  return true;
}

/// A large message comes in pieces, of which a dead sender owes the rest.
bool receive(char* bytes) {
  int doubles = 0;
  MPI_Get_count(&polled, MPI_DOUBLE, &doubles);
  auto buffer = std::make_unique<std::vector<double>>(at(doubles));
  MPI_Request request = MPI_REQUEST_NULL;
  MPI_Irecv(buffer->data(), doubles, MPI_DOUBLE, polled.MPI_SOURCE, kMessage,
            session().communicator(), &request);
  const auto begin = Clock::now();
  int waited = 0;
  for (;;) {
    int done = 0;
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    if (done != 0) break;
    Session::pause(waited);
    const bool may_be_dead = session().gone(polled.MPI_SOURCE) || stop_requested();
    if (may_be_dead && seconds_since(begin) > kLongestDelivery / 10.0) {
      static_cast<void>(buffer.release());  // MPI may still write to it
      return false;
    }
  }
  std::memcpy(bytes, buffer->data(), buffer->size() * sizeof(double));
  return true;
}

// --- The end -------------------------------------------------------------------------------------

void dismiss_workers() {
  const Command end;
  for (int rank = 1; rank < session().size(); ++rank) {
    MPI_Send(&end, sizeof end, MPI_BYTE, rank, kCommand, session().communicator());
  }
}

void deliver_messages() {
  const auto begin = Clock::now();
  for (int waited = 0; drop_delivered() && !stop_requested();) {
    Session::pause(waited);
    for (int rank = 0; rank < session().size(); ++rank) {
      if (session().gone(rank)) session().forget(rank);
    }
    if (session().is_abandoned() && seconds_since(begin) > kLongestDelivery) return;
  }
}

const char* join(Role role, const char* version) {
  const char* error = session().join(role, version);
  if (error == nullptr) {
    session().at_leave(role == Role::Starts ? deliver_messages : dismiss_workers);
  }
  return error;
}

/// A worker in the middle of a factorization would wait for ever for a program that is dead, where
/// the launcher lets it live.
void end_with_rank_0(const std::atomic<bool>& dismissed) {
  for (;;) {
    const bool gone = session().gone(0);
    if (dismissed) return;
    if (gone) {
      std::fputs("ipminmax-worker: rank 0 has ended\n", stderr);
      _exit(1);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }
}

constexpr Plugin kPlugin{
    .interface_number = kInterface,
    .mumps_structure_size = sizeof(DMUMPS_STRUC_C),
    .join = join,
    .rank = [] { return session().rank(); },
    .size = [] { return session().size(); },
    .leave = [] { session().leave(); },
    .create = [](void* data) { return Instances::of_process().create(mumps(data)); },
    .run = [](int id, void* data) { return Instances::of_process().run(id, mumps(data)); },
    .send = send,
    .poll = poll,
    .receive = receive,
    .stop_requested = stop_requested,
    .gone = [](int rank) { return session().gone(rank); },
    .forget = [](int rank) { session().forget(rank); },
};

}  // namespace
}  // namespace ipminmax::mpi

extern "C" {

const ipminmax::mpi::Plugin* ipminmax_mpi_plugin() { return &ipminmax::mpi::kPlugin; }

int ipminmax_mpi_work(const char* version, bool verbose) {
  using namespace ipminmax::mpi;
  if (const std::string error = session().join_as_worker(version); !error.empty()) {
    std::fprintf(stderr, "ipminmax-worker: %s\n", error.c_str());
    if (session().rank() == 0 && session().size() > 1) MPI_Abort(MPI_COMM_WORLD, 1);
    session().leave();
    return 1;
  }
  static std::atomic<bool> dismissed = false;
  std::thread([] { end_with_rank_0(dismissed); }).detach();
  WorkerInstances instances;
  for (;;) {
    int waited = 0;
    for (int arrived = 0; arrived == 0;) {
      MPI_Iprobe(0, kCommand, session().communicator(), &arrived, MPI_STATUS_IGNORE);
      if (arrived == 0) Session::pause(waited);
    }
    Command command;
    MPI_Recv(&command, sizeof command, MPI_BYTE, 0, kCommand, session().communicator(),
             MPI_STATUS_IGNORE);
    if (command.job == 0) break;
    instances.run(command);
  }
  dismissed = true;
  if (verbose) instances.report();
  session().leave();
  return 0;
}

}  // extern "C"
