#pragma once

#include <IpTNLP.hpp>
#include <array>
#include <cmath>
#include <cstddef>
#include <ipminmax/adapter/horizon_shift.hpp>
#include <ipminmax/adapter/minmax_tnlp.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

/// A planar quadrotor in wind, T stages of h seconds ahead:
///
///   min over u   max over w, s
///                sum over stages  |s_k - target|_Q^2 + r |u_k - hover|^2 - price |w_k|^2
///   subject to   s_{k+1} = s_k + h f(s_k, u_k, w_k),   0 <= u_k <= u_max,   |w_k| <= w_max
///
/// s = (x, z, angle, their speeds), u the two thrusts, w the wind's acceleration (sideways,
/// upwards):
///   f = (speeds,
///        -(u_0 + u_1) sin(angle) + w_0, (u_0 + u_1) cos(angle) - g + w_1, turn (u_0 - u_1)).
///
/// Wind and thrust move the same state, so the states are Max's variables and the dynamics his
/// constraints, as each reads them: given u, choosing w is choosing the states. docs/modelling.md.
namespace quadrotor {

using State = std::array<double, 6>;

struct Settings {
  int stages = 20;
  double step = 0.1;        ///< s
  double gravity = 9.81;    ///< m/s^2
  double turn = 6.0;        ///< angular acceleration per difference of thrusts (per unit mass)
  double thrust_max = 9.0;  ///< of each rotor, per unit mass
  double wind_max = 2.0;    ///< m/s^2
  double price = 4.0;       ///< of the wind's square, per stage
  double effort = 0.05;     ///< of the thrusts' square
  State weight{1.0, 1.0, 0.5, 0.2, 0.2, 0.1};
  State target{};
};

class Quadrotor final : public ipminmax::MinMaxTNLP {
 public:
  using Index = Ipopt::Index;
  using Number = Ipopt::Number;
  static constexpr Index kStates = 6, kThrusts = 2, kWinds = 2;

  Quadrotor(Settings settings, State now) : c_(settings), now_(now) {}

  // Stages k = 0, ..., T - 1: thrusts, winds; states of k = 1, ..., T.
  [[nodiscard]] Index thrust(Index k, Index i) const { return kThrusts * k + i; }
  [[nodiscard]] Index wind(Index k, Index i) const { return kThrusts * c_.stages + kWinds * k + i; }
  [[nodiscard]] Index state(Index k, Index i) const {
    return (kThrusts + kWinds) * c_.stages + kStates * (k - 1) + i;
  }
  [[nodiscard]] Index variables() const { return (kThrusts + kWinds + kStates) * c_.stages; }
  [[nodiscard]] Index equations() const { return kStates * c_.stages; }

  void set_state(State now) { now_ = now; }
  void set_start(ipminmax::PrimalDual start) { start_ = std::move(start); }
  [[nodiscard]] ipminmax::HorizonShift horizon_shift() const {
    const auto begin = [](Index i) { return static_cast<std::size_t>(i); };
    return {begin(c_.stages),
            {{begin(thrust(0, 0)), kThrusts},
             {begin(wind(0, 0)), kWinds},
             {begin(state(1, 0)), kStates}},
            {{0, kStates}}};
  }
  /// The plant: one stage.
  [[nodiscard]] State after(const State& s, const double* u, const double* w) const {
    const State rate = derivative(s, u, w);
    State next = s;
    for (std::size_t i = 0; i < next.size(); ++i) next[i] += c_.step * rate[i];
    return next;
  }

