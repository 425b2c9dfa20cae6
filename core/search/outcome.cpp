#include "core/search/outcome.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "core/model/norms.hpp"
#include "core/model/status_table.hpp"
#include "core/search/first_order_test.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

bool search_failed(Status status) { return row_of(status).group == StatusRow::Group::Failure; }

bool stopped_from_outside(Status status) {
  return status == Status::UserStop || status == Status::MaxCpuTime ||
         status == Status::MaxWallTime || status == Status::OutOfMemory;
}

bool is_final(Status status) {
  return status == Status::InvalidProblem || status == Status::InvalidOption ||
         status == Status::TooFewDegreesOfFreedom;
}

Result without_point(Status status, std::string message) {
  Result result;
  result.status = status;
  result.message = std::move(message);
  return result;
}

void set_seconds(const Stopwatch& stopwatch, Result& result) {
  result.seconds = result.timing.total = stopwatch.wall();
  result.cpu_seconds = stopwatch.cpu();
}

SearchOutcome better(SearchOutcome earlier, SearchOutcome later) {
  if (is_success(later.status) || later.status == Status::UserStop) return later;
  return is_success(earlier.status) || search_failed(later.status) ? std::move(earlier)
                                                                   : std::move(later);
}

namespace {

/// What is NaN or infinite in a result, empty: nothing.
std::string_view not_finite_part(const Result& result) {
  if (!all_finite(result.v)) return "a variable";
  if (!std::isfinite(result.objective)) return "the objective";
  if (!all_finite(result.constraints)) return "a constraint";
  if (!all_finite(result.lambda)) return "a multiplier of a constraint";
  if (!all_finite(result.z_lower) || !all_finite(result.z_upper)) return "a multiplier of a bound";
  const KktError& e = result.error;
  const std::array errors{e.primal, e.dual_min, e.dual_max, e.complementarity, e.total};
  if (!all_finite(errors)) return "an error";
  return {};
}

}  // namespace

PointKind kind_without_test(double primal, double tolerance) {
  if (std::isnan(primal)) return PointKind::Unknown;
  return primal <= tolerance ? PointKind::FeasiblePoint : PointKind::InfeasiblePoint;
}

void describe(CanonicalProblem& canonical, const SolverOptions& options, const Point& point,
              Result& result) {
  canonical.restore(point.iterate, result);
  result.error = point.error;
  const double violation = canonical.violation(result);
  result.error.primal =
      options.honor_original_bounds ? violation : largest(result.error.primal, violation);
  result.objective_scale = canonical.objective_scale();
  const bool stationary = result.certificate.kind == PointKind::FirstOrderPoint;
  if (result.certificate.second_order == SecondOrder::NotTested && !stationary) {
    result.certificate.kind = kind_without_test(result.error.primal, options.constr_viol_tol);
  }
}

void describe(CanonicalProblem& canonical, const SolverOptions& options,
              const SearchOutcome& outcome, Result& result) {
  result.status = outcome.status;
  result.message = outcome.message;
  result.certificate = outcome.certificate;
  result.mu = outcome.mu;
  result.iterations = outcome.iterations;
  describe(canonical, options, outcome.point, result);
  const std::string_view what = not_finite_part(result);
  if (is_success(result.status) && !what.empty()) {
    result.status = Status::InvalidNumber;
    result.message = std::string(what) + " is NaN or infinite at the last point";
    result.certificate = {};
    describe(canonical, options, outcome.point, result);
  }
}

void add_work(const Result& part, Result& total) {
  total.iterations += part.iterations;
  total.factorizations += part.factorizations;
  total.counts += part.counts;
  total.timing += part.timing;
  total.over_y.solves += part.over_y.solves;
  total.over_y.maximizations += part.over_y.maximizations;
}

void set_work(const Result& total, Result& answer) {
  answer.iterations = total.iterations;
  answer.factorizations = total.factorizations;
  answer.counts = total.counts;
  answer.timing = total.timing;
  answer.over_y.solves = total.over_y.solves;
  answer.over_y.maximizations = total.over_y.maximizations;
}

PointRank rank_of(const CanonicalProblem& canonical, const SolverOptions& options,
                  const Point& point) {
  const auto or_last = [](double value) { return std::isnan(value) ? kInfinity : value; };
  const bool minimization = canonical.max_size() == 0;
  constexpr double kOfTol = 1e-2;
  const bool is_met = minimization && is_within_tolerances(point.error, options) &&
                      point.error.dual_min <= kOfTol * options.dual_inf_tol;
  return {.is_unmet = !is_met,
          .violation = std::max(or_last(point.error.primal), options.constr_viol_tol),
          .value = or_last(minimization ? point.evaluation.f : point.error.total),
          .error = or_last(point.error.total)};
}

void BestPoint::see(const PointRank& its_rank, const Point& its_point, double its_mu,
                    Index its_iteration) {
  if (any && !(its_rank < rank)) return;
  any = true;
  rank = its_rank;
  point = its_point;
  mu = its_mu;
  iteration = its_iteration;
}

}  // namespace ipminmax
