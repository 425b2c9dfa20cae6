#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <ipminmax/core/problem.hpp>
#include <span>
#include <utility>
#include <vector>

#include "chauffeur_tnlp.hpp"

namespace chauffeur {

/// The game of chauffeur_tnlp.hpp in the sequential formulation: the states are functions
/// of the controls, so that T + 2T variables and 2T constraints are left, and full matrices.
///
/// Variables u_0..u_{T-1} (Min), then dx_0, dy_0, dx_1, ... (Max). With heading h_k after k steps,
/// t_k = (-sin h_k, cos h_k), residuals r_i = p_{i+1} - e_{i+1} and R_k = sum_{i >= k} r_i:
///
///   df/dh_k = 2 s v t_k'R_k       df/dd_j = -2 s (R_j + gamma_d d_j)
///   d2f/dh_k dh_l = 2 s (v^2 (T - max(k,l)) t_k't_l - [k=l] v (cos h_k, sin h_k)'R_k)
///   d2f/dh_k dd_j = -2 s v (T - max(k,j)) t_k
///   d2f/dd_j dd_l = 2 s (T - max(j,l) - [j=l] gamma_d) I
///
/// and h_k = h_0 + sum_{j < k} u_j turns derivatives in h into suffix sums. A gradient costs O(T),
/// a Hessian O(T^2).
class SequentialChauffeur final : public ipminmax::Problem {
 public:
  using Index = ipminmax::Index;

  SequentialChauffeur(const Parameters& parameters, const State& state, std::vector<Control> start)
      : p_(parameters), state_(state), start_(std::move(start)), T_(parameters.horizon) {
    constexpr double kInfinity = 2e19;
    const std::size_t T = size(T_);
    structure_.variable_players.assign(3 * T, ipminmax::Player::Max);
    std::fill_n(structure_.variable_players.begin(), T, ipminmax::Player::Min);
    structure_.variable_lower.assign(3 * T, -kInfinity);
    structure_.variable_upper.assign(3 * T, kInfinity);
    structure_.constraint_lower.assign(2 * T, -kInfinity);
    structure_.constraint_upper.assign(2 * T, p_.d_max * p_.d_max);
    std::fill_n(structure_.constraint_upper.begin(), T, p_.u_max * p_.u_max);
    for (Index i = 0; i < T_; ++i) structure_.jacobian.push_back({i, i});
    for (Index i = 0; i < T_; ++i) {
      structure_.jacobian.push_back({T_ + i, d(i)});
      structure_.jacobian.push_back({T_ + i, d(i) + 1});
    }
    structure_.constraint_players = implied_constraint_players(structure_);
    for (Index row = 0; row < T_; ++row) {  // u with u
      for (Index col = 0; col <= row; ++col) structure_.hessian.push_back({row, col});
    }
    for (Index j = 0; j < T_; ++j) {
      for (Index c = 0; c < 2; ++c) {
        for (Index m = 0; m < T_; ++m) structure_.hessian.push_back({d(j) + c, m});
        for (Index l = 0; l <= j; ++l) structure_.hessian.push_back({d(j) + c, d(l) + c});
      }
    }
    for (auto* values : {&cos_, &sin_, &Rx_, &Ry_}) values->resize(T + 1);
    sums_.resize(T + 1);
    row_sums_.resize((T + 1) * (T + 1));
  }

  /// The controls of a point, as ChauffeurTNLP::set_controls takes them.
  [[nodiscard]] std::vector<Control> controls(std::span<const double> v) const {
    std::vector<Control> controls;
    for (Index i = 0; i < T_; ++i) {
      controls.push_back({v[size(i)], v[size(d(i))], v[size(d(i)) + 1]});
    }
    return controls;
  }

  [[nodiscard]] const ipminmax::ProblemStructure& structure() const override { return structure_; }

