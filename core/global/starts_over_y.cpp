#include <algorithm>
#include <iterator>
#include <new>
#include <tuple>
#include <utility>
#include <vector>

#include "core/global/over_y.hpp"
#include "core/global/refinement.hpp"
#include "core/global/starts.hpp"
#include "core/model/compare.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/robust/robust_scope.hpp"
#include "core/worst_case.hpp"

// The answer of all starts: the best one, with other y of it looked at.
namespace ipminmax {

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
  [[nodiscard]] bool may_look_over_y(const Result& result) const {
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
  [[nodiscard]] std::pair<Result*, Index> best_so_far() {
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

Answer Starts::choose() { return Choice(*this).make(); }

}  // namespace ipminmax
