// libipminmax_mpi.so: see interface.hpp.
#include <cstdio>
#include <cstring>
#include <deque>
#include <vector>

#include "linalg/mpi/interface.hpp"
#include "linalg/mpi/remote_mumps.hpp"
#include "linalg/mpi/session.hpp"

namespace ipminmax::mpi {
namespace {

Session& session() { return Session::of_process(); }

DMUMPS_STRUC_C& mumps(void* data) { return *static_cast<DMUMPS_STRUC_C*>(data); }

// --- Messages between programs --------------------------------------------------------------------

/// Messages on their way; they are whole numbers of doubles, so that MPI's counts suffice.
struct Sent {
  std::vector<double> data;
  MPI_Request request = MPI_REQUEST_NULL;
};

std::deque<Sent>& sent() {
  static auto* const process_wide = new std::deque<Sent>;
  return *process_wide;
}

MPI_Status polled;

void drop_delivered() {
  while (!sent().empty()) {
    int done = 0;
    MPI_Test(&sent().front().request, &done, MPI_STATUS_IGNORE);
    if (done == 0) return;
    sent().pop_front();
  }
}

void send(int rank, const char* bytes, std::size_t count) {
  Sent& message = sent().emplace_back();
  message.data.resize((count + sizeof(double) - 1) / sizeof(double));
  std::memcpy(message.data.data(), bytes, count);
  MPI_Isend(message.data.data(), static_cast<int>(message.data.size()), MPI_DOUBLE, rank, kMessage,
            session().communicator(), &message.request);
}

bool poll(int* rank, std::size_t* count) {
  drop_delivered();
  int arrived = 0;
  MPI_Iprobe(MPI_ANY_SOURCE, kMessage, session().communicator(), &arrived, &polled);
  if (arrived == 0) return false;
  int doubles = 0;
  MPI_Get_count(&polled, MPI_DOUBLE, &doubles);
  *rank = polled.MPI_SOURCE;
  *count = static_cast<std::size_t>(doubles) * sizeof(double);
  return true;
}

void receive(char* bytes) {
  int doubles = 0;
  MPI_Get_count(&polled, MPI_DOUBLE, &doubles);
  MPI_Recv(bytes, doubles, MPI_DOUBLE, polled.MPI_SOURCE, kMessage, session().communicator(),
           MPI_STATUS_IGNORE);
}

// --- The end --------------------------------------------------------------------------------------

void dismiss_workers() {
  const Command end;
  for (int rank = 1; rank < session().size(); ++rank) {
    MPI_Send(&end, sizeof end, MPI_BYTE, rank, kCommand, session().communicator());
  }
}

void deliver_messages() {
  for (int waited = 0; !sent().empty() && !stop_requested();) {
    drop_delivered();
    Session::pause(waited);
  }
}

const char* join(Role role, const char* version) {
  const char* error = session().join(role, version);
  if (error == nullptr) {
    session().at_leave(role == Role::Starts ? deliver_messages : dismiss_workers);
  }
  return error;
}

constexpr Plugin kPlugin{
    .interface_number = kInterface,
    .mumps_structure_size = sizeof(DMUMPS_STRUC_C),
    .join = join,
    .rank = [] { return session().rank(); },
    .size = [] { return session().size(); },
    .leave = [] { session().leave(); },
    .create = [](Part part,
                 void* data) { return Instances::of_process().create(part, mumps(data)); },
    .start = [](int id, void* data) { return Instances::of_process().start(id, mumps(data)); },
    .finish = [](int id, void* data) { return Instances::of_process().finish(id, mumps(data)); },
    .send = send,
    .poll = poll,
    .receive = receive,
    .stop_requested = stop_requested,
    .abandon = [] { session().abandon(); },
};

}  // namespace
}  // namespace ipminmax::mpi

extern "C" {

const ipminmax::mpi::Plugin* ipminmax_mpi_plugin() { return &ipminmax::mpi::kPlugin; }

int ipminmax_mpi_work(const char* version, bool verbose) {
  using namespace ipminmax::mpi;
  if (const std::string error = session().join_as_worker(version); !error.empty()) {
    std::fprintf(stderr, "ipminmax-worker: %s\n", error.c_str());
    if (session().rank() == 0) MPI_Abort(MPI_COMM_WORLD, 2);
    session().leave();
    return 1;
  }
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
  if (verbose) instances.report();
  session().leave();
  return 0;
}

}  // extern "C"
