#include "core/sensitivity.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "core/certificate/active_set.hpp"
#include "core/certificate/parameters.hpp"
#include "core/certificate/scaling.hpp"
#include "core/differences/finite_difference_hessian.hpp"
#include "core/model/forwarding_problem.hpp"
#include "core/model/indices.hpp"
#include "core/model/norms.hpp"
#include "core/point/point.hpp"
#include "core/robust/robust_copies.hpp"
#include "core/sensitivity/active_system.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

/// Per place, absent ones at infinity.
struct Bounds {
  std::vector<double> lower, upper;
};

/// The values of variables and constraints in one vector per place.
std::vector<double> joined(std::span<const double> variables, std::span<const double> constraints) {
  std::vector<double> all(variables.begin(), variables.end());
  all.insert(all.end(), constraints.begin(), constraints.end());
  return all;
}

Bounds bounds_of(const ProblemStructure& structure, const SolverOptions& options) {
  Bounds bounds{joined(structure.variable_lower, structure.constraint_lower),
                joined(structure.variable_upper, structure.constraint_upper)};
  for (double& value : bounds.lower) {
    if (value <= options.nlp_lower_bound_inf) value = -kInfinity;
  }
  for (double& value : bounds.upper) {
    if (value >= options.nlp_upper_bound_inf) value = kInfinity;
  }
  return bounds;
}

/// Per place +1 for Min, -1 for Max: times this, multipliers of lower bounds (z_lower, -lambda) and
/// of upper ones (z_upper, lambda) are >= 0.
std::vector<double> signs_of(const ProblemStructure& structure) {
  std::vector<double> signs;
  for (const auto* players : {&structure.variable_players, &structure.constraint_players}) {
    for (const Player player : *players) signs.push_back(player == Player::Min ? 1.0 : -1.0);
  }
  return signs;
}

/// "variable 3", or the model's name for it.
std::string place_name(const ProblemStructure& structure, std::size_t place) {
  const std::size_t n = structure.variable_players.size();
  const auto& names = place < n ? structure.variable_names : structure.constraint_names;
  const std::size_t i = place < n ? place : place - n;
  return (place < n ? "variable " : "constraint ") +
         (i < names.size() ? names[i] : std::to_string(i));
}

/// What holds a place: a bound whose multiplier, times the square of the length, exceeds the
/// distance to it. pressure: the multiplier, positive on the lower bound. weak: -1 or +1 where
/// neither exceeds the other clearly at the lower or the upper bound, else 0.
Hold hold_of(double value, double lower, double upper, double pressure, double length, int& weak) {
  weak = 0;
  if (lower == upper) return Hold::Fixed;
  const auto found = [&](int side, double strict_ratio) {
    return class_of(std::max(-side * pressure, 0.0) * length * length,
                    std::max(side < 0 ? value - lower : upper - value, 0.0), strict_ratio);
  };
  for (const int side : {1, -1}) {
    if (found(side, parameters::certificate::kStrictRatio) == BoundClass::WeaklyActive) weak = side;
  }
  if (found(-1, 1.0) == BoundClass::Active) return Hold::Lower;
  return found(1, 1.0) == BoundClass::Active ? Hold::Upper : Hold::Free;
}

constexpr const char* kInaccurate = "the KKT system cannot be solved accurately";

/// What moves: bounds, or (inner) the minimizer's variables, to which only Max reacts.
struct Move {
  Bounds bounds;  ///< changes
  bool inner = false;
  std::vector<double> held;  ///< n, read at Min's variables when inner
};

/// A point on the way of a linearized solution. Per place: the value of a variable or constraint,
/// and what balances its bounds, entries of grad f + J'lambda and of -lambda.
struct Waypoint {
  ActiveSet active;
  std::vector<double> value, multiplier;
  Bounds bounds;
  double objective = 0.0;
};

/// Derivatives of a Waypoint along a Move.
struct Velocity {
  std::vector<double> value, multiplier;
  double slope = 0.0, curvature = 0.0;  ///< of the objective
};

/// The next change of the active set.
struct Event {
  double step = kInfinity;
  std::size_t place = 0;
  Hold to = Hold::Free, from = Hold::Free;
};

std::vector<double> padded(const std::vector<double>& values, std::size_t size, const char* name) {
  if (values.empty()) return std::vector<double>(size, 0.0);
  if (values.size() != size) {
    throw std::invalid_argument(std::string(name) + " has " + std::to_string(values.size()) +
                                " entries, but there are " + std::to_string(size));
  }
  if (!all_finite(values)) throw std::invalid_argument(std::string(name) + " is not finite");
  return values;
}

