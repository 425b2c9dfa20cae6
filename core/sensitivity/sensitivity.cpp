#include "core/sensitivity.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "core/differences/finite_difference_hessian.hpp"
#include "core/model/forwarding_problem.hpp"
#include "core/model/norms.hpp"
#include "core/robust/robust_copies.hpp"
#include "core/sensitivity/active_system.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {
namespace {

constexpr const char* kInaccurate = "the KKT system cannot be solved accurately";

/// What moves: bounds, or (inner) the minimizer's variables, to which only Max reacts.
struct Move {
  Bounds bounds;  ///< changes
  bool inner = false;
  std::vector<double> held;  ///< n, read at Min's variables when inner
};

/// A point on the way of a linearized solution.
struct Waypoint {
  ActiveSet active;
  std::vector<double> v, lambda, reduced, g;  ///< reduced: grad f + J'lambda, n
  Bounds bounds;
  double objective = 0.0;
};

/// Derivatives of a Waypoint along a Move.
struct Velocity {
  std::vector<double> v, lambda, reduced, g;
  double slope = 0.0, curvature = 0.0;  ///< of the value
};

/// The next change of the active set.
struct Event {
  double step = kInfinity;
  bool of_constraint = false;
  std::size_t index = 0;
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
  for (std::size_t i = 0; i < values.size(); ++i) values[i] += step * direction[i];
}

/// Multipliers of a variable's bounds from what has to balance them.
void split_multiplier(Hold hold, double sign, double reduced, double& lower, double& upper) {
  lower = upper = 0.0;
  if (hold == Hold::Lower || (hold == Hold::Fixed && sign * reduced >= 0.0)) lower = reduced;
  if (hold == Hold::Upper || (hold == Hold::Fixed && sign * reduced < 0.0)) upper = -reduced;
}

/// The model with fixed variables free to move: their values are parameters, and the differences
/// that make its Hessian leave out what is fixed.
Restructured unfixed(Problem& problem) {
  Restructured model(problem);
  ProblemStructure& s = model.changed;
  for (std::size_t i = 0; i < s.variable_lower.size(); ++i) {
    if (s.variable_lower[i] < s.variable_upper[i]) continue;
    s.variable_lower[i] = -kInfinity;
    s.variable_upper[i] = kInfinity;
  }
  return model;
}

std::string text_of(ActiveSystem::Outcome outcome) {
  switch (outcome) {
    case ActiveSystem::Outcome::OutOfMemory:
      return "out of memory";
    case ActiveSystem::Outcome::WrongInertia:
      return "the KKT matrix has the wrong inertia: no local minmax";
    default:
      return "the KKT matrix is singular: dependent active constraints or a flat direction";
  }
}

}  // namespace

struct Sensitivity::State {
  ProblemStructure structure;
  Waypoint solution;
  std::vector<double> min_part;          ///< J'lambda of Min's constraints
  std::vector<double> z_lower, z_upper;  ///< of the result
  std::optional<ActiveSystem> system;
  std::vector<std::string> weak;
  bool available = false;
  Index lost_factorizations = 0, lost_analyses = 0;  ///< of earlier systems

  [[nodiscard]] std::string read(Problem& problem, const Result& result,
                                 const SolverOptions& options);
  void read_solution(const Result& result, const Bounds& bounds, const Lengths& lengths,
                     std::vector<double> gradient, const std::vector<double>& jacobian);
  [[nodiscard]] std::string factorize(const SolverOptions& options, std::vector<double> jacobian,
                                      std::vector<double> hessian);
  [[nodiscard]] Move move_of(const BoundChange& change) const;
  [[nodiscard]] Move move_of(std::span<const double> dx) const;
  [[nodiscard]] Waypoint start(const Move& move) const;
  [[nodiscard]] std::optional<Velocity> velocity(const Waypoint& at, const Move& move);
  [[nodiscard]] Event next_event(const Waypoint& at, const Velocity& velocity,
                                 const Move& move) const;
  [[nodiscard]] ActiveSetChange describe(const Event& event, double share) const;
  [[nodiscard]] SolutionDerivative derivative(const Move& move);
  [[nodiscard]] Prediction predict(const Move& move);
  void write(const Waypoint& at, const Move& move, Prediction& prediction) const;
  [[nodiscard]] bool is_min(std::size_t variable) const {
    return structure.variable_players[variable] == Player::Min;
  }
  [[nodiscard]] bool is_min_constraint(std::size_t constraint) const {
    return structure.constraint_players[constraint] == Player::Min;
  }
};