  [[nodiscard]] bool starting_point(ipminmax::StartingPoint& start) override {
    for (Index i = 0; i < T_; ++i) {
      start.v[size(i)] = start_[size(i)].u;
      start.v[size(d(i))] = start_[size(i)].dx;
      start.v[size(d(i)) + 1] = start_[size(i)].dy;
    }
    return !start.needs_multipliers;
  }

  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    f = p_.scale * simulate(v);
    return true;
  }

  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    simulate(v);
    const double two = 2.0 * p_.scale;
    double suffix = 0.0;  // sum over k > j of df/dh_k
    for (Index j = T_ - 1; j >= 0; --j) {
      const std::size_t k = size(j);
      grad[k] = p_.step * suffix + two * p_.gamma_u * v[k];
      suffix += two * p_.speed * (cos_[k] * Ry_[k] - sin_[k] * Rx_[k]);
      const std::size_t dk = size(d(j));
      grad[dk] = -two * (p_.step * Rx_[k] + p_.gamma_d * v[dk]);
      grad[dk + 1] = -two * (p_.step * Ry_[k] + p_.gamma_d * v[dk + 1]);
    }
    return true;
  }

  [[nodiscard]] bool constraints(std::span<const double> v, bool, std::span<double> g) override {
    for (Index i = 0; i < T_; ++i) {
      const double u = v[size(i)], dx = v[size(d(i))], dy = v[size(d(i)) + 1];
      g[size(i)] = u * u;
      g[size(T_ + i)] = dx * dx + dy * dy;
    }
    return true;
  }

  [[nodiscard]] bool jacobian(std::span<const double> v, bool, std::span<double> values) override {
    for (std::size_t k = 0; k < values.size(); ++k) {
      values[k] = 2.0 * v[size(structure_.jacobian[k].col)];
    }
    return true;
  }

  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma,
                             std::span<const double> lambda, bool,
                             std::span<double> values) override {
    simulate(v);
    const double two = 2.0 * sigma * p_.scale, h2 = p_.step * p_.step;
    double* next = values.data();
    const auto left = [&](Index k, Index l) { return static_cast<double>(T_ - std::max(k, l)); };

    // S(row, col) = sum over k > row, l > col of d2f/dh_k dh_l; row sums accumulate over k.
    const auto row_sum = [&](Index k, Index l) -> double& {
      return row_sums_[size(k) * size(T_ + 1) + size(l)];
    };
    for (Index l = 0; l <= T_; ++l) row_sum(T_, l) = 0.0;
    for (Index k = T_ - 1; k >= 0; --k) {
      const std::size_t ks = size(k);
      double suffix = 0.0;
      row_sum(k, T_) = 0.0;
      for (Index l = T_ - 1; l >= 0; --l) {
        const std::size_t ls = size(l);
        suffix += p_.speed * p_.speed * left(k, l) * (sin_[ks] * sin_[ls] + cos_[ks] * cos_[ls]);
        if (k == l) suffix -= p_.speed * (cos_[ks] * Rx_[ks] + sin_[ks] * Ry_[ks]);
        row_sum(k, l) = row_sum(k + 1, l) + suffix;
      }
    }
    for (Index row = 0; row < T_; ++row) {
      for (Index col = 0; col <= row; ++col) *next++ = two * h2 * row_sum(row + 1, col + 1);
      next[-1] += two * p_.gamma_u + 2.0 * lambda[size(row)];
    }
    for (Index j = 0; j < T_; ++j) {
      for (Index c = 0; c < 2; ++c) {
        const std::vector<double>& t = c == 0 ? sin_ : cos_;
        const double sign = c == 0 ? 1.0 : -1.0;
        double suffix = 0.0;  // over k > m
        for (Index m = T_ - 1; m >= 0; --m) {
          sums_[size(m)] = suffix;
          suffix += sign * p_.speed * left(m, j) * t[size(m)];
        }
        for (Index m = 0; m < T_; ++m) *next++ = two * h2 * sums_[size(m)];
        for (Index l = 0; l <= j; ++l) *next++ = two * h2 * left(j, l);
        next[-1] += 2.0 * lambda[size(T_ + j)] - two * p_.gamma_d;
      }
    }
    return true;
  }

 private:
  static std::size_t size(Index i) { return static_cast<std::size_t>(i); }
  [[nodiscard]] Index d(Index stage) const { return T_ + 2 * stage; }

  /// f / scale; leaves cos and sin of the headings and the suffix sums R.
  double simulate(std::span<const double> v) {
    State s = state_;
    double f = 0.0;
    for (Index i = 0; i < T_; ++i) {
      const std::size_t k = size(i);
      const Control c{v[k], v[size(d(i))], v[size(d(i)) + 1]};
      cos_[k] = std::cos(s.heading);
      sin_[k] = std::sin(s.heading);
      s = {s.px + p_.speed * cos_[k], s.py + p_.speed * sin_[k], s.heading + p_.step * c.u,
           s.ex + p_.step * c.dx, s.ey + p_.step * c.dy};
      Rx_[k] = s.px - s.ex;
      Ry_[k] = s.py - s.ey;
      f += Rx_[k] * Rx_[k] + Ry_[k] * Ry_[k] + p_.gamma_u * c.u * c.u -
           p_.gamma_d * (c.dx * c.dx + c.dy * c.dy);
    }
    for (std::size_t k = size(T_) - 1; k-- > 0;) {
      Rx_[k] += Rx_[k + 1];
      Ry_[k] += Ry_[k + 1];
    }
    return f;
  }

  Parameters p_;
  State state_;
  std::vector<Control> start_;
  Index T_;
  ipminmax::ProblemStructure structure_;
  std::vector<double> cos_, sin_, Rx_, Ry_, sums_, row_sums_;
};

}  // namespace chauffeur