void add(double step, const std::vector<double>& direction, std::vector<double>& values) {
  for (const auto i : indices(values)) values[i] += step * direction[i];
}

/// The model with fixed variables free to move: their values are parameters, and the differences
/// that make its Hessian leave out what is fixed.
Restructured unfixed(Problem& problem) {
  Restructured model(problem);
  ProblemStructure& s = model.changed;
  for (const auto i : indices(s.variable_lower)) {
    if (s.variable_lower[i] < s.variable_upper[i]) continue;
    s.variable_lower[i] = -kInfinity;
    s.variable_upper[i] = kInfinity;
  }
  return model;
}

}  // namespace

struct [[gnu::visibility("hidden")]] Sensitivity::State {
  ProblemStructure structure;
  std::size_t n = 0;          ///< variables, which are the first places
  std::vector<double> signs;  ///< signs_of
  Waypoint solution;
  std::vector<double> inner_multiplier;  ///< of variables, without Min's constraints
  std::vector<double> z_lower, z_upper;  ///< of the result
  std::optional<ActiveSystem> system;
  std::vector<double> lengths;  ///< of variables and constraints, in which bounds are active
  std::vector<std::string> weak;
  bool available = false;
  Index lost_factorizations = 0, lost_analyses = 0;  ///< of earlier systems

  [[nodiscard]] std::string read(Problem & problem, const Result& result,
                                 const SolverOptions& options);
  /// The model is evaluated at the result.
  [[nodiscard]] std::string read_point(CanonicalProblem & canonical, const Result& result,
                                       const SolverOptions& options);
  /// The bounds, multipliers and active set of the solution. dual: of the variables.
  void read_solution(const Result& result, const SolverOptions& options,
                     const std::vector<double>& dual);
  /// The system of the solution's active set.
  [[nodiscard]] std::string factorize(const SolverOptions& options,
                                      const CanonicalProblem& canonical,
                                      const Evaluation& evaluation);
  [[nodiscard]] Move move_of(const BoundChange& change) const;
  [[nodiscard]] Move move_of(std::span<const double> dx) const;
  [[nodiscard]] Waypoint start(const Move& move) const;
  [[nodiscard]] std::optional<Velocity> velocity(const Waypoint& at, const Move& move);
  [[nodiscard]] Event next_event(const Waypoint& at, const Velocity& velocity, const Move& move)
      const;
  [[nodiscard]] ActiveSetChange describe(const Event& event, double share) const;
  [[nodiscard]] SolutionDerivative derivative(const Move& move);
  [[nodiscard]] Prediction predict(const Move& move);
  /// Values or derivatives of v, lambda and the bounds' multipliers.
  template <class To>
  void write(const Waypoint& at, const Move& move, const std::vector<double>& value,
             const std::vector<double>& multiplier, To& to) const;
  /// Whether it is the minimizer's, who does not react to an inner move.
  [[nodiscard]] bool is_still(std::size_t place, const Move& move) const {
    return move.inner && signs[place] > 0.0;
  }
};

std::string Sensitivity::State::read(Problem& problem, const Result& result,
                                     const SolverOptions& options) {
  structure = problem.structure();
  if (!robust_constraints(structure).empty()) {
    return "sensitivities of models with robust constraints are not available";
  }
  n = structure.variable_players.size();
  const std::size_t m = structure.constraint_players.size();
  if (result.v.size() != n || result.lambda.size() != m || result.constraints.size() != m ||
      (result.certificate.kind != PointKind::LocalMinmax &&
       result.certificate.kind != PointKind::FirstOrderPoint)) {
    return "the result is no first-order point of the problem";
  }
  const bool differences =
      options.hessian_approximation == HessianApproximation::FiniteDifferenceValues ||
      !structure.has_hessian;
  Restructured free = unfixed(problem);
  std::optional<FiniteDifferenceHessian> wrapped;
  if (differences) wrapped.emplace(free, options);
  AtResult model(wrapped ? static_cast<Problem&>(*wrapped) : free, &result);
  SolverOptions unscaled = options;
  unscaled.nlp_scaling_method = Scaling::None;
  unscaled.obj_scaling_factor = 1.0;
  unscaled.hessian_approximation = HessianApproximation::Exact;
  unscaled.warm_start_init_point = false;
  Counts counts;
  Timing timing;
  CanonicalProblem canonical(model, unscaled, counts, timing);
  if (std::string error = canonical.build(); !error.empty()) return error;
  signs = signs_of(structure);
  return read_point(canonical, result, options);
}

