#pragma once

#include <span>
#include <utility>
#include <vector>

#include "core/problem.hpp"

namespace ipminmax::testing {

/// constant + linear'v + v'Qv/2. Q's entries are given once per pair, on either side of the
/// diagonal; entries of the same place add.
struct QuadraticFunction {
  double constant = 0.0;
  std::vector<std::pair<Index, double>> linear{};
  std::vector<Triplet> places{};
  std::vector<double> values{};

  void add_linear(Index i, double value) { linear.emplace_back(i, value); }
  void add(Index i, Index j, double value) {
    places.push_back({i, j});
    values.push_back(value);
  }
  [[nodiscard]] double operator()(std::span<const double> v) const;
  /// gradient += weight * the gradient at v
  void add_gradient(std::span<const double> v, double weight, std::span<double> gradient) const;
};

/// Quadratic objective and constraints of any sparsity; each evaluation costs one pass over the
/// entries.
class QuadraticProblem final : public Problem {
 public:
  /// n_min Min variables followed by n_max Max variables, all free.
  QuadraticProblem(Index n_min, Index n_max);

  QuadraticFunction& f() { return objective_; }
  void set_bounds(Index i, double lower, double upper);
  void set_start(std::vector<double> v) { start_ = std::move(v); }
  void add_constraint(QuadraticFunction g, double lower, double upper);
  /// To be called once after the last change.
  void finish();

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override;
  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override;
  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override;
  [[nodiscard]] bool constraints(std::span<const double> v, bool, std::span<double> g) override;
  [[nodiscard]] bool jacobian(std::span<const double> v, bool, std::span<double> values) override;
  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override;

 private:
  ProblemStructure structure_;
  QuadraticFunction objective_;
  std::vector<QuadraticFunction> constraints_;
  std::vector<double> start_;
};

}  // namespace ipminmax::testing
