#pragma once

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "shared_dynamics.hpp"

/// The linear-quadratic game without bounds by dynamic programming.
namespace shared_dynamics {

/// Whether -gamma^2 |w|^2 outweighs what w can gain: the objective is concave in w (u fixed), which
/// a local minmax needs. Bounded real lemma, the Riccati recursion without control:
///   P = Q + A'PA + A'PE (gamma^2 I - E'PE)^-1 E'PA   with gamma^2 I - E'PE > 0 at every stage.
inline bool is_concave_in_w(const System& s, double gamma) {
  Eigen::MatrixXd p = s.q;
  for (int k = 0; k < s.horizon; ++k) {
    const Eigen::MatrixXd m = gamma * gamma * Eigen::MatrixXd::Identity(s.e.cols(), s.e.cols()) -
                              s.e.transpose() * p * s.e;
    const Eigen::LLT<Eigen::MatrixXd> llt(m);
    if (llt.info() != Eigen::Success) return false;
    const Eigen::MatrixXd pa = p * s.a, ep = s.e.transpose() * pa;
    p = s.q + s.a.transpose() * pa + ep.transpose() * llt.solve(ep);
  }
  return true;
}

/// Smallest gamma of is_concave_in_w, by bisection.
inline double critical_gamma(const System& s) {
  double low = 0.0, high = 1.0;
  while (!is_concave_in_w(s, high)) high *= 2.0;
  while (high - low > 1e-13 * high) {
    const double middle = 0.5 * (low + high);
    (is_concave_in_w(s, middle) ? high : low) = middle;
  }
  return high;
}

struct RiccatiAnswer {
  double value = std::numeric_limits<double>::quiet_NaN();  ///< of the objective
  Eigen::VectorXd u0, w0;                                   ///< first moves
};

/// Value and first moves of the saddle point; meaningful for gamma > critical_gamma. From P_T = Q
/// backwards, with D = [B E], S = diag(R, -gamma^2 I):
///   (u, w) = -(S + D'PD)^-1 D'PA x,   P <- Q + A'PA - A'PD (S + D'PD)^-1 D'PA.
/// The stage x_0 itself costs nothing.
inline RiccatiAnswer riccati(const System& s) {
  const Eigen::Index nu = s.b.cols(), nw = s.e.cols();
  Eigen::MatrixXd d(s.a.rows(), nu + nw), weight = Eigen::MatrixXd::Zero(nu + nw, nu + nw);
  d << s.b, s.e;
  weight.topLeftCorner(nu, nu) = s.r;
  weight.bottomRightCorner(nw, nw).diagonal().setConstant(-s.gamma * s.gamma);
  Eigen::MatrixXd p = s.q, gain;
  for (int k = s.horizon; k > 0; --k) {
    const Eigen::MatrixXd pa = p * s.a, dpa = d.transpose() * pa;
    gain = -(weight + d.transpose() * p * d).lu().solve(dpa);
    const Eigen::MatrixXd next = s.a.transpose() * pa + dpa.transpose() * gain;
    p = next + (k > 1 ? s.q : Eigen::MatrixXd::Zero(s.q.rows(), s.q.cols()));
  }
  const Eigen::VectorXd moves = gain * s.x0;
  return {s.x0.dot(p * s.x0), moves.head(nu), moves.tail(nw)};
}

}  // namespace shared_dynamics
