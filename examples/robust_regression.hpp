#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <ipminmax/core/problem.hpp>
#include <span>
#include <stdexcept>
#include <utility>

/// Least squares whose data an adversary may falsify, each sample's regressors within a ball:
///
///   min over x   max over e   sum_i ((a_i + e_i)'x - b_i)^2   subject to   |e_i|^2 <= rho^2
///
/// The maximum is known, phi(x) = sum_i (|r_i| + rho |x|)^2 with r_i = a_i'x - b_i, at
/// e_i = rho sign(r_i) x / |x|. The inner problem is convex in e, not concave: where |r_i| < rho
/// |x| the opposite e_i is a local maximum too, so there can be local minmax points below phi.
class RobustRegression final : public ipminmax::Problem {
 public:
  using Index = ipminmax::Index;

  /// data: one row a_i per sample.
  RobustRegression(Eigen::MatrixXd data, Eigen::VectorXd target, double rho)
      : a_(std::move(data)), b_(std::move(target)), rho_(rho) {
    if (a_.rows() != b_.size() || a_.rows() == 0 || a_.cols() == 0)
      throw std::invalid_argument("one target per sample is needed");
    if (!(rho > 0.0)) throw std::invalid_argument("rho must be positive");
    const auto k = static_cast<Index>(a_.cols()), samples = static_cast<Index>(a_.rows());
    const auto n = static_cast<std::size_t>(k + k * samples), m = static_cast<std::size_t>(samples);
    structure_.variable_players.assign(n, ipminmax::Player::Max);
    std::fill_n(structure_.variable_players.begin(), k, ipminmax::Player::Min);
    structure_.variable_lower.assign(n, -2e19);
    structure_.variable_upper.assign(n, 2e19);
    structure_.constraint_lower.assign(m, -2e19);
    structure_.constraint_upper.assign(m, rho * rho);
    for (Index i = 0; i < k; ++i)
      for (Index j = 0; j <= i; ++j) structure_.hessian.push_back({i, j});
    for (Index s = 0; s < samples; ++s) {
      for (Index i = 0; i < k; ++i) {
        structure_.jacobian.push_back({s, k + s * k + i});
        for (Index j = 0; j < k; ++j) structure_.hessian.push_back({k + s * k + i, j});
        for (Index j = 0; j <= i; ++j) structure_.hessian.push_back({k + s * k + i, k + s * k + j});
      }
    }
    structure_.constraint_players = ipminmax::implied_constraint_players(structure_);
  }

  [[nodiscard]] double worst_case(const Eigen::VectorXd& x) const {
    return ((a_ * x - b_).array().abs() + rho_ * x.norm()).square().sum();
  }

  [[nodiscard]] const ipminmax::ProblemStructure& structure() const override { return structure_; }

  /// Least squares without adversary, and his best answer to it, shortened.
  [[nodiscard]] bool starting_point(ipminmax::StartingPoint& start) override {
    const Eigen::VectorXd x = (a_.transpose() * a_).ldlt().solve(a_.transpose() * b_);
    std::copy(x.begin(), x.end(), start.v.begin());
    const Eigen::VectorXd r = a_ * x - b_;
    for (Eigen::Index s = 0; s < a_.rows(); ++s) {
      const Eigen::VectorXd e = (r[s] < 0.0 ? -0.5 : 0.5) * rho_ / std::max(x.norm(), 1e-12) * x;
      std::copy(e.begin(), e.end(), start.v.begin() + (1 + s) * a_.cols());
    }
    return true;
  }

  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    f = 0.0;
    for (Eigen::Index s = 0; s < a_.rows(); ++s) f += std::pow(residual(v, s), 2.0);
    return true;
  }

  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    std::fill(grad.begin(), grad.end(), 0.0);
    const Eigen::Index k = a_.cols();
    for (Eigen::Index s = 0; s < a_.rows(); ++s) {
      const double r = residual(v, s);
      Eigen::Map<Eigen::VectorXd>(grad.data(), k) += 2.0 * r * regressors(v, s);
      Eigen::Map<Eigen::VectorXd>(grad.data() + (1 + s) * k, k) = 2.0 * r * x_of(v);
    }
    return true;
  }

  [[nodiscard]] bool constraints(std::span<const double> v, bool, std::span<double> g) override {
    for (Eigen::Index s = 0; s < a_.rows(); ++s)
      g[static_cast<std::size_t>(s)] = error(v, s).squaredNorm();
    return true;
  }

  [[nodiscard]] bool jacobian(std::span<const double> v, bool, std::span<double> values) override {
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = 2.0 * v[static_cast<std::size_t>(a_.cols()) + i];
    return true;
  }

  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    const Eigen::Index k = a_.cols();
    const Eigen::VectorXd x = x_of(v);
    Eigen::MatrixXd xx = Eigen::MatrixXd::Zero(k, k);
    for (Eigen::Index s = 0; s < a_.rows(); ++s)
      xx += 2.0 * regressors(v, s) * regressors(v, s).transpose();
    std::size_t entry = 0;
    for (Eigen::Index i = 0; i < k; ++i)
      for (Eigen::Index j = 0; j <= i; ++j) values[entry++] = sigma * xx(i, j);
    for (Eigen::Index s = 0; s < a_.rows(); ++s) {
      const Eigen::VectorXd w = regressors(v, s);
      const double r = residual(v, s);
      for (Eigen::Index i = 0; i < k; ++i) {
        for (Eigen::Index j = 0; j < k; ++j)
          values[entry++] = sigma * 2.0 * (x[i] * w[j] + (i == j ? r : 0.0));
        for (Eigen::Index j = 0; j <= i; ++j)
          values[entry++] = sigma * 2.0 * x[i] * x[j] +
                            (i == j ? 2.0 * lambda[static_cast<std::size_t>(s)] : 0.0);
      }
    }
    return true;
  }

 private:
  [[nodiscard]] Eigen::VectorXd x_of(std::span<const double> v) const {
    return Eigen::Map<const Eigen::VectorXd>(v.data(), a_.cols());
  }
  [[nodiscard]] Eigen::VectorXd error(std::span<const double> v, Eigen::Index s) const {
    return Eigen::Map<const Eigen::VectorXd>(v.data() + (1 + s) * a_.cols(), a_.cols());
  }
  [[nodiscard]] Eigen::VectorXd regressors(std::span<const double> v, Eigen::Index s) const {
    return a_.row(s).transpose() + error(v, s);
  }
  [[nodiscard]] double residual(std::span<const double> v, Eigen::Index s) const {
    return regressors(v, s).dot(x_of(v)) - b_[s];
  }

  Eigen::MatrixXd a_;
  Eigen::VectorXd b_;
  double rho_;
  ipminmax::ProblemStructure structure_;
};
