#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <utility>

/// The paper's Algorithm 1 as printed, with dense matrices and eigenvalues; it shares nothing with
/// the library. For tests.
namespace ipminmax::testing {

/// The derivatives that J_zz and g(z, b) are made of, for min over x in {G_x = 0, F_x <= 0}, max
/// over y in {G_y = 0, F_y <= 0}. Jacobians have a row per constraint.
struct PaperDerivatives {
  Eigen::VectorXd fx, fy;          ///< gradient of f
  Eigen::VectorXd gx, hx, gy, hy;  ///< G_x, F_x, G_y, F_y
  Eigen::MatrixXd gx_x, hx_x, gy_x, gy_y, hy_x, hy_y;
  Eigen::MatrixXd xx, xy, yy;  ///< of L, with its multipliers
};

/// Of L = f + nu_x'G_x + lambda_x'(F_x + s_x) + nu_y'G_y - lambda_y'(F_y + s_y).
struct PaperPoint {
  Eigen::VectorXd x, sx, y, sy, nu_y, lambda_y, nu_x, lambda_x;
};

using PaperFunctions = std::function<PaperDerivatives(const PaperPoint&)>;

struct PaperInertia {
  Eigen::Index positive = 0, negative = 0, zero = 0;
  friend bool operator==(const PaperInertia&, const PaperInertia&) = default;
};

/// By eigenvalues, after a congruence that makes all rows equally large: entries lambda / s are
/// huge.
inline PaperInertia inertia(Eigen::MatrixXd matrix) {
  PaperInertia result;
  if (matrix.rows() == 0) return result;
  for (int sweep = 0; sweep < 3; ++sweep) {
    const Eigen::VectorXd d =
        matrix.cwiseAbs().rowwise().maxCoeff().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    matrix = (d.asDiagonal() * matrix * d.asDiagonal()).eval();
  }
  const Eigen::VectorXd values =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
  constexpr double kZero = 1e-15;
  for (const double value : values) {
    ++(value > kZero ? result.positive : value < -kZero ? result.negative : result.zero);
  }
  return result;
}

/// What the printed algorithm leaves open.
struct PaperChoices {
  double sigma = 0.2;
  double delta_epsilon = 0.0;
  double first = 1e-4, growth = 10.0;  ///< "increase"
  bool line7 = true;
  double tau_min = 0.99;  ///< alpha keeps 1 - max(tau_min, 1 - b) of s and lambda
};

class DenseAlgorithmOne {
 public:
  DenseAlgorithmOne(PaperFunctions functions, PaperPoint start, double b, PaperChoices choices)
      : functions_(std::move(functions)), choices_(choices), z_(std::move(start)), b_(b) {}

  [[nodiscard]] const PaperPoint& point() const { return z_; }
  [[nodiscard]] double b() const { return b_; }
  [[nodiscard]] double epsilon_x() const { return epsilon_x_; }
  [[nodiscard]] double epsilon_y() const { return epsilon_y_; }
  [[nodiscard]] double alpha() const { return alpha_; }
  [[nodiscard]] double line7_mu() const { return line7_mu_; }
  /// Of the last step: its b, and |g(z, b)| at its end.
  [[nodiscard]] double b_of_step() const { return b_of_step_; }
  [[nodiscard]] double norm_after_step() const { return norm_after_step_; }
  [[nodiscard]] PaperInertia inner_at_zero() const { return inner_at_zero_; }
  [[nodiscard]] PaperInertia full_at_zero() const { return full_at_zero_; }

  /// Lines 2 to 14.
  void iterate() {
    const PaperDerivatives d = functions_(z_);
    const Eigen::MatrixXd j = matrix(d);
    if (norm_of(d, b_) > choices_.delta_epsilon) choose_epsilons(j);
    const Eigen::VectorXd step =
        -(j + shift(epsilon_x_, epsilon_y_)).partialPivLu().solve(scaled_residual(d, b_));
    move(step);
    b_of_step_ = b_;
    norm_after_step_ = norm_of(functions_(z_), b_);
    if (norm_after_step_ <= b_) b_ *= choices_.sigma;  // lines 13 and 14
  }

