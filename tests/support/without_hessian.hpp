#pragma once

#include <cmath>
#include <span>
#include <utility>

#include <ipminmax/core/problem.hpp>

namespace ipminmax::testing {

/// A problem's functions and first derivatives alone; counts their calls. The structure of the
/// Hessian may be kept, its values are never given.
class WithoutHessian final : public Problem {
 public:
  explicit WithoutHessian(Problem& problem, bool keep_structure = false)
      : problem_(problem), structure_(problem.structure()) {
    if (keep_structure) return;
    structure_.has_hessian = false;
    structure_.hessian.clear();
  }

  ProblemStructure& mutable_structure() { return structure_; }

  Index gradients = 0, jacobians = 0, starting_points = 0;

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    ++starting_points;
    return problem_.starting_point(start);
  }
  [[nodiscard]] bool user_scaling(UserScaling& scaling) override {
    return problem_.user_scaling(scaling);
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool new_v, double& f) override {
    return problem_.objective(v, new_v, f);
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool new_v,
                              std::span<double> grad) override {
    ++gradients;
    return problem_.gradient(v, new_v, grad);
  }
  [[nodiscard]] bool constraints(std::span<const double> v, bool new_v,
                                 std::span<double> g) override {
    return problem_.constraints(v, new_v, g);
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool new_v,
                              std::span<double> values) override {
    ++jacobians;
    return problem_.jacobian(v, new_v, values);
  }
  [[nodiscard]] bool hessian(std::span<const double>, bool, double, std::span<const double>, bool,
                             std::span<double> values) override {
    for (double& value : values) value = std::nan("");
    return true;
  }

 private:
  Problem& problem_;
  ProblemStructure structure_;
};

}  // namespace ipminmax::testing
