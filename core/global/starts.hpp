#pragma once

#include <atomic>
#include <condition_variable>
#include <exception>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/answer.hpp"
#include "core/global/witnesses.hpp"
#include "core/model/budget.hpp"
#include "core/parallel/ranks.hpp"
#include "core/search/one_start.hpp"

namespace ipminmax {

/// What the starts of a multistart left, in whatever order they ended; the answer is the best of
/// this list.
struct StartOutcomes {
  std::map<Index, Result> certified;
  /// Points of starts that no certified one came of, of the first thousand starts: their y may be
  /// worse elsewhere.
  std::map<Index, std::vector<double>> uncertified;
  /// The best result without certificate, the earlier start's among equals; start -1: none.
  std::pair<Index, Result> best_uncertified{-1, {}};
  std::map<Status, Index> statuses;
  Result work;  ///< iterations, factorizations, counts and times of all, and what is no start's

  /// Each start once.
  void add(Index start, Result&& result);
  /// Certified results in the order of their starts, those to full tolerance first: they stand for
  /// others to the acceptable level. The list has them no more.
  [[nodiscard]] std::vector<std::pair<Index, Result>> take_certified();
};

/// Numbers of starts to be made, handed out in ascending order to any number of threads.
class StartQueue {
 public:
  void put(Index first, Index last) {
    const std::lock_guard lock(mutex_);
    next_ = first;
    last_ = last;
    changed_.notify_all();
  }
  /// One that was handed out before, or by another rank.
  void put(Index start) {
    const std::lock_guard lock(mutex_);
    again_.insert(start);
    changed_.notify_all();
  }
  /// Nothing is handed out any more.
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_all();
  }
  /// Waits for one; none: closed.
  std::optional<Index> take() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return closed_ || is_waiting(); });
    return first();
  }
  std::optional<Index> take_if_any() {
    const std::lock_guard lock(mutex_);
    return first();
  }

 private:
  bool is_waiting() const { return !again_.empty() || next_ <= last_; }
  std::optional<Index> first() {
    if (closed_ || !is_waiting()) return std::nullopt;
    return again_.empty() ? next_++ : again_.extract(again_.begin()).value();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::set<Index> again_;
  Index next_ = 1, last_ = 0;
  bool closed_ = false;
};

/// A list of starts of x, each refined over y, and the choice of the best: in threads of this
/// process, and on other ranks where there are.
class Starts {
 public:
  /// models: one per thread. Structure and options are in order.
  /// known: worst cases near the model's own start, of a solve before.
  Starts(const std::vector<Problem*>& models, const SolverOptions& options, Budget& budget,
         const Points& given, const std::vector<RobustWorstCase>& known);

  Answer run();
  /// With the other ranks, which have called this, too; all return the same.
  Answer run(Ranks& ranks);

 private:
  /// A model, used by one thread, and what its searches have in common.
  struct Worker {
    Problem* model;
    KeptWork structure = kept_structure();
    bool detected = false;
  };
  class Choice;
  class OnRanks;  // starts_over_ranks.cpp

  void prepare();
  void read_model_start();
  void start_after_the_first();
  void work(Worker& worker);
  void run_start(Worker& worker, Index start);
  void run_start(Worker& worker, Index start, const std::vector<double>& v,
                 const SolverOptions& options);
  SolverOptions one_cold_search() const;
  void note_exception(Index start, std::exception_ptr exception);
  void record(Index start, Result&& result);
  const ProblemStructure& structure() const { return workers_.front().model->structure(); }

  std::vector<Worker> workers_;  ///< one per thread
  const SolverOptions& options_;
  Budget& budget_;
  const Points& given_;
  const std::vector<RobustWorstCase>& known_;
  std::vector<double> model_start_;
  bool maximization_ = false;  ///< no free Min variable: the larger value is the better one
  Index asked_ = 1;
  Index last_ = 0;
  StartQueue queue_;

  std::mutex mutex_;  ///< of everything below
  std::exception_ptr exception_;
  Index thrown_by_ = std::numeric_limits<Index>::max();  ///< start of the exception
  std::set<Index> recorded_;                             ///< starts whose result is here
  Index ended_ = 0;                                      ///< of them, not cut short
  std::string interrupted_by_;                           ///< what the launcher did, empty: nothing
  StartOutcomes outcomes_;

  Witnesses witnesses_;
  bool is_first_rank_ = true;
  std::vector<Ranks::Message> outbox_;     ///< of another rank
  std::atomic<bool> others_ended_ = true;  ///< nothing more comes from other ranks
};

}  // namespace ipminmax
