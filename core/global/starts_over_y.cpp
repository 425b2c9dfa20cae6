#include <algorithm>
#include <new>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/global/over_y.hpp"
#include "core/global/starts.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/worst_case.hpp"

// Other y of the points that the starts found.
namespace ipminmax {
namespace {

/// f is that of an inner maximum, as far as the search tells.
bool has_value(Status status) { return is_success(status) || status == Status::NoLocalMinmaxFound; }

}  // namespace

/// Over f, at a point; where f is treated as a robust constraint that was done already, and with a
/// negative factor of the objective the inner player minimizes.
bool Starts::may_look_over_y(const Result& result) const {
  return !maximization_ && !(result.objective_scale < 0.0) && !result.v.empty() &&
         all_finite(result.v) && result.over_y.branches == 0 && !options_.minmax_epigraph &&
         has_max_variables(workers_.front().model->structure());
}

/// Of certified points only the smallest value can be the answer: it is maximized over y. One that
/// does not hold is no answer, and its higher y is one more start.
void Starts::check_worst_cases(Answer& answer) {
  if (starts_over_y_of_objective(options_) == 0) return;
  std::vector<DistinctPoint>& points = answer.points;
  Index more_starts = asked_;
  for (;;) {
    DistinctPoint* next = nullptr;
    for (DistinctPoint& point : points) {
      if (next == nullptr || better(point.result, next->result)) next = &point;
    }
    if (next == nullptr || next->result.certificate.kind != PointKind::LocalMinmax ||
        next->result.worst_case.starts > 0 || !may_look_over_y(next->result)) {
      return;
    }
    std::vector<std::vector<double>> given;  // the y of the other points
    for (const DistinctPoint& other : points) {
      if (static_cast<Index>(given.size()) >= options_.minmax_worst_case_starts) break;
      if (&other != next) given.push_back(other.result.v);
    }
    check_worst_case(next->result, next->first_start, given);
    const WorstCase worst = next->result.worst_case;
    const bool goes_on = worst.higher && !worst.unbounded && more_starts-- > 0;
    if (goes_on && budget_.used_up()) next->result.over_y.finished = false;
    settle(budget_.interrupted(), next->result);
    if (!goes_on) continue;
    if (budget_.interrupted()) return;
    run_start(workers_.front(), ++last_, worst.v, one_cold_search());
    if (exception_) std::rethrow_exception(exception_);
    add_certified(points);
  }
}

void Starts::check_worst_case(Result& result, Index start,
                              const std::vector<std::vector<double>>& given) {
  Problem& model = *workers_.front().model;
  Result work;
  try {
    look_for_worst_case(model, starts_over_y_of_objective(options_), given,
                        {options_, budget_, start, model.structure(), work, work.over_y}, result);
  } catch (const std::bad_alloc&) {  // between two maximizations
    budget_.stop(Status::OutOfMemory);
    result.over_y.finished = false;
  }
  outcomes_.add_work(work);
}

/// The best of the answers without a certificate, maximized over y, too; a higher y is one more
/// start, of which a certified point may come.
void Starts::choose_uncertified(Answer& answer) {
  std::tie(answer.best_start, answer.best) = outcomes_.take_best_uncertified();
  if (starts_over_y_of_objective(options_) == 0) return;
  for (Index more_starts = asked_;; --more_starts) {
    Result& best = answer.best;
    if (!has_value(best.status) || !may_look_over_y(best)) return;
    std::vector<std::vector<double>> given;
    for (const auto& [start, point] : outcomes_.uncertified()) {
      if (static_cast<Index>(given.size()) + 1 >= options_.minmax_worst_case_starts) break;
      given.push_back(point.v);
    }
    check_worst_case(best, answer.best_start, given);
    const WorstCase worst = best.worst_case;
    if (!worst.higher || worst.unbounded || more_starts == 0) return;
    if (budget_.used_up()) {
      best.over_y.finished = false;
      return;
    }
    settle(std::nullopt, best);
    run_start(workers_.front(), ++last_, worst.v, one_cold_search());
    if (exception_) std::rethrow_exception(exception_);
    add_certified(answer.points);
    if (!answer.points.empty()) return check_worst_cases(answer);
    auto [start, other] = outcomes_.take_best_uncertified();
    if (start < 0 || !better(other, best)) return;
    answer.best_start = start;
    best = std::move(other);
  }
}

/// The best point may stand over a weak branch of y, which the y of other starts may show.
void Starts::look_for_worse(Answer& answer) {
  Result& best = answer.best;
  if (!has_value(best.status) || !may_look_over_y(best)) return;
  if (starts_over_y_of_objective(options_) == 0) {
    compare_with_others(answer, best);
  } else if (best.worst_case.starts == 0) {  // the budget was used up
    best.over_y.asked = starts_over_y_of_objective(options_);
    best.over_y.finished = false;
  }
  if (best.worst_case.higher && best.status != Status::WorstCaseNotMet) {
    best.message += "; " + describe_worst_case(best);
  } else if (best.status == Status::NoLocalMinmaxFound && !with_branches()) {
    best.message += "; minmax_epigraph_at_kinks yes goes on over the branches of y";
  }
}

/// At the cost of an evaluation each.
void Starts::compare_with_others(const Answer& answer, Result& best) {
  if (budget_.interrupted()) return;
  OtherAnswers others{.points = {},
                      .objectives = {},
                      .tol = options_.tol,
                      .constr_viol_tol = options_.constr_viol_tol};
  for (const DistinctPoint& point : answer.points) {
    others.add(point.result.v, point.result.objective);
  }
  for (const auto& [start, point] : outcomes_.uncertified()) others.add(point.v, point.objective);
  if (others.points.size() < 2) return;  // its own
  Result work;
  try {
    compare_with(others, *workers_.front().model, best, work.counts);
  } catch (const std::bad_alloc&) {
    budget_.stop(Status::OutOfMemory);
  }
  outcomes_.add_work(work);
}

}  // namespace ipminmax