std::string Sensitivity::State::read_point(CanonicalProblem& canonical, const Result& result,
                                           const SolverOptions& options) {
  Point point = unevaluated_point(canonical, canonical.starting_point());
  Iterate& iterate = point.iterate;
  const auto each_own = [&](auto use) {
    for (const IndexRange own : {canonical.x(), canonical.y()}) {
      for (const Index i : indices(own)) use(i, at(canonical.model_variable(i)));
    }
  };
  each_own([&](Index i, std::size_t place) { iterate.v[i] = result.v[place]; });
  for (const Index j : each_constraint(canonical)) {
    iterate.lambda[j] = result.lambda[at(canonical.model_constraint(j))];
  }
  if (!evaluate_derivatives(canonical, point)) {
    return canonical.evaluation_error() + " at the solution";
  }
  const VariableScaling scaling = variable_scaling(canonical, iterate.v, point.evaluation);
  lengths.assign(signs.size(), 1.0);
  std::vector<double> dual(n);
  each_own([&](Index i, std::size_t place) {
    lengths[place] = scaling.variable[i];
    dual[place] = point.dual[i];
  });
  for (const Index j : each_constraint(canonical)) {
    lengths[n + at(canonical.model_constraint(j))] = 1.0 / scaling.constraint[j];
  }
  for (const Index j : indices(canonical.min_constraints())) iterate.lambda[j] = 0.0;
  renew_dual(canonical, point);
  inner_multiplier.resize(n);
  each_own([&](Index i, std::size_t place) { inner_multiplier[place] = point.dual[i]; });
  read_solution(result, options, dual);
  return factorize(options, canonical, point.evaluation);
}

void Sensitivity::State::read_solution(const Result& result, const SolverOptions& options,
                                       const std::vector<double>& dual) {
  solution.bounds = bounds_of(structure, options);
  solution.value = joined(result.v, result.constraints);
  solution.multiplier = joined(dual, result.lambda);
  for (std::size_t k = n; k < signs.size(); ++k) solution.multiplier[k] *= -1.0;
  solution.objective = result.objective;
  solution.active.clear();
  weak.clear();
  for (const auto k : indices(signs)) {
    int side = 0;
    solution.active.push_back(hold_of(solution.value[k], solution.bounds.lower[k],
                                      solution.bounds.upper[k], signs[k] * solution.multiplier[k],
                                      lengths[k], side));
    if (side != 0)
      weak.push_back(place_name(structure, k) + " at its " + (side < 0 ? "lower" : "upper") +
                     " bound");
  }
  z_lower = result.z_lower;
  z_upper = result.z_upper;
}

std::string Sensitivity::State::factorize(const SolverOptions& options,
                                          const CanonicalProblem& canonical,
                                          const Evaluation& evaluation) {
  std::vector<Triplet> entries;
  std::vector<double> values;
  const auto variable = [&](Index i) { return canonical.model_variable(i); };
  for_each_in_hessian(canonical, evaluation, [&](Index i, Index j, double value) {
    entries.push_back({variable(i), variable(j)});
    values.push_back(value);
  });
  for_each_in_jacobian(canonical, evaluation, [&](Index row, Index col, double value) {
    entries.push_back({static_cast<Index>(n) + canonical.model_constraint(row), variable(col)});
    values.push_back(value);
  });
  std::vector<std::int8_t> expected;
  std::vector<double> scale = lengths;
  for (const auto k : indices(signs)) {
    expected.push_back(static_cast<std::int8_t>(k < n ? signs[k] : -signs[k]));
    if (k >= n) scale[k] = 1.0 / lengths[k];
  }
  if (!system || !system->fits(expected, entries)) {
    if (system) {
      lost_factorizations += system->factorizations();
      lost_analyses += system->analyses();
    }
    system.emplace(n, std::move(expected), std::move(entries), options);
  }
  system->set_values(values, std::move(scale));
  return system->factorize(solution.active);
}

Move Sensitivity::State::move_of(const BoundChange& change) const {
  const std::size_t m = signs.size() - n;
  Move move;
  move.bounds = {joined(padded(change.variable_lower, n, "variable_lower"),
                        padded(change.constraint_lower, m, "constraint_lower")),
                 joined(padded(change.variable_upper, n, "variable_upper"),
                        padded(change.constraint_upper, m, "constraint_upper"))};
  for (const auto k : indices(signs)) {
    if (solution.active[k] == Hold::Fixed && move.bounds.lower[k] != move.bounds.upper[k]) {
      throw std::invalid_argument("the equal bounds of " + place_name(structure, k) +
                                  " must be moved alike");
    }
  }
  return move;
}

