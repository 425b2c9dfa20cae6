#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <memory>
#include <optional>
#include <ranges>
#include <span>
#include <stdexcept>
#include <string>
#include <typeinfo>
#include <utility>
#include <vector>

#include "../../core/formulas/autodiff.hpp"
#include "../../core/formulas/interval.hpp"
#include "../../core/options.hpp"
#include "../../core/problem.hpp"
#include "../../core/robust.hpp"
#include "../../core/solver.hpp"
#include "horizon_shift.hpp"

/// @file
/// Control against disturbance in stages. You write dynamics and cost; derivatives, sparsity and
/// players are found automatically.
///
///     min over u   max over w, s   sum over stages of cost(s, u, w) + terminal_cost(s_T)
///     subject to   s_0 given,  s_{k+1} = F(s_k, u_k, w_k)
///
/// F integrates ds/dt = dynamics(s, u_k, w_k) over one stage of length `step`, and the cost with
/// it, by the chosen Discretization (default: RungeKutta4). With Discrete F is dynamics itself.
///
///     struct Pendulum {
///       static constexpr std::size_t states = 2, controls = 1, disturbances = 1;
///       void dynamics(auto s, auto u, auto w, auto rate) const {
///         rate[0] = s[1];
///         rate[1] = sin(s[0]) + u[0] + w[0];
///       }
///       auto cost(auto s, auto u, auto w) const {
///         return s[0] * s[0] + 0.1 * u[0] * u[0] - 5.0 * w[0] * w[0];
///       }
///     };
///     ipminmax::StageGame game(Pendulum{}, {.stages = 30, .step = 0.1, .initial = {1.0, 0.0}});
///     ipminmax::StageAnswer plan = game.solve();   // plan.controls[0], plan.states[30], ...
///     plan = game.solve_next({0.9, -0.1});         // one stage later, from what was measured
///
/// Disturbances w and states s are Max's variables, and the dynamics are his constraints. Controls,
/// gains and parameters are Min's variables. Limits are Min's constraints, and robust if they read
/// a variable of Max. See docs/stages.md.
namespace ipminmax {

/// Rule that gives the next state, f being the dynamics. Controls and disturbances are constant in
/// a stage. All but Discrete integrate the cost by the same rule.
enum class Discretization : std::uint8_t {
  Discrete,          ///< s_{k+1} = f(s_k); the cost is a sum
  Euler,             ///< s_{k+1} = s_k + step f(s_k)
  RungeKutta4,       ///< the classical explicit rule of order 4
  ImplicitMidpoint,  ///< s_{k+1} = s_k + step f((s_k + s_{k+1}) / 2); order 2, A-stable
  HermiteSimpson     ///< implicit collocation of order 4
};

/// Argument of a model's functions that need more than s, u, w.
template <class T>
struct StagePoint {
  std::span<const T> s, u, w, p;  ///< state, control, disturbance, parameters
  T t = 0.0;                      ///< time since the start
  std::size_t k = 0;              ///< stage
};

/// The numbers of a game. An empty vector means none, or zeros. A bound of 1e19 or more is absent.
struct Horizon {
  std::size_t stages = 20;  ///< T, the number of stages
  double step = 0.1;        ///< length of a stage, in the unit of time of the dynamics
  Discretization discretization = Discretization::RungeKutta4;
  std::vector<double> initial{};         ///< s_0: one entry per state
  std::vector<double> initial_spread{};  ///< one entry per state: Max moves s_0 by at most this
  /// One entry per state: the starting point has the states on the line from s_0 to it.
  std::vector<double> final_guess{};
  std::vector<double> control_lower{}, control_upper{};          ///< one entry per control
  std::vector<double> control_guess{};                           ///< one entry per control
  std::vector<double> disturbance_lower{}, disturbance_upper{};  ///< one entry per disturbance
  std::vector<double> parameter_lower{}, parameter_upper{};  ///< one per parameter, Min's variables
  std::vector<double> parameter_guess{};                     ///< one entry per parameter
  /// Bounds of the duration of the horizon, which Min chooses; the stages are equally long. Both 0:
  /// the duration is stages times step.
  double duration_lower = 0.0, duration_upper = 0.0;
  /// Feedback: bounds of the gain matrix G (controls by states, row by row), which Min chooses. The
  /// dynamics get the control u_k + G s_k; control bounds then hold for u_k. Equal bounds give G.
  /// Empty: no feedback.
  std::vector<double> gain_lower{}, gain_upper{};
  /// Feedback of past disturbances: the control also has the sum over l = 1, ..., memory of
  /// M_l w_{k-l}. Min chooses the matrices M_l (controls by disturbances), with entries of at most
  /// memory_bound.
  std::size_t memory = 0;
  double memory_bound = 2e19;
  /// Weight, in the objective, of the squares of u_k, G and M_l, if Min chooses an entry of G or
  /// memory is above 0. It makes the choice unique if they can express the same control.
  double feedback_price = 1e-3;
  std::vector<std::string> state_names{}, control_names{}, disturbance_names{};
};

/// An answer by stage.
struct StageAnswer {
  Result result;
  std::vector<std::vector<double>> states;        ///< s_0, ..., s_T
  std::vector<std::vector<double>> controls;      ///< T of them, as applied: with feedback
  std::vector<std::vector<double>> disturbances;  ///< w_0, ..., w_{T-1}
  std::vector<double> parameters;
  std::vector<double> gains;   ///< G row by row
  std::vector<double> memory;  ///< M_1, M_2, ... row by row
  double duration = 0.0;
  std::vector<RobustWorstCase> worst_cases;  ///< of limits

