#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <ipminmax/adapter/minmax_tnlp.hpp>
#include <ipminmax/core/sensitivity.hpp>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include <ipminmax/adapter/horizon_shift.hpp>

/// The homicidal chauffeur as a model predictive control problem.
///
/// A pursuer p drives a car (Dubins' vehicle: constant speed v, steering u) and wants to run over a
/// pedestrian e who walks with velocity d:
///
///   p+ = phi_p(p, u) = (p1 + v cos p3, p2 + v sin p3, p3 + h u)      e+ = e + h d
///
/// From the present states p_0 and e_0 the two look T stages ahead:
///
///   min over u_i, p_{i+1}   max over d_i, e_{i+1}
///     scale * sum_{i<T} |p_{i+1}^(1,2) - e_{i+1}|^2 + gamma_u u_i^2 - gamma_d |d_i|^2
///   subject to   p_{i+1} = phi_p(p_i, u_i),  u_i^2 <= u_max^2        (the pursuer's)
///                e_{i+1} = e_i + h d_i,    |d_i|^2 <= d_max^2        (the evader's)
///
/// Controls are per step (h = 1) or per unit of time (h is the time of a step).
///
/// This is the simultaneous formulation: the states are variables and the dynamics are constraints.
/// All derivatives are exact; everything is ordered stage by stage, so the matrices are banded and
/// one evaluation costs O(T) and allocates nothing.
namespace chauffeur {

using Ipopt::Index;
using Ipopt::Number;

struct Parameters {
  Index horizon = 20;        ///< T
  Number speed = 0.1;        ///< v of the pursuer, per step
  Number u_max = 0.5;        ///< largest steering angle, per h
  Number d_max = 0.06;       ///< largest speed of the evader, per h
  Number gamma_u = 80.0;     ///< price of steering
  Number gamma_d = 1000.0;   ///< price of walking
  Number scale = 1.0 / 400;  ///< factor of the objective
  Number step = 1.0;         ///< h
};

/// One pursuit of fixed length and duration, cut into ever smaller steps: the same
/// continuous-time problem for every T.
inline Parameters refined(Index horizon) {
  const Number T = horizon;
  return {horizon, 2.0 / T, 10.0 / T, 1.2 / T, 0.2 * T * T, 0.25 * T * T, 1.0 / T};
}

/// The same pursuit with controls per unit of time and costs summed: neither bounds nor their
/// multipliers become as small as tolerances where T is large.
inline Parameters refined_in_rates(Index horizon) {
  const Number T = horizon;
  return {.horizon = horizon,
          .speed = 2.0 / T,
          .u_max = 10.0,
          .d_max = 1.2,
          .gamma_u = 0.2,
          .gamma_d = 0.25,
          .step = 1.0 / T};
}

struct State {
  Number px = 0.0, py = 0.0, heading = 0.0;  ///< pursuer
  Number ex = 0.5, ey = 0.5;                 ///< evader
};

struct Control {
  Number u = 0.0;             ///< steering of the pursuer
  Number dx = 0.0, dy = 0.0;  ///< velocity of the evader
};

/// Both dynamics, one step.
inline State advance(const State& s, const Control& c, Number speed, Number step = 1.0) {
  return {s.px + speed * std::cos(s.heading), s.py + speed * std::sin(s.heading),
          s.heading + step * c.u, s.ex + step * c.dx, s.ey + step * c.dy};
}

/// The control as an actuator applies it: cut to what the player is able to do.
inline Control saturate(Control c, const Parameters& limits) {
  c.u = std::clamp(c.u, -limits.u_max, limits.u_max);
  const Number pace = std::hypot(c.dx, c.dy);
  if (pace > limits.d_max) {
    c.dx *= limits.d_max / pace;
    c.dy *= limits.d_max / pace;
  }
  return c;
}

inline Number squared_distance(const State& s) {
  return (s.px - s.ex) * (s.px - s.ex) + (s.py - s.ey) * (s.py - s.ey);
}

class ChauffeurTNLP : public ipminmax::MinMaxTNLP {
 public:
  /// Every stage's controls start at guess. Take one that is not symmetric: from u = 0, d = 0 with
  /// the evader straight ahead, the iterates would stay on the line through both.
  ChauffeurTNLP(const Parameters& parameters, const State& state, const Control& guess)
      : parameters_(parameters), state_(state) {
    if (parameters.horizon < 1) throw std::invalid_argument("the horizon must be at least 1");
    controls_.assign(static_cast<std::size_t>(parameters.horizon), guess);
  }

