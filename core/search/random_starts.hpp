#pragma once

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "core/model/canonical_problem.hpp"
#include "core/model/forwarding_problem.hpp"
#include "core/model/iterate.hpp"
#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"

namespace ipminmax {

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

/// Adds iterations, factorizations, counts and times of a part to those of the whole.
void add_work(const Result& part, Result& total);
/// Writes the same of a whole into its answer.
void set_work(const Result& total, Result& answer);

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
