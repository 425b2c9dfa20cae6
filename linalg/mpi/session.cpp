#include "linalg/mpi/session.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <thread>
#include <utility>

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

struct Welcome {
  std::int32_t accepted;
  char text[500];
};

std::string name_of_rank(int rank) { return "rank " + std::to_string(rank); }

constexpr const char* kUsage = "mpirun -n 1 program : -n 3 ipminmax-worker";

volatile std::sig_atomic_t terminated = 0;
void (*next_handler)(int) = SIG_DFL;  ///< the program's own

extern "C" void ipminmax_mpi_on_sigterm(int number) {
  terminated = 1;
  if (next_handler != SIG_DFL) next_handler(number);
}

/// Hears of SIGTERM before the program does; a second one ends it as usual.
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

/// A thread that makes MPI calls for another, which need not wait until they return.
class Caller {
 public:
  /// False: stop was requested before the task was done; the task goes on, unless never.
  bool run(const std::function<void()>& task) {
    std::unique_lock lock(mutex_);
    if (!started_) {
      std::thread([this] { work(); }).detach();
      started_ = true;
    }
    task_ = task;
    busy_ = true;
    changed_.notify_all();
    while (!changed_.wait_for(lock, std::chrono::milliseconds(50), [&] { return !busy_; })) {
      if (stop_requested()) return false;
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

bool stop_requested() { return terminated != 0; }

struct Session::Hello {
  std::uint32_t magic = kMagic;
  std::int32_t interface_number = kInterface;
  std::int32_t role = 0;
  std::int32_t pid = 0;
  char version[32] = "";
  char host[64] = "";
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
  if (is_initialized == 0) {
    MPI_Init_thread(nullptr, nullptr, MPI_THREAD_SERIALIZED, &level_);
    initialized_ = true;
    std::atexit([] { Session::of_process().leave(); });
  } else {
    MPI_Query_thread(&level_);
    // MPI_Finalize begins with the deletion of the attributes of MPI_COMM_SELF.
    int key = MPI_KEYVAL_INVALID;
    MPI_Comm_create_keyval(MPI_COMM_NULL_COPY_FN, &Session::before_finalize, &key, nullptr);
    MPI_Comm_set_attr(MPI_COMM_SELF, key, this);
  }
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &size_);
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
    if (rank_ == 0) {
      watch_sigterm();
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
  hello.pid = static_cast<std::int32_t>(getpid());
  version.copy(hello.version, sizeof hello.version - 1);
  gethostname(hello.host, sizeof hello.host - 1);
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
    if (seconds > 0.0 && std::chrono::duration<double>(Clock::now() - begin).count() > seconds) {
      return "rank 0 does not share starts";
    }
    pause(waited);
  }
  Welcome welcome{};
  MPI_Recv(&welcome, sizeof welcome, MPI_BYTE, 0, kWelcomeTag, MPI_COMM_WORLD, MPI_STATUS_IGNORE);
  return welcome.accepted != 0 ? std::string() : std::string(welcome.text);
}

std::string Session::gather(Role role, const std::string& version) {
  const double patience = role == Role::Solver ? kWorkerPatience : kProgramPatience;
  const Role wanted = role == Role::Solver ? Role::Worker : Role::Starts;
  std::vector<int> waiting;  // ranks that expect a welcome
  std::vector<bool> heard(static_cast<std::size_t>(size_), false);
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
      if (std::chrono::duration<double>(Clock::now() - begin).count() > limit) break;
      pause(waited);
      continue;
    }
    waited = 0;
    Hello hello;
    MPI_Recv(&hello, sizeof hello, MPI_BYTE, status.MPI_SOURCE, kHelloTag, MPI_COMM_WORLD,
             MPI_STATUS_IGNORE);
    const int rank = status.MPI_SOURCE;
    heard[static_cast<std::size_t>(rank)] = true;
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
      hello.host[sizeof hello.host - 1] = '\0';
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
  Welcome welcome{error.empty() ? 1 : 0, ""};
  error.copy(welcome.text, sizeof welcome.text - 1);
  for (const int rank : waiting) {
    MPI_Send(&welcome, sizeof welcome, MPI_BYTE, rank, kWelcomeTag, MPI_COMM_WORLD);
  }
  return error;
}

MPI_Comm Session::group(int first, int count) {
  if (first == 0 && count == size_) return communicator_;
  for (const Group& known : groups_) {
    if (known.first == first && known.count == count) return known.communicator;
  }
  MPI_Group all, part;
  MPI_Comm_group(communicator_, &all);
  int range[1][3] = {{first, first + count - 1, 1}};
  MPI_Group_range_incl(all, 1, range, &part);
  Group made{first, count, MPI_COMM_NULL};
  MPI_Comm_create_group(communicator_, part, first, &made.communicator);
  MPI_Group_free(&part);
  MPI_Group_free(&all);
  groups_.push_back(made);
  return made.communicator;
}

const char* Session::trouble() {
  if (!error_.empty()) return error_.c_str();
  if (left_) return fail("the program has finalized MPI");
  if (size_ == 1) return nullptr;
  if (stop_requested()) {
    abandon();
    return fail("the launcher ends the program: another rank has died, or it was interrupted");
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
  if (size_ == 1 || level_ < MPI_THREAD_SERIALIZED) {
    task();
    return nullptr;
  }
  return caller().run(task) ? nullptr : trouble();
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
  if (joined_ && !abandoned_ && at_leave_) at_leave_();
  left_ = true;
}

void Session::leave() {
  release();
  int is_finalized = 0;
  MPI_Finalized(&is_finalized);
  if (initialized_ && !abandoned_ && is_finalized == 0) MPI_Finalize();
  initialized_ = false;
}

}  // namespace ipminmax::mpi
