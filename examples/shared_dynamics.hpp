#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <ipminmax/core/problem.hpp>
#include <span>
#include <stdexcept>

/// Control against disturbance with shared dynamics, over T stages:
///
///   min over u   max over w, x   sum_{k=1..T} x_k'Q x_k + sum_{k<T} (u_k'R u_k - gamma^2 |w_k|^2)
///   subject to   x_{k+1} = A x_k + B u_k + E w_k + softening (sin p_k - p_k) e,   p_k = x_k[0]
///                |u_k| <= u_max,   |w_k| <= w_max   (entry by entry)
///
/// Both players move the state, so the states are variables of the maximizer and the dynamics its
/// constraints (the paper's remark on shared dynamics): given u and w they leave x no choice.
namespace shared_dynamics {

struct System {
  Eigen::MatrixXd a, b, e;  ///< nx by nx, nx by nu, nx by nw
  Eigen::MatrixXd q, r;     ///< symmetric, nx by nx and nu by nu
  double gamma = 1.0;
  Eigen::VectorXd x0;   ///< nx
  int horizon = 10;     ///< T
  double u_max = 2e19;  ///< 2e19: no bound
  double w_max = 2e19;
  double softening = 0.0;  ///< 0: linear dynamics
  int softened_row = 0;    ///< e is this unit vector
};

/// A mass on a spring with a motor and a gust, both at the mass: x = (position, velocity), step h.
/// With softening the spring's force is sin p instead of p: a pendulum.
inline System oscillator(int horizon, bool pendulum) {
  constexpr double h = 0.2;
  System s;
  s.a = (Eigen::MatrixXd(2, 2) << 1.0, h, -h, 1.0 - 0.5 * h).finished();
  s.b = (Eigen::MatrixXd(2, 1) << 0.0, h).finished();
  s.e = (Eigen::MatrixXd(2, 1) << 0.0, 0.5 * h).finished();
  s.q = Eigen::MatrixXd::Identity(2, 2);
  s.r = Eigen::MatrixXd::Constant(1, 1, 0.1);
  s.gamma = 2.0;
  s.x0 = Eigen::Vector2d(1.0, 0.0);
  s.horizon = horizon;
  if (pendulum) {
    s.softening = -h;
    s.softened_row = 1;
  }
  return s;
}

class Game final : public ipminmax::Problem {
 public:
  using Index = ipminmax::Index;

  explicit Game(System system) : s_(std::move(system)) {
    const Eigen::Index n = s_.a.rows();
    if (s_.horizon < 1) throw std::invalid_argument("the horizon must be at least 1");
    if (s_.a.cols() != n || s_.b.rows() != n || s_.e.rows() != n || s_.q.rows() != n ||
        s_.q.cols() != n || s_.r.rows() != s_.b.cols() || s_.r.cols() != s_.b.cols() ||
        s_.x0.size() != n)
      throw std::invalid_argument("the matrices of the system do not fit together");
    nx_ = static_cast<Index>(n);
    nu_ = static_cast<Index>(s_.b.cols());
    nw_ = static_cast<Index>(s_.e.cols());
    describe();
  }

  // Numbers of variables; k counts stages, x has k = 1, ..., T.
  [[nodiscard]] Index u(Index k, Index i) const { return k * nu_ + i; }
  [[nodiscard]] Index w(Index k, Index i) const { return s_.horizon * nu_ + k * nw_ + i; }
  [[nodiscard]] Index x(Index k, Index i) const {
    return s_.horizon * (nu_ + nw_) + (k - 1) * nx_ + i;
  }
  [[nodiscard]] Index variables() const { return s_.horizon * (nu_ + nw_ + nx_); }

  [[nodiscard]] const ipminmax::ProblemStructure& structure() const override { return structure_; }

