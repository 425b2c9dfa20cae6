#include <algorithm>
#include <exception>
#include <iomanip>
#include <limits>
#include <mutex>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <tuple>
#include <utility>

#include "core/model/structure_check.hpp"
#include "core/model/timer.hpp"
#include "core/multistart.hpp"
#include "core/search/multistart_run.hpp"
#include "core/search/outcome.hpp"
#include "core/search/random_starts.hpp"
#include "core/search/ranking.hpp"
#include "core/search/restart.hpp"
#include "core/search/result_bytes.hpp"

namespace ipminmax {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// No other starting point can change such an end.
bool is_final(Status status) {
  return status == Status::InvalidProblem || status == Status::InvalidOption ||
         status == Status::TooFewDegreesOfFreedom;
}

bool has_free_min_variable(const ProblemStructure& s) {
  for (std::size_t i = 0; i < s.variable_players.size(); ++i) {
    if (s.variable_players[i] == Player::Min &&
        !(i < s.variable_lower.size() && i < s.variable_upper.size() &&
          s.variable_lower[i] == s.variable_upper[i])) {
      return true;
    }
  }
  return false;
}

}  // namespace

Multistart::Multistart(const std::vector<Problem*>& models, const SolverOptions& options,
                       const MultistartObserver& observer,
                       const std::vector<std::vector<double>>& given)
    : options_(options), observer_(observer), given_(given), limit_(options) {
  for (Problem* model : models) workers_.push_back({model});
}

void Multistart::prepare() {
  check_given();
  last_ = std::max(options_.minmax_starts - 1, static_cast<Index>(given_.size()));
  maximization_ = !has_free_min_variable(workers_.front().model->structure());
}

MultistartResult Multistart::run() {
  prepare();
  run_start(workers_.front(), 0);
  if (!exception_ && last_ > 0) {
    const Status first = outcomes_.statuses().begin()->first;
    if (!is_final(first)) {
      start_after_the_first();
      if (search_failed(first)) begin_anew_if_uncertified();
    }
  }
  if (exception_) std::rethrow_exception(exception_);
  return collect();
}

void Multistart::check_given() const {
  const std::size_t n = workers_.front().model->structure().variable_players.size();
  for (std::size_t k = 0; k < given_.size(); ++k) {
    if (given_[k].size() == n) continue;
    throw std::invalid_argument("given starting point " + std::to_string(k) + " has " +
                                std::to_string(given_[k].size()) + " values for " +
                                std::to_string(n) + " variables");
  }
}

void Multistart::start_after_the_first() {
  queue_.put(1, last_);
  {
    std::vector<std::jthread> threads;  // joined when they go out of scope
    for (std::size_t t = 1; t < workers_.size() && static_cast<Index>(t) < last_; ++t) {
      try {
        threads.emplace_back([this, t] { work(workers_[t]); });
      } catch (const std::system_error&) {
        break;  // no more threads to be had: go on with those there are
      }
    }
    work(workers_.front());
  }
  wait_for_others();
}

void Multistart::work(Worker& worker) {
  while (const auto start = queue_.take()) {
    if (time_is_up()) return;
    run_start(worker, *start);
  }
}

bool Multistart::time_is_up() {
  const bool cpu = limit_.stopwatch().cpu() >= options_.max_cpu_time;
  if (cpu || limit_.stopwatch().wall() >= options_.max_wall_time) {
    const std::lock_guard lock(mutex_);
    interrupt(cpu ? Status::MaxCpuTime : Status::MaxWallTime);
  }
  return out_of_time_;
}

SolverOptions Multistart::with_remaining_time() const {
  SolverOptions options = options_;
  // The CPU clock is that of the process, so the rest is a limit for all threads together.
  limit_.pass_on(options);
  return options;
}