  /// Returns whether the solve succeeded with a certified local minmax.
  [[nodiscard]] bool certified() const {
    return is_success(result.status) && result.certificate.kind == PointKind::LocalMinmax;
  }
};

/// The game of a Model with these members:
///   static constexpr std::size_t states, controls, disturbances;   // numbers; each may be 0
///   void dynamics(auto s, auto u, auto w, auto rate) const;        // or (auto at, auto rate)
///   auto cost(auto s, auto u, auto w) const;                       // or (auto at)
/// and optionally
///   static constexpr std::size_t parameters;
///   auto terminal_cost(auto s) const;                              // or (auto at)
///   static constexpr std::size_t limits;                           // rows of
///   void limits_of(auto s, auto u, auto g) const;                  // or (auto at, auto g)
///   static constexpr std::size_t terminal_limits;                  // rows of
///   void terminal_limits_of(auto s, auto g) const;                 // or (auto at, auto g)
/// `at` is a StagePoint; either all functions take it or none. Limits mean g <= 0 for every
/// disturbance, with the state and the time t at the end of each stage and the control of that
/// stage. Terminal limits read the last state.
///
/// Variables: s_0, u_0, w_0, s_1, ..., s_T, parameters, gains, memory, duration. Constraints: stage
/// by stage the dynamics and the limits; the terminal limits.
template <class Model>
class StageGame : public Problem {
 public:
  static constexpr std::size_t nx = Model::states, nu = Model::controls, nw = Model::disturbances;
  static constexpr std::size_t np = [] {
    if constexpr (requires { Model::parameters; })
      return static_cast<std::size_t>(Model::parameters);
    return std::size_t{0};
  }();
  static constexpr std::size_t nl = [] {
    if constexpr (requires { Model::limits; }) return static_cast<std::size_t>(Model::limits);
    return std::size_t{0};
  }();
  static constexpr std::size_t nt = [] {
    if constexpr (requires { Model::terminal_limits; })
      return static_cast<std::size_t>(Model::terminal_limits);
    return std::size_t{0};
  }();

  /// Throws std::invalid_argument if lengths do not fit, there is no stage, the step is not
  /// positive, or bounds cross.
  StageGame(Model model, Horizon horizon) : model_(std::move(model)), h_(std::move(horizon)) {
    fill_in();
    shared_ = np + gains() + disturbance_gains() + (free_time() ? 1 : 0);
    locals_ = kBlock + nx + shared_ + h_.memory * nw;
    local_.resize(locals_);
    one_.emplace(locals_);
    together_.emplace(locals_);
    end_tape_.emplace(index(nx + shared_), nt + 1);
    describe();
    find_structure();
  }

  /// Gives access to the model, to change numbers in its formulas for the next solves. They must
  /// read the same variables as before.
  [[nodiscard]] Model& model() {
    value_point_.clear();
    derivative_point_.clear();
    return model_;
  }
  [[nodiscard]] const Model& model() const { return model_; }
  [[nodiscard]] const Horizon& horizon() const { return h_; }

  // Return indices of variables; stages k = 0, ..., T - 1, states also k = T.
  [[nodiscard]] Index state(std::size_t k, std::size_t i) const { return index(k * kBlock + i); }
  [[nodiscard]] Index control(std::size_t k, std::size_t i) const { return state(k, nx + i); }
  [[nodiscard]] Index disturbance(std::size_t k, std::size_t i) const {
    return state(k, nx + nu + i);
  }
  [[nodiscard]] Index parameter(std::size_t i) const { return index(tail() + i); }
  /// Returns the index of entry (i, j) of G: control i, state j.
  [[nodiscard]] Index gain(std::size_t i, std::size_t j) const {
    return index(tail() + np + i * nx + j);
  }
  /// Returns the index of the duration, or -1 if it is given.
  [[nodiscard]] Index duration() const { return free_time() ? index(tail() + shared_ - 1) : -1; }

  /// Sets s_0 for the next solves.
  void set_initial(std::span<const double> s) {
    need(s.size() == nx, "initial: one value per state");
    h_.initial.assign(s.begin(), s.end());
    for (const auto i : up_to(nx)) {
      const double spread = h_.initial_spread.empty() ? 0.0 : h_.initial_spread[i];
      structure_.variable_lower[i] = s[i] - spread;
      structure_.variable_upper[i] = s[i] + spread;
      start_.v[i] = s[i];
    }
  }
  /// Sets the starting point of the next solve.
  void set_start(PrimalDual start) {
    need(start.v.size() == start_.v.size(), "a start: one value per variable");
    need(start.lambda.empty() ||
             (start.lambda.size() == rows() && start.z_lower.size() == variables() &&
              start.z_upper.size() == variables()),
         "a start: no multipliers, or all");
    start_ = std::move(start);
  }

  /// Solves from the guess of the horizon, or from the start that was set. Orderings, symbolic
  /// factorizations and scaling are kept from solve to solve. Limits are treated as in
  /// solve_robust.
  [[nodiscard]] StageAnswer solve(const SolverOptions& options = {},
                                  const SolveObserver& observer = {}) {
    StageAnswer answer = by_stage(solver_.solve(*this, options, observer));
    last_ = answer.result;
    answer.worst_cases = answer.result.worst_cases;
    return answer;
  }
  /// Solves one stage later: s_0 is the measured state (one entry per state), and the solve starts
  /// at the last answer moved one stage ahead, with barrier parameter mu. If the last solve did not
  /// succeed or there was none, it starts where solve does.
  [[nodiscard]] StageAnswer solve_next(std::span<const double> measured, SolverOptions options = {},
                                       double mu = 1e-3, const SolveObserver& observer = {}) {
    const bool warm = last_ && is_success(last_->status);
    if (warm) {
      set_start(shifted(*last_));
      solver_.start_at(horizon_shift().worst_cases(*last_));
      start_warm(options, mu);
    }
    set_initial(measured);
    return solve(options, observer);
  }
  [[nodiscard]] StageAnswer solve_next(std::initializer_list<double> measured,
                                       SolverOptions options = {}, double mu = 1e-3) {
    return solve_next(std::span(measured.begin(), measured.size()), std::move(options), mu);
  }
  /// Returns an answer moved one stage ahead.
  [[nodiscard]] PrimalDual shifted(const Result& result) const {
    return horizon_shift().next(result);
  }
  /// Sets options for a start close to the solution.
  static void start_warm(SolverOptions& options, double mu) { warm_start(options, mu); }