std::string Sensitivity::State::read(Problem& problem, const Result& result,
                                     const SolverOptions& options) {
  const bool differences =
      options.hessian_approximation == HessianApproximation::FiniteDifferenceValues ||
      !problem.structure().has_hessian;
  std::optional<Restructured> free;
  std::optional<FiniteDifferenceHessian> wrapped;
  if (differences) wrapped.emplace(free.emplace(unfixed(problem)), options);
  Problem& model = wrapped ? *wrapped : problem;
  structure = problem.structure();
  structure.hessian = model.structure().hessian;
  structure.has_hessian = true;
  if (!robust_constraints(structure).empty()) {
    return "sensitivities of models with robust constraints are not available";
  }
  const std::size_t n = structure.variable_players.size();
  const std::size_t m = structure.constraint_players.size();
  if (result.v.size() != n || result.lambda.size() != m || result.constraints.size() != m ||
      (result.certificate.kind != PointKind::LocalMinmax &&
       result.certificate.kind != PointKind::FirstOrderPoint)) {
    return "the result is no first-order point of the problem";
  }
  std::vector<double> gradient(n), jacobian(structure.jacobian.size()),
      hessian(structure.hessian.size());
  if (!model.gradient(result.v, true, gradient) ||
      (m > 0 && !model.jacobian(result.v, false, jacobian)) ||
      !model.hessian(result.v, false, 1.0, result.lambda, true, hessian)) {
    return "a derivative of the model is undefined at the solution";
  }
  if (!all_finite(gradient) || !all_finite(jacobian) || !all_finite(hessian)) {
    return "a derivative of the model is not finite at the solution";
  }
  read_solution(result, bounds_of(structure, options),
                lengths_of(problem, structure, options, result.v, jacobian, hessian),
                std::move(gradient), jacobian);
  return factorize(options, std::move(jacobian), std::move(hessian));
}

void Sensitivity::State::read_solution(const Result& result, const Bounds& bounds,
                                       const Lengths& lengths, std::vector<double> gradient,
                                       const std::vector<double>& jacobian) {
  min_part.assign(gradient.size(), 0.0);
  solution = {};
  solution.reduced = std::move(gradient);
  for (std::size_t k = 0; k < jacobian.size(); ++k) {
    const auto row = static_cast<std::size_t>(structure.jacobian[k].row);
    const auto col = static_cast<std::size_t>(structure.jacobian[k].col);
    const double part = jacobian[k] * result.lambda[row];
    solution.reduced[col] += part;
    if (is_min_constraint(row)) min_part[col] += part;
  }
  solution.v = result.v;
  solution.lambda = result.lambda;
  solution.g = result.constraints;
  solution.objective = result.objective;
  solution.bounds = bounds;
  solution.active = active_set_of(structure, bounds, result, solution.reduced, lengths, weak);
  z_lower = result.z_lower;
  z_upper = result.z_upper;
}

/// The system of the solution's active set.
std::string Sensitivity::State::factorize(const SolverOptions& options,
                                          std::vector<double> jacobian,
                                          std::vector<double> hessian) {
  if (!system || !system->fits(structure)) {
    if (system) {
      lost_factorizations += system->factorizations();
      lost_analyses += system->analyses();
    }
    system.emplace(structure, options);
  }
  system->set_values(std::move(hessian), std::move(jacobian));
  const auto outcome = system->factorize(solution.active);
  return outcome == ActiveSystem::Outcome::Ok ? std::string() : text_of(outcome);
}

Move Sensitivity::State::move_of(const BoundChange& change) const {
  const std::size_t n = structure.variable_players.size();
  const std::size_t m = structure.constraint_players.size();
  Move move;
  move.bounds = {padded(change.variable_lower, n, "variable_lower"),
                 padded(change.variable_upper, n, "variable_upper"),
                 padded(change.constraint_lower, m, "constraint_lower"),
                 padded(change.constraint_upper, m, "constraint_upper")};
  const auto check = [&](bool of_constraint, const std::vector<Hold>& holds,
                         const std::vector<double>& lower, const std::vector<double>& upper) {
    for (std::size_t i = 0; i < holds.size(); ++i) {
      if (holds[i] != Hold::Fixed || lower[i] == upper[i]) continue;
      throw std::invalid_argument("the equal bounds of " +
                                  place_name(structure, of_constraint, static_cast<Index>(i)) +
                                  " must be moved alike");
    }
  };
  check(false, solution.active.variables, move.bounds.variable_lower, move.bounds.variable_upper);
  check(true, solution.active.constraints, move.bounds.constraint_lower,
        move.bounds.constraint_upper);
  return move;
}