  /// The present states p_0 and e_0.
  void set_state(const State& state) { state_ = state; }

  [[nodiscard]] const State& state() const { return state_; }

  /// What other present states are to the solver: they stand in the dynamics of the first stage, so
  /// it is the constants of these constraints that move.
  [[nodiscard]] ipminmax::BoundChange state_change(const State& other) const {
    const State from = advance(state_, {}, parameters_.speed);
    const State to = advance(other, {}, parameters_.speed);
    ipminmax::BoundChange change;
    change.constraint_lower.assign(static_cast<std::size_t>(kConstraints * horizon()), 0.0);
    const auto constant = [&](Index which) -> Number& {
      return change.constraint_lower[static_cast<std::size_t>(constraint(0, which))];
    };
    constant(kPxStep) = to.px - from.px;
    constant(kPyStep) = to.py - from.py;
    constant(kHeadingStep) = to.heading - from.heading;
    constant(kExStep) = to.ex - from.ex;
    constant(kEyStep) = to.ey - from.ey;
    change.constraint_upper = change.constraint_lower;
    return change;
  }

  /// The controls of the first stage in a point of this model.
  [[nodiscard]] static Control first_control(const std::vector<double>& v) {
    return {v[kU], v[kDx], v[kDy]};
  }

  /// T controls: the starting point before a solve, the answer after it.
  [[nodiscard]] const std::vector<Control>& controls() const { return controls_; }
  void set_controls(const std::vector<Control>& controls) {
    if (controls.size() != controls_.size())
      throw std::invalid_argument("one control per stage is needed");
    controls_ = controls;
  }

  /// Moves the controls one stage ahead and repeats the last: the start for the next time step.
  void shift_controls() { std::shift_left(controls_.begin(), controls_.end(), 1); }

  /// The stages in a point of this model.
  [[nodiscard]] ipminmax::HorizonShift horizon_shift() const {
    return {static_cast<std::size_t>(horizon()), {{0, kVariables}}, {{0, kConstraints}}};
  }
  /// The next solves start here, multipliers included; empty: from the controls.
  void set_start(std::optional<ipminmax::PrimalDual> start) { start_ = std::move(start); }

  /// Objective of the last answer.
  [[nodiscard]] Number objective() const { return objective_; }

  bool get_variable_players(Index n, ipminmax::Player* players) override {
    for (Index j = 0; j < n; ++j)
      players[j] = j % kVariables < kDx ? ipminmax::Player::Min : ipminmax::Player::Max;
    return true;
  }

  bool get_nlp_info(Index& n, Index& m, Index& nnz_jac_g, Index& nnz_h_lag,
                    IndexStyleEnum& index_style) override {
    n = kVariables * horizon();
    m = kConstraints * horizon();
    nnz_jac_g = 0;
    visit_jacobian(nullptr, [&](Index, Index, Number) { ++nnz_jac_g; });
    nnz_h_lag = 0;
    visit_hessian(nullptr, 0.0, nullptr, [&](Index, Index, Number) { ++nnz_h_lag; });
    index_style = C_STYLE;
    return true;
  }

  bool get_bounds_info(Index n, Number* x_l, Number* x_u, Index m, Number* g_l,
                       Number* g_u) override {
    std::fill_n(x_l, n, -kInfinity);
    std::fill_n(x_u, n, kInfinity);
    std::fill_n(g_l, m, 0.0);
    std::fill_n(g_u, m, 0.0);
    for (Index i = 0; i < horizon(); ++i) {
      g_l[constraint(i, kSteering)] = -kInfinity;
      g_u[constraint(i, kSteering)] = parameters_.u_max * parameters_.u_max;
      g_l[constraint(i, kWalking)] = -kInfinity;
      g_u[constraint(i, kWalking)] = parameters_.d_max * parameters_.d_max;
    }
    return true;
  }

