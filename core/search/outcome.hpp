#pragma once

#include <optional>
#include <string>

#include "core/method/step_method.hpp"
#include "core/model/timer.hpp"
#include "core/point/point.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// All that a search leaves.
struct SearchOutcome {
  Status status = Status::InternalError;
  std::string message;  ///< empty: the status says all
  Point point;
  double mu = 0.0;
  Certificate certificate;              ///< of the point, where it was tested
  Index iterations = 0;                 ///< of the solve so far
  std::optional<Index> of_iteration{};  ///< the point's, where it is not the last one but the best
};

/// What is known of a point that was not tested, from its violation of constraints and bounds.
[[nodiscard]] PointKind kind_without_test(double primal, double tolerance);

/// Whether a search that ended so may do better from another starting point.
[[nodiscard]] bool search_failed(Status status);

/// By its user, a time limit or a lack of memory: nothing else is tried after it.
[[nodiscard]] bool stopped_from_outside(Status status);

/// Of the stopwatch.
void set_seconds(const Stopwatch& stopwatch, Result& result);

/// What a solve reports of two outcomes: a solution, where both are none the first failure, unless
/// the later search was stopped and did not fail.
[[nodiscard]] SearchOutcome better(SearchOutcome earlier, SearchOutcome later);

/// Objective, constraints, multipliers and errors of a point in the model's units, and what the
/// certificate, which stays, says of its kind.
void describe(CanonicalProblem& canonical, const SolverOptions& options, const Point& point,
              Result& result);

/// What the outcome of a search is to the caller. A success is finite.
void describe(CanonicalProblem& canonical, const SolverOptions& options,
              const SearchOutcome& outcome, Result& result);

}  // namespace ipminmax