  /// J_zz in the order (x, s_x, y, s_y, nu_y, lambda_y, nu_x, lambda_x).
  [[nodiscard]] Eigen::MatrixXd matrix(const PaperDerivatives& d) const {
    Eigen::MatrixXd j = Eigen::MatrixXd::Zero(size(), size());
    const auto put = [&](Eigen::Index row, Eigen::Index col, const Eigen::MatrixXd& block) {
      j.block(row, col, block.rows(), block.cols()) = block;
      j.block(col, row, block.cols(), block.rows()) = block.transpose();
    };
    const Eigen::Index x = 0, sx = nx(), y = sx + mx(), sy = y + ny(), nu_y = sy + my(),
                       lambda_y = nu_y + ly(), nu_x = lambda_y + my(), lambda_x = nu_x + lx();
    const auto eye = [](Eigen::Index n) { return Eigen::MatrixXd::Identity(n, n); };
    put(x, x, d.xx);
    put(x, y, d.xy);
    put(y, y, d.yy);
    put(sx, sx, z_.lambda_x.cwiseQuotient(z_.sx).asDiagonal());
    put(sy, sy, (-z_.lambda_y.cwiseQuotient(z_.sy)).asDiagonal());
    put(x, nu_y, d.gy_x.transpose());
    put(x, lambda_y, -d.hy_x.transpose());
    put(y, nu_y, d.gy_y.transpose());
    put(y, lambda_y, -d.hy_y.transpose());
    put(sy, lambda_y, -eye(my()));
    put(x, nu_x, d.gx_x.transpose());
    put(x, lambda_x, d.hx_x.transpose());
    put(sx, lambda_x, eye(mx()));
    return j;
  }
  [[nodiscard]] Eigen::MatrixXd shift(double x, double y) const {
    Eigen::VectorXd e = Eigen::VectorXd::Zero(size());
    e.head(nx()).setConstant(x);
    e.segment(nx() + mx(), ny()).setConstant(-y);
    return e.asDiagonal();
  }
  /// J_yy of a J_zz.
  [[nodiscard]] Eigen::MatrixXd inner(const Eigen::MatrixXd& j) const {
    const Eigen::Index n = ny() + my() + ly() + my();
    return j.block(nx() + mx(), nx() + mx(), n, n);
  }
  [[nodiscard]] PaperInertia inner_expected() const { return {ly() + my(), ny() + my(), 0}; }
  [[nodiscard]] PaperInertia full_expected() const {
    return {nx() + mx() + ly() + my(), lx() + mx() + ny() + my(), 0};
  }

 private:
  [[nodiscard]] Eigen::Index nx() const { return z_.x.size(); }
  [[nodiscard]] Eigen::Index ny() const { return z_.y.size(); }
  [[nodiscard]] Eigen::Index mx() const { return z_.sx.size(); }
  [[nodiscard]] Eigen::Index my() const { return z_.sy.size(); }
  [[nodiscard]] Eigen::Index lx() const { return z_.nu_x.size(); }
  [[nodiscard]] Eigen::Index ly() const { return z_.nu_y.size(); }
  [[nodiscard]] Eigen::Index size() const {
    return nx() + ny() + 2 * mx() + 2 * my() + lx() + ly();
  }

  /// S^-1 g(z, b); S = 1 where `unscaled`.
  [[nodiscard]] Eigen::VectorXd scaled_residual(const PaperDerivatives& d, double b,
                                                bool unscaled = false) const {
    Eigen::VectorXd g(size());
    const Eigen::ArrayXd one_x = Eigen::ArrayXd::Ones(mx()), one_y = Eigen::ArrayXd::Ones(my());
    const Eigen::ArrayXd sx = unscaled ? one_x : z_.sx.array().eval();
    const Eigen::ArrayXd sy = unscaled ? one_y : z_.sy.array().eval();
    g << d.fx + d.gx_x.transpose() * z_.nu_x + d.hx_x.transpose() * z_.lambda_x +
             d.gy_x.transpose() * z_.nu_y - d.hy_x.transpose() * z_.lambda_y,
        ((z_.lambda_x.array() * z_.sx.array() - b) / sx).matrix(),
        d.fy + d.gy_y.transpose() * z_.nu_y - d.hy_y.transpose() * z_.lambda_y,
        ((-z_.lambda_y.array() * z_.sy.array() + b) / sy).matrix(), d.gy, -d.hy - z_.sy, d.gx,
        d.hx + z_.sx;
    return g;
  }
  [[nodiscard]] double norm_of(const PaperDerivatives& d, double b) const {
    return scaled_residual(d, b, true).lpNorm<Eigen::Infinity>();
  }

