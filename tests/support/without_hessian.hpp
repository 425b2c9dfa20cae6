#pragma once

#include <cmath>
#include <span>

#include <support/forwarding_problem.hpp>

namespace ipminmax::testing {

/// A problem's functions and first derivatives alone; counts their calls. The structure of the
/// Hessian may be kept, its values are never given.
class WithoutHessian : public CountingProblem {
 public:
  explicit WithoutHessian(Problem& problem, bool keep_structure = false)
      : CountingProblem(problem), structure_(problem.structure()) {
    if (keep_structure) return;
    structure_.has_hessian = false;
    structure_.hessian.clear();
  }

  ProblemStructure& mutable_structure() { return structure_; }

  Index starting_points = 0;

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    ++starting_points;
    return ForwardingProblem::starting_point(start);
  }
  [[nodiscard]] bool hessian(std::span<const double>, bool, double, std::span<const double>, bool,
                             std::span<double> values) override {
    for (double& value : values) value = std::nan("");
    return true;
  }

 private:
  ProblemStructure structure_;
};

}  // namespace ipminmax::testing