  /// Splits a result of this problem by stage.
  [[nodiscard]] StageAnswer by_stage(Result result) const {
    StageAnswer answer;
    answer.result = std::move(result);
    const std::vector<double>& v = answer.result.v;
    if (v.empty()) return answer;
    need(v.size() == variables(), "a result: one value per variable");
    const auto cut = [&](std::size_t begin, std::size_t size) {
      const auto part = std::span(v).subspan(begin, size);
      return std::vector<double>(part.begin(), part.end());
    };
    std::vector<double> local(locals_);
    for (std::size_t k = 0; k <= h_.stages; ++k) {
      answer.states.push_back(cut(k * kBlock, nx));
      if (k == h_.stages) break;
      gather<double>(v, k, local);
      const auto u = applied_control<double>(local);
      answer.controls.emplace_back(u.begin(), u.end());
      answer.disturbances.push_back(cut(k * kBlock + nx + nu, nw));
    }
    answer.parameters = cut(tail(), np);
    answer.gains = cut(tail() + np, gains());
    answer.memory = cut(tail() + np + gains(), disturbance_gains());
    answer.duration =
        free_time() ? v[tail() + shared_ - 1] : h_.step * static_cast<double>(h_.stages);
    return answer;
  }
  /// Returns the state after a stage of length Horizon::step (also if Min chooses the duration), as
  /// a plant for closed loops. It takes one step of the game's discretization, or `steps` equal
  /// ones for a finer plant. The classical Runge-Kutta method replaces an implicit one, by default
  /// with ten steps. Discrete dynamics take one. Throws std::invalid_argument for wrong lengths.
  [[nodiscard]] std::vector<double> simulate(std::span<const double> s, std::span<const double> u,
                                             std::span<const double> w,
                                             std::span<const double> p = {}, std::size_t k = 0,
                                             std::size_t steps = 0) const {
    need(s.size() == nx && u.size() == nu && w.size() == nw && p.size() == np,
         "simulate: one value per state, control, disturbance and parameter");
    const bool is_explicit = h_.discretization <= Discretization::RungeKutta4;
    const std::size_t by_default = is_explicit ? 1 : 10;
    if (steps == 0 || h_.discretization == Discretization::Discrete) steps = by_default;
    std::vector<Plain> state(s.begin(), s.end()), control(u.begin(), u.end()),
        wind(w.begin(), w.end()), parameters(p.begin(), p.end());
    Stage<Plain> stage{*this,
                       {state, control, wind, parameters, {}, k},
                       Plain(h_.step / static_cast<double>(steps)),
                       is_explicit ? h_.discretization : Discretization::RungeKutta4};
    for (const auto i : up_to(steps)) {
      stage.at.t =
          h_.step * (static_cast<double>(k) + static_cast<double>(i) / static_cast<double>(steps));
      std::array<Plain, nx> next{};
      static_cast<void>(stage.advance(state, std::span<Plain>(next)));
      state.assign(next.begin(), next.end());
    }
    std::vector<double> result;
    for (const Plain& value : state) result.push_back(value.value());
    return result;
  }
  [[nodiscard]] std::vector<double> simulate(std::span<const double> s, std::span<const double> u,
                                             std::initializer_list<double> w) const {
    return simulate(s, u, std::span(w.begin(), w.size()));
  }

  [[nodiscard]] const ProblemStructure& structure() const override { return structure_; }
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    std::ranges::copy(start_.v, start.v.begin());
    if (!start.needs_multipliers) return true;
    if (start_.lambda.empty()) return false;
    std::ranges::copy(start_.lambda, start.lambda.begin());
    std::ranges::copy(start_.z_lower, start.z_lower.begin());
    std::ranges::copy(start_.z_upper, start.z_upper.begin());
    return true;
  }
  /// Copies the model; null for a derived class that does not override it.
  [[nodiscard]] std::unique_ptr<Problem> clone() const override {
    if (typeid(*this) != typeid(StageGame)) return nullptr;
    return copy_as<StageGame>();
  }
  [[nodiscard]] bool objective(std::span<const double> v, bool, double& f) override {
    values(v, parts());
    f = objective_;
    return std::isfinite(f);
  }
  [[nodiscard]] bool constraints(std::span<const double> v, bool, std::span<double> g) override {
    values(v, parts());
    std::ranges::copy(rows_, g.begin());
    return all_finite(g);
  }
  [[nodiscard]] bool gradient(std::span<const double> v, bool, std::span<double> grad) override {
    first_derivatives(v, parts());
    std::ranges::copy(gradient_, grad.begin());
    return all_finite(grad);
  }
  [[nodiscard]] bool jacobian(std::span<const double> v, bool, std::span<double> to) override {
    first_derivatives(v, parts());
    std::ranges::copy(jacobian_, to.begin());
    return all_finite(to);
  }
  [[nodiscard]] bool constraint_rows(std::span<const Index> rows, std::span<const double> v, bool,
                                     std::span<double> g) override {
    values(v, parts_up_to(rows));
    bool finite = true;
    for (const Index row : rows) {
      const auto j = static_cast<std::size_t>(row);
      g[j] = rows_[j];
      finite = finite && std::isfinite(g[j]);
    }
    return finite;
  }
  [[nodiscard]] bool jacobian_rows(std::span<const Index> rows, std::span<const double> v, bool,
                                   std::span<double> to) override {
    first_derivatives(v, parts_up_to(rows));
    std::copy_n(jacobian_.begin(), derived_entries_, to.begin());
    return all_finite(to.first(derived_entries_));
  }
  [[nodiscard]] bool hessian(std::span<const double> v, bool, double sigma,
                             std::span<const double> lambda, bool, std::span<double> to) override {
    std::ranges::fill(to, 0.0);
    std::size_t place = 0;
    const auto take = [&](auto& of, std::size_t first) {
      of.weights.resize(kRows + 1);
      of.weights[kRows].fill(sigma);
      for (const auto l : up_to(of.count)) {
        for (const auto j : up_to(kRows)) of.weights[j][l] = lambda[(first + l) * kRows + j];
      }
      of.values.assign(stage_pattern_.hessian.size(), {});
      of.tape.hessian_at(of.weights, of.values);
    };
    const auto put = [&](std::size_t k, auto value_of) {
      for (const auto e : up_to(stage_pattern_.hessian.size())) {
        if (is_there(k, stage_pattern_.hessian[e])) to[place++] = value_of(e);
      }
    };
    for (std::size_t k = 0; k < h_.stages; k = end_of_group(k)) {
      const std::size_t count = end_of_group(k) - k;
      const auto weights = lambda.subspan(k * kRows, count * kRows);
      if (sigma != 0.0 || std::ranges::any_of(weights, [](double w) { return w != 0.0; })) {
        derive_group(v, k, take, put);
      } else {
        for (const auto l : up_to(count)) put(k + l, [](std::size_t) { return 0.0; });
      }
    }
    record_end(v);
    end_weights_.assign(nt + 1, sigma);
    std::ranges::copy(lambda.subspan(h_.stages * kRows, nt), end_weights_.begin());
    end_tape_->hessian(end_weights_, to.subspan(place));
    return all_finite(to);
  }

