#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <support/dense_algebra.hpp>
#include <support/dense_algorithm_one.hpp>

namespace ipminmax::testing {

PaperInertia inertia(Eigen::MatrixXd matrix) {
  PaperInertia result;
  if (matrix.rows() == 0) return result;
  for (int sweep = 0; sweep < 3; ++sweep) {
    const Eigen::VectorXd d =
        matrix.cwiseAbs().rowwise().maxCoeff().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    matrix = (d.asDiagonal() * matrix * d.asDiagonal()).eval();
  }
  const Eigen::VectorXd values = symmetric_eigenvalues(matrix);
  constexpr double kZero = 1e-15;
  for (const double value : values) {
    ++(value > kZero ? result.positive : value < -kZero ? result.negative : result.zero);
  }
  return result;
}

void DenseAlgorithmOne::iterate() {
  const PaperDerivatives d = functions_(z_);
  const Eigen::MatrixXd j = matrix(d);
  if (norm_of(d, b_) > choices_.delta_epsilon) choose_epsilons(j);
  const Eigen::VectorXd step =
      -solve_dense(j + shift(epsilon_x_, epsilon_y_), scaled_residual(d, b_));
  move(step);
  b_of_step_ = b_;
  norm_after_step_ = norm_of(functions_(z_), b_);
  if (norm_after_step_ <= b_) b_ *= choices_.sigma;  // lines 13 and 14
}

Eigen::MatrixXd DenseAlgorithmOne::matrix(const PaperDerivatives& d) const {
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

Eigen::MatrixXd DenseAlgorithmOne::shift(double x, double y) const {
  Eigen::VectorXd e = Eigen::VectorXd::Zero(size());
  e.head(nx()).setConstant(x);
  e.segment(nx() + mx(), ny()).setConstant(-y);
  return e.asDiagonal();
}

Eigen::MatrixXd DenseAlgorithmOne::inner(const Eigen::MatrixXd& j) const {
  const Eigen::Index n = ny() + my() + ly() + my();
  return j.block(nx() + mx(), nx() + mx(), n, n);
}

Eigen::VectorXd DenseAlgorithmOne::scaled_residual(const PaperDerivatives& d, double b,
                                                   bool unscaled) const {
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

double DenseAlgorithmOne::norm_of(const PaperDerivatives& d, double b) const {
  return scaled_residual(d, b, true).lpNorm<Eigen::Infinity>();
}

bool DenseAlgorithmOne::full_right(const Eigen::MatrixXd& j, double fraction) const {
  return inertia(j + shift(fraction * epsilon_x_, fraction * epsilon_y_)) == full_expected();
}

bool DenseAlgorithmOne::inner_right(const Eigen::MatrixXd& j, double y) const {
  return inertia(inner(j + shift(0.0, y))) == inner_expected();
}

double DenseAlgorithmOne::increased(double epsilon) const {
  if (epsilon > 1e30) throw std::runtime_error("no shift gives the inertias");
  return epsilon == 0.0 ? choices_.first : choices_.growth * epsilon;
}

void DenseAlgorithmOne::choose_epsilons(const Eigen::MatrixXd& j) {
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

void DenseAlgorithmOne::move(const Eigen::VectorXd& step) {
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

}  // namespace ipminmax::testing
