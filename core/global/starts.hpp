#pragma once

#include <atomic>
#include <exception>
#include <functional>
#include <limits>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/answer.hpp"
#include "core/global/choice.hpp"
#include "core/global/ranks.hpp"
#include "core/global/start_outcomes.hpp"
#include "core/global/start_queue.hpp"
#include "core/model/budget.hpp"
#include "core/search/one_start.hpp"

namespace ipminmax {

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
  [[nodiscard]] SolverOptions one_cold_search() const;
  void begin_anew_if_uncertified();
  void detect(Worker& worker, Index start);
  void start_after_the_first();
  void note_exception(Index start, std::exception_ptr exception);
  void record(Index start, Result&& result);
  [[nodiscard]] Answer collect();
  void add_certified(std::vector<DistinctPoint>& points);
  void choose_best(Answer& answer);
  void read_model_start();
  [[nodiscard]] bool with_branches() const;

  // Other y of the points; starts_over_y.cpp.
  [[nodiscard]] bool may_look_over_y(const Result& result) const;
  void choose_over_y(Answer& answer);
  [[nodiscard]] std::pair<Result*, Index> best_so_far(Answer& answer);
  [[nodiscard]] std::vector<std::vector<double>> others_than(
      const Result& best, const std::vector<DistinctPoint>& points, Index most) const;
  void check_worst_case(Result& result, Index start, const std::vector<std::vector<double>>& given);
  void look_for_worse(Answer& answer);
  void compare_with_others(const Answer& answer, Result& best);

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

  bool is_first_rank_ = true;
  std::vector<Ranks::Message> outbox_;     ///< of another rank
  std::atomic<bool> others_ended_ = true;  ///< nothing more comes from other ranks
};

}  // namespace ipminmax