void Multistart::run_start(Worker& worker, Index start) {
  if (start == 0) {
    SolverOptions options = options_;
    if (last_ > 0) options.minmax_max_restarts = 0;  // the other starts are chosen here
    run_start(worker, 0, {}, options);
    return;
  }
  const auto g = at(start) - 1;
  std::vector<double> v =
      g < given_.size() ? given_[g]
                        : random_start(worker.model->structure(), model_start_, start, options_);
  run_start(worker, start, std::move(v), one_cold_search());
}

/// Of a start other than the model's.
SolverOptions Multistart::one_cold_search() const {
  SolverOptions options = with_remaining_time();
  options.warm_start_init_point = false;
  options.minmax_max_restarts = 0;
  return options;
}

/// As a single solve does, which is not to find more than many starts.
void Multistart::begin_anew_if_uncertified() {
  if (exception_ || interrupted_ || outcomes_.has_certified() || !makes_new_starts(options_))
    return;
  if (options_.minmax_epigraph) return;  // which makes no new starts
  if (!has_max_variables(workers_.front().model->structure())) return;
  run_start(workers_.front(), ++last_, {}, with_remaining_time());
}

/// v: n values, or empty for the model's own start.
void Multistart::run_start(Worker& worker, Index start, std::vector<double> v,
                           const SolverOptions& options) {
  try {
    detect(worker, start);
    Restarted restarted(*worker.model, std::move(v));
    Result result = worker.structure.solve(restarted, options, observer_of(start));
    if (start == 0) model_start_ = restarted.model_start();
    record(start, std::move(result));
  } catch (...) {
    note_exception(start, std::current_exception());
  }
}

/// The model's calls count once, whatever the number of threads.
void Multistart::detect(Worker& worker, Index start) {
  if (std::exchange(worker.detected, true)) return;
  const Counts counts = worker.structure.detect(*worker.model, options_);
  if (start > 0) return;
  const std::lock_guard lock(mutex_);
  outcomes_.add_work(counts);
}

void Multistart::note_exception(Index start, std::exception_ptr exception) {
  const std::lock_guard lock(mutex_);
  if (!exception_ || start < end_) exception_ = std::move(exception);
  end_ = std::min(end_.load(), start);
  queue_.close();
}

SolveObserver Multistart::observer_of(Index start) {
  SolveObserver observer;
  observer.on_iteration = [this, start](const IterationInfo& info) {
    if (start > end_) return false;
    if (!observer_.on_iteration) return true;
    const std::lock_guard lock(mutex_);
    if (start > end_) return false;
    if (observer_.on_iteration(start, info)) return true;
    interrupt(Status::UserStop);
    return false;
  };
  if (observer_.message) {
    observer.message = [this, start](std::string_view text) {
      const std::lock_guard lock(mutex_);
      observer_.message(start, text);
    };
  }
  return observer;
}

void Multistart::interrupt(Status status) {
  if (!interrupted_ || status == Status::UserStop) interrupted_ = status;
  if (status == Status::UserStop) end_ = -1;
  out_of_time_ = true;
  queue_.close();
  if (!is_first_rank_)
    outbox_.push_back({0, Ranks::Kind::Interrupted, static_cast<Index>(status), {}});
}

void Multistart::record(Index start, Result&& result) {
  const std::lock_guard lock(mutex_);
  // A start that was taken over from a rank that was only slow comes twice.
  if (!recorded_.insert(start).second) return;
  if (result.status == Status::MaxCpuTime || result.status == Status::MaxWallTime) {
    interrupt(result.status);
  }
  if (!is_first_rank_) {
    outbox_.push_back({0, Ranks::Kind::Result, start, to_bytes(result)});
    return;
  }
  if (static_cast<Index>(recorded_.size()) > last_) queue_.close();
  if (observer_.on_result) observer_.on_result(start, result);
  outcomes_.add(start, std::move(result));
}