  [[nodiscard]] bool starting_point(ipminmax::StartingPoint& start) override {
    for (Index k = 1; k <= s_.horizon; ++k)
      for (Index i = 0; i < nx_; ++i) start.v[at(x(k, i))] = s_.x0[i];
    return true;
  }

  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    f = 0.0;
    for (Index k = 0; k < s_.horizon; ++k) {
      const auto xk = state(v, k + 1), uk = part(v, u(k, 0), nu_), wk = part(v, w(k, 0), nw_);
      f += xk.dot(s_.q * xk) + uk.dot(s_.r * uk) - s_.gamma * s_.gamma * wk.squaredNorm();
    }
    return true;
  }

  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    const auto put = [&](Index first, const Eigen::VectorXd& values) {
      std::copy(values.begin(), values.end(), grad.begin() + first);
    };
    for (Index k = 0; k < s_.horizon; ++k) {
      put(u(k, 0), 2.0 * s_.r * part(v, u(k, 0), nu_));
      put(w(k, 0), -2.0 * s_.gamma * s_.gamma * part(v, w(k, 0), nw_));
      put(x(k + 1, 0), 2.0 * s_.q * state(v, k + 1));
    }
    return true;
  }

  /// x_{k+1} - A x_k - B u_k - E w_k - softening (sin p_k - p_k) e
  [[nodiscard]] bool constraints(std::span<const double> v, bool, std::span<double> g) override {
    for (Index k = 0; k < s_.horizon; ++k) {
      const Eigen::VectorXd xk = state(v, k);
      Eigen::VectorXd defect =
          state(v, k + 1) - s_.a * xk - s_.b * part(v, u(k, 0), nu_) - s_.e * part(v, w(k, 0), nw_);
      defect[s_.softened_row] -= s_.softening * (std::sin(xk[0]) - xk[0]);
      std::copy(defect.begin(), defect.end(), g.begin() + k * nx_);
    }
    return true;
  }

  [[nodiscard]] bool jacobian(std::span<const double> v, bool, std::span<double> values) override {
    std::size_t entry = 0;
    each_jacobian_entry([&](Index, Index, double value) { values[entry++] = value; }, v);
    return true;
  }

  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    std::size_t entry = 0;
    each_hessian_entry([&](Index, Index, double value) { values[entry++] = value; }, v, sigma,
                       lambda);
    return true;
  }

 private:
  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }
  static Eigen::VectorXd part(std::span<const double> v, Index first, Index count) {
    return Eigen::Map<const Eigen::VectorXd>(v.data() + first, count);
  }
  [[nodiscard]] Eigen::VectorXd state(std::span<const double> v, Index k) const {
    return k == 0 ? s_.x0 : part(v, x(k, 0), nx_);
  }

  void describe() {
    const std::size_t n = at(variables()), m = at(s_.horizon * nx_);
    using ipminmax::Player;
    structure_.variable_players.assign(n, Player::Max);
    structure_.variable_lower.assign(n, -2e19);
    structure_.variable_upper.assign(n, 2e19);
    for (Index i = 0; i < w(0, 0); ++i) {
      structure_.variable_players[at(i)] = Player::Min;
      structure_.variable_lower[at(i)] = -s_.u_max;
      structure_.variable_upper[at(i)] = s_.u_max;
    }
    for (Index i = w(0, 0); i < x(1, 0); ++i) {
      structure_.variable_lower[at(i)] = -s_.w_max;
      structure_.variable_upper[at(i)] = s_.w_max;
    }
    structure_.constraint_lower.assign(m, 0.0);
    structure_.constraint_upper.assign(m, 0.0);
    const std::vector<double> zeros(std::max(n, m), 0.0);
    each_jacobian_entry(
        [&](Index row, Index col, double) {
          structure_.jacobian.push_back({row, col});
        },
        zeros);
    each_hessian_entry(
        [&](Index row, Index col, double) {
          structure_.hessian.push_back({row, col});
        },
        zeros, 0.0, zeros);
    structure_.constraint_players = ipminmax::implied_constraint_players(structure_);
  }

  template <class Emit>
  void each_jacobian_entry(Emit emit, std::span<const double> v) const {
    for (Index k = 0; k < s_.horizon; ++k) {
      for (Index i = 0; i < nx_; ++i) {
        const Index row = k * nx_ + i;
        emit(row, x(k + 1, i), 1.0);
        for (Index j = 0; j < nu_; ++j) emit(row, u(k, j), -s_.b(i, j));
        for (Index j = 0; j < nw_; ++j) emit(row, w(k, j), -s_.e(i, j));
        for (Index j = 0; j < nx_ && k > 0; ++j) {
          double value = -s_.a(i, j);
          if (i == s_.softened_row && j == 0)
            value -= s_.softening * (std::cos(v[at(x(k, 0))]) - 1.0);
          emit(row, x(k, j), value);
        }
      }
    }
  }

  template <class Emit>
  void each_hessian_entry(Emit emit, std::span<const double> v, double sigma,
                          std::span<const double> lambda) const {
    for (Index k = 0; k < s_.horizon; ++k) {
      for (Index i = 0; i < nu_; ++i)
        for (Index j = 0; j <= i; ++j) emit(u(k, i), u(k, j), 2.0 * sigma * s_.r(i, j));
      for (Index i = 0; i < nw_; ++i) emit(w(k, i), w(k, i), -2.0 * sigma * s_.gamma * s_.gamma);
      for (Index i = 0; i < nx_; ++i)
        for (Index j = 0; j <= i; ++j) emit(x(k + 1, i), x(k + 1, j), 2.0 * sigma * s_.q(i, j));
      if (k > 0)  // of the sine
        emit(x(k, 0), x(k, 0),
             lambda[at(k * nx_ + s_.softened_row)] * s_.softening * std::sin(v[at(x(k, 0))]));
    }
  }

  System s_;
  Index nx_ = 0, nu_ = 0, nw_ = 0;
  ipminmax::ProblemStructure structure_;
};

}  // namespace shared_dynamics