  /// The point of set_start, or the controls as they are and the states that follow from them,
  /// without multipliers.
  bool get_starting_point(Index, bool, Number* x, bool init_z, Number* z_L, Number* z_U, Index,
                          bool init_lambda, Number* lambda) override {
    if (start_) {
      std::copy(start_->v.begin(), start_->v.end(), x);
      if (init_z) std::copy(start_->z_lower.begin(), start_->z_lower.end(), z_L);
      if (init_z) std::copy(start_->z_upper.begin(), start_->z_upper.end(), z_U);
      if (init_lambda) std::copy(start_->lambda.begin(), start_->lambda.end(), lambda);
      return true;
    }
    if (init_z || init_lambda) return false;
    State s = state_;
    for (Index i = 0; i < horizon(); ++i) {
      const Control& c = controls_[static_cast<std::size_t>(i)];
      s = advance(s, c, parameters_.speed, parameters_.step);
      Number* stage = x + variable(i, 0);
      stage[kU] = c.u;
      stage[kPx] = s.px;
      stage[kPy] = s.py;
      stage[kHeading] = s.heading;
      stage[kDx] = c.dx;
      stage[kDy] = c.dy;
      stage[kEx] = s.ex;
      stage[kEy] = s.ey;
    }
    return true;
  }

  bool eval_f(Index, const Number* x, bool, Number& f) override {
    f = 0.0;
    for (Index i = 0; i < horizon(); ++i) {
      const Number* stage = x + variable(i, 0);
      const Number rx = stage[kPx] - stage[kEx], ry = stage[kPy] - stage[kEy];
      f += rx * rx + ry * ry + parameters_.gamma_u * stage[kU] * stage[kU] -
           parameters_.gamma_d * (stage[kDx] * stage[kDx] + stage[kDy] * stage[kDy]);
    }
    f *= parameters_.scale;
    return true;
  }

  bool eval_grad_f(Index n, const Number* x, bool, Number* grad) override {
    std::fill_n(grad, n, 0.0);
    const Number two = 2.0 * parameters_.scale;
    for (Index i = 0; i < horizon(); ++i) {
      const Number* stage = x + variable(i, 0);
      Number* g = grad + variable(i, 0);
      g[kU] = two * parameters_.gamma_u * stage[kU];
      g[kPx] = two * (stage[kPx] - stage[kEx]);
      g[kPy] = two * (stage[kPy] - stage[kEy]);
      g[kEx] = -g[kPx];
      g[kEy] = -g[kPy];
      g[kDx] = -two * parameters_.gamma_d * stage[kDx];
      g[kDy] = -two * parameters_.gamma_d * stage[kDy];
    }
    return true;
  }

  bool eval_g(Index, const Number* x, bool, Index, Number* g) override {
    State now = state_;
    for (Index i = 0; i < horizon(); ++i) {
      const Number* stage = x + variable(i, 0);
      const Control c{stage[kU], stage[kDx], stage[kDy]};
      const State next = advance(now, c, parameters_.speed, parameters_.step);
      now = {stage[kPx], stage[kPy], stage[kHeading], stage[kEx], stage[kEy]};
      Number* r = g + constraint(i, 0);
      r[kPxStep] = now.px - next.px;
      r[kPyStep] = now.py - next.py;
      r[kHeadingStep] = now.heading - next.heading;
      r[kSteering] = c.u * c.u;
      r[kExStep] = now.ex - next.ex;
      r[kEyStep] = now.ey - next.ey;
      r[kWalking] = c.dx * c.dx + c.dy * c.dy;
    }
    return true;
  }

  bool eval_jac_g(Index, const Number* x, bool, Index, Index, Index* rows, Index* cols,
                  Number* values) override {
    if (values == nullptr)
      visit_jacobian(x, [&](Index row, Index col, Number) { *rows++ = row, *cols++ = col; });
    else
      visit_jacobian(x, [&](Index, Index, Number value) { *values++ = value; });
    return true;
  }

  bool eval_h(Index, const Number* x, bool, Number sigma, Index, const Number* lambda, bool, Index,
              Index* rows, Index* cols, Number* values) override {
    if (values == nullptr)
      visit_hessian(x, sigma, lambda,
                    [&](Index row, Index col, Number) { *rows++ = row, *cols++ = col; });
    else
      visit_hessian(x, sigma, lambda, [&](Index, Index, Number value) { *values++ = value; });
    return true;
  }

  /// Keeps the controls, whatever the status: in closed loop something has to be applied.
  void finalize_solution(Ipopt::SolverReturn, Index n, const Number* x, const Number*,
                         const Number*, Index, const Number*, const Number*, Number obj_value,
                         const Ipopt::IpoptData*, Ipopt::IpoptCalculatedQuantities*) override {
    objective_ = obj_value;
    if (!std::all_of(x, x + n, [](Number value) { return std::isfinite(value); })) return;
    for (Index i = 0; i < horizon(); ++i) {
      const Number* stage = x + variable(i, 0);
      controls_[static_cast<std::size_t>(i)] = {stage[kU], stage[kDx], stage[kDy]};
    }
  }

