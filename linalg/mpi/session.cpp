#include "linalg/mpi/session.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace ipminmax::mpi {
namespace {

using Clock = std::chrono::steady_clock;

// Tags in MPI_COMM_WORLD, which may be the program's as well.
constexpr int kHelloTag = 31991;
constexpr int kWelcomeTag = 31992;
constexpr std::uint32_t kMagic = 0x49504d4d;

/// Workers are up when MPI_Init returns; programs that share starts read their model first.
constexpr double kWorkerPatience = 10.0;
constexpr double kProgramPatience = 120.0;

/// Seconds that a worker lives after SIGTERM at most, so that rank 0 can write its answer first.
constexpr unsigned kTimeAfterSigterm = 60;
/// The same for ranks that share starts, when a rank is dead.
constexpr double kTimeForFirst = 20.0;

/// How often a rank that waits looks whether the others are still there.
constexpr auto kLook = std::chrono::milliseconds(50);

std::string name_of_rank(int rank) { return "rank " + std::to_string(rank); }

constexpr const char* kUsage = "mpirun -n 1 program : -n 3 ipminmax-worker";

volatile std::sig_atomic_t terminated = 0;
void (*next_handler)(int) = SIG_DFL;  ///< the program's own

extern "C" void ipminmax_mpi_on_sigterm(int number) {
  terminated = 1;
  if (next_handler != SIG_DFL) next_handler(number);
}

/// Hears of SIGTERM before the program does; a second one ends it as usual.
///
/// All ranks do. mpirun sends SIGTERM, waits (a second, odls_base_sigkill_timeout) and sends
/// SIGKILL; but the wait ends as soon as one of the processes does, so that rank 0 could not even
/// write its answer if the others obeyed at once.
void watch_sigterm() {
  struct sigaction action = {};
  if (sigaction(SIGTERM, nullptr, &action) != 0 || action.sa_handler == SIG_IGN ||
      (static_cast<unsigned>(action.sa_flags) & SA_SIGINFO) != 0) {
    return;
  }
  next_handler = action.sa_handler;
  action = {};
  action.sa_handler = ipminmax_mpi_on_sigterm;
  action.sa_flags = static_cast<int>(SA_RESETHAND) | SA_RESTART;
  sigemptyset(&action.sa_mask);
  sigaction(SIGTERM, &action, nullptr);
}

/// Names the machine (since it was booted) and its table of processes: numbers of processes mean
/// the same where this is equal.
std::string table_of_processes() {
  std::string boot;
  std::ifstream("/proc/sys/kernel/random/boot_id") >> boot;
  struct stat status = {};
  if (boot.empty() || stat("/proc/self/ns/pid", &status) != 0) return {};
  return boot + ":" + std::to_string(status.st_ino);
}

/// A thread that makes MPI calls for another, which need not wait until they return.
class Caller {
 public:
  /// False: stop() was true before the task was done; the task goes on, unless never.
  bool run(const std::function<void()>& task, const std::function<bool()>& stop) {
    std::unique_lock lock(mutex_);
    if (!started_) {
      std::thread([this] { work(); }).detach();
      started_ = true;
    }
    task_ = task;
    busy_ = true;
    changed_.notify_all();
    while (!changed_.wait_for(lock, kLook, [&] { return !busy_; })) {
      if (stop()) return false;
    }
    return true;
  }

 private:
  [[noreturn]] void work() {
    std::unique_lock lock(mutex_);
    for (;;) {
      changed_.wait(lock, [&] { return busy_; });
      lock.unlock();
      task_();
      lock.lock();
      busy_ = false;
      changed_.notify_all();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::function<void()> task_;
  bool started_ = false, busy_ = false;
};

/// Never destroyed: its thread may be waiting for a dead rank when the program ends.
Caller& caller() {
  static auto* const process_wide = new Caller;
  return *process_wide;
}

}  // namespace

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

bool stop_requested() { return terminated != 0; }

struct Session::Hello {
  std::uint32_t magic = kMagic;
  std::int32_t interface_number = kInterface;
  std::int32_t role = 0;
  std::int32_t pid = 0;
  char version[32] = "";
  char host[64] = "";
  char processes[80] = "";

