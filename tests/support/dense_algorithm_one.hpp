#pragma once

#include <Eigen/Core>
#include <functional>
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
[[nodiscard]] PaperInertia inertia(Eigen::MatrixXd matrix);

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
  void iterate();

  /// J_zz in the order (x, s_x, y, s_y, nu_y, lambda_y, nu_x, lambda_x).
  [[nodiscard]] Eigen::MatrixXd matrix(const PaperDerivatives& d) const;
  [[nodiscard]] Eigen::MatrixXd shift(double x, double y) const;
  /// J_yy of a J_zz.
  [[nodiscard]] Eigen::MatrixXd inner(const Eigen::MatrixXd& j) const;
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
                                                bool unscaled = false) const;
  [[nodiscard]] double norm_of(const PaperDerivatives& d, double b) const;

  [[nodiscard]] bool full_right(const Eigen::MatrixXd& j, double fraction = 1.0) const;
  [[nodiscard]] bool inner_right(const Eigen::MatrixXd& j, double y) const;
  [[nodiscard]] double increased(double epsilon) const;

  /// Lines 3 to 11.
  void choose_epsilons(const Eigen::MatrixXd& j);

  /// Line 12.
  void move(const Eigen::VectorXd& step);

  PaperFunctions functions_;
  PaperChoices choices_;
  PaperPoint z_;
  double b_;
  double epsilon_x_ = 0.0, epsilon_y_ = 0.0, alpha_ = 0.0, line7_mu_ = 0.0;
  double b_of_step_ = 0.0, norm_after_step_ = 0.0;
  PaperInertia inner_at_zero_, full_at_zero_;
};

}  // namespace ipminmax::testing