 protected:
  /// Whether the model's functions take a StagePoint.
  static constexpr bool kTakesPoints =
      !requires(const Model& m, std::span<const Plain> in, std::span<Plain> out) {
    m.dynamics(in, in, in, out);
  };
  /// Stages whose derivatives are taken together: what an operation costs beside its arithmetic is
  /// paid once.
  static constexpr std::size_t kLanes = 4;
  static constexpr std::size_t kBlock = nx + nu + nw;  ///< variables of a stage
  static constexpr std::size_t kRows = nx + nl;        ///< constraints of a stage
  /// With more stages names would take longer than a solve.
  static constexpr std::size_t kMostNamed = 5000;
  static constexpr double kNone = 2e19;

  static Index index(std::size_t i) { return static_cast<Index>(i); }
  /// 0, 1, ..., n - 1
  static auto up_to(std::size_t n) { return std::views::iota(std::size_t{0}, n); }
  static void need(bool condition, const char* what) {
    if (!condition) throw std::invalid_argument(std::string("StageGame: ") + what);
  }
  static bool all_finite(std::span<const double> values) {
    return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
  }

  [[nodiscard]] std::size_t gains() const { return h_.gain_lower.size(); }
  [[nodiscard]] std::size_t disturbance_gains() const { return nu * nw * h_.memory; }
  [[nodiscard]] bool free_time() const { return h_.duration_upper > 0.0; }
  [[nodiscard]] std::size_t tail() const { return h_.stages * kBlock + nx; }  ///< of parameters on
  [[nodiscard]] std::size_t variables() const { return tail() + shared_; }
  [[nodiscard]] std::size_t rows() const { return h_.stages * kRows + nt; }

  template <class Game>
  [[nodiscard]] std::unique_ptr<Problem> copy_as() const {
    auto copy = std::make_unique<Game>(model_, h_);
    copy->start_ = start_;
    return copy;
  }

  /// Checks the lengths and writes out what was left empty.
  void fill_in() {
    constexpr auto kMostIndices = static_cast<std::size_t>(std::numeric_limits<Index>::max());
    need(h_.stages > 0, "stages must be positive");
    need(h_.stages < kMostIndices / (kBlock + kRows + 1),
         "more stages than variables have indices");
    need(h_.step > 0.0 && std::isfinite(h_.step), "step must be positive");
    need(h_.initial.size() == nx, "initial: one value per state");
    need(0.0 <= h_.duration_lower && h_.duration_lower <= h_.duration_upper,
         "duration: 0 <= lower <= upper");
    need(h_.gain_lower.empty() || h_.gain_lower.size() == nu * nx,
         "gain_lower: controls times states");
    need(h_.gain_upper.size() == h_.gain_lower.size(), "gain_upper: as many as gain_lower");
    need(h_.memory < h_.stages, "memory must be below the number of stages");
    const auto fill = [&](std::vector<double>& values, std::size_t size, double value,
                          const char* what) {
      if (values.empty()) values.assign(size, value);
      need(values.size() == size, what);
      need(std::ranges::none_of(values, [](double x) { return std::isnan(x); }), what);
    };
    const auto bounds = [&](std::vector<double>& lower, std::vector<double>& upper,
                            std::size_t size, const char* what) {
      fill(lower, size, -kNone, what);
      fill(upper, size, kNone, what);
      for (const auto i : up_to(size)) need(lower[i] <= upper[i], what);
    };
    bounds(h_.control_lower, h_.control_upper, nu, "bounds of controls: one per control, in order");
    bounds(h_.disturbance_lower, h_.disturbance_upper, nw,
           "bounds of disturbances: one per disturbance, in order");
    bounds(h_.parameter_lower, h_.parameter_upper, np,
           "bounds of parameters: one per parameter, in order");
    bounds(h_.gain_lower, h_.gain_upper, gains(), "bounds of gains: in order");
    fill(h_.control_guess, nu, 0.0, "control_guess: one per control");
    fill(h_.parameter_guess, np, 0.0, "parameter_guess: one per parameter");
    if (!h_.final_guess.empty()) fill(h_.final_guess, nx, 0.0, "final_guess: one per state");
    if (!h_.initial_spread.empty()) fill(h_.initial_spread, nx, 0.0, "initial_spread: per state");
    const auto names = [](const std::vector<std::string>& given, std::size_t size) {
      need(given.empty() || given.size() == size, "names: one each, or none");
    };
    names(h_.state_names, nx);
    names(h_.control_names, nu);
    names(h_.disturbance_names, nw);
  }