Move Sensitivity::State::move_of(std::span<const double> dx) const {
  Move move = move_of(BoundChange{});
  move.inner = true;
  if (dx.size() != n) {
    throw std::invalid_argument("dx has " + std::to_string(dx.size()) + " entries, but there are " +
                                std::to_string(n) + " variables");
  }
  move.held.assign(dx.begin(), dx.end());
  for (std::size_t i = 0; i < n; ++i) {
    if (signs[i] < 0.0) move.held[i] = 0.0;
  }
  if (!all_finite(move.held)) throw std::invalid_argument("dx is not finite");
  return move;
}

Waypoint Sensitivity::State::start(const Move& move) const {
  Waypoint start = solution;
  for (const auto k : indices(signs)) {
    if (move.inner && k < n) start.multiplier[k] = inner_multiplier[k];
    if (is_still(k, move)) start.active[k] = k < n ? Hold::Fixed : Hold::Free;
  }
  return start;
}

/// The system must have the factors for the active set. Empty: it cannot be solved accurately.
std::optional<Velocity> Sensitivity::State::velocity(const Waypoint& at, const Move& move) {
  std::vector<double> moved(signs.size(), 0.0);  // of what is held
  for (const auto k : indices(moved)) {
    if (at.active[k] == Hold::Free) continue;
    moved[k] = at.active[k] == Hold::Upper ? move.bounds.upper[k] : move.bounds.lower[k];
    if (k < n && is_still(k, move)) moved[k] = move.held[k];
  }
  Velocity velocity;
  if (!system->solve(moved, velocity.value, velocity.multiplier)) return std::nullopt;
  for (std::size_t k = n; k < moved.size(); ++k) {
    velocity.value[k] = std::exchange(velocity.multiplier[k], -velocity.value[k]);
  }
  for (const auto k : indices(moved)) {
    velocity.slope += at.multiplier[k] * moved[k];
    velocity.curvature += velocity.multiplier[k] * moved[k];
  }
  const bool finite = all_finite(velocity.value) && all_finite(velocity.multiplier) &&
                      std::isfinite(velocity.slope) && std::isfinite(velocity.curvature);
  return finite ? std::optional(std::move(velocity)) : std::nullopt;
}

Event Sensitivity::State::next_event(const Waypoint& at, const Velocity& velocity,
                                     const Move& move) const {
  Event next;
  // What is >= 0 and must stay so.
  const auto watch = [&](double value, double rate, const Event& event) {
    if (!(rate < 0.0) || !std::isfinite(value)) return;
    const double step = std::max(value, 0.0) / -rate;
    if (step < next.step) {
      next = event;
      next.step = step;
    }
  };
  for (const auto k : indices(signs)) {
    if (is_still(k, move)) continue;
    const Hold hold = at.active[k];
    if (hold == Hold::Free) {
      watch(at.value[k] - at.bounds.lower[k], velocity.value[k] - move.bounds.lower[k],
            {.place = k, .to = Hold::Lower});
      watch(at.bounds.upper[k] - at.value[k], move.bounds.upper[k] - velocity.value[k],
            {.place = k, .to = Hold::Upper});
    } else if (hold != Hold::Fixed) {
      const double sign = hold == Hold::Lower ? signs[k] : -signs[k];
      watch(sign * at.multiplier[k], sign * velocity.multiplier[k],
            {.place = k, .to = Hold::Free, .from = hold});
    }
  }
  return next;
}

ActiveSetChange Sensitivity::State::describe(const Event& event, double share) const {
  ActiveSetChange change;
  change.share = share;
  change.of_constraint = event.place >= n;
  change.index = static_cast<Index>(event.place - (change.of_constraint ? n : 0));
  change.enters = event.to != Hold::Free;
  change.upper = (change.enters ? event.to : event.from) == Hold::Upper;
  change.text = place_name(structure, event.place) +
                (change.enters ? " reaches its " : " leaves its ") +
                (change.upper ? "upper bound" : "lower bound");
  return change;
}

SolutionDerivative Sensitivity::State::derivative(const Move& move) {
  const Waypoint at = start(move);
  if (const std::string& error = system->factorize(at.active); !error.empty()) {
    throw std::runtime_error(error);
  }
  std::optional<Velocity> velocity = this->velocity(at, move);
  if (!velocity) throw std::runtime_error(kInaccurate);
  SolutionDerivative result;
  result.objective = velocity->slope;
  result.objective_curvature = velocity->curvature;
  result.z_lower.assign(n, 0.0);
  result.z_upper.assign(n, 0.0);
  write(at, move, velocity->value, velocity->multiplier, result);
  return result;
}

