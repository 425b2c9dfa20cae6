#include "core/reduction/solve_reduced.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/model/norms.hpp"
#include "core/search/one_start.hpp"
#include "core/search/outcome.hpp"

namespace ipminmax {
namespace {

/// Solves, each with worst cases that the one before met.
constexpr Index kMostRounds = 40;
/// Steps in a row shorter than this share of the Newton step after which other maxima are looked
/// for.
constexpr double kShort = 0.1;
constexpr int kShortSteps = 3;

/// Adds the other maxima that the rows have met at the x accepted last. Whether there were any.
bool add_branches(Reduction& reduction, ReducedRows& rows, double distinct_tol) {
  bool any = false;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    RowMaximum* maximum = rows.maximum(k);
    if (maximum == nullptr) continue;
    std::vector<double> other = maximum->other_branch(distinct_tol);
    if (other.empty()) continue;
    const bool known = std::ranges::any_of(reduction.worst_cases, [&](const auto& one) {
      return one.constraint == maximum->constraint() && same_point(one.v, other, distinct_tol);
    });
    if (known) continue;
    reduction.worst_cases.push_back(
        {maximum->constraint(), std::move(other), true, false, maximum->side() > 0.0 ? 1 : -1});
    any = true;
  }
  return any;
}

void keep_maxima(Reduction& reduction, ReducedRows& rows) {
  for (std::size_t k = 0; k < rows.size(); ++k) {
    if (RowMaximum* maximum = rows.maximum(k)) reduction.worst_cases[k].v = maximum->point().v;
  }
}

/// A certificate holds for x where each worst case on which it rests is a strict local maximum with
/// a y that moves smoothly with x.
void test_worst_cases(ReducedRows& rows, Result& result) {
  if (result.certificate.kind != PointKind::LocalMinmax) return;
  for (std::size_t k = 0; k < rows.size(); ++k) {
    RowMaximum* maximum = rows.maximum(k);
    if (maximum == nullptr || maximum->is_held() || !rows.is_active(result, k)) continue;
    const Result settled = maximum->settle();
    const bool strict = settled.certificate.kind == PointKind::LocalMinmax &&
                        settled.certificate.weakly_active_max == 0 &&
                        same_point(settled.v, maximum->point().v, 1e-4);
    if (strict) continue;
    Certificate& found = result.certificate;
    found.kind = PointKind::FirstOrderPoint;
    found.second_order = SecondOrder::Undecided;
    found.margin = found.least_curvature = 0.0;
    found.reasons.push_back(
        {.kind = CertificateReason::Kind::RobustRow,
         .player = Player::Max,
         .text = "the worst case of a robust constraint is not certified as a strict local maximum",
         .variables = {},
         .constraints = {maximum->constraint()}});
    if (result.status == Status::Solved) {
      result.status = Status::SolvedDegenerate;
      result.message = std::string(name_of(result.status));
    }
    return;
  }
}

}  // namespace

ReducedSolve solve_reduced(Reduction& reduction, const SolverOptions& options,
                           const SolveObserver& observer) {
  ReducedSolve answer;
  Counts counts;
  Index iterations = 0, factorizations = 0;
  bool watches = true;
  for (Index round = 0; round < kMostRounds; ++round) {
    answer.rows = std::make_unique<ReducedRows>(reduction.model, reduction.worst_cases,
                                                reduction.reads_y, options, reduction.budget);
    ReducedRows& rows = *answer.rows;
    reduction.rows = &rows;
    if (!reduction.start.empty()) rows.start_at(reduction.start);
    int short_steps = 0;
    bool met = false;
    SolveObserver own = observer;
    own.on_iteration = [&](const IterationInfo& info) {
      if (observer.on_iteration && !observer.on_iteration(info)) return false;
      const bool is_short = info.iteration > 0 && info.alpha_primal < kShort;
      short_steps = is_short ? short_steps + 1 : 0;
      if (!watches || short_steps < kShortSteps) return true;
      short_steps = 0;
      met = add_branches(reduction, rows, options.minmax_distinct_tol);
      return !met;
    };
    answer.result = solve_from_start(rows, options, reduction.budget, own, nullptr);
    ++answer.solves;
    for (std::size_t k = 0; k < rows.size(); ++k) {
      if (rows.maximum(k) != nullptr) answer.maximizations += rows.maximum(k)->solves();
    }
    iterations += answer.result.iterations;
    factorizations += answer.result.factorizations;
    counts += answer.result.counts;
    const Status status = answer.result.status;
    if (!met && !is_success(status) && !stopped_from_outside(status)) {
      met = add_branches(reduction, rows, options.minmax_distinct_tol);
    }
    keep_maxima(reduction, rows);
    const bool has_point = !answer.result.v.empty() && all_finite(answer.result.v);
    if (!met || !has_point) break;
    reduction.start = answer.result.v;
  }
  answer.result.iterations = iterations;
  answer.result.factorizations = factorizations;
  answer.result.counts = counts;
  test_worst_cases(*answer.rows, answer.result);
  if (!is_success(answer.result.status) && !answer.rows->failure().empty()) {
    answer.result.message +=
        "; a worst case could not be followed (" + answer.rows->failure() + ")";
  }
  return answer;
}

}  // namespace ipminmax