  /// Variables and constraints in their order.
  void describe() {
    const bool named = h_.stages <= kMostNamed;
    using Names = std::vector<std::string>;
    std::string stage;  // ends the names
    const auto name = [&](const Names& given, const char* stem, std::size_t i) {
      return (i < given.size() ? given[i] : stem + std::to_string(i)) + stage;
    };
    const auto add = [&](Player player, double lower, double upper, double start,
                         const Names& given, const char* stem, std::size_t i) {
      structure_.variable_players.push_back(player);
      structure_.variable_lower.push_back(lower);
      structure_.variable_upper.push_back(upper);
      start_.v.push_back(std::clamp(start, lower, upper));
      if (named) structure_.variable_names.push_back(name(given, stem, i));
    };
    const auto add_row = [&](Player player, const char* prefix, const Names& given,
                             const char* stem, std::size_t i) {
      structure_.constraint_players.push_back(player);
      structure_.constraint_lower.push_back(player == Player::Min ? -kNone : 0.0);  // limits
      structure_.constraint_upper.push_back(0.0);
      if (named) structure_.constraint_names.push_back(prefix + name(given, stem, i));
    };
    const std::vector<double>& last = h_.final_guess.empty() ? h_.initial : h_.final_guess;
    for (std::size_t k = 0; k <= h_.stages; ++k) {
      if (named) stage = "[" + std::to_string(k) + "]";
      const double share = static_cast<double>(k) / static_cast<double>(h_.stages);
      for (const auto i : up_to(nx))
        add(Player::Max, -kNone, kNone, (1.0 - share) * h_.initial[i] + share * last[i],
            h_.state_names, "state", i);
      if (k == h_.stages) break;
      for (const auto i : up_to(nu))
        add(Player::Min, h_.control_lower[i], h_.control_upper[i], h_.control_guess[i],
            h_.control_names, "control", i);
      for (const auto i : up_to(nw))
        add(Player::Max, h_.disturbance_lower[i], h_.disturbance_upper[i], 0.0,
            h_.disturbance_names, "disturbance", i);
      for (const auto i : up_to(nx)) add_row(Player::Max, "next_", h_.state_names, "state", i);
      for (const auto i : up_to(nl)) add_row(Player::Min, "", {}, "limit", i);
    }
    stage.clear();
    for (const auto i : up_to(np))
      add(Player::Min, h_.parameter_lower[i], h_.parameter_upper[i], h_.parameter_guess[i], {},
          "parameter", i);
    for (const auto i : up_to(gains()))
      add(Player::Min, h_.gain_lower[i], h_.gain_upper[i], 0.0, {}, "gain", i);
    for (const auto i : up_to(disturbance_gains()))
      add(Player::Min, -h_.memory_bound, h_.memory_bound, 0.0, {}, "memory", i);
    if (free_time())
      add(Player::Min, h_.duration_lower, h_.duration_upper,
          h_.step * static_cast<double>(h_.stages), {"duration"}, "", 0);
    for (const auto i : up_to(nt)) add_row(Player::Min, "", {}, "terminal_limit", i);
    set_initial(std::vector<double>(h_.initial));
  }

  /// The pattern of all stages together; the first ones lack disturbances before the start.
  void find_structure() {
    for (const auto k : up_to(h_.stages)) {
      record(*one_, start_.v, k);
      if (k == 0 || stage_pattern_ != one_->tape.pattern())
        stage_pattern_ = autodiff::united(stage_pattern_, one_->tape.pattern());
    }
    record_end(start_.v);
    end_pattern_ = end_tape_->pattern();
    one_->tape.set_pattern(stage_pattern_);
    together_->tape.set_pattern(stage_pattern_);
    end_tape_->set_pattern(end_pattern_);
    for (const auto k : up_to(h_.stages)) {
      for (const auto& [row, col] : stage_pattern_.jacobian) {
        const Index j = global(k, col);
        if (j >= 0 && row < index(kRows))
          structure_.jacobian.push_back({index(k * kRows) + row, j});
      }
      for (const Triplet& entry : stage_pattern_.hessian) {
        if (is_there(k, entry))
          structure_.hessian.push_back({global(k, entry.row), global(k, entry.col)});
      }
    }
    const auto end = [&](Index local) { return index(h_.stages * kBlock) + local; };
    for (const auto& [row, col] : end_pattern_.jacobian) {
      if (row < index(nt))
        structure_.jacobian.push_back({index(h_.stages * kRows) + row, end(col)});
    }
    for (const auto& [row, col] : end_pattern_.hessian)
      structure_.hessian.push_back({end(row), end(col)});
    rows_.resize(rows());
    gradient_.resize(variables());
    jacobian_.resize(structure_.jacobian.size());
  }
  /// Variable of a stage's input: s_k, u_k, w_k, s_{k+1}; parameters, gains, memory, duration;
  /// w_{k-1}, w_{k-2}, ... -1: before the start.
  [[nodiscard]] Index global(std::size_t k, Index input) const {
    auto local = static_cast<std::size_t>(input);
    if (local < kBlock + nx) return index(k * kBlock + local);
    local -= kBlock + nx;
    if (local < shared_) return index(tail() + local);
    if constexpr (nw > 0) {
      const std::size_t back = (local - shared_) / nw + 1, i = (local - shared_) % nw;
      if (back <= k) return disturbance(k - back, i);
    }
    return -1;
  }
  [[nodiscard]] bool is_there(std::size_t k, const Triplet& entry) const {
    return k >= h_.memory || (global(k, entry.row) >= 0 && global(k, entry.col) >= 0);
  }
  template <class T>
  void gather(std::span<const T> v, std::size_t k, std::span<T> local) const {
    const auto own = v.subspan(k * kBlock, kBlock + nx), shared = v.subspan(tail(), shared_);
    std::ranges::copy(shared, std::ranges::copy(own, local.begin()).out);
    for (std::size_t i = kBlock + nx + shared_; i < locals_; ++i) {
      const Index at = global(k, index(i));
      local[i] = at < 0 ? T(0.0) : v[static_cast<std::size_t>(at)];
    }
  }