template <class To>
void Sensitivity::State::write(const Waypoint& at, const Move& move,
                               const std::vector<double>& value,
                               const std::vector<double>& multiplier, To& to) const {
  const auto end = static_cast<std::ptrdiff_t>(n);
  to.v.assign(value.begin(), value.begin() + end);
  to.lambda.assign(multiplier.begin() + end, multiplier.end());
  for (double& lambda : to.lambda) lambda = 0.0 - lambda;
  for (std::size_t i = 0; i < n; ++i) {
    if (is_still(i, move)) continue;
    to.z_lower[i] = to.z_upper[i] = 0.0;
    const Hold hold = at.active[i];
    if (hold == Hold::Free) continue;
    // A fixed variable's multiplier stays on the side where it is.
    if (hold == Hold::Upper || (hold == Hold::Fixed && signs[i] * at.multiplier[i] < 0.0)) {
      to.z_upper[i] = -multiplier[i];
    } else {
      to.z_lower[i] = multiplier[i];
    }
  }
}

Prediction Sensitivity::State::predict(const Move& move) {
  Waypoint at = start(move);
  Prediction prediction;
  const std::size_t most_changes = 2 * signs.size() + 10;
  while (prediction.share < 1.0) {
    prediction.message = system->factorize(at.active);
    if (!prediction.message.empty()) break;
    const std::optional<Velocity> found = this->velocity(at, move);
    if (!found) {
      prediction.message = kInaccurate;
      break;
    }
    const Velocity& velocity = *found;
    const Event event = next_event(at, velocity, move);
    const double left = 1.0 - prediction.share;
    const double step = std::min(event.step, left);
    add(step, velocity.value, at.value);
    add(step, velocity.multiplier, at.multiplier);
    add(step, move.bounds.lower, at.bounds.lower);
    add(step, move.bounds.upper, at.bounds.upper);
    at.objective += step * (velocity.slope + 0.5 * step * velocity.curvature);
    prediction.share = step < left ? prediction.share + step : 1.0;
    if (prediction.share == 1.0) break;
    if (prediction.changes.size() == most_changes) {
      prediction.message = "the active set keeps changing";
      break;
    }
    at.active[event.place] = event.to;
    if (event.to == Hold::Free) at.multiplier[event.place] = 0.0;
    prediction.changes.push_back(describe(event, prediction.share));
  }
  prediction.objective = at.objective;
  prediction.z_lower = z_lower;
  prediction.z_upper = z_upper;
  write(at, move, at.value, at.multiplier, prediction);
  return prediction;
}

// --- Public functions ----------------------------------------------------------------------------

BoundChange move_variable(const ProblemStructure& structure, Index variable, double by) {
  BoundChange change;
  change.variable_lower.assign(structure.variable_players.size(), 0.0);
  change.variable_lower[static_cast<std::size_t>(variable)] = by;
  change.variable_upper = change.variable_lower;
  return change;
}

BoundChange move_constraint(const ProblemStructure& structure, Index constraint, double by) {
  BoundChange change;
  change.constraint_lower.assign(structure.constraint_players.size(), 0.0);
  change.constraint_lower[static_cast<std::size_t>(constraint)] = by;
  change.constraint_upper = change.constraint_lower;
  return change;
}

Sensitivity::Sensitivity() : state_(std::make_unique<State>()) {}
Sensitivity::~Sensitivity() = default;
Sensitivity::Sensitivity(Sensitivity&&) noexcept = default;
Sensitivity& Sensitivity::operator=(Sensitivity&&) noexcept = default;

std::string Sensitivity::update(Problem& problem, const Result& result,
                                const SolverOptions& options) {
  state_->available = false;
  std::string error = check(options);
  if (error.empty()) error = state_->read(problem, result, options);
  state_->available = error.empty();
  return error;
}

bool Sensitivity::available() const { return state_->available; }

const std::vector<std::string>& Sensitivity::weakly_active() const { return state_->weak; }

SolutionDerivative Sensitivity::derivative(const BoundChange& direction) {
  return state_->derivative(state_->move_of(direction));
}

Prediction Sensitivity::predict(const BoundChange& change) {
  return state_->predict(state_->move_of(change));
}

SolutionDerivative Sensitivity::reaction(std::span<const double> dx) {
  return state_->derivative(state_->move_of(dx));
}

Prediction Sensitivity::react(std::span<const double> dx) {
  return state_->predict(state_->move_of(dx));
}

Index Sensitivity::factorizations() const {
  return state_->lost_factorizations + (state_->system ? state_->system->factorizations() : 0);
}

Index Sensitivity::analyses() const {
  return state_->lost_analyses + (state_->system ? state_->system->analyses() : 0);
}

}  // namespace ipminmax