  [[nodiscard]] bool full_right(const Eigen::MatrixXd& j, double fraction = 1.0) const {
    return inertia(j + shift(fraction * epsilon_x_, fraction * epsilon_y_)) == full_expected();
  }
  [[nodiscard]] bool inner_right(const Eigen::MatrixXd& j, double y) const {
    return inertia(inner(j + shift(0.0, y))) == inner_expected();
  }
  [[nodiscard]] double increased(double epsilon) const {
    if (epsilon > 1e30) throw std::runtime_error("no shift gives the inertias");
    return epsilon == 0.0 ? choices_.first : choices_.growth * epsilon;
  }

  /// Lines 3 to 11.
  void choose_epsilons(const Eigen::MatrixXd& j) {
    epsilon_x_ = epsilon_y_ = line7_mu_ = 0.0;
    inner_at_zero_ = inertia(inner(j));
    full_at_zero_ = inertia(j);
    double failed = 0.0;
    while (!inner_right(j, epsilon_y_)) {
      failed = epsilon_y_;
      epsilon_y_ = increased(epsilon_y_);
    }
    while (!full_right(j)) epsilon_x_ = increased(epsilon_x_);
    if (!choices_.line7 || epsilon_y_ == 0.0 || full_at_zero_ != full_expected()) return;
    // The value of mu is open: below the largest one at which J_yy - mu E_y is singular.
    while (failed == 0.0 || inner_right(j, failed)) {
      failed = failed == 0.0 ? epsilon_y_ / choices_.growth : failed / choices_.growth;
      if (failed <= 1e-7) return;  // J_yy is only singular: no theorem, no end (f = x y)
    }
    line7_mu_ = failed / epsilon_y_;
    while (full_right(j, line7_mu_)) epsilon_x_ = increased(epsilon_x_);
  }

  /// Line 12.
  void move(const Eigen::VectorXd& step) {
    Eigen::Index at = 0;
    const auto part = [&](const Eigen::VectorXd& like) {
      const Eigen::VectorXd result = step.segment(at, like.size());
      at += like.size();
      return result;
    };
    const PaperPoint d{part(z_.x),    part(z_.sx),       part(z_.y),    part(z_.sy),
                       part(z_.nu_y), part(z_.lambda_y), part(z_.nu_x), part(z_.lambda_x)};
    const double tau = std::max(choices_.tau_min, 1.0 - b_);
    alpha_ = 1.0;
    const auto limit = [&](const Eigen::VectorXd& value, const Eigen::VectorXd& change) {
      for (Eigen::Index i = 0; i < value.size(); ++i) {
        if (alpha_ * change[i] < -tau * value[i]) alpha_ = -tau * value[i] / change[i];
      }
    };
    limit(z_.sx, d.sx);
    limit(z_.sy, d.sy);
    limit(z_.lambda_x, d.lambda_x);
    limit(z_.lambda_y, d.lambda_y);
    z_.x += alpha_ * d.x;
    z_.sx += alpha_ * d.sx;
    z_.y += alpha_ * d.y;
    z_.sy += alpha_ * d.sy;
    z_.nu_y += alpha_ * d.nu_y;
    z_.lambda_y += alpha_ * d.lambda_y;
    z_.nu_x += alpha_ * d.nu_x;
    z_.lambda_x += alpha_ * d.lambda_x;
  }

  PaperFunctions functions_;
  PaperChoices choices_;
  PaperPoint z_;
  double b_;
  double epsilon_x_ = 0.0, epsilon_y_ = 0.0, alpha_ = 0.0, line7_mu_ = 0.0;
  double b_of_step_ = 0.0, norm_after_step_ = 0.0;
  PaperInertia inner_at_zero_, full_at_zero_;
};

}  // namespace ipminmax::testing
