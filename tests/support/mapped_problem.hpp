#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <support/forwarding_problem.hpp>

namespace ipminmax::testing {

/// Another problem with v = A u for its variables. Bounds of v that u shares are kept: columns of A
/// that are unit vectors, alone in their row.
class MappedProblem final : public ForwardingProblem {
 public:
  MappedProblem(Problem& problem, Eigen::MatrixXd map, std::vector<Player> players,
                std::vector<double> start)
      : ForwardingProblem(problem),
        inner_(problem.structure()),
        structure_(inner_),
        map_(std::move(map)),
        start_(std::move(start)) {
    const auto n = static_cast<std::size_t>(map_.cols());
    structure_.variable_players = std::move(players);
    structure_.variable_names.clear();
    structure_.variable_lower.assign(n, -1e20);
    structure_.variable_upper.assign(n, 1e20);
    for (Eigen::Index i = 0; i < map_.rows(); ++i) {
      if ((map_.row(i).array() != 0.0).count() != 1) continue;
      Eigen::Index k = 0;
      if (map_.row(i).maxCoeff(&k) != 1.0) continue;
      structure_.variable_lower[static_cast<std::size_t>(k)] = inner_.variable_lower[at(i)];
      structure_.variable_upper[static_cast<std::size_t>(k)] = inner_.variable_upper[at(i)];
    }
    hessian_ = Eigen::MatrixXd::Zero(map_.rows(), map_.rows());
    jacobian_ = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(inner_.constraint_lower.size()),
                                      map_.rows());
    for (const auto& [row, col] : inner_.hessian) hessian_(row, col) = hessian_(col, row) = 1.0;
    for (const auto& [row, col] : inner_.jacobian) jacobian_(row, col) = 1.0;
    structure_.hessian.clear();
    structure_.jacobian.clear();
    const Eigen::MatrixXd size = map_.cwiseAbs();
    const Eigen::MatrixXd h = size.transpose() * hessian_ * size, j = jacobian_ * size;
    for (Index row = 0; row < map_.cols(); ++row) {
      for (Index col = 0; col <= row; ++col) {
        if (h(row, col) != 0.0) structure_.hessian.push_back({row, col});
      }
    }
    for (Index row = 0; row < jacobian_.rows(); ++row) {
      for (Index col = 0; col < map_.cols(); ++col) {
        if (j(row, col) != 0.0) structure_.jacobian.push_back({row, col});
      }
    }
  }

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    std::ranges::copy(start_, start.v.begin());
    return !start.needs_multipliers;
  }
  [[nodiscard]] bool objective(std::span<const double> u, bool new_v, double& f) override {
    return ForwardingProblem::objective(of(u), new_v, f);
  }
  [[nodiscard]] bool gradient(std::span<const double> u, bool new_v,
                              std::span<double> grad) override {
    values_.resize(at(map_.rows()));
    if (!ForwardingProblem::gradient(of(u), new_v, values_)) return false;
    Eigen::Map<Eigen::VectorXd>(grad.data(), map_.cols()) = map_.transpose() * vector(values_);
    return true;
  }
  [[nodiscard]] bool constraints(std::span<const double> u, bool new_v,
                                 std::span<double> g) override {
    return ForwardingProblem::constraints(of(u), new_v, g);
  }
  [[nodiscard]] bool jacobian(std::span<const double> u, bool new_v,
                              std::span<double> values) override {
    values_.resize(inner_.jacobian.size());
    if (!ForwardingProblem::jacobian(of(u), new_v, values_)) return false;
    jacobian_.setZero();
    for (std::size_t k = 0; k < values_.size(); ++k)
      jacobian_(inner_.jacobian[k].row, inner_.jacobian[k].col) += values_[k];
    const Eigen::MatrixXd mapped = jacobian_ * map_;
    for (std::size_t k = 0; k < values.size(); ++k)
      values[k] = mapped(structure_.jacobian[k].row, structure_.jacobian[k].col);
    return true;
  }
  [[nodiscard]] bool hessian(std::span<const double> u, bool new_v, double sigma,
                             std::span<const double> lambda, bool new_lambda,
                             std::span<double> values) override {
    values_.resize(inner_.hessian.size());
    if (!ForwardingProblem::hessian(of(u), new_v, sigma, lambda, new_lambda, values_)) return false;
    hessian_.setZero();
    for (std::size_t k = 0; k < values_.size(); ++k) {
      const auto [row, col] = inner_.hessian[k];
      hessian_(row, col) += values_[k];
      if (row != col) hessian_(col, row) += values_[k];
    }
    const Eigen::MatrixXd mapped = map_.transpose() * hessian_ * map_;
    for (std::size_t k = 0; k < values.size(); ++k)
      values[k] = mapped(structure_.hessian[k].row, structure_.hessian[k].col);
    return true;
  }

 private:
  [[nodiscard]] static std::size_t at(Eigen::Index i) { return static_cast<std::size_t>(i); }
  [[nodiscard]] static Eigen::Map<const Eigen::VectorXd> vector(std::span<const double> v) {
    return {v.data(), static_cast<Eigen::Index>(v.size())};
  }
  [[nodiscard]] std::span<const double> of(std::span<const double> u) {
    v_ = map_ * vector(u);
    return {v_.data(), static_cast<std::size_t>(v_.size())};
  }

  ProblemStructure inner_, structure_;
  Eigen::MatrixXd map_, hessian_, jacobian_;
  std::vector<double> start_, values_;
  Eigen::VectorXd v_;
};

}  // namespace ipminmax::testing