 private:
  // Stage i holds u_i, p_{i+1} (Min) and d_i, e_{i+1} (Max).
  enum Variable : Index { kU, kPx, kPy, kHeading, kDx, kDy, kEx, kEy, kVariables };
  enum Constraint : Index {
    kPxStep,
    kPyStep,
    kHeadingStep,
    kSteering,
    kExStep,
    kEyStep,
    kWalking,
    kConstraints
  };
  static constexpr Number kInfinity = 2e19;

  static Index variable(Index stage, Index which) { return kVariables * stage + which; }
  static Index constraint(Index stage, Index which) { return kConstraints * stage + which; }
  [[nodiscard]] Index horizon() const { return parameters_.horizon; }

  /// Calls entry(row, col, value) for every entry of the Jacobian, always in the same order. With
  /// x null the values mean nothing. One list for structure and values, so they cannot disagree.
  template <class Entry>
  void visit_jacobian(const Number* x, Entry entry) const {
    for (Index i = 0; i < horizon(); ++i) {
      const auto c = [i](Index which) { return constraint(i, which); };
      const auto now = [i](Index which) { return variable(i - 1, which); };  // p_i, e_i
      const auto next = [i](Index which) { return variable(i, which); };     // p_{i+1}, u_i, ...
      entry(c(kPxStep), next(kPx), 1.0);
      entry(c(kPyStep), next(kPy), 1.0);
      entry(c(kHeadingStep), next(kHeading), 1.0);
      entry(c(kHeadingStep), next(kU), -parameters_.step);
      entry(c(kSteering), next(kU), x ? 2.0 * x[next(kU)] : 0.0);
      entry(c(kExStep), next(kEx), 1.0);
      entry(c(kExStep), next(kDx), -parameters_.step);
      entry(c(kEyStep), next(kEy), 1.0);
      entry(c(kEyStep), next(kDy), -parameters_.step);
      entry(c(kWalking), next(kDx), x ? 2.0 * x[next(kDx)] : 0.0);
      entry(c(kWalking), next(kDy), x ? 2.0 * x[next(kDy)] : 0.0);
      if (i == 0) continue;  // p_0 and e_0 are given
      const Number heading = x ? x[now(kHeading)] : 0.0;
      entry(c(kPxStep), now(kPx), -1.0);
      entry(c(kPxStep), now(kHeading), parameters_.speed * std::sin(heading));
      entry(c(kPyStep), now(kPy), -1.0);
      entry(c(kPyStep), now(kHeading), -parameters_.speed * std::cos(heading));
      entry(c(kHeadingStep), now(kHeading), -1.0);
      entry(c(kExStep), now(kEx), -1.0);
      entry(c(kEyStep), now(kEy), -1.0);
    }
  }

  /// The same for the lower triangle of the Hessian of sigma f + lambda' g.
  template <class Entry>
  void visit_hessian(const Number* x, Number sigma, const Number* lambda, Entry entry) const {
    const Number two = 2.0 * sigma * parameters_.scale;
    const auto multiplier = [&](Index stage, Index which) {
      return lambda ? lambda[constraint(stage, which)] : 0.0;
    };
    for (Index i = 0; i < horizon(); ++i) {
      const auto v = [i](Index which) { return variable(i, which); };
      const Number walking = 2.0 * multiplier(i, kWalking) - two * parameters_.gamma_d;
      entry(v(kU), v(kU), two * parameters_.gamma_u + 2.0 * multiplier(i, kSteering));
      entry(v(kPx), v(kPx), two);
      entry(v(kPy), v(kPy), two);
      entry(v(kDx), v(kDx), walking);
      entry(v(kDy), v(kDy), walking);
      entry(v(kEx), v(kEx), two);
      entry(v(kEy), v(kEy), two);
      entry(v(kEx), v(kPx), -two);
      entry(v(kEy), v(kPy), -two);
      if (i + 1 == horizon()) continue;  // the last heading moves nothing
      const Number heading = x ? x[v(kHeading)] : 0.0;
      entry(v(kHeading), v(kHeading),
            parameters_.speed * (multiplier(i + 1, kPxStep) * std::cos(heading) +
                                 multiplier(i + 1, kPyStep) * std::sin(heading)));
    }
  }

  Parameters parameters_;
  State state_;
  std::vector<Control> controls_;
  std::optional<ipminmax::PrimalDual> start_;
  Number objective_ = 0.0;
};

}  // namespace chauffeur