MultistartResult Multistart::collect() {
  MultistartResult answer;
  add_certified(answer.points);
  // A negative factor of the objective makes the inner player minimize.
  const bool mirrored =
      !answer.points.empty() && answer.points.front().result.objective_scale < 0.0;
  if (options_.minmax_worst_case_starts > 0 && !maximization_ && !mirrored) {
    check_worst_cases(answer);
  }
  choose_best(answer);
  return answer;
}

void Multistart::add_certified(std::vector<DistinctPoint>& points) {
  const bool over_branches = options_.minmax_epigraph || options_.minmax_epigraph_at_kinks;
  for (auto& [start, result] : outcomes_.take_certified()) {
    add_distinct(workers_.front().model->structure(), over_branches && !maximization_,
                 options_.minmax_distinct_tol, start, std::move(result), points);
  }
}

void Multistart::choose_best(MultistartResult& answer) {
  std::vector<DistinctPoint>& points = answer.points;
  std::ranges::sort(points, [this](const DistinctPoint& a, const DistinctPoint& b) {
    return std::tuple(rank(a.result), a.first_start) < std::tuple(rank(b.result), b.first_start);
  });
  for (const auto& [status, count] : outcomes_.statuses()) {
    answer.statuses.emplace_back(status, count);
    answer.starts += count;
  }
  answer.interrupted = interrupted_;
  std::tie(answer.best_start, answer.best) =
      points.empty() ? outcomes_.take_best_uncertified()
                     : std::pair(points.front().first_start, points.front().result);
  if (interrupted_ && (*interrupted_ == Status::UserStop || !is_success(answer.best.status))) {
    answer.best.status = *interrupted_;
    answer.best.message = interrupted_by_.empty()
                              ? std::string(name_of(*interrupted_)) + " in a multistart"
                              : interrupted_by_;
  }
  look_for_worse(answer);
  Result& best = answer.best;
  best.iterations = outcomes_.work().iterations;
  best.factorizations = outcomes_.work().factorizations;
  best.counts = outcomes_.work().counts;
  best.timing = outcomes_.work().timing;
  best.seconds = best.timing.total = limit_.stopwatch().wall();
  best.cpu_seconds = limit_.stopwatch().cpu();
}

std::string points_as_csv(const MultistartResult& result) {
  std::ostringstream text;
  text << std::setprecision(std::numeric_limits<double>::max_digits10)
       << "rank,value,found,first_start,margin,status";
  const std::size_t n = result.points.empty() ? 0 : result.points.front().result.v.size();
  for (std::size_t i = 0; i < n; ++i) text << ",v_" << i;
  text << '\n';
  for (std::size_t k = 0; k < result.points.size(); ++k) {
    const DistinctPoint& point = result.points[k];
    text << k + 1 << ',' << point.result.objective << ',' << point.found << ',' << point.first_start
         << ',' << point.result.certificate.margin << ',' << name_of(point.result.status);
    for (const double value : point.result.v) text << ',' << value;
    text << '\n';
  }
  return text.str();
}

MultistartResult multistart(Problem& problem, const SolverOptions& options,
                            const MultistartObserver& observer,
                            const std::vector<std::vector<double>>& given) {
  return Multistart({&problem}, options, observer, given).run();
}

MultistartResult multistart(const ProblemFactory& make_problem, int threads,
                            const SolverOptions& options, const MultistartObserver& observer,
                            const std::vector<std::vector<double>>& given) {
  const int starts = std::max(options.minmax_starts, static_cast<int>(given.size()) + 1);
  std::vector<std::unique_ptr<Problem>> owned;
  std::vector<Problem*> models;
  for (int t = 0; t < std::clamp(threads, 1, std::max(starts - 1, 1)); ++t) {
    owned.push_back(make_problem());
    if (!owned.back()) throw std::invalid_argument("the factory of a multistart made no problem");
    models.push_back(owned.back().get());
  }
  return Multistart(std::move(models), options, observer, given).run();
}

}  // namespace ipminmax
