#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/method/step_method.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/model/forwarding_problem.hpp"
#include "core/model/iterate.hpp"
#include "core/options.hpp"
#include "core/point/point.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// Evaluates and measures a starting point, of which v without slacks is given and for a warm start
/// the multipliers: slacks, multipliers, functions and derivatives. False: impossible, as
/// CanonicalProblem::evaluation_error says.
[[nodiscard]] bool evaluate_start(const MethodContext& context, const SolverOptions& options,
                                  Point& point);

/// Where and how a search begins.
struct Start {
  Point point;
  StepKind how = StepKind::None;
  /// By Algorithm 1, which then has failed at this iteration; empty: by the method of the options.
  std::optional<Index> algorithm_one_until{};
};

/// The starting points of a solve after the model's own: random ones, every other one in a box for
/// Algorithm 1.
class OtherStarts : MethodContext {
 public:
  explicit OtherStarts(const MethodContext& context) : MethodContext(context) {}

  /// The next one at which the model is defined. Shifts of earlier searches and raised accuracy of
  /// factorizations are forgotten. Empty: there is none.
  [[nodiscard]] std::optional<Start> next();
  /// Random points drawn.
  [[nodiscard]] Index drawn() const { return drawn_; }
  /// "failed from 3 other starting points, too (why no more)": Pyomo takes a line of the log that
  /// begins with a number for an iteration.
  [[nodiscard]] std::string describe() const;

 private:
  Index drawn_ = 0;
  Index first_iteration_ = 0;  ///< at the end of the search from the model's point
  Index most_iterations_ = 0;  ///< after it, until when searches begin
};

/// A model with another starting point.
class Restarted final : public SameRows {
 public:
  /// start: n values; empty: the model's, which is then kept in model_start().
  Restarted(Problem& model, std::vector<double> start)
      : SameRows(model), start_(std::move(start)) {}

  [[nodiscard]] const std::vector<double>& model_start() const { return model_start_; }

  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    const bool known = start_.empty() && !start.needs_multipliers;
    if (const std::vector<double>& from = known ? model_start_ : start_; !from.empty()) {
      std::ranges::copy(from, start.v.begin());
      return true;
    }
    if (!model().starting_point(start)) return false;
    model_start_.assign(start.v.begin(), start.v.end());
    return true;
  }
  [[nodiscard]] std::unique_ptr<Problem> clone() const override { return cloned(*this); }

 private:
  std::vector<double> start_;
  std::vector<double> model_start_;
};

/// The variables of the model's starting point; empty: it gives none that is finite.
[[nodiscard]] std::vector<double> starting_values(Problem& model);

/// Random starting point number `start`: each has a generator of its own, so that it does not
/// depend on which thread draws it.
[[nodiscard]] std::vector<double> random_start(const ProblemStructure& structure,
                                               const std::vector<double>& center, Index start,
                                               const SolverOptions& options);

/// Whether a search with Max variables that fails is begun anew elsewhere.
[[nodiscard]] bool makes_new_starts(const SolverOptions& options);

/// The number-th other starting point (from 1) of a search that failed from the model's: uniform in
/// the box of the bounds; where a bound is missing or far away, within a reach around the model's
/// point (odd numbers) or around zero (even ones), which changes from pair to pair: starts that ran
/// to infinity are worth another look nearer by. The same for every run. Slacks and multipliers are
/// zero.
[[nodiscard]] Iterate restart_point(const CanonicalProblem& canonical, const Iterate& start,
                                    Index number);

/// Whether every variable of x and y has two bounds.
[[nodiscard]] bool is_box(const CanonicalProblem& canonical);

}  // namespace ipminmax
