#include "core/global/starts.hpp"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <new>
#include <system_error>
#include <thread>

#include "core/global/audit.hpp"
#include "core/global/over_y.hpp"
#include "core/global/refinement.hpp"
#include "core/model/compare.hpp"
#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/parallel/joined_thread.hpp"
#include "core/robust/robust_scope.hpp"
#include "core/search/outcome.hpp"
#include "core/search/starts.hpp"
#include "core/worst_case.hpp"
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

/// The answer of all starts: the best one, with other y of it looked at.
class Starts::Choice {
 public:
  explicit Choice(Starts& starts) : all_(starts) {}

  Answer make() {
    answer_.best_start = -1;
    add_certified();
    choose_over_y();
    choose_best();
    return std::move(answer_);
  }

 private:
  /// Over f, at a point with the value of an inner maximum, as far as the search tells; where f is
  /// treated as a robust constraint that was done already, and with a negative factor of the
  /// objective the inner player minimizes.
  bool may_look_over_y(const Result& result) const {
    return (is_success(result.status) || result.status == Status::NoLocalMinmaxFound) &&
           !all_.maximization_ && !(result.objective_scale < 0.0) && !result.v.empty() &&
           all_finite(result.v) && result.over_y.branches == 0 && !options_.minmax_epigraph &&
           has_max_variables(model_.structure());
  }

  /// Adds certified points, unless they are known: then one more start has found them, and the
  /// higher value stands for both. Where several y are worst, any of them may stand in v, and
  /// points with the same x are one.
  void add_certified() {
    const ProblemStructure& structure = model_.structure();
    const bool branches = options_.minmax_epigraph || options_.minmax_epigraph_at_kinks;
    const bool by_x =
        (branches || has_rows_for_every_y(structure, options_)) && !all_.maximization_;
    VariableRanges ranges(structure);
    ranges.see(all_.model_start_);
    for (const DistinctPoint& point : answer_.points) ranges.see(point.result.v);
    for (const auto& [start, v] : all_.outcomes_.uncertified) ranges.see(v);
    auto certified = all_.outcomes_.take_certified();
    for (const auto& [start, result] : certified) ranges.see(result.v);
    std::vector<std::size_t> compared = variables_of(structure, Player::Min);
    if (!by_x)
      std::ranges::copy(variables_of(structure, Player::Max), std::back_inserter(compared));
    for (auto& one : certified) {
      Result& result = one.second;
      const auto known = std::ranges::find_if(answer_.points, [&](const DistinctPoint& point) {
        return same_point(result.v, point.result.v, ranges, compared, options_.minmax_distinct_tol);
      });
      if (known == answer_.points.end()) {
        answer_.points.push_back({std::move(result), one.first, 1});
        continue;
      }
      ++known->found;
      // The higher of two y at the same x is the worst case there.
      if (by_x && result.objective > known->result.objective) {
        known->result = std::move(result);
        known->first_start = one.first;
      }
    }
  }

  /// The best answer, certified if any is, is maximized over y. One that does not hold is no
  /// answer, and its higher y is one more start.
  void choose_over_y() {
    for (Index more_starts = all_.asked_;;) {
      const auto [best, start] = best_so_far();
      if (starts_ == 0 || best->worst_case.starts > 0 || !may_look_over_y(*best)) return;
      look_over_y(*best, start);
      const WorstCase worst = best->worst_case;
      const bool goes_on = worst.higher && !worst.unbounded && more_starts-- > 0;
      if (goes_on && budget_.used_up()) best->over_y.finished = false;
      Counts counts;
      audit(model_, options_, Witnesses(), budget_, *best, counts);
      if (!goes_on) continue;
      if (budget_.interrupted()) return;
      all_.run_start(all_.workers_.front(), ++all_.last_, worst.v, all_.one_cold_search());
      if (all_.exception_) std::rethrow_exception(all_.exception_);
      add_certified();
    }
  }

