#include "linalg/workers.hpp"

#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cfenv>
#include <csignal>
#include <deque>
#include <new>
#include <system_error>
#include <thread>

#include "linalg/library_lock.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

/// What the threads share with their caller. It stays where it is, in a child of fork for ever: its
/// threads cannot be joined there.
struct Workers::Team {
  struct Member {
    std::atomic<int> turn{0};  ///< counts the pieces; negative: the end
    std::thread thread{};
  };
  const pid_t process = getpid();
  std::deque<Member> members{};  ///< which do not move
  std::atomic<int> busy{0};
  // Of the present work.
  Call call = nullptr;
  const void* piece = nullptr;
  std::fenv_t environment{};

  void work(Member& member, int index);
  void add_member();
  void end();
};

void Workers::Team::work(Member& member, int index) {
  for (int last = 0;;) {
    member.turn.wait(last, std::memory_order_acquire);
    last = member.turn.load(std::memory_order_acquire);
    if (last < 0) return;
    std::fesetenv(&environment);
    call(piece, index);
    if (busy.fetch_sub(1, std::memory_order_acq_rel) == 1) busy.notify_one();
  }
}

/// Throws std::bad_alloc or std::system_error and has none more then.
void Workers::Team::add_member() {
  sigset_t blocked, before;
  sigfillset(&blocked);
  for (const int own : {SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGTRAP}) sigdelset(&blocked, own);
  Member& member = members.emplace_back();
  const int index = static_cast<int>(members.size());
  pthread_sigmask(SIG_SETMASK, &blocked, &before);
  try {
    member.thread = std::thread([this, &member, index] { work(member, index); });
  } catch (...) {
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    members.pop_back();
    throw;
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

void Workers::Team::end() {
  for (Member& member : members) {
    member.turn.store(-1, std::memory_order_release);
    member.turn.notify_one();
  }
  for (Member& member : members) member.thread.join();
}

Workers::Workers() = default;

Workers::~Workers() {
  if (!team_) return;
  if (team_->process == getpid()) {
    team_->end();
  } else {
    static_cast<void>(team_.release());
  }
}

/// How many there are, as many as are wanted if they can be made.
int Workers::have_threads(int wanted) {
  if (team_ && team_->process != getpid()) static_cast<void>(team_.release());
  try {
    if (!team_) team_ = std::make_unique<Team>();
    while (static_cast<int>(team_->members.size()) < wanted) team_->add_member();
  } catch (const std::bad_alloc&) {
  } catch (const std::system_error&) {
  }
  return team_ ? std::min(wanted, static_cast<int>(team_->members.size())) : 0;
}

void Workers::run(int count, Call run_piece, const void* piece) {
  if (count <= 0) return;
  const int threads = count > 1 && !LibraryLock::is_held() ? have_threads(count - 1) : 0;
  if (threads > 0) {
    team_->call = run_piece;
    team_->piece = piece;
    std::fegetenv(&team_->environment);
    team_->busy.store(threads, std::memory_order_relaxed);
    for (int k = 0; k < threads; ++k) {
      std::atomic<int>& turn = team_->members[at(k)].turn;
      // Not negative, however often.
      turn.store((turn.load(std::memory_order_relaxed) + 1) & 0x7fffffff,
                 std::memory_order_release);
      turn.notify_one();
    }
  }
  run_piece(piece, 0);
  for (int k = threads + 1; k < count; ++k) run_piece(piece, k);
  if (threads == 0) return;
  for (int busy = 1; (busy = team_->busy.load(std::memory_order_acquire)) > 0;) {
    team_->busy.wait(busy, std::memory_order_acquire);
  }
}

}  // namespace ipminmax