  bool get_variable_players(Index n, ipminmax::Player* players) override {
    for (Index i = wind(0, 0); i < n; ++i) players[i] = ipminmax::Player::Max;  // winds and states
    return true;
  }
  bool get_nlp_info(Index& n, Index& m, Index& jacobian, Index& hessian,
                    IndexStyleEnum& style) override {
    n = variables();
    m = equations();
    jacobian = count([&](auto emit) { each_jacobian_entry(nullptr, emit); });
    hessian = count([&](auto emit) { each_hessian_entry(nullptr, 0.0, nullptr, emit); });
    style = C_STYLE;
    return true;
  }
  bool get_var_con_metadata(Index n, StringMetaDataMapType& variables, IntegerMetaDataMapType&,
                            NumericMetaDataMapType&, Index m, StringMetaDataMapType& constraints,
                            IntegerMetaDataMapType&, NumericMetaDataMapType&) override {
    std::vector<std::string> names(static_cast<std::size_t>(n)), rows(static_cast<std::size_t>(m));
    const char* const of_state[] = {"x", "z", "angle", "vx", "vz", "turn"};
    const auto put = [&](Index at, const std::string& name, Index k) {
      names[static_cast<std::size_t>(at)] = name + "[" + std::to_string(k) + "]";
    };
    for (Index k = 0; k < c_.stages; ++k) {
      put(thrust(k, 0), "left", k), put(thrust(k, 1), "right", k);
      put(wind(k, 0), "wind_x", k), put(wind(k, 1), "wind_z", k);
      for (Index i = 0; i < kStates; ++i) {
        put(state(k + 1, i), of_state[i], k + 1);
        rows[static_cast<std::size_t>(kStates * k + i)] =
            std::string("next_") + of_state[i] + "[" + std::to_string(k) + "]";
      }
    }
    variables["idx_names"] = std::move(names);
    constraints["idx_names"] = std::move(rows);
    return true;
  }
  bool get_bounds_info(Index, Number* lower, Number* upper, Index m, Number* g_lower,
                       Number* g_upper) override {
    const auto put = [&](Index at, double low, double up) { lower[at] = low, upper[at] = up; };
    for (Index k = 0; k < c_.stages; ++k) {
      for (Index i = 0; i < kThrusts; ++i) put(thrust(k, i), 0.0, c_.thrust_max);
      for (Index i = 0; i < kWinds; ++i) put(wind(k, i), -c_.wind_max, c_.wind_max);
      for (Index i = 0; i < kStates; ++i) put(state(k + 1, i), -2e19, 2e19);
    }
    for (Index j = 0; j < m; ++j) g_lower[j] = g_upper[j] = 0.0;
    return true;
  }
  /// Hovering where it is, or the point that was set, multipliers included.
  bool get_starting_point(Index, bool, Number* v, bool init_z, Number* z_lower, Number* z_upper,
                          Index, bool init_lambda, Number* lambda) override {
    if (start_) {
      std::copy(start_->v.begin(), start_->v.end(), v);
      if (init_z) std::copy(start_->z_lower.begin(), start_->z_lower.end(), z_lower);
      if (init_z) std::copy(start_->z_upper.begin(), start_->z_upper.end(), z_upper);
      if (init_lambda) std::copy(start_->lambda.begin(), start_->lambda.end(), lambda);
      return true;
    }
    for (Index k = 0; k < c_.stages; ++k) {
      for (Index i = 0; i < kThrusts; ++i) v[thrust(k, i)] = hover();
      for (Index i = 0; i < kWinds; ++i) v[wind(k, i)] = 0.0;
      for (Index i = 0; i < kStates; ++i) v[state(k + 1, i)] = now_[at(i)];
    }
    return !init_z && !init_lambda;
  }

  bool eval_f(Index, const Number* v, bool, Number& f) override {
    f = 0.0;
    for (Index k = 0; k < c_.stages; ++k) {
      for (Index i = 0; i < kStates; ++i) f += c_.weight[at(i)] * square(error(v, k + 1, i));
      for (Index i = 0; i < kThrusts; ++i) f += c_.effort * square(v[thrust(k, i)] - hover());
      for (Index i = 0; i < kWinds; ++i) f -= c_.price * square(v[wind(k, i)]);
    }
    return true;
  }
  bool eval_grad_f(Index, const Number* v, bool, Number* grad) override {
    for (Index k = 0; k < c_.stages; ++k) {
      for (Index i = 0; i < kStates; ++i)
        grad[state(k + 1, i)] = 2.0 * c_.weight[at(i)] * error(v, k + 1, i);
      for (Index i = 0; i < kThrusts; ++i)
        grad[thrust(k, i)] = 2.0 * c_.effort * (v[thrust(k, i)] - hover());
      for (Index i = 0; i < kWinds; ++i) grad[wind(k, i)] = -2.0 * c_.price * v[wind(k, i)];
    }
    return true;
  }
  /// s_{k+1} - s_k - h f(s_k, u_k, w_k)
  bool eval_g(Index, const Number* v, bool, Index, Number* g) override {
    for (Index k = 0; k < c_.stages; ++k) {
      const State next = after(state_at(v, k), v + thrust(k, 0), v + wind(k, 0));
      for (Index i = 0; i < kStates; ++i) g[kStates * k + i] = v[state(k + 1, i)] - next[at(i)];
    }
    return true;
  }
  bool eval_jac_g(Index, const Number* v, bool, Index, Index, Index* row, Index* col,
                  Number* values) override {
    each_jacobian_entry(v, [&](Index i, Index j, double value) {
      if (values == nullptr)
        *row++ = i, *col++ = j;
      else
        *values++ = value;
    });
    return true;
  }
  bool eval_h(Index, const Number* v, bool, Number sigma, Index, const Number* lambda, bool, Index,
              Index* row, Index* col, Number* values) override {
    each_hessian_entry(v, sigma, lambda, [&](Index i, Index j, double value) {
      if (values == nullptr)
        *row++ = i, *col++ = j;
      else
        *values++ = value;
    });
    return true;
  }
  void finalize_solution(Ipopt::SolverReturn, Index, const Number*, const Number*, const Number*,
                         Index, const Number*, const Number*, Number, const Ipopt::IpoptData*,
                         Ipopt::IpoptCalculatedQuantities*) override {}