Move Sensitivity::State::move_of(std::span<const double> dx) const {
  const std::size_t n = structure.variable_players.size();
  Move move = move_of(BoundChange{});
  move.inner = true;
  if (dx.size() != n) {
    throw std::invalid_argument("dx has " + std::to_string(dx.size()) + " entries, but there are " +
                                std::to_string(n) + " variables");
  }
  move.held.assign(dx.begin(), dx.end());
  for (std::size_t i = 0; i < n; ++i) {
    if (!is_min(i)) move.held[i] = 0.0;
  }
  if (!all_finite(move.held)) throw std::invalid_argument("dx is not finite");
  return move;
}

Waypoint Sensitivity::State::start(const Move& move) const {
  Waypoint start = solution;
  if (!move.inner) return start;
  for (std::size_t i = 0; i < start.v.size(); ++i) {
    start.reduced[i] -= min_part[i];
    if (is_min(i)) start.active.variables[i] = Hold::Fixed;
  }
  for (std::size_t j = 0; j < start.lambda.size(); ++j) {
    if (is_min_constraint(j)) start.active.constraints[j] = Hold::Free;
  }
  return start;
}

/// The system must have the factors for the active set. Empty: it cannot be solved accurately.
std::optional<Velocity> Sensitivity::State::velocity(const Waypoint& at, const Move& move) {
  const std::size_t n = at.v.size();
  const std::size_t m = at.lambda.size();
  Velocity velocity;
  velocity.v.assign(n, 0.0);
  velocity.lambda.assign(m, 0.0);
  velocity.reduced.assign(n, 0.0);
  velocity.g.assign(m, 0.0);
  std::vector<double> right_side(m, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    const Hold hold = at.active.variables[i];
    if (hold == Hold::Upper) velocity.v[i] = move.bounds.variable_upper[i];
    if (hold == Hold::Lower || hold == Hold::Fixed) velocity.v[i] = move.bounds.variable_lower[i];
    if (move.inner && is_min(i)) velocity.v[i] = move.held[i];
  }
  for (std::size_t j = 0; j < m; ++j) {
    const Hold hold = at.active.constraints[j];
    if (hold == Hold::Upper) right_side[j] = move.bounds.constraint_upper[j];
    if (hold == Hold::Lower || hold == Hold::Fixed) right_side[j] = move.bounds.constraint_lower[j];
  }
  if (!system->solve(velocity.v, right_side, velocity.lambda)) return std::nullopt;
  system->multiply(velocity.v, velocity.lambda, velocity.reduced, velocity.g);
  for (std::size_t i = 0; i < n; ++i) {
    if (at.active.variables[i] == Hold::Free) continue;
    velocity.slope += at.reduced[i] * velocity.v[i];
    velocity.curvature += velocity.reduced[i] * velocity.v[i];
  }
  for (std::size_t j = 0; j < m; ++j) {
    if (at.active.constraints[j] == Hold::Free) continue;
    velocity.slope -= at.lambda[j] * right_side[j];
    velocity.curvature -= velocity.lambda[j] * right_side[j];
  }
  return velocity;
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
  for (std::size_t i = 0; i < at.v.size(); ++i) {
    if (move.inner && is_min(i)) continue;
    const Hold hold = at.active.variables[i];
    const double sign = sign_of(structure.variable_players[i]);
    if (hold == Hold::Free) {
      watch(at.v[i] - at.bounds.variable_lower[i], velocity.v[i] - move.bounds.variable_lower[i],
            {.of_constraint = false, .index = i, .to = Hold::Lower});
      watch(at.bounds.variable_upper[i] - at.v[i], move.bounds.variable_upper[i] - velocity.v[i],
            {.of_constraint = false, .index = i, .to = Hold::Upper});
    } else if (hold != Hold::Fixed) {
      const double pressure = hold == Hold::Lower ? sign : -sign;
      watch(pressure * at.reduced[i], pressure * velocity.reduced[i],
            {.of_constraint = false, .index = i, .to = Hold::Free, .from = hold});
    }
  }
  for (std::size_t j = 0; j < at.g.size(); ++j) {
    if (move.inner && is_min_constraint(j)) continue;
    const Hold hold = at.active.constraints[j];
    const double sign = sign_of(structure.constraint_players[j]);
    if (hold == Hold::Free) {
      watch(at.g[j] - at.bounds.constraint_lower[j],
            velocity.g[j] - move.bounds.constraint_lower[j],
            {.of_constraint = true, .index = j, .to = Hold::Lower});
      watch(at.bounds.constraint_upper[j] - at.g[j],
            move.bounds.constraint_upper[j] - velocity.g[j],
            {.of_constraint = true, .index = j, .to = Hold::Upper});
    } else if (hold != Hold::Fixed) {
      const double pressure = hold == Hold::Upper ? sign : -sign;
      watch(pressure * at.lambda[j], pressure * velocity.lambda[j],
            {.of_constraint = true, .index = j, .to = Hold::Free, .from = hold});
    }
  }
  return next;
}