  template <class T>
  [[nodiscard]] std::array<T, nu> applied_control(std::span<const T> in) const {
    std::array<T, nu> u{};
    const std::span<const T> shared = in.subspan(kBlock + nx);
    for (const auto i : up_to(nu)) {
      u[i] = in[nx + i];
      for (std::size_t j = 0; j < nx && gains() > 0; ++j) u[i] += shared[np + i * nx + j] * in[j];
      for (const auto l : up_to(h_.memory)) {
        for (const auto j : up_to(nw))
          u[i] += shared[np + gains() + (l * nu + i) * nw + j] * shared[shared_ + l * nw + j];
      }
    }
    return u;
  }
  [[nodiscard]] bool prices_feedback() const {
    return h_.memory > 0 || !std::ranges::equal(h_.gain_lower, h_.gain_upper);
  }

  /// One stage in numbers of type T.
  template <class T>
  struct Stage {
    const StageGame& game;
    StagePoint<T> at;
    T h;
    Discretization how;
    using State = std::array<T, nx>;

    /// The stage's point with another state and time.
    StagePoint<T> point(std::span<const T> s, const T& t) const {
      StagePoint<T> p = at;
      p.s = s;
      p.t = t;
      return p;
    }
    T cost(std::span<const T> s, const T& t) const {
      const StagePoint<T> p = point(s, t);
      if constexpr (kTakesPoints)
        return game.model_.cost(p);
      else
        return game.model_.cost(p.s, p.u, p.w);
    }
    State rate(std::span<const T> s, const T& t) const {
      const StagePoint<T> p = point(s, t);
      State to{};
      if constexpr (kTakesPoints)
        game.model_.dynamics(p, std::span<T>(to));
      else
        game.model_.dynamics(p.s, p.u, p.w, std::span<T>(to));
      return to;
    }
    /// s + h r
    static State along(std::span<const T> s, const T& step, const State& r) {
      State to{};
      for (const auto i : up_to(nx)) to[i] = s[i] + step * r[i];
      return to;
    }
    /// The next state of an explicit rule; returns the stage's cost.
    T advance(std::span<const T> s, std::span<T> next) const {
      if (how == Discretization::Discrete) {
        std::ranges::copy(rate(s, at.t), next.begin());
        return cost(s, at.t);
      }
      const State a = rate(s, at.t);
      if (how == Discretization::Euler) {
        std::ranges::copy(along(s, h, a), next.begin());
        return h * cost(s, at.t);
      }
      const T half = 0.5 * h, middle = at.t + half, end = at.t + h;
      const State s2 = along(s, half, a), b = rate(s2, middle);
      const State s3 = along(s, half, b), c = rate(s3, middle);
      const State s4 = along(s, h, c), d = rate(s4, end);
      for (const auto i : up_to(nx))
        next[i] = s[i] + h * (1.0 / 6.0) * (a[i] + 2.0 * (b[i] + c[i]) + d[i]);
      return h * (1.0 / 6.0) *
             (cost(s, at.t) + 2.0 * (cost(s2, middle) + cost(s3, middle)) + cost(s4, end));
    }
    /// s_{k+1} minus what the rule gives; returns the stage's cost.
    T defects(std::span<const T> next, std::span<T> to) const {
      const std::span<const T> s = at.s;
      const T half = 0.5 * h, middle = at.t + half, end = at.t + h;
      if (how == Discretization::ImplicitMidpoint) {
        State mid{};
        for (const auto i : up_to(nx)) mid[i] = 0.5 * (s[i] + next[i]);
        const State r = rate(mid, middle);
        for (const auto i : up_to(nx)) to[i] = next[i] - s[i] - h * r[i];
        return h * cost(mid, middle);
      }
      if (how == Discretization::HermiteSimpson) {
        const State a = rate(s, at.t), c = rate(next, end);
        State mid{};
        for (const auto i : up_to(nx)) mid[i] = 0.5 * (s[i] + next[i]) + h * 0.125 * (a[i] - c[i]);
        const State b = rate(mid, middle);
        for (const auto i : up_to(nx))
          to[i] = next[i] - s[i] - h * (1.0 / 6.0) * (a[i] + 4.0 * b[i] + c[i]);
        return h * (1.0 / 6.0) * (cost(s, at.t) + 4.0 * cost(mid, middle) + cost(next, end));
      }
      State given{};
      const T total = advance(s, given);
      for (const auto i : up_to(nx)) to[i] = next[i] - given[i];
      return total;
    }
  };

