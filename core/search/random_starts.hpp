#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "core/model/forwarding_problem.hpp"
#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// A model with another starting point.
class Restarted final : public ForwardingProblem {
 public:
  /// start: n values; empty: the model's, which is then kept in model_start().
  Restarted(Problem& model, std::vector<double> start)
      : ForwardingProblem(model), start_(std::move(start)) {}

  [[nodiscard]] const std::vector<double>& model_start() const { return model_start_; }

  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    if (!start_.empty()) {
      std::ranges::copy(start_, start.v.begin());
      return true;
    }
    if (!model().starting_point(start)) return false;
    model_start_.assign(start.v.begin(), start.v.end());
    return true;
  }

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

}  // namespace ipminmax
