#pragma once

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <exception>
#include <functional>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/answer.hpp"
#include "core/global/audit.hpp"
#include "core/global/choice.hpp"
#include "core/model/budget.hpp"
#include "core/multistart.hpp"
#include "core/parallel/ranks.hpp"
#include "core/search/one_start.hpp"
#include "linalg/inertia.hpp"

namespace ipminmax {

/// What the starts of a multistart left, in whatever order they ended; the answer is the best of
/// this list.
class StartOutcomes {
 public:
  /// A start that no certified point came of.
  struct Uncertified {
    std::vector<double> v;
    double objective;
  };

  /// Each start once.
  void add(Index start, Result&& result);
  /// Work that is no start's.
  void add_work(const Result& part);
  void add_work(const Counts& part);

  [[nodiscard]] bool has_certified() const { return !certified_.empty(); }
  /// By their starts. Of the first kRoom starts, whose y may be worse elsewhere.
  [[nodiscard]] const std::map<Index, Uncertified>& uncertified() const { return uncertified_; }
  /// Certified results in the order of their starts, those to full tolerance first: they stand for
  /// others to the acceptable level. The list has them no more.
  [[nodiscard]] std::vector<std::pair<Index, Result>> take_certified();
  /// Of results without certificate, the earlier start's among equals; start -1: there is none.
  [[nodiscard]] std::pair<Index, Result> take_best_uncertified();
  [[nodiscard]] const std::map<Status, Index>& statuses() const { return statuses_; }
  /// Iterations, factorizations, counts and times of all.
  [[nodiscard]] const Result& work() const { return work_; }

 private:
  std::map<Index, Result> certified_;
  std::map<Index, Uncertified> uncertified_;
  std::pair<Index, Result> best_uncertified_{-1, {}};
  std::map<Status, Index> statuses_;
  Result work_;
};

/// Numbers of starts to be made, handed out in ascending order to any number of threads.
class StartQueue {
 public:
  void put(Index first, Index last) {
    const std::lock_guard lock(mutex_);
    if (last < first) return;
    // Ranges that overlap become one.
    for (auto range = waiting_.begin(); range != waiting_.end();) {
      if (range->second < first || range->first > last) {
        ++range;
        continue;
      }
      first = std::min(first, range->first);
      last = std::max(last, range->second);
      range = waiting_.erase(range);
    }
    waiting_.emplace(first, last);
    changed_.notify_all();
  }
  /// Nothing is handed out any more.
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_all();
  }
  /// Waits for one; none: closed.
  [[nodiscard]] std::optional<Index> take() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return closed_ || !waiting_.empty(); });
    return first();
  }
  [[nodiscard]] std::optional<Index> take_if_any() {
    const std::lock_guard lock(mutex_);
    return first();
  }

 private:
  std::optional<Index> first() {
    if (closed_ || waiting_.empty()) return std::nullopt;
    const auto [start, last] = *waiting_.begin();
    waiting_.erase(waiting_.begin());
    if (start < last) waiting_.emplace(start + 1, last);
    return start;
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<Index, Index>
      waiting_;  ///< last of each range by its first, however many starts there are
  bool closed_ = false;
};

/// A list of starts of x, each refined over y, and the choice of the best: in threads of this
/// process, and on other ranks where there are.
class Starts {
 public:
  /// models: one per thread. Structure and options are in order.
  /// known: worst cases near the model's own start, of a solve before.
  Starts(const std::vector<Problem*>& models, const SolverOptions& options, Budget& budget,
         const std::vector<std::vector<double>>& given, const std::vector<RobustWorstCase>& known);

  Answer run();
  /// With the other ranks, which have called this, too; all return the same.
  Answer run(Ranks& ranks);

 private:
  /// A model, used by one thread, and what its searches have in common.
  struct Worker {
    Problem* model;
    SearchStructure structure{};
    bool detected = false;
  };
  void prepare();
  void check_given() const;
  void work(Worker& worker);
  void run_start(Worker& worker, Index start);
  void run_start(Worker& worker, Index start, const std::vector<double>& v,
                 const SolverOptions& options);
  [[nodiscard]] Result refine(Worker& worker, Problem& model, Index start,
                              const std::vector<double>& v, const SolverOptions& options);
  [[nodiscard]] SolverOptions one_cold_search() const;
  void begin_anew_if_uncertified();
  void detect(Worker& worker, Index start);
  void start_after_the_first();
  void note_exception(Index start, std::exception_ptr exception);
  void record(Index start, Result&& result);
  [[nodiscard]] Answer collect();
  void add_certified(std::vector<DistinctPoint>& points);
  void choose_best(Answer& answer);
  void audit_best(Result& best);
  void read_model_start();
  [[nodiscard]] bool with_branches() const;

  // Other y of the points; starts_over_y.cpp.
  [[nodiscard]] static bool has_value(Status status);
  [[nodiscard]] bool may_look_over_y(const Result& result) const;
  void choose_over_y(Answer& answer);
  [[nodiscard]] std::pair<Result*, Index> best_so_far(Answer& answer);
  [[nodiscard]] std::vector<std::vector<double>> others_than(
      const Result& best, const std::vector<DistinctPoint>& points, Index most) const;
  void check_worst_case(Result& result, Index start, const std::vector<std::vector<double>>& given);

  // On several ranks; starts_over_ranks.cpp.
  Answer run_as_first(Ranks& ranks);
  Answer run_as_other(Ranks& ranks);
  std::optional<Answer> read_messages(Ranks& ranks, const std::function<void()>& stop);
  struct Others;
  void take_messages(Ranks& ranks, Others& others);
  void give_back(std::set<Index>& starts);
  void hand_out(Ranks& ranks, Others& others);
  void look_after(Ranks& ranks, Others& others);
  void wait_for_others();
  void send_answer(Ranks& ranks, const Others& others, const Answer& answer,
                   const std::exception_ptr& failure);

  std::vector<Worker> workers_;  ///< one per thread
  const SolverOptions& options_;
  Budget& budget_;
  const std::vector<std::vector<double>>& given_;
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