  /// Rows of a stage, then its cost.
  template <class T>
  void run_stage(std::size_t k, std::span<const T> in, std::span<T> out) const {
    const std::array<T, nu> u = applied_control(in);
    const std::span<const T> next = in.subspan(kBlock, nx), shared = in.subspan(kBlock + nx);
    const T h = step<T>(shared);
    Stage<T> stage{
        *this,
        {in.first(nx), u, in.subspan(nx + nu, nw), shared.first(np), h * static_cast<double>(k), k},
        h,
        h_.discretization};
    T& cost = out[kRows];
    cost = stage.defects(next, out.first(nx));
    if (prices_feedback()) {
      for (const auto i : up_to(nu)) cost += h_.feedback_price * in[nx + i] * in[nx + i];
    }
    if constexpr (nl > 0) {
      const StagePoint<T> at = stage.point(next, stage.at.t + h);
      const std::span<T> g = out.subspan(nx, nl);
      if constexpr (kTakesPoints)
        model_.limits_of(at, g);
      else
        model_.limits_of(at.s, at.u, g);
    }
  }
  template <class T>
  [[nodiscard]] T step(std::span<const T> shared) const {
    if (!free_time()) return h_.step;
    return shared[shared_ - 1] * (1.0 / static_cast<double>(h_.stages));
  }
  /// Terminal limits, then the terminal cost. in: s_T, parameters, gains, memory, duration.
  template <class T>
  void run_end(std::span<const T> in, std::span<T> out) const {
    const std::span<const T> shared = in.subspan(nx);
    const StagePoint<T> at{
        in.first(nx), {}, {}, shared.first(np), step<T>(shared) * static_cast<double>(h_.stages),
        h_.stages};
    T& cost = out[nt];
    cost = 0.0;
    if constexpr (kTakesPoints) {
      if constexpr (requires { model_.terminal_cost(at); }) cost = model_.terminal_cost(at);
    } else if constexpr (requires { model_.terminal_cost(at.s); }) {
      cost = model_.terminal_cost(at.s);
    }
    const std::size_t feedback = prices_feedback() ? gains() + disturbance_gains() : 0;
    for (const auto i : up_to(feedback))
      cost += h_.feedback_price * shared[np + i] * shared[np + i];
    if constexpr (nt > 0) {
      const std::span<T> g = out.first(nt);
      if constexpr (kTakesPoints)
        model_.terminal_limits_of(at, g);
      else
        model_.terminal_limits_of(at.s, g);
    }
  }

  /// States s_1, ..., s_T of v set to those that follow by an explicit rule; the constraints are
  /// set to their values, the objective is returned.
  template <class T>
  [[nodiscard]] T roll_out(std::span<T> v, std::span<T> rows) const {
    std::vector<T> local(locals_);
    std::array<T, kRows + 1> out{};
    T total = 0.0;
    for (const auto k : up_to(h_.stages)) {
      gather<T>(v, k, local);
      const auto next = std::span(local).subspan(kBlock, nx);
      std::ranges::fill(next, T(0.0));
      run_stage<T>(k, local, out);
      for (const auto i : up_to(nx)) next[i] = v[(k + 1) * kBlock + i] = -out[i];
      run_stage<T>(k, local, out);
      std::ranges::fill(std::span(out).first(nx), T(0.0));
      std::copy_n(out.begin(), kRows, rows.subspan(k * kRows).begin());
      total += out[kRows];
    }
    std::array<T, nt + 1> last{};
    run_end<T>(v.subspan(h_.stages * kBlock), last);
    std::copy_n(last.begin(), nt, rows.last(nt).begin());
    return total + last[nt];
  }

  /// Derivatives of L stages at a time.
  template <std::size_t L>
  struct Stages {
    explicit Stages(std::size_t inputs) : local(inputs), tape(index(inputs), kRows + 1) {}
    static constexpr std::size_t count = L;
    std::vector<autodiff::Lanes<L>> local, weights, values;
    autodiff::TapeOf<L> tape;
  };
  /// Runs the formulas of L stages from k on. False: they differ in a branch.
  template <std::size_t L>
  bool record(Stages<L>& of, std::span<const double> v, std::size_t k) {
    for (const auto l : up_to(L)) {
      gather<double>(v, k + l, local_);
      for (const auto i : up_to(locals_)) of.local[i][l] = local_[i];
    }
    using Number = autodiff::TapedLanes<L>;
    return of.tape.record_at(of.local, [&](std::span<const Number> in, std::span<Number> out) {
      run_stage<Number>(k, in, out);
    });
  }
  [[nodiscard]] std::size_t end_of_group(std::size_t k) const {
    return std::min(k + kLanes, h_.stages);
  }
  /// Derivatives of the group of stages that begins at k: together, or one by one where stages
  /// differ (functions of the stage's number, the first ones with memory, branches) or are few.
  /// take(of, first) computes of.values, put(stage, value_of) gets those of each stage in turn.
  template <class Take, class Put>
  void derive_group(std::span<const double> v, std::size_t k, const Take& take, const Put& put) {
    const auto derive = [&](auto& of, std::size_t first) {
      if (!record(of, v, first)) return false;
      take(of, first);
      for (const auto l : up_to(of.count))
        put(first + l, [&](std::size_t e) { return of.values[e][l]; });
      return true;
    };
    const std::size_t end = end_of_group(k);
    const bool may_differ = kTakesPoints || h_.memory > 0 || end - k < kLanes;
    if (!may_differ && derive(*together_, k)) return;
    for (; k < end; ++k) derive(*one_, k);
  }
  void record_end(std::span<const double> v) {
    end_tape_->record(
        v.subspan(h_.stages * kBlock),
        [&](std::span<const Taped> in, std::span<Taped> out) { run_end<Taped>(in, out); });
  }

  /// The stages and the end.
  [[nodiscard]] std::size_t parts() const { return h_.stages + 1; }
  /// The first ones, up to that of the last of some constraints (ascending).
  [[nodiscard]] std::size_t parts_up_to(std::span<const Index> rows) const {
    if (rows.empty()) return 0;
    return std::min(static_cast<std::size_t>(rows.back()) / kRows, h_.stages) + 1;
  }