 private:
  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }
  static double square(double a) { return a * a; }
  [[nodiscard]] double hover() const { return 0.5 * c_.gravity; }
  [[nodiscard]] double error(const Number* v, Index k, Index i) const {
    return v[state(k, i)] - c_.target[at(i)];
  }
  [[nodiscard]] State state_at(const Number* v, Index k) const {
    State s = now_;
    for (Index i = 0; i < kStates && k > 0; ++i) s[at(i)] = v[state(k, i)];
    return s;
  }
  [[nodiscard]] State derivative(const State& s, const double* u, const double* w) const {
    const double thrust = u[0] + u[1];
    return {s[3],
            s[4],
            s[5],
            -thrust * std::sin(s[2]) + w[0],
            thrust * std::cos(s[2]) - c_.gravity + w[1],
            c_.turn * (u[0] - u[1])};
  }

  template <class Each>
  static Index count(Each each) {
    Index entries = 0;
    each([&](Index, Index, double) { ++entries; });
    return entries;
  }

  /// v null: for the structure.
  template <class Emit>
  void each_jacobian_entry(const Number* v, Emit emit) const {
    const double h = c_.step;
    for (Index k = 0; k < c_.stages; ++k) {
      const auto row = [k](Index i) { return kStates * k + i; };
      const double angle = v == nullptr ? 0.0 : state_at(v, k)[2];
      const double total = v == nullptr ? 0.0 : v[thrust(k, 0)] + v[thrust(k, 1)];
      for (Index i = 0; i < kStates; ++i) {
        emit(row(i), state(k + 1, i), 1.0);
        if (k > 0) emit(row(i), state(k, i), -1.0);
      }
      for (Index i = 0; i < 3 && k > 0; ++i) emit(row(i), state(k, i + 3), -h);
      if (k > 0) {
        emit(row(3), state(k, 2), h * total * std::cos(angle));
        emit(row(4), state(k, 2), h * total * std::sin(angle));
      }
      for (Index i = 0; i < kThrusts; ++i) {
        emit(row(3), thrust(k, i), h * std::sin(angle));
        emit(row(4), thrust(k, i), -h * std::cos(angle));
        emit(row(5), thrust(k, i), (i == 0 ? -h : h) * c_.turn);
      }
      for (Index i = 0; i < kWinds; ++i) emit(row(3 + i), wind(k, i), -h);
    }
  }

  /// Lower triangle; v null: for the structure.
  template <class Emit>
  void each_hessian_entry(const Number* v, double sigma, const Number* lambda, Emit emit) const {
    const double h = c_.step;
    for (Index k = 0; k < c_.stages; ++k) {
      for (Index i = 0; i < kThrusts; ++i)
        emit(thrust(k, i), thrust(k, i), 2.0 * sigma * c_.effort);
      for (Index i = 0; i < kWinds; ++i) emit(wind(k, i), wind(k, i), -2.0 * sigma * c_.price);
      for (Index i = 0; i < kStates; ++i)
        emit(state(k + 1, i), state(k + 1, i), 2.0 * sigma * c_.weight[at(i)]);
      if (k == 0) continue;  // the first state is given
      const double angle = v == nullptr ? 0.0 : v[state(k, 2)];
      const double total = v == nullptr ? 0.0 : v[thrust(k, 0)] + v[thrust(k, 1)];
      const double lx = v == nullptr ? 0.0 : lambda[kStates * k + 3];
      const double lz = v == nullptr ? 0.0 : lambda[kStates * k + 4];
      emit(state(k, 2), state(k, 2), h * total * (lz * std::cos(angle) - lx * std::sin(angle)));
      for (Index i = 0; i < kThrusts; ++i)
        emit(state(k, 2), thrust(k, i), h * (lx * std::cos(angle) + lz * std::sin(angle)));
    }
  }

  Settings c_;
  State now_;
  std::optional<ipminmax::PrimalDual> start_;
};

}  // namespace quadrotor