  Hello() {
    pid = static_cast<std::int32_t>(getpid());
    gethostname(host, sizeof host - 1);
    table_of_processes().copy(processes, sizeof processes - 1);
  }
  [[nodiscard]] Peer peer(const Hello& me) const {
    const bool near = processes[0] != '\0' && std::strcmp(processes, me.processes) == 0;
    return {near ? pid : 0, host};
  }
};

struct Session::Welcome {
  std::int32_t accepted = 0;
  char text[500] = "";
  Hello from;
};

Session& Session::of_process() {
  static auto* const process_wide = new Session;
  return *process_wide;
}

const char* Session::fail(std::string text) {
  error_ = std::move(text);
  return error_.c_str();
}

void Session::initialize() {
  int is_initialized = 0;
  MPI_Initialized(&is_initialized);
  // Also where the program has initialized MPI: its MPI_Finalize may be the stub in the sequential
  // MUMPS.
  std::atexit([] { Session::of_process().leave(); });
  if (is_initialized == 0) {
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &level_);
  } else {
    MPI_Query_thread(&level_);
    // MPI_Finalize begins with the deletion of the attributes of MPI_COMM_SELF.
    int key = MPI_KEYVAL_INVALID;
    MPI_Comm_create_keyval(MPI_COMM_NULL_COPY_FN, &Session::before_finalize, &key, nullptr);
    MPI_Comm_set_attr(MPI_COMM_SELF, key, this);
  }
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &size_);
  peers_.resize(at(size_));
  forgotten_.resize(at(size_));
}

int Session::before_finalize(MPI_Comm, int, void* session, void*) {
  static_cast<Session*>(session)->release();
  return MPI_SUCCESS;
}

const char* Session::join(Role role, const std::string& version) {
  if (!error_.empty()) return error_.c_str();
  int is_finalized = 0;
  MPI_Finalized(&is_finalized);
  if (is_finalized != 0 || left_) return fail("the program has finalized MPI");
  if (joined_) {
    if (size_ == 1 || role == role_) return nullptr;
    return role == Role::Solver
               ? "mumps_mpi needs workers, and all ranks run this program to share its starts"
               : "the other ranks are workers of mumps_mpi; to share starts, all ranks have to run "
                 "the program";
  }
  initialize();
  role_ = role;
  std::string error;
  if (size_ > 1) {
    if (rank_ == 0 || role == Role::Starts) watch_sigterm();
    if (rank_ == 0) {
      error = gather(role, version);
    } else {
      error = say_hello(role, version);
      if (error.empty() && role == Role::Starts) error = await_welcome(kProgramPatience);
    }
  }
  if (!error.empty()) return fail(error);
  MPI_Comm_dup(MPI_COMM_WORLD, &communicator_);
  joined_ = true;
  return nullptr;
}

std::string Session::join_as_worker(const std::string& version) {
  initialize();
  if (size_ == 1 || rank_ == 0) {
    return std::string("a worker cannot be the only rank or rank 0: ") + kUsage;
  }
  role_ = Role::Worker;
  watch_sigterm();
  next_handler = [](int) { alarm(kTimeAfterSigterm); };
  std::string error = say_hello(Role::Worker, version);
  if (error.empty()) error = await_welcome(0.0);
  if (!error.empty()) return error;
  MPI_Comm_dup(MPI_COMM_WORLD, &communicator_);
  joined_ = true;
  return {};
}

