#include "core/global/starts.hpp"

#include <algorithm>
#include <chrono>
#include <new>
#include <system_error>
#include <thread>

#include "core/global/refinement.hpp"
#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/parallel/joined_thread.hpp"
#include "core/parallel/ranks.hpp"
#include "core/robust/robust_scope.hpp"
#include "core/search/one_start.hpp"
#include "core/search/outcome.hpp"
#include "core/search/starts.hpp"
#include "linalg/library_lock.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

void StartOutcomes::add(Index start, Result&& result) {
  constexpr Index kMostKept = 1000;
  ++statuses[result.status];
  add_work(result, work);
  if (is_certified(result)) {
    certified.emplace(start, std::move(result));
    return;
  }
  if (start < kMostKept && !result.v.empty() && all_finite(result.v)) {
    uncertified.emplace(start, result.v);
  }
  // Equal ranks go to the earlier start, in whatever order they end.
  auto& [best_start, best] = best_uncertified;
  if (best_start < 0 || better(result, best) || (!better(best, result) && start < best_start)) {
    best_uncertified = {start, std::move(result)};
  }
}

std::vector<std::pair<Index, Result>> StartOutcomes::take_certified() {
  std::vector<std::pair<Index, Result>> taken;
  for (const bool solved : {true, false}) {
    for (auto& [start, result] : certified) {
      if ((result.status == Status::Solved) == solved) taken.emplace_back(start, std::move(result));
    }
  }
  certified.clear();
  return taken;
}

namespace {

bool has_free_min_variable(const ProblemStructure& s) {
  const auto &lower = s.variable_lower, &upper = s.variable_upper;
  return std::ranges::any_of(variables_of(s, Player::Min), [&](std::size_t i) {
    return !(i < lower.size() && i < upper.size() && lower[i] == upper[i]);
  });
}

}  // namespace

Starts::Starts(const std::vector<Problem*>& models, const SolverOptions& options, Budget& budget,
               const Points& given, const std::vector<RobustWorstCase>& known)
    : options_(options),
      budget_(budget),
      given_(given),
      known_(known),
      witnesses_(models.front()->structure()) {
  for (Problem* model : models) workers_.push_back({model});
}

void Starts::prepare() {
  for (const auto k : indices(given_))
    require_size("given starting point " + std::to_string(k), structure(), given_[k]);
  last_ = std::max(options_.minmax_starts - 1, static_cast<Index>(given_.size()));
  asked_ = last_ + 1;
  maximization_ = !has_free_min_variable(structure());
}

Answer Starts::run() {
  prepare();
  run_start(workers_.front(), 0);
  if (!exception_ && last_ > 0) {
    const Status first = outcomes_.statuses.begin()->first;
    if (!is_final(first)) {
      if (model_start_.empty()) read_model_start();
      start_after_the_first();
      // As a single solve does, which is not to find more than many starts.
      if (search_failed(first) && !exception_ && outcomes_.certified.empty() &&
          makes_new_starts(options_) && !options_.minmax_epigraph &&
          has_max_variables(structure()) && !budget_.used_up()) {
        run_start(workers_.front(), ++last_, {}, options_);
      }
    }
  }
  if (exception_) std::rethrow_exception(exception_);
  return choose();
}

void Starts::read_model_start() {
  model_start_ = starting_values(*workers_.front().model);
  // Where the model has none, start 0 fails and there is no other.
  if (model_start_.empty()) model_start_.resize(structure().variable_players.size());
}

