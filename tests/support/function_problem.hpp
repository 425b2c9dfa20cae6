#pragma once

#include <functional>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/problem.hpp"

namespace ipminmax::testing {

inline constexpr double kInf = std::numeric_limits<double>::infinity();

/// Unconstrained (or bounded) problem from callables with a dense Hessian.
class FunctionProblem : public Problem {
 public:
  using Vector = Eigen::VectorXd;
  using Matrix = Eigen::MatrixXd;

  FunctionProblem(std::vector<Player> players, Vector start, std::function<double(const Vector&)> f,
                  std::function<Vector(const Vector&)> gradient,
                  std::function<Matrix(const Vector&)> hessian)
      : start_(std::move(start)),
        f_(std::move(f)),
        gradient_(std::move(gradient)),
        hessian_(std::move(hessian)) {
    const auto n = static_cast<Index>(players.size());
    structure_.variable_players = std::move(players);
    structure_.variable_lower.assign(static_cast<std::size_t>(n), -kInf);
    structure_.variable_upper.assign(static_cast<std::size_t>(n), kInf);
    for (Index i = 0; i < n; ++i) {
      for (Index j = 0; j <= i; ++j) structure_.hessian.push_back({i, j});
    }
  }

  /// f = v'Hv/2 + g'v.
  static FunctionProblem quadratic(std::vector<Player> players, Matrix h, Vector g, Vector start) {
    return FunctionProblem(
        std::move(players), std::move(start),
        [h, g](const Vector& v) { return 0.5 * v.dot(h * v) + g.dot(v); },
        [h, g](const Vector& v) { return Vector(h * v + g); }, [h](const Vector&) { return h; });
  }

  ProblemStructure& mutable_structure() { return structure_; }
  Vector& start() { return start_; }

  const ProblemStructure& structure() const override { return structure_; }
  bool starting_point(StartingPoint& start) override {
    std::copy(start_.begin(), start_.end(), start.v.begin());
    return true;
  }
  bool objective(std::span<const double> v, bool, double& f) override {
    f = f_(vector(v));
    return true;
  }
  bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    const Vector g = gradient_(vector(v));
    std::copy(g.begin(), g.end(), grad.begin());
    return true;
  }
  bool constraints(std::span<const double>, bool, std::span<double>) override { return true; }
  bool jacobian(std::span<const double>, bool, std::span<double>) override { return true; }
  bool hessian(std::span<const double> v, bool, double sigma, std::span<const double>, bool,
               std::span<double> values) override {
    const Matrix h = hessian_(vector(v));
    for (std::size_t k = 0; k < structure_.hessian.size(); ++k) {
      values[k] = sigma * h(structure_.hessian[k].row, structure_.hessian[k].col);
    }
    return true;
  }

 private:
  static Vector vector(std::span<const double> v) {
    return Eigen::Map<const Vector>(v.data(), static_cast<Eigen::Index>(v.size()));
  }

  ProblemStructure structure_;
  Vector start_;
  std::function<double(const Vector&)> f_;
  std::function<Vector(const Vector&)> gradient_;
  std::function<Matrix(const Vector&)> hessian_;
};

}  // namespace ipminmax::testing