  /// f and g at v, of these first parts.
  void values(std::span<const double> v, std::size_t count) {
    if (!std::ranges::equal(v, value_point_)) {
      value_point_.assign(v.begin(), v.end());
      valued_ = 0;
      objective_ = 0.0;
    }
    std::array<Plain, kRows + 1> out{};
    for (; valued_ < std::min(count, h_.stages); ++valued_) {
      gather<double>(v, valued_, local_);
      plain_.assign(local_.begin(), local_.end());
      run_stage<Plain>(valued_, plain_, out);
      for (const auto j : up_to(kRows)) rows_[valued_ * kRows + j] = out[j].value();
      objective_ += out[kRows].value();
    }
    if (valued_ >= count) return;
    std::array<Plain, nt + 1> last{};
    const auto end = v.subspan(h_.stages * kBlock);
    plain_.assign(end.begin(), end.end());
    run_end<Plain>(plain_, last);
    for (const auto j : up_to(nt)) rows_[h_.stages * kRows + j] = last[j].value();
    objective_ += last[nt].value();
    ++valued_;
  }
  /// Gradient and Jacobian at v, of these first parts.
  void first_derivatives(std::span<const double> v, std::size_t count) {
    if (!std::ranges::equal(v, derivative_point_)) {
      derivative_point_.assign(v.begin(), v.end());
      derived_ = derived_entries_ = 0;
      std::ranges::fill(gradient_, 0.0);
    }
    const auto take = [&](auto& of, std::size_t) {
      of.values.assign(stage_pattern_.jacobian.size(), {});
      of.tape.jacobian_at(0, kRows + 1, of.values);
    };
    const auto put = [&](std::size_t k, auto value_of) {
      for (const auto e : up_to(stage_pattern_.jacobian.size())) {
        const auto& [row, col] = stage_pattern_.jacobian[e];
        const Index i = global(k, col);
        if (i < 0) continue;
        if (row < index(kRows))
          jacobian_[derived_entries_++] = value_of(e);
        else
          gradient_[static_cast<std::size_t>(i)] += value_of(e);
      }
      derived_ = k + 1;
    };
    while (derived_ < std::min(count, h_.stages)) derive_group(v, derived_, take, put);
    if (derived_ >= count) return;
    record_end(v);
    end_values_.assign(end_pattern_.jacobian.size(), 0.0);
    end_tape_->jacobian(0, nt + 1, end_values_);
    for (const auto e : up_to(end_values_.size())) {
      const auto& [row, col] = end_pattern_.jacobian[e];
      if (row < index(nt))
        jacobian_[derived_entries_++] = end_values_[e];
      else
        gradient_[h_.stages * kBlock + static_cast<std::size_t>(col)] += end_values_[e];
    }
    ++derived_;
  }
  [[nodiscard]] HorizonShift horizon_shift() const {
    return {h_.stages, {{0, kBlock}}, {{0, kRows}}};
  }

  Model model_;
  Horizon h_;
  std::size_t shared_ = 0;  ///< parameters, gains, memory, duration
  std::size_t locals_ = 0;  ///< inputs of a stage
  std::optional<Stages<1>> one_;
  std::optional<Stages<kLanes>> together_;
  std::optional<autodiff::Tape> end_tape_;
  autodiff::Pattern stage_pattern_, end_pattern_;
  ProblemStructure structure_;
  PrimalDual start_;
  RepeatedSolver solver_;
  std::optional<Result> last_;

  std::vector<double> value_point_, derivative_point_;  ///< empty: none
  std::size_t valued_ = 0, derived_ = 0;                ///< parts evaluated there
  std::size_t derived_entries_ = 0;                     ///< of the Jacobian
  double objective_ = 0.0;
  std::vector<double> rows_, gradient_, jacobian_;
  std::vector<double> local_, end_weights_, end_values_;
  std::vector<Plain> plain_;
};

/// A game whose worst cases can be proved (docs/proof.md). Its Model's functions must also take
/// intervals, and its rule must be explicit (Discrete, Euler, RungeKutta4), so that the states
/// follow from s_0 and the disturbances.
template <class Model>
class ProvableStageGame final : public StageGame<Model>, public BoxFunctions {
 public:
  using Game = StageGame<Model>;
  /// Throws std::invalid_argument as StageGame, and for an implicit rule.
  ProvableStageGame(Model model, Horizon horizon) : Game(std::move(model), std::move(horizon)) {
    const Discretization rule = this->horizon().discretization;
    if (rule == Discretization::ImplicitMidpoint || rule == Discretization::HermiteSimpson) {
      throw std::invalid_argument("a provable game of stages needs an explicit discretization");
    }
  }

  [[nodiscard]] const BoxFunctions* over_boxes() const override { return this; }
  [[nodiscard]] IntervalJet objective_over(std::span<const IntervalJet> v) const override {
    std::vector<IntervalJet> g(this->rows());
    return all_over(v, g);
  }
  void constraints_over(std::span<const IntervalJet> v, std::span<IntervalJet> g) const override {
    static_cast<void>(all_over(v, g));
  }
  [[nodiscard]] IntervalJet all_over(std::span<const IntervalJet> v,
                                     std::span<IntervalJet> g) const override {
    std::vector<IntervalJet> own(v.begin(), v.end());
    return this->template roll_out<IntervalJet>(own, g);
  }
  [[nodiscard]] bool is_concurrent() const override { return true; }
  [[nodiscard]] std::unique_ptr<Problem> clone() const override {
    return this->template copy_as<ProvableStageGame>();
  }
  [[nodiscard]] Determined determined() const override {
    Determined found;
    for (const auto k : this->up_to(this->horizon().stages)) {
      for (const auto i : this->up_to(Game::nx)) {
        found.variables.push_back(this->state(k + 1, i));
        found.constraints.push_back(static_cast<Index>(k * Game::kRows + i));
      }
    }
    return found;
  }
  void determine(std::span<double> v) const override {
    std::vector<Plain> own(v.begin(), v.end()), g(this->rows());
    static_cast<void>(this->template roll_out<Plain>(own, g));
    std::ranges::transform(own, v.begin(), [](const Plain& value) { return value.value(); });
  }
};

}  // namespace ipminmax