  /// The best certified point; where there is none the best other one, kept in the answer.
  std::pair<Result*, Index> best_so_far() {
    DistinctPoint* best = nullptr;
    for (DistinctPoint& point : answer_.points) {
      if (best == nullptr || better(point.result, best->result)) best = &point;
    }
    if (best != nullptr) return {&best->result, best->first_start};
    auto [start, other] = std::exchange(all_.outcomes_.best_uncertified, {-1, {}});
    if (start >= 0 && (answer_.best_start < 0 || better(other, answer_.best))) {
      answer_.best_start = start;
      answer_.best = std::move(other);
    }
    return {&answer_.best, answer_.best_start};
  }

  /// From the y of other points, too, without a certificate only where none has one.
  void look_over_y(Result& best, Index start) {
    Points others;
    for (const DistinctPoint& other : answer_.points) {
      if (&other.result != &best) others.push_back(other.result.v);
    }
    if (answer_.points.empty()) {
      for (const auto& [number, v] : all_.outcomes_.uncertified) others.push_back(v);
    }
    others.resize(std::min(others.size(), static_cast<std::size_t>(starts_ - 1)));
    Result work;
    try {
      look_for_worst_case(model_, starts_, others,
                          {options_, budget_, start, model_.structure(), work}, best);
    } catch (const std::bad_alloc&) {  // between two maximizations
      budget_.stop(Status::OutOfMemory);
      best.over_y.finished = false;
    }
    add_work(work, all_.outcomes_.work);
  }

  void choose_best() {
    for (const auto& [status, count] : all_.outcomes_.statuses) {
      answer_.statuses.emplace_back(status, count);
      answer_.starts += count;
    }
    const auto rank = [this](const DistinctPoint& point) {
      Rank own = rank_of(point.result);
      if (all_.maximization_ && std::get<0>(own) == 1) std::get<2>(own) *= -1.0;
      return std::tuple(own, point.first_start);
    };
    std::vector<DistinctPoint>& points = answer_.points;
    Result& best = answer_.best;
    std::set<Index> audited;
    do {
      std::ranges::sort(points, {}, rank);
      if (!points.empty()) {
        answer_.best_start = points.front().first_start;
        best = points.front().result;
      }
      audit_best();
      // One that is refuted makes room for the next.
      if (!points.empty() && best.over_y.better_known) points.front().result = best;
    } while (best.over_y.better_known && audited.insert(answer_.best_start).second &&
             audited.size() < points.size());
    const auto why = budget_.interrupted();
    if (why && (best.over_x.made < all_.asked_ || *why == Status::UserStop))
      answer_.interrupted = why;
    if (why && !all_.interrupted_by_.empty()) best.message = all_.interrupted_by_;
    set_work(all_.outcomes_.work, best);
  }

  /// With the y of all starts.
  void audit_best() {
    Result& best = answer_.best;
    best.over_x = {.asked = all_.asked_, .made = std::min(all_.asked_, all_.ended_)};
    const bool looks = may_look_over_y(best);
    if (looks && starts_ > 0 && best.worst_case.starts == 0) {  // the budget was used up
      best.over_y.asked = starts_;
      best.over_y.finished = false;
    }
    // The start that was to meet it was cut short.
    if (budget_.interrupted() && best.status == Status::WorstCaseNotMet)
      best.over_y.finished = false;
    audit(model_, options_, all_.witnesses_, budget_, best, all_.outcomes_.work.counts);
    if (looks && best.worst_case.higher && best.status != Status::WorstCaseNotMet)
      best.message += "\n" + describe_worst_case(best);
  }

  Starts& all_;
  Restarted model_{*all_.workers_.front().model, all_.model_start_};  // whose start is known
  const SolverOptions& options_ = all_.options_;
  Budget& budget_ = all_.budget_;
  const Index starts_ = starts_over_y_of_objective(options_);
  Answer answer_;
};

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
  return Choice(*this).make();
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
    run_start(worker, 0, {}, last_ > 0 ? without_restarts(options_) : options_);
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
  SolverOptions options = without_restarts(options_);
  options.warm_start_init_point = false;
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
    const bool among_others = workers_.size() > 1 || !is_first_rank_;
    record(start,
           refine({model, options, budget_, start, among_others, worker.structure, known_}, v));
    if (start == 0) model_start_ = model.model_start();
  } catch (...) {
    note_exception(start, std::current_exception());
  }
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
