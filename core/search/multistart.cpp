#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <iomanip>
#include <limits>
#include <map>
#include <mutex>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <tuple>
#include <utility>

#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/model/timer.hpp"
#include "core/multistart.hpp"
#include "core/search/multistart_run.hpp"
#include "core/search/other_answers.hpp"
#include "core/search/outcome.hpp"
#include "core/search/random_starts.hpp"
#include "core/search/restart.hpp"
#include "core/search/result_bytes.hpp"
#include "core/worst_case.hpp"

namespace ipminmax {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

Rank rank_of(const Result& result) {
  // NaN would break the order.
  const auto number = [](double value) {
    return std::isnan(value) ? std::numeric_limits<double>::infinity() : value;
  };
  const Certificate& found = result.certificate;
  // With a negative factor Min maximizes.
  const double objective = result.objective_scale < 0.0 ? -result.objective : result.objective;
  if (result.v.empty()) return {6, 0, 0.0};
  if (found.kind == PointKind::LocalMinmax) return {1, 0, number(objective)};
  if (found.second_order == SecondOrder::Violated) return {4, 0, number(result.error.total)};
  if (is_success(result.status)) {
    return {2, found.inner == found.inner_expected ? 0 : 1, number(objective)};
  }
  if (found.kind == PointKind::InfeasiblePoint) return {5, 0, number(result.error.primal)};
  return {3, 0, number(result.error.total)};
}

/// Starts whose points are kept although they are not certified: their y may be worse elsewhere.
constexpr Index kKeptUncertified = 1000;

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
  if (!exception_ && last_ > 0 && !is_final(statuses_.begin()->first)) {
    const bool failed = search_failed(statuses_.begin()->first);
    start_after_the_first();
    if (failed) begin_anew_if_uncertified();
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
  if (exception_ || interrupted_ || !certified_.empty() || !makes_new_starts(options_)) return;
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
  total_.counts.gradient += counts.gradient;
  total_.counts.jacobian += counts.jacobian;
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
  ++statuses_[result.status];
  add_work(result, total_);
  if (observer_.on_result) observer_.on_result(start, result);
  if (result.certificate.kind == PointKind::LocalMinmax) {
    certified_.emplace(start, std::move(result));
    return;
  }
  if (start < kKeptUncertified && !result.v.empty() && all_finite(result.v)) {
    uncertified_.emplace(start, std::pair(result.v, result.objective));
  }
  // Equal ranks go to the earlier start, in whatever order they end.
  const bool first = best_uncertified_start_ < 0;
  if (first || better(result, best_uncertified_) ||
      (!better(best_uncertified_, result) && start < best_uncertified_start_)) {
    best_uncertified_ = std::move(result);
    best_uncertified_start_ = start;
  }
}

MultistartResult Multistart::collect() {
  MultistartResult answer;
  // Points to full tolerance first: they stand for those to the acceptable level.
  for (const bool solved : {true, false}) {
    for (auto& [start, result] : certified_) {
      if ((result.status == Status::Solved) == solved) {
        add_point(start, std::move(result), answer.points);
      }
    }
  }
  certified_.clear();
  // A negative factor of the objective makes the inner player minimize.
  const bool mirrored =
      !answer.points.empty() && answer.points.front().result.objective_scale < 0.0;
  if (options_.minmax_worst_case_starts > 0 && !maximization_ && !mirrored) {
    check_worst_cases(answer);
  }
  choose_best(answer);
  return answer;
}

/// The best point may stand over a weak branch of y, which the y of other starts may show.
void Multistart::look_for_worse(MultistartResult& answer) {
  Result& best = answer.best;
  const bool has_value = is_success(best.status) || best.status == Status::NoLocalMinmaxFound;
  // A negative factor of the objective makes the inner player minimize.
  if (!has_value || maximization_ || best.objective_scale < 0.0 || interrupted_ || best.v.empty() ||
      !all_finite(best.v) || !has_max_variables(workers_.front().model->structure())) {
    return;
  }
  if (options_.minmax_worst_case_starts == 0) {
    OtherAnswers others{.points = {},
                        .objectives = {},
                        .tol = options_.tol,
                        .constr_viol_tol = options_.constr_viol_tol};
    for (const DistinctPoint& point : answer.points)
      others.add(point.result.v, point.result.objective);
    for (const auto& [start, point] : uncertified_) others.add(point.first, point.second);
    compare_with(others, *workers_.front().model, best, total_.counts);
  } else if (answer.points.empty()) {
    std::vector<std::vector<double>> given;
    for (const auto& [start, point] : uncertified_) {
      if (static_cast<Index>(given.size()) + 1 >= options_.minmax_worst_case_starts) break;
      given.push_back(point.first);
    }
    best.worst_case = worst_case_of(best, answer.best_start, given);
  }
  if (!answer.points.empty()) answer.points.front().result.worst_case = best.worst_case;
  if (best.worst_case.higher) {
    best.message += "; " + describe_worst_case(best);
  } else if (best.status == Status::NoLocalMinmaxFound && !options_.minmax_epigraph &&
             !options_.minmax_epigraph_at_kinks) {
    best.message += "; minmax_epigraph_at_kinks yes goes on over the branches of y";
  }
}

void Multistart::add_point(Index start, Result&& result, std::vector<DistinctPoint>& points) const {
  // Where several y are worst, any of them may stand in v.
  const bool over_branches = options_.minmax_epigraph || options_.minmax_epigraph_at_kinks;
  const ProblemStructure& s = workers_.front().model->structure();
  const auto place = [&](const std::vector<double>& v) {
    return over_branches && !maximization_ ? min_part(s, v) : v;
  };
  const std::vector<double> own = place(result.v);
  const auto known = std::ranges::find_if(points, [&](const DistinctPoint& point) {
    return same_point(own, place(point.result.v), options_.minmax_distinct_tol);
  });
  if (known == points.end()) {
    points.push_back({std::move(result), start, 1});
  } else {
    ++known->found;
  }
}

Rank Multistart::rank(const Result& result) const {
  Rank rank = rank_of(result);
  if (std::get<0>(rank) == 1) {
    const WorstCase& worst = result.worst_case;
    double& value = std::get<2>(rank);
    if (worst.starts > 0 && !worst.v.empty()) value = std::max(value, worst.value);
    if (worst.unbounded) value = std::numeric_limits<double>::infinity();
    if (maximization_) value = -value;
  }
  return rank;
}

void Multistart::check_worst_cases(MultistartResult& answer) {
  // The worst case at x is at least the local value, so points whose value exceeds the best worst
  // case need no check.
  std::vector<DistinctPoint>& points = answer.points;
  Index more_starts = last_ + 1;
  while (!interrupted_) {
    DistinctPoint* next = nullptr;
    double best = std::numeric_limits<double>::infinity();
    for (DistinctPoint& point : points) {
      const double value = std::get<2>(rank(point.result));
      if (point.result.worst_case.starts > 0) {
        best = std::min(best, value);
      } else if (next == nullptr || value < next->result.objective) {
        next = &point;
      }
    }
    if (next == nullptr || !(next->result.objective < best)) return;
    std::vector<std::vector<double>> given;  // the y of the other points
    for (const DistinctPoint& other : points) {
      if (static_cast<Index>(given.size()) >= options_.minmax_worst_case_starts) break;
      if (&other != next) given.push_back(other.result.v);
    }
    next->result.worst_case = worst_case_of(next->result, next->first_start, given);
    const WorstCase worst = next->result.worst_case;
    if (worst.starts == 0) return;  // interrupted
    if (!worst.higher || worst.unbounded || interrupted_ || more_starts-- == 0) continue;
    go_on_from(worst.v, answer);
  }
}

WorstCase Multistart::worst_case_of(const Result& result, Index start,
                                    const std::vector<std::vector<double>>& given) {
  MultistartObserver observer;
  observer.on_iteration = [&](Index, const IterationInfo& info) {
    return !observer_.on_iteration || observer_.on_iteration(start, info);
  };
  observer.on_result = [&](Index, const Result& made) { add_work(made, total_); };
  const WorstCaseCheck check =
      check_worst_case(*workers_.front().model, result.v, with_remaining_time(),
                       options_.minmax_worst_case_starts, given, observer);
  if (check.interrupted) interrupt(*check.interrupted);
  return check.found;
}

/// One more start, at the higher branch of y.
void Multistart::go_on_from(const std::vector<double>& v, MultistartResult& answer) {
  run_start(workers_.front(), ++last_, v, one_cold_search());
  if (exception_) std::rethrow_exception(exception_);
  for (auto& [start, result] : certified_) add_point(start, std::move(result), answer.points);
  certified_.clear();
}

void Multistart::choose_best(MultistartResult& answer) {
  std::vector<DistinctPoint>& points = answer.points;
  std::ranges::sort(points, [this](const DistinctPoint& a, const DistinctPoint& b) {
    return std::tuple(rank(a.result), a.first_start) < std::tuple(rank(b.result), b.first_start);
  });
  for (const auto& [status, count] : statuses_) {
    answer.statuses.emplace_back(status, count);
    answer.starts += count;
  }
  answer.interrupted = interrupted_;
  answer.best = points.empty() ? std::move(best_uncertified_) : points.front().result;
  answer.best_start = points.empty() ? best_uncertified_start_ : points.front().first_start;
  if (interrupted_ && (*interrupted_ == Status::UserStop || !is_success(answer.best.status))) {
    answer.best.status = *interrupted_;
    answer.best.message = interrupted_by_.empty()
                              ? std::string(name_of(*interrupted_)) + " in a multistart"
                              : interrupted_by_;
  }
  look_for_worse(answer);
  Result& best = answer.best;
  best.iterations = total_.iterations;
  best.factorizations = total_.factorizations;
  best.counts = total_.counts;
  best.timing = total_.timing;
  best.seconds = best.timing.total = limit_.stopwatch().wall();
  best.cpu_seconds = limit_.stopwatch().cpu();
}

bool better(const Result& a, const Result& b) { return rank_of(a) < rank_of(b); }

bool same_point(std::span<const double> a, std::span<const double> b, double tol) {
  double distance = 0.0;
  double size = 1.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    distance = std::max(distance, std::abs(a[i] - b[i]));
    size = std::max(size, std::abs(b[i]));
  }
  return distance <= tol * size;
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
