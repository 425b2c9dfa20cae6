#pragma once

#include <atomic>
#include <exception>
#include <limits>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/model/timer.hpp"
#include "core/multistart.hpp"
#include "core/search/ranking.hpp"
#include "core/search/ranks.hpp"
#include "core/search/search_structure.hpp"
#include "core/search/start_outcomes.hpp"
#include "core/search/start_queue.hpp"
#include "core/worst_case.hpp"

namespace ipminmax {

/// One multistart: in threads of this process, and on other ranks where there are.
class Multistart {
 public:
  /// models: one per thread.
  Multistart(const std::vector<Problem*>& models, const SolverOptions& options,
             const MultistartObserver& observer, const std::vector<std::vector<double>>& given);

  MultistartResult run();
  /// With the other ranks, which have called this, too; all return the same.
  MultistartResult run(Ranks& ranks);

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
  void run_start(Worker& worker, Index start, std::vector<double> v, const SolverOptions& options);
  [[nodiscard]] SolverOptions one_cold_search() const;
  void begin_anew_if_uncertified();
  void detect(Worker& worker, Index start);
  void start_after_the_first();
  void note_exception(Index start, std::exception_ptr exception);
  [[nodiscard]] SolverOptions with_remaining_time() const;
  [[nodiscard]] bool time_is_up();
  [[nodiscard]] SolveObserver observer_of(Index start);
  void record(Index start, Result&& result);
  void interrupt(Status status);
  [[nodiscard]] MultistartResult collect();
  void add_certified(std::vector<DistinctPoint>& points);
  void choose_best(MultistartResult& answer);

  // Worst cases of the points; see multistart_worst_cases.cpp.
  [[nodiscard]] Rank rank(const Result& result) const;
  void check_worst_cases(MultistartResult& answer);
  [[nodiscard]] WorstCase worst_case_of(const Result& result, Index start,
                                        const std::vector<std::vector<double>>& given);
  void go_on_from(const std::vector<double>& v, MultistartResult& answer);
  void look_for_worse(MultistartResult& answer);

  // On several ranks; see multistart_over_ranks.cpp.
  MultistartResult run_as_first(Ranks& ranks);
  MultistartResult run_as_other(Ranks& ranks);
  struct Others;
  void take_messages(Ranks& ranks, Others& others);
  void give_back(std::set<Index>& starts);
  void hand_out(Ranks& ranks, Others& others);
  void look_after(Ranks& ranks, Others& others);
  void wait_for_others();
  void send_answer(Ranks& ranks, const Others& others, const MultistartResult& answer,
                   const std::exception_ptr& failure);
  void read_model_start();
  void tell_first(Ranks::Kind kind, Index start, std::vector<char> bytes);

  std::vector<Worker> workers_;  ///< one per thread
  const SolverOptions& options_;
  const MultistartObserver& observer_;
  const std::vector<std::vector<double>>& given_;
  TimeLimit limit_;
  std::vector<double> model_start_;
  bool maximization_ = false;  ///< no free Min variable: the larger value is the better one
  Index last_ = 0;
  StartQueue queue_;
  /// Starts after this one are given up: it threw an exception, or the observer stopped all (-1).
  std::atomic<Index> end_ = std::numeric_limits<Index>::max();
  std::atomic<bool> out_of_time_ = false;

  std::mutex mutex_;  ///< of the observer and of everything below
  std::exception_ptr exception_;
  std::set<Index> recorded_;    ///< starts whose result is here
  std::string interrupted_by_;  ///< what the launcher did, empty: nothing
  StartOutcomes outcomes_;
  std::optional<Status> interrupted_;

  bool is_first_rank_ = true;
  std::vector<Ranks::Message> outbox_;     ///< of another rank
  std::atomic<bool> others_ended_ = true;  ///< nothing more comes from other ranks
};

}  // namespace ipminmax
