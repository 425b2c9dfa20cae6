#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/model/norms.hpp"
#include "core/model/structure_check.hpp"
#include "core/search/multistart_run.hpp"
#include "core/search/other_answers.hpp"
#include "core/worst_case.hpp"

// What a multistart does about worst cases over y of the points that its starts found.
namespace ipminmax {

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
  observer.on_result = [&](Index, const Result& made) { outcomes_.add_work(made); };
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
  add_certified(answer.points);
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
    for (const DistinctPoint& point : answer.points) {
      others.add(point.result.v, point.result.objective);
    }
    for (const auto& [start, point] : outcomes_.uncertified()) {
      others.add(point.v, point.objective);
    }
    Counts counts;
    compare_with(others, *workers_.front().model, best, counts);
    outcomes_.add_work(counts);
  } else if (answer.points.empty()) {
    std::vector<std::vector<double>> given;
    for (const auto& [start, point] : outcomes_.uncertified()) {
      if (static_cast<Index>(given.size()) + 1 >= options_.minmax_worst_case_starts) break;
      given.push_back(point.v);
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

}  // namespace ipminmax