std::string Session::say_hello(Role role, const std::string& version) {
  Hello hello;
  hello.role = static_cast<std::int32_t>(role);
  version.copy(hello.version, sizeof hello.version - 1);
  MPI_Send(&hello, sizeof hello, MPI_BYTE, 0, kHelloTag, MPI_COMM_WORLD);
  if (role != Role::Solver) return {};
  return "linear_solver mumps_mpi works for rank 0 alone, and this is rank " +
         std::to_string(rank_) + " of " + std::to_string(size_) +
         "; start the others as workers: " + kUsage;
}

std::string Session::await_welcome(double seconds) {
  const auto begin = Clock::now();
  int waited = 0;
  int arrived = 0;
  for (;;) {
    MPI_Iprobe(0, kWelcomeTag, MPI_COMM_WORLD, &arrived, MPI_STATUS_IGNORE);
    if (arrived != 0) break;
    if (seconds > 0.0 && seconds_since(begin) > seconds) {
      return "rank 0 does not share starts";
    }
    pause(waited);
  }
  Welcome welcome;
  MPI_Recv(&welcome, sizeof welcome, MPI_BYTE, 0, kWelcomeTag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  peers_[0] = welcome.from.peer({});
  return welcome.accepted != 0 ? std::string() : std::string(welcome.text);
}

std::string Session::gather(Role role, const std::string& version) {
  const double patience = role == Role::Solver ? kWorkerPatience : kProgramPatience;
  const Role wanted = role == Role::Solver ? Role::Worker : Role::Starts;
  std::vector<int> waiting;  // ranks that expect a welcome
  Array<bool> heard(size_);
  heard[0] = true;
  std::string error;
  const auto begin = Clock::now();
  for (int waited = 0; std::ranges::find(heard, false) != heard.end();) {
    int arrived = 0;
    MPI_Status status;
    MPI_Iprobe(MPI_ANY_SOURCE, kHelloTag, MPI_COMM_WORLD, &arrived, &status);
    if (arrived == 0) {
      // A wrong one decides; the others are still waited for, that they may be told.
      const double limit = error.empty() ? patience : 1.0;
      if (seconds_since(begin) > limit) break;
      pause(waited);
      continue;
    }
    waited = 0;
    Hello hello;
    MPI_Recv(&hello, sizeof hello, MPI_BYTE, status.MPI_SOURCE, kHelloTag, MPI_COMM_WORLD,
             MPI_STATUS_IGNORE);
    const int rank = status.MPI_SOURCE;
    hello.host[sizeof hello.host - 1] = '\0';
    hello.processes[sizeof hello.processes - 1] = '\0';
    peers_[rank] = hello.peer({});
    heard[rank] = true;
    const auto is = static_cast<Role>(hello.role);
    if (is != Role::Solver) waiting.push_back(rank);
    if (is != wanted) {
      if (error.empty()) {
        error = wanted == Role::Worker
                    ? name_of_rank(rank) + " runs a program instead of ipminmax-worker: " + kUsage
                    : name_of_rank(rank) +
                          (is == Role::Worker ? " is a worker" : " wants mumps_mpi") +
                          "; to share starts, all ranks have to run the program";
      }
    } else if (hello.magic != kMagic || hello.interface_number != kInterface ||
               hello.version != version) {
      hello.version[sizeof hello.version - 1] = '\0';
      error = name_of_rank(rank) + " on " + hello.host + " is of version " + hello.version +
              ", rank 0 of version " + version;
    }
  }
  if (const auto silent = std::ranges::find(heard, false); error.empty() && silent != heard.end()) {
    const auto rank = static_cast<int>(silent - heard.begin());
    error = name_of_rank(rank) + " did not answer within " +
            std::to_string(static_cast<int>(patience)) + " s; " +
            (wanted == Role::Worker ? std::string("it has to be ipminmax-worker: ") + kUsage
                                    : std::string("all ranks have to share the starts"));
  }
  Welcome welcome;
  welcome.accepted = error.empty() ? 1 : 0;
  error.copy(welcome.text, sizeof welcome.text - 1);
  for (const int rank : waiting) {
    MPI_Send(&welcome, sizeof welcome, MPI_BYTE, rank, kWelcomeTag, MPI_COMM_WORLD);
  }
  return error;
}

bool Session::gone(int rank) const {
  const std::int32_t pid = peers_[rank].pid;
  return pid > 0 && kill(pid, 0) != 0 && errno == ESRCH;
}

void Session::forget(int rank) {
  forgotten_[rank] = true;
  abandoned_ = true;
}

/// Empty: they have not.
std::string Session::why_stopped() const {
  for (int rank = 0; rank < size_; ++rank) {
    if (rank == rank_ || !gone(rank)) continue;
    return name_of_rank(rank) + " on " + peers_[rank].host +
           " has died (killed, or out of memory?)";
  }
  if (!stop_requested()) return {};
  return "the launcher ends the program: it was interrupted, or another rank has died";
}

const char* Session::trouble() {
  if (!error_.empty()) return error_.c_str();
  if (left_) return fail("the program has finalized MPI");
  if (size_ == 1) return nullptr;
  if (std::string why = why_stopped(); !why.empty()) {
    abandoned_ = true;
    return fail(std::move(why));
  }
  if (level_ < MPI_THREAD_SERIALIZED) {
    int is_main = 0;
    MPI_Is_thread_main(&is_main);
    if (is_main == 0) {
      return "the program has initialized MPI for calls of its main thread only; with mumps_mpi in "
             "another thread it needs MPI_THREAD_SERIALIZED";
    }
  }
  return nullptr;
}

const char* Session::call(const std::function<void()>& task) {
  if (const char* error = trouble()) return error;
  if (size_ == 1) {
    task();
    return nullptr;
  }
  if (level_ < MPI_THREAD_SERIALIZED) {
    run_watched(task);
    return trouble();
  }
  return caller().run(task, [this] { return !why_stopped().empty(); }) ? nullptr : trouble();
}

/// In this thread, which cannot return before the task does, even if that is never: then another
/// one says why, until the launcher ends the process.
void Session::run_watched(const std::function<void()>& task) const {
  std::mutex mutex;
  std::condition_variable changed;
  bool done = false;
  const std::jthread watch([&] {
    std::unique_lock lock(mutex);
    while (!changed.wait_for(lock, kLook, [&] { return done; })) {
      const std::string why = why_stopped();
      if (why.empty()) continue;
      std::fprintf(stderr, "ipminmax: linear solver failed: %s\n", why.c_str());
      return;
    }
  });
  task();
  const std::lock_guard lock(mutex);
  done = true;
  changed.notify_all();
}

void Session::pause(int& waited) {
  constexpr int kSpins = 200;
  constexpr int kLongest = 1000;  // microseconds
  if (++waited > kSpins) {
    std::this_thread::sleep_for(std::chrono::microseconds(std::min(waited - kSpins, kLongest)));
  } else if (waited % 20 == 0) {
    std::this_thread::yield();
  }
}

void Session::release() {
  if (left_) return;
  if (joined_ && at_leave_ && !(abandoned_ && role_ == Role::Solver)) at_leave_();
  left_ = true;
}

void Session::leave() {
  const bool first_call = !left_;
  release();
  int is_initialized = 0, is_finalized = 0;
  MPI_Initialized(&is_initialized);
  MPI_Finalized(&is_finalized);
  if (is_initialized == 0 || is_finalized != 0) return;
  // A rank that shares starts and has the answer is not stopped.
  const bool stopped = stop_requested() && (rank_ == 0 || role_ == Role::Worker);
  if (!abandoned_ && !stopped) {
    MPI_Finalize();
  } else if (first_call && joined_ && rank_ > 0) {
    // The launcher takes the end of this process for a reason to kill rank 0.
    const auto begin = Clock::now();
    while (!gone(0) && seconds_since(begin) < kTimeForFirst) std::this_thread::sleep_for(kLook);
  }
}

}  // namespace ipminmax::mpi
