#include <algorithm>
#include <exception>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/global/starts.hpp"
#include "core/parallel/joined_thread.hpp"
#include "core/parallel/ranks.hpp"
#include "linalg/numbers.hpp"

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
std::vector<char> text_bytes(const std::string& text) { return {text.begin(), text.end()}; }

}  // namespace

/// This thread exchanges messages, others search.
class Starts::OnRanks {
 public:
  OnRanks(Starts& starts, Ranks& ranks) : all_(starts), ranks_(ranks), others_(at(ranks.size())) {}
  // Rank 0.
  Answer run_as_first() {
    Answer answer;
    others_[0].ended = true;
    all_.others_ended_ = ranks_.size() == 1;
    const std::exception_ptr failure = run_beside([&] { answer = all_.run(); },
                                                  [&] {
                                                    take_messages();
                                                    hand_out();
                                                    look_after();
                                                    ranks_.pause();
                                                  });
    send_answer(answer, failure);
    if (failure) std::rethrow_exception(failure);
    return answer;
  }

  // Another one.
  Answer run_as_other() {
    all_.prepare();
    all_.read_model_start();
    std::atomic<std::size_t> running = 0;
    std::vector<JoinedThread> threads;
    for (Worker& worker : all_.workers_) {
      ++running;
      threads.emplace_back([this, &worker, &running] {
        all_.work(worker);
        --running;
      });
      ranks_.send(0, Kind::Ready);
    }
    bool end_told = false, failure_told = false, interruption_told = false;
    for (;;) {
      ranks_.beat();
      std::vector<Ranks::Message> results;
      {
        const std::lock_guard lock(all_.mutex_);
        results.swap(all_.outbox_);
        if (all_.exception_ && !std::exchange(failure_told, true)) {
          results.push_back(
              {0, Kind::Failure, all_.thrown_by_, text_bytes(what_of(all_.exception_))});
        }
      }
      if (const auto why = all_.budget_.interrupted();
          why && !std::exchange(interruption_told, true)) {
        all_.queue_.close();
        results.push_back({0, Kind::Interrupted, static_cast<Index>(*why), {}});
      }
      const bool ended = running == 0;  // before what it left is sent
      for (const Ranks::Message& result : results)
        ranks_.send(0, result.kind, result.start, result.bytes);
      if (ended && results.empty() && !std::exchange(end_told, true)) ranks_.send(0, Kind::Ended);
      if (auto answer = read_messages()) return std::move(*answer);
      if (ranks_.stop_requested()) stop();
      if (ranks_.is_lost(0)) {
        stop();
        ranks_.forget(0);
        if (!ranks_.stop_requested())
          throw std::runtime_error("rank 0 of the multistart does not answer any more");
        Answer stopped;
        stopped.interrupted = stopped.best.status = Status::UserStop;
        stopped.best.message = kStopped;
        return stopped;
      }
      ranks_.pause();
    }
  }

 private:
  using Kind = Ranks::Kind;

  /// What rank 0 knows of another one.
  struct Other {
    Index ready = 0;         ///< threads that wait for a start
    std::set<Index> starts;  ///< being made
    bool dead = false, ended = false;
  };
  void take_messages() {
    while (auto message = ranks_.receive()) {
      Other& rank = others_[at(message->rank)];
      rank.dead = false;  // it was only slow
      switch (message->kind) {
        case Kind::Ready:
          ++rank.ready;
          break;
        case Kind::Result:
          ++rank.ready;
          rank.starts.erase(message->start);
          all_.record(message->start, result_from(message->bytes));
          break;
        case Kind::Failure:
          ++rank.ready;
          rank.starts.erase(message->start);
          all_.note_exception(message->start,
                              std::make_exception_ptr(std::runtime_error(message->text())));
          break;
        case Kind::Interrupted:
          all_.budget_.stop(static_cast<Status>(message->start));
          break;
        case Kind::Ended:
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
  void give_back(std::set<Index>& starts) {
    const std::lock_guard lock(all_.mutex_);
    for (const Index start : starts) {
      if (!all_.recorded_.contains(start)) all_.queue_.put(start);
    }
    starts.clear();
  }

  void hand_out() {
    // Factorizations are counted where they are made: only here with a limit of them.
    if (all_.budget_.factorizations_left()) return;
    for (int r = 1; r < ranks_.size(); ++r) {
      Other& rank = others_[at(r)];
      while (rank.ready > 0 && !rank.dead) {
        const auto start = all_.queue_.take_if_any();
        if (!start) return;
        ranks_.send(r, Kind::Start, *start);
        rank.starts.insert(*start);
        --rank.ready;
      }
    }
  }

  /// Dead ranks, limits, and what the launcher wants.
  void look_after() {
    ranks_.beat();
    for (int r = 1; r < ranks_.size(); ++r) {
      Other& rank = others_[at(r)];
      if (rank.dead || !ranks_.is_lost(r, kWorkerDeadAfter)) continue;
      rank.dead = true;
      give_back(rank.starts);
      all_.budget_.say(0, "rank " + std::to_string(r) +
                              " does not answer any more; its starts are made by others");
    }
    bool stop = false;
    {
      const std::lock_guard lock(all_.mutex_);
      if (ranks_.stop_requested()) {
        all_.interrupted_by_ = kStopped;
        all_.budget_.stop(Status::UserStop);
        all_.others_ended_ = true;
      }
      stop = all_.exception_ != nullptr;
    }
    if (all_.budget_.interrupted()) {
      stop = true;
      all_.queue_.close();
    }
    if (stop && !std::exchange(stop_sent_, true)) ranks_.send_to_others(Kind::Stop);
    if (std::ranges::all_of(others_, [](const Other& r) { return r.dead || r.ended; }))
      all_.others_ended_ = true;
  }

  /// Where the launcher ends all, the others wait for the end of this process: the end of theirs
  /// would hasten it.
  void send_answer(const Answer& answer, const std::exception_ptr& failure) {
    if (ranks_.stop_requested()) return;
    const std::vector<char> bytes = failure ? text_bytes(what_of(failure)) : to_bytes(answer);
    Index is = failure ? kException : kResult;
    for (int rank = 1; rank < ranks_.size(); ++rank) {
      if (!others_[at(rank)].dead) continue;
      ranks_.forget(rank);
      is |= kRankDead;
    }
    ranks_.send_to_others(Kind::Final, is, bytes);
  }

  /// Of rank 0. An answer: the last one, of all ranks.
  std::optional<Answer> read_messages() {
    while (auto message = ranks_.receive()) {
      if (message->kind == Kind::Start) {
        all_.queue_.put(message->start);
      } else if (message->kind == Kind::Stop) {
        stop();
      } else if (message->kind == Kind::Final) {
        stop();
        if ((message->start & kRankDead) != 0) ranks_.forget(0);  // it does not wait for us either
        if ((message->start & kException) != 0) throw std::runtime_error(message->text());
        return multistart_result_from(message->bytes);
      }
    }
    return std::nullopt;
  }

  /// What this rank still makes is of no use.
  void stop() {
    all_.budget_.end_after(-1);
    all_.queue_.close();
  }

  Starts& all_;
  Ranks& ranks_;
  std::vector<Other> others_;  ///< of each rank
  bool stop_sent_ = false;
};

Answer Starts::run(Ranks& ranks) {
  is_first_rank_ = ranks.rank() == 0;
  OnRanks here(*this, ranks);
  return is_first_rank_ ? here.run_as_first() : here.run_as_other();
}

}  // namespace ipminmax