ActiveSetChange Sensitivity::State::describe(const Event& event, double share) const {
  ActiveSetChange change;
  change.share = share;
  change.of_constraint = event.of_constraint;
  change.index = static_cast<Index>(event.index);
  change.enters = event.to != Hold::Free;
  change.upper = (change.enters ? event.to : event.from) == Hold::Upper;
  change.text = place_name(structure, event.of_constraint, change.index) +
                (change.enters ? " reaches its " : " leaves its ") +
                (change.upper ? "upper bound" : "lower bound");
  return change;
}

SolutionDerivative Sensitivity::State::derivative(const Move& move) {
  const Waypoint at = start(move);
  if (const auto outcome = system->factorize(at.active); outcome != ActiveSystem::Outcome::Ok) {
    throw std::runtime_error(text_of(outcome));
  }
  std::optional<Velocity> velocity = this->velocity(at, move);
  if (!velocity) throw std::runtime_error(kInaccurate);
  Velocity& found = *velocity;
  SolutionDerivative result;
  result.objective = found.slope;
  result.objective_curvature = found.curvature;
  result.z_lower.assign(at.v.size(), 0.0);
  result.z_upper.assign(at.v.size(), 0.0);
  for (std::size_t i = 0; i < at.v.size(); ++i) {
    if (move.inner && is_min(i)) continue;
    const double sign = sign_of(structure.variable_players[i]);
    const Hold hold = at.active.variables[i];
    // A fixed variable's multiplier stays on the side where it is.
    const bool upper = hold == Hold::Upper || (hold == Hold::Fixed && sign * at.reduced[i] < 0.0);
    if (hold != Hold::Free) {
      (upper ? result.z_upper : result.z_lower)[i] = upper ? -found.reduced[i] : found.reduced[i];
    }
  }
  result.v = std::move(found.v);
  result.lambda = std::move(found.lambda);
  return result;
}

void Sensitivity::State::write(const Waypoint& at, const Move& move, Prediction& prediction) const {
  prediction.v = at.v;
  prediction.lambda = at.lambda;
  prediction.objective = at.objective;
  prediction.z_lower = z_lower;
  prediction.z_upper = z_upper;
  for (std::size_t i = 0; i < at.v.size(); ++i) {
    if (move.inner && is_min(i)) continue;
    split_multiplier(at.active.variables[i], sign_of(structure.variable_players[i]), at.reduced[i],
                     prediction.z_lower[i], prediction.z_upper[i]);
  }
}

Prediction Sensitivity::State::predict(const Move& move) {
  Waypoint at = start(move);
  Prediction prediction;
  const std::size_t most_changes = 2 * (at.v.size() + at.g.size()) + 10;
  while (prediction.share < 1.0) {
    if (const auto outcome = system->factorize(at.active); outcome != ActiveSystem::Outcome::Ok) {
      prediction.message = text_of(outcome);
      break;
    }
    const std::optional<Velocity> found = this->velocity(at, move);
    if (!found) {
      prediction.message = kInaccurate;
      break;
    }
    const Velocity& velocity = *found;
    const Event event = next_event(at, velocity, move);
    const double left = 1.0 - prediction.share;
    const double step = std::min(event.step, left);
    add(step, velocity.v, at.v);
    add(step, velocity.lambda, at.lambda);
    add(step, velocity.reduced, at.reduced);
    add(step, velocity.g, at.g);
    add(step, move.bounds.variable_lower, at.bounds.variable_lower);
    add(step, move.bounds.variable_upper, at.bounds.variable_upper);
    add(step, move.bounds.constraint_lower, at.bounds.constraint_lower);
    add(step, move.bounds.constraint_upper, at.bounds.constraint_upper);
    at.objective += step * (velocity.slope + 0.5 * step * velocity.curvature);
    prediction.share = step < left ? prediction.share + step : 1.0;
    if (prediction.share == 1.0) break;
    if (prediction.changes.size() == most_changes) {
      prediction.message = "the active set keeps changing";
      break;
    }
    (event.of_constraint ? at.active.constraints : at.active.variables)[event.index] = event.to;
    if (event.of_constraint && event.to == Hold::Free) at.lambda[event.index] = 0.0;
    prediction.changes.push_back(describe(event, prediction.share));
  }
  write(at, move, prediction);
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
