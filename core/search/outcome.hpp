#pragma once

#include <compare>
#include <optional>
#include <string>
#include <vector>

#include "core/method/step_method.hpp"
#include "core/model/budget.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/options.hpp"
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

/// No other starting point can change such an end.
[[nodiscard]] bool is_final(Status status);

/// A result without a point.
[[nodiscard]] Result without_point(Status status, std::string message);

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

/// Adds iterations, factorizations, counts and times of a part to those of the whole.
void add_work(const Result& part, Result& total);
/// Writes the same of a whole into its answer.
void set_work(const Result& total, Result& answer);

/// How good a point is for one who has to make do with it. Less is better.
struct PointRank {
  /// Of a minimization: not within the tolerances, with a gradient of the Lagrangian far below
  /// dual_inf_tol in the model's units.
  bool is_unmet = true;
  double violation = 0.0;  ///< of the model's constraints, at least constr_viol_tol
  double value = 0.0;      ///< of a minimization the objective, else the first-order error
  double error = 0.0;      ///< of first order

  auto operator<=>(const PointRank&) const = default;
};

/// Of a measured point. What is NaN ranks last.
[[nodiscard]] PointRank rank_of(const CanonicalProblem& canonical, const SolverOptions& options,
                                const Point& point);

/// The best point that the searches of a solve have seen, for the case that they fail.
struct BestPoint {
  bool any = false;  ///< have seen one; else the point is room for it
  PointRank rank;
  Point point;
  double mu = 0.0;
  Index iteration = 0;

  /// Takes the point where it is the best so far.
  void see(const PointRank& its_rank, const Point& its_point, double its_mu, Index its_iteration);
};

/// Room for the arrays of a Result, kept from one to the next.
struct ResultArrays {
  std::vector<double> v, lambda, z_lower, z_upper, constraints;
  std::string message;

  /// The room of a result that is not needed any more.
  void take_from(Result& result) {
    exchange(result);
    result = {};
  }
  /// To a result without arrays, whose arrays then hold values of no meaning.
  void give_to(Result& result) {
    exchange(result);
    result.message.clear();
  }

 private:
  void exchange(Result& result) {
    v.swap(result.v);
    lambda.swap(result.lambda);
    z_lower.swap(result.z_lower);
    z_upper.swap(result.z_upper);
    constraints.swap(result.constraints);
    message.swap(result.message);
  }
};

}  // namespace ipminmax
