#include <algorithm>
#include <new>
#include <utility>
#include <vector>

#include "core/global/over_y.hpp"
#include "core/global/starts.hpp"
#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/worst_case.hpp"

// Other y of the points that the starts found.
namespace ipminmax {
/// f is that of an inner maximum, as far as the search tells.
bool Starts::has_value(Status status) {
  return is_success(status) || status == Status::NoLocalMinmaxFound;
}

/// Over f, at a point; where f is treated as a robust constraint that was done already, and with a
/// negative factor of the objective the inner player minimizes.
bool Starts::may_look_over_y(const Result& result) const {
  return !maximization_ && !(result.objective_scale < 0.0) && !result.v.empty() &&
         all_finite(result.v) && result.over_y.branches == 0 && !options_.minmax_epigraph &&
         has_max_variables(workers_.front().model->structure());
}

/// The best answer, certified if any is, is maximized over y. One that does not hold is no answer,
/// and its higher y is one more start.
void Starts::choose_over_y(Answer& answer) {
  const Index starts = starts_over_y_of_objective(options_);
  for (Index more_starts = asked_;;) {
    const auto [best, start] = best_so_far(answer);
    if (starts == 0 || best->worst_case.starts > 0 || !has_value(best->status) ||
        !may_look_over_y(*best)) {
      return;
    }
    check_worst_case(*best, start, others_than(*best, answer.points, starts - 1));
    const WorstCase worst = best->worst_case;
    const bool goes_on = worst.higher && !worst.unbounded && more_starts-- > 0;
    if (goes_on && budget_.used_up()) best->over_y.finished = false;
    Result work;
    audit(*workers_.front().model, options_, Witnesses(), budget_, *best, work.counts);
    if (!goes_on) continue;
    if (budget_.interrupted()) return;
    run_start(workers_.front(), ++last_, worst.v, one_cold_search());
    if (exception_) std::rethrow_exception(exception_);
    add_certified(answer.points);
  }
}

/// The best certified point; where there is none the best other one, kept in the answer.
std::pair<Result*, Index> Starts::best_so_far(Answer& answer) {
  DistinctPoint* best = nullptr;
  for (DistinctPoint& point : answer.points) {
    if (best == nullptr || better(point.result, best->result)) best = &point;
  }
  if (best != nullptr) return {&best->result, best->first_start};
  auto [start, other] = outcomes_.take_best_uncertified();
  if (start >= 0 && (answer.best_start < 0 || better(other, answer.best))) {
    answer.best_start = start;
    answer.best = std::move(other);
  }
  return {&answer.best, answer.best_start};
}

/// The y of other points, without a certificate only where none has one.
std::vector<std::vector<double>> Starts::others_than(const Result& best,
                                                     const std::vector<DistinctPoint>& points,
                                                     Index most) const {
  std::vector<std::vector<double>> others;
  for (const DistinctPoint& other : points) {
    if (&other.result != &best) others.push_back(other.result.v);
  }
  if (points.empty()) {
    for (const auto& [start, other] : outcomes_.uncertified()) others.push_back(other.v);
  }
  others.resize(std::min(others.size(), static_cast<std::size_t>(most)));
  return others;
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

}  // namespace ipminmax