/// When all was interrupted, what other ranks have so far still counts.
void Starts::start_after_the_first() {
  constexpr double kSecondsToEnd = 3.0;
  queue_.put(1, last_);
  // Factorizations are counted when a solve has ended: only one at a time keeps to their number.
  const bool alone = budget_.factorizations_left() || LibraryLock::is_held();
  const std::size_t most = alone ? 1 : workers_.size();
  {
    std::vector<JoinedThread> threads;  // joined when they go out of scope
    for (std::size_t t = 1; t < most && static_cast<Index>(t) < last_; ++t) {
      try {
        threads.emplace_back([this, t] { work(workers_[t]); });
      } catch (const std::system_error&) {
        break;  // no more threads to be had: go on with those there are
      }
    }
    work(workers_.front());
  }
  const auto all_are_recorded = [this] {
    const std::lock_guard lock(mutex_);
    return static_cast<Index>(recorded_.size()) > last_;
  };
  for (const Stopwatch waited;
       !all_are_recorded() && !others_ended_ && waited.wall() <= kSecondsToEnd;) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

void Starts::work(Worker& worker) {
  while (const auto start = queue_.take()) {
    if (budget_.used_up()) {
      queue_.close();
      return;
    }
    run_start(worker, *start);
  }
}

void Starts::run_start(Worker& worker, Index start) {
  if (start == 0) {
    SolverOptions options = options_;
    if (last_ > 0) options.minmax_max_restarts = 0;  // the other starts are chosen here
    run_start(worker, 0, {}, options);
    return;
  }
  const auto g = at(start) - 1;
  run_start(worker, start,
            g < given_.size()
                ? given_[g]
                : random_start(worker.model->structure(), model_start_, start, options_),
            one_cold_search());
}

/// Of a start other than the model's.
SolverOptions Starts::one_cold_search() const {
  SolverOptions options = options_;
  options.warm_start_init_point = false;
  options.minmax_max_restarts = 0;
  return options;
}

/// v: n values, or empty for the model's own start.
void Starts::run_start(Worker& worker, Index start, const std::vector<double>& v,
                       const SolverOptions& options) {
  try {
    // The model's calls count once, whatever the number of threads.
    if (!std::exchange(worker.detected, true)) {
      const Counts calls = detect_hessian(*worker.model, options_, worker.structure);
      const std::lock_guard lock(mutex_);
      if (start == 0) outcomes_.work.counts += calls;
    }
    Restarted model(*worker.model, v);  // which keeps its start
    record(start, refine(worker, model, start, v, options));
    if (start == 0) model_start_ = model.model_start();
  } catch (...) {
    note_exception(start, std::current_exception());
  }
}

/// One start, audited with the y that it has met itself, so that it does not depend on others. A
/// robust constraint that one of these violates is solved again with it.
Result Starts::refine(Worker& worker, Problem& model, Index start, const std::vector<double>& v,
                      const SolverOptions& options) try {
  constexpr int kMostRefuted = 2;
  const bool among_others = workers_.size() > 1 || !is_first_rank_;
  std::vector<RobustWorstCase> known;
  if (start == 0) known = known_;
  Witnesses met(model.structure());
  std::vector<double> from = v;
  std::optional<Result> refuted;
  for (int round = 0;; ++round) {
    Result result = Refinement{options, budget_, among_others, known, met}.from(model, from, start,
                                                                                worker.structure);
    met.add(result);
    if (refuted) add_work(*refuted, result);
    audit(model, options, met, budget_, result, result.counts);
    const bool by_row = result.over_y.better_known && !result.worst_case.higher &&
                        !result.worst_cases.empty() && !options.minmax_epigraph;
    if (!by_row || round == kMostRefuted || budget_.used_up()) return result;
    from = result.v;
    known = result.worst_cases;
    for (RobustWorstCase& one : known) one.range = 0.0;  // none is followed alone
    refuted = std::move(result);
  }
} catch (const std::bad_alloc&) {  // between two solves
  budget_.stop(Status::OutOfMemory);
  return without_point(Status::OutOfMemory, "out of memory");
}

void Starts::note_exception(Index start, std::exception_ptr exception) {
  const std::lock_guard lock(mutex_);
  if (!exception_ || start < thrown_by_) exception_ = std::move(exception);
  thrown_by_ = std::min(thrown_by_, start);
  budget_.end_after(start);
  queue_.close();
}

void Starts::record(Index start, Result&& result) {
  const std::lock_guard lock(mutex_);
  // A start that was taken over from a rank that was only slow comes twice.
  if (!recorded_.insert(start).second) return;
  if (!is_first_rank_) {
    outbox_.push_back({0, Ranks::Kind::Result, start, to_bytes(result)});
    return;
  }
  const bool cut = budget_.interrupted() && !is_success(result.status) &&
                   (stopped_from_outside(result.status) || result.status == Status::MaxIterations);
  if (start < asked_ && !cut) ++ended_;
  if (static_cast<Index>(recorded_.size()) > last_) queue_.close();
  budget_.tell(start, result);
  witnesses_.add(result);
  outcomes_.add(start, std::move(result));
}

}  // namespace ipminmax
