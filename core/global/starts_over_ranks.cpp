#include <algorithm>
#include <exception>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/global/starts.hpp"
#include "core/multistart.hpp"
#include "core/parallel/joined_thread.hpp"
#include "core/parallel/ranks.hpp"
#include "core/parallel/result_bytes.hpp"
#include "core/search/random_starts.hpp"

namespace ipminmax {
namespace {

/// Seconds of silence after which a rank on another machine counts as dead; beats come once a
/// second. On this one its process is looked at.
constexpr double kWorkerDeadAfter = 15.0;
constexpr const char* kStopped =
    "stopped by the launcher, because a rank has died or it was interrupted; best of the "
    "starts made so far";

/// What Kind::Final says in place of a start.
enum AnswerIs : Index { kResult = 0, kException = 1, kRankDead = 2 };
/// Seconds that the others get to end what they do when all is interrupted.
constexpr double kTimeToEnd = 3.0;

std::vector<char> text_bytes(const std::string& text) { return {text.begin(), text.end()}; }

}  // namespace

/// What rank 0 knows of the other ranks.
struct Starts::Others {
  struct Rank {
    Index ready = 0;         ///< threads that wait for a start
    std::set<Index> starts;  ///< being made
    bool dead = false, ended = false;
  };
  explicit Others(int size) : ranks(static_cast<std::size_t>(size)) { ranks[0].ended = true; }
  std::vector<Rank> ranks;
  bool stop_sent = false;
};

Answer Starts::run(Ranks& ranks) {
  is_first_rank_ = ranks.rank() == 0;
  return is_first_rank_ ? run_as_first(ranks) : run_as_other(ranks);
}

// --- Rank 0 --------------------------------------------------------------------------------------

/// This thread exchanges messages, others search.
Answer Starts::run_as_first(Ranks& ranks) {
  Answer answer;
  std::exception_ptr failure;
  std::atomic<bool> done = false;
  others_ended_ = ranks.size() == 1;
  Others others(ranks.size());
  {
    const JoinedThread search([&] {
      try {
        answer = run();
      } catch (...) {
        failure = std::current_exception();
      }
      done = true;
    });
    while (!done) {
      take_messages(ranks, others);
      hand_out(ranks, others);
      look_after(ranks, others);
      ranks.pause();
    }
  }
  send_answer(ranks, others, answer, failure);
  if (failure) std::rethrow_exception(failure);
  return answer;
}

/// Where the launcher ends all, the others wait for the end of this process: the end of theirs
/// would hasten it.
void Starts::send_answer(Ranks& ranks, const Others& others, const Answer& answer,
                         const std::exception_ptr& failure) {
  if (ranks.stop_requested()) return;
  const std::vector<char> bytes = failure ? text_bytes(what_of(failure)) : to_bytes(answer);
  Index is = failure ? kException : kResult;
  for (int rank = 1; rank < ranks.size(); ++rank) {
    if (!others.ranks[static_cast<std::size_t>(rank)].dead) continue;
    ranks.forget(rank);
    is |= kRankDead;
  }
  for (int rank = 1; rank < ranks.size(); ++rank) {
    ranks.send(rank, Ranks::Kind::Final, is, bytes);
  }
}

void Starts::take_messages(Ranks& ranks, Others& others) {
  while (auto message = ranks.receive()) {
    Others::Rank& rank = others.ranks[static_cast<std::size_t>(message->rank)];
    rank.dead = false;  // it was only slow
    switch (message->kind) {
      case Ranks::Kind::Ready:
        ++rank.ready;
        break;
      case Ranks::Kind::Result:
        ++rank.ready;
        rank.starts.erase(message->start);
        record(message->start, result_from(message->bytes));
        break;
      case Ranks::Kind::Failure:
        ++rank.ready;
        rank.starts.erase(message->start);
        note_exception(message->start, std::make_exception_ptr(std::runtime_error(std::string(
                                           message->bytes.begin(), message->bytes.end()))));
        break;
      case Ranks::Kind::Interrupted:
        budget_.stop(static_cast<Status>(message->start));
        break;
      case Ranks::Kind::Ended:
        rank.ended = true;
        rank.ready = 0;
        give_back(rank.starts);
        break;
      default:
        break;
    }
  }
}

/// Starts that a rank will not make.
void Starts::give_back(std::set<Index>& starts) {
  const std::lock_guard lock(mutex_);
  for (const Index start : starts) {
    if (!recorded_.contains(start)) queue_.put(start, start);
  }
  starts.clear();
}

void Starts::hand_out(Ranks& ranks, Others& others) {
  // Factorizations are counted where they are made: only here with a limit of them.
  if (budget_.factorizations_left()) return;
  for (int r = 1; r < ranks.size(); ++r) {
    Others::Rank& rank = others.ranks[static_cast<std::size_t>(r)];
    while (rank.ready > 0 && !rank.dead) {
      const auto start = queue_.take_if_any();
      if (!start) return;
      ranks.send(r, Ranks::Kind::Start, *start);
      rank.starts.insert(*start);
      --rank.ready;
    }
  }
}

/// Dead ranks, limits, and what the launcher wants.
void Starts::look_after(Ranks& ranks, Others& others) {
  ranks.beat();
  for (int r = 1; r < ranks.size(); ++r) {
    Others::Rank& rank = others.ranks[static_cast<std::size_t>(r)];
    if (rank.dead || !(ranks.gone(r) || ranks.silence(r) > kWorkerDeadAfter)) continue;
    rank.dead = true;
    give_back(rank.starts);
    budget_.say(0, "rank " + std::to_string(r) +
                       " does not answer any more; its starts are made by others");
  }
  if (ranks.stop_requested()) {
    const std::lock_guard lock(mutex_);
    interrupted_by_ = kStopped;
    budget_.stop(Status::UserStop);
    queue_.close();
    others_ended_ = true;
  }
  bool stop = false;
  {
    const std::lock_guard lock(mutex_);
    stop = exception_ != nullptr;
  }
  if (budget_.interrupted()) {
    stop = true;
    queue_.close();
  }
  if (stop && !std::exchange(others.stop_sent, true)) {
    for (int r = 1; r < ranks.size(); ++r) ranks.send(r, Ranks::Kind::Stop);
  }
  if (std::ranges::all_of(others.ranks, [](const auto& r) { return r.dead || r.ended; })) {
    others_ended_ = true;
  }
}

/// When all was interrupted, what the others have so far still counts.
void Starts::wait_for_others() {
  const Stopwatch waited;
  for (;;) {
    {
      const std::lock_guard lock(mutex_);
      if (static_cast<Index>(recorded_.size()) > last_) return;
    }
    if (others_ended_ || waited.wall() > kTimeToEnd) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

// --- Other ranks ---------------------------------------------------------------------------------

namespace {

/// Of another rank when the launcher ends all.
Answer stopped() {
  Answer answer;
  answer.interrupted = answer.best.status = Status::UserStop;
  answer.best.message = kStopped;
  return answer;
}

}  // namespace

/// Of rank 0. An answer: the last one, of all ranks.
std::optional<Answer> Starts::read_messages(Ranks& ranks, const std::function<void()>& stop) {
  while (auto message = ranks.receive()) {
    if (message->kind == Ranks::Kind::Start) {
      queue_.put(message->start, message->start);
    } else if (message->kind == Ranks::Kind::Stop) {
      stop();
    } else if (message->kind == Ranks::Kind::Final) {
      stop();
      if ((message->start & kRankDead) != 0) ranks.forget(0);  // it does not wait for us either
      if ((message->start & kException) != 0) {
        throw std::runtime_error(std::string(message->bytes.begin(), message->bytes.end()));
      }
      return multistart_result_from(message->bytes);
    }
  }
  return std::nullopt;
}

/// This thread exchanges messages, others search.
Answer Starts::run_as_other(Ranks& ranks) {
  prepare();
  read_model_start();
  std::atomic<std::size_t> running = 0;
  std::vector<JoinedThread> threads;
  for (Worker& worker : workers_) {
    ++running;
    threads.emplace_back([this, &worker, &running] {
      work(worker);
      --running;
    });
    ranks.send(0, Ranks::Kind::Ready);
  }
  const auto stop = [this] {
    budget_.end_after(-1);
    queue_.close();
  };
  bool end_told = false, failure_told = false, interruption_told = false;
  for (;;) {
    ranks.beat();
    std::vector<Ranks::Message> results;
    {
      const std::lock_guard lock(mutex_);
      results.swap(outbox_);
      if (exception_ && !std::exchange(failure_told, true)) {
        results.push_back({0, Ranks::Kind::Failure, thrown_by_, text_bytes(what_of(exception_))});
      }
    }
    if (const auto why = budget_.interrupted(); why && !std::exchange(interruption_told, true)) {
      queue_.close();
      results.push_back({0, Ranks::Kind::Interrupted, static_cast<Index>(*why), {}});
    }
    const bool ended = running == 0;  // before what it left is sent
    for (const Ranks::Message& result : results) {
      ranks.send(0, result.kind, result.start, result.bytes);
    }
    if (ended && results.empty() && !std::exchange(end_told, true)) {
      ranks.send(0, Ranks::Kind::Ended);
    }
    if (auto answer = read_messages(ranks, stop)) return std::move(*answer);
    if (ranks.stop_requested()) stop();
    if (ranks.gone(0) || ranks.silence(0) > Ranks::kDeadAfter) {
      stop();
      ranks.forget(0);
      if (ranks.stop_requested()) return stopped();
      throw std::runtime_error("rank 0 of the multistart does not answer any more");
    }
    ranks.pause();
  }
}

}  // namespace ipminmax
