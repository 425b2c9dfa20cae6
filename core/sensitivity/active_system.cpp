#include "core/sensitivity/active_system.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/certificate/bound_classes.hpp"
#include "core/certificate/parameters.hpp"
#include "core/certificate/units.hpp"
#include "core/kkt/block.hpp"
#include "core/model/forwarding_problem.hpp"
#include "core/model/parameters.hpp"
#include "linalg/make_solver.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

Bounds bounds_of(const ProblemStructure& structure, const SolverOptions& options) {
  Bounds bounds{structure.variable_lower, structure.variable_upper, structure.constraint_lower,
                structure.constraint_upper};
  for (auto* lower : {&bounds.variable_lower, &bounds.constraint_lower}) {
    for (double& value : *lower) {
      if (value <= options.nlp_lower_bound_inf) value = -kInfinity;
    }
  }
  for (auto* upper : {&bounds.variable_upper, &bounds.constraint_upper}) {
    for (double& value : *upper) {
      if (value >= options.nlp_upper_bound_inf) value = kInfinity;
    }
  }
  return bounds;
}

std::string place_name(const ProblemStructure& structure, bool of_constraint, Index index) {
  const auto& names = of_constraint ? structure.constraint_names : structure.variable_names;
  const std::string kind = of_constraint ? "constraint " : "variable ";
  const auto i = static_cast<std::size_t>(index);
  return i < names.size() ? kind + names[i] : kind + std::to_string(index);
}

namespace {

/// Derivatives that are known at a point, as a model that starts there.
class KnownDerivatives final : public Restructured {
 public:
  KnownDerivatives(Problem& problem, const std::vector<double>& v,
                   const std::vector<double>& jacobian, const std::vector<double>& hessian)
      : Restructured(problem), v_(v), jacobian_(jacobian), hessian_(hessian) {}
  [[nodiscard]] bool starting_point(StartingPoint& start) override {
    std::ranges::copy(v_, start.v.begin());
    return true;
  }
  [[nodiscard]] bool gradient(std::span<const double>, bool, std::span<double> grad) override {
    std::ranges::fill(grad, 0.0);  // lengths do not depend on it
    return true;
  }
  [[nodiscard]] bool constraints(std::span<const double>, bool, std::span<double> g) override {
    std::ranges::fill(g, 0.0);
    return true;
  }
  [[nodiscard]] bool jacobian(std::span<const double>, bool, std::span<double> values) override {
    std::ranges::copy(jacobian_, values.begin());
    return true;
  }
  [[nodiscard]] bool hessian(std::span<const double>, bool, double, std::span<const double>, bool,
                             std::span<double> values) override {
    std::ranges::copy(hessian_, values.begin());
    return true;
  }

 private:
  const std::vector<double>&v_, &jacobian_, &hessian_;
};

}  // namespace

Lengths lengths_of(Problem& problem, const ProblemStructure& structure,
                   const SolverOptions& options, const std::vector<double>& v,
                   const std::vector<double>& jacobian, const std::vector<double>& hessian) {
  Lengths lengths{std::vector(v.size(), 1.0), std::vector(structure.constraint_lower.size(), 1.0)};
  SolverOptions unscaled = options;
  unscaled.nlp_scaling_method = Scaling::None;
  unscaled.hessian_approximation = HessianApproximation::Exact;
  unscaled.fixed_variable_treatment = FixedVariableTreatment::MakeParameter;
  unscaled.warm_start_init_point = false;
  Counts counts;
  Timing timing;
  KnownDerivatives known(problem, v, jacobian, hessian);
  known.changed = structure;
  CanonicalProblem canonical(known, unscaled, counts, timing);
  if (!canonical.build().empty()) return lengths;
  Evaluation here;
  here.gradient.setZero(canonical.variables());
  here.jacobian.resize(canonical.jacobian().size());
  here.hessian.resize(canonical.hessian().size());
  Eigen::VectorXd point = canonical.starting_point().v;
  const auto visit = [&](auto use) {
    for (const IndexRange own : {canonical.x(), canonical.y()}) {
      for (Index i = own.begin; i < own.end; ++i) use(i, at(canonical.model_variable(i)));
    }
  };
  visit([&](Index i, std::size_t of_model) { point[i] = v[of_model]; });
  if (canonical.derivatives(point, Eigen::VectorXd::Zero(canonical.constraints()), here) !=
      EvaluationStatus::Ok) {
    return lengths;
  }
  const Units units = units_of(canonical, point, here);
  visit([&](Index i, std::size_t of_model) { lengths.variables[of_model] = units.variable[i]; });
  for (Index j = 0; j < canonical.constraints(); ++j) {
    if (canonical.model_constraint(j) >= 0)
      lengths.constraints[at(canonical.model_constraint(j))] = 1.0 / units.constraint[j];
  }
  return lengths;
}

ActiveSet active_set_of(const ProblemStructure& structure, const Bounds& bounds,
                        const Result& result, const std::vector<double>& reduced_gradient,
                        const Lengths& lengths, std::vector<std::string>& weak) {
  weak.clear();
  const auto hold = [&](bool of_constraint, std::size_t i, double lower_bound, double upper_bound,
                        double value, double pressure) {
    if (lower_bound == upper_bound) return Hold::Fixed;
    const double length = (of_constraint ? lengths.constraints : lengths.variables)[i];
    const auto found = [&](double distance, double multiplier, double strict_ratio) {
      return class_of(std::max(multiplier, 0.0) * length * length, std::max(distance, 0.0),
                      strict_ratio);
    };
    constexpr double kStrictRatio = parameters::certificate::kStrictRatio;
    const double above = value - lower_bound, below = upper_bound - value;
    const bool weak_below = found(above, pressure, kStrictRatio) == BoundClass::Doubtful;
    if (weak_below || found(below, -pressure, kStrictRatio) == BoundClass::Doubtful) {
      weak.push_back(place_name(structure, of_constraint, static_cast<Index>(i)) + " at its " +
                     (weak_below ? "lower" : "upper") + " bound");
    }
    if (found(above, pressure, 1.0) == BoundClass::Active) return Hold::Lower;
    return found(below, -pressure, 1.0) == BoundClass::Active ? Hold::Upper : Hold::Free;
  };
  ActiveSet active;
  for (std::size_t i = 0; i < structure.variable_players.size(); ++i) {
    active.variables.push_back(hold(false, i, bounds.variable_lower[i], bounds.variable_upper[i],
                                    result.v[i],
                                    sign_of(structure.variable_players[i]) * reduced_gradient[i]));
  }
  for (std::size_t j = 0; j < structure.constraint_players.size(); ++j) {
    active.constraints.push_back(
        hold(true, j, bounds.constraint_lower[j], bounds.constraint_upper[j], result.constraints[j],
             -sign_of(structure.constraint_players[j]) * result.lambda[j]));
  }
  return active;
}

namespace {

double max_norm(std::span<const double> values) {
  double norm = 0.0;
  for (const double value : values) norm = std::max(norm, std::abs(value));
  return norm;
}

}  // namespace

ActiveSystem::ActiveSystem(const ProblemStructure& structure, const SolverOptions& options)
    : variable_players_(structure.variable_players),
      constraint_players_(structure.constraint_players),
      hessian_pattern_(structure.hessian),
      jacobian_pattern_(structure.jacobian),
      solver_(make_symmetric_solver(options.linear_solver, solver_options(options))) {
  const auto n = static_cast<Index>(variable_players_.size());
  std::vector<Triplet> entries = hessian_pattern_;
  for (const auto& [row, col] : jacobian_pattern_) entries.push_back({n + row, col});
  for (const Player player : variable_players_) signs_.push_back(player == Player::Min ? 1 : -1);
  for (const Player player : constraint_players_) signs_.push_back(player == Player::Min ? -1 : 1);
  for (const std::int8_t sign : signs_) ++(sign > 0 ? expected_.positive : expected_.negative);
  matrix_ = SymmetricMatrix(static_cast<Index>(signs_.size()), entries);
  scale_.assign(signs_.size(), 1.0);
}

bool ActiveSystem::fits(const ProblemStructure& structure) const {
  return structure.variable_players == variable_players_ &&
         structure.constraint_players == constraint_players_ &&
         structure.hessian == hessian_pattern_ && structure.jacobian == jacobian_pattern_;
}

void ActiveSystem::set_values(std::vector<double> hessian, std::vector<double> jacobian) {
  hessian_ = std::move(hessian);
  jacobian_ = std::move(jacobian);
  factorized_ = false;
}

void ActiveSystem::assemble(const ActiveSet& active) {
  const std::size_t n = variable_players_.size();
  matrix_.set_zero();
  const auto values = matrix_.values();
  const auto positions = matrix_.triplet_positions();
  const auto is_free = [&](Index variable) { return active.variables[at(variable)] == Hold::Free; };
  for (std::size_t k = 0; k < hessian_.size(); ++k) {
    const auto [row, col] = hessian_pattern_[k];
    if (is_free(row) && is_free(col)) values[at(positions[k])] += hessian_[k];
  }
  for (std::size_t k = 0; k < jacobian_.size(); ++k) {
    const auto [row, col] = jacobian_pattern_[k];
    if (active.constraints[at(row)] != Hold::Free && is_free(col)) {
      values[at(positions[hessian_.size() + k])] += jacobian_[k];
    }
  }
  for (std::size_t i = 0; i < signs_.size(); ++i) {
    const bool out =
        i < n ? active.variables[i] != Hold::Free : active.constraints[i - n] == Hold::Free;
    if (out) values[at(matrix_.diagonal_position(static_cast<Index>(i)))] = signs_[i];
  }
}

/// Rows and columns are divided by the square roots of their largest entries, a few times.
void ActiveSystem::equilibrate() {
  std::ranges::fill(scale_, 1.0);
  std::vector<double> largest(scale_.size());
  const auto starts = matrix_.column_starts();
  const auto rows = matrix_.rows();
  const auto values = matrix_.values();
  const auto visit = [&](auto entry) {
    for (std::size_t col = 0; col < scale_.size(); ++col) {
      for (std::size_t k = at(starts[col]); k < at(starts[col + 1]); ++k) {
        entry(at(rows[k]), col, values[k]);
      }
    }
  };
  for (int round = 0; round < parameters::kEnough; ++round) {
    std::ranges::fill(largest, 0.0);
    visit([&](std::size_t row, std::size_t col, double value) {
      const double size = std::abs(value) * scale_[row] * scale_[col];
      largest[row] = std::max(largest[row], size);
      largest[col] = std::max(largest[col], size);
    });
    for (std::size_t i = 0; i < scale_.size(); ++i) {
      if (largest[i] > 0.0) scale_[i] /= std::sqrt(largest[i]);
    }
  }
  visit(
      [&](std::size_t row, std::size_t col, double& value) { value *= scale_[row] * scale_[col]; });
}

ActiveSystem::Outcome ActiveSystem::factorize_values() {
  if (signs_.empty()) return Outcome::Ok;
  if (!analyzed_) {
    ++analyses_;
    analyzed_ = solver_->analyze(matrix_, signs_).ok;
    if (!analyzed_) return Outcome::OutOfMemory;
  }
  Factorization found;
  const auto once = [&] {
    ++factorizations_;
    found = solver_->factorize(matrix_);
    if (found.status == FactorizationStatus::OutOfMemory) return Outcome::OutOfMemory;
    if (found.status != FactorizationStatus::Ok) return Outcome::Singular;
    return found.inertia == expected_ ? Outcome::Ok : Outcome::WrongInertia;
  };
  solver_->reset_quality();
  Outcome outcome = once();
  while (outcome != Outcome::Ok && !found.trust.pivoted && solver_->increase_quality()) {
    outcome = once();
  }
  return outcome;
}

ActiveSystem::Outcome ActiveSystem::factorize(const ActiveSet& active) {
  if (factorized_ && active == active_) return outcome_;
  active_ = active;
  assemble(active);
  equilibrate();
  outcome_ = factorize_values();
  factorized_ = true;
  return outcome_;
}

bool ActiveSystem::solve_refined(std::span<const double> rhs, std::span<double> solution) {
  std::vector<double> residual(rhs.size()), product(rhs.size());
  for (;;) {
    std::ranges::fill(solution, 0.0);
    std::copy(rhs.begin(), rhs.end(), residual.begin());
    const double norm = max_norm(rhs);
    double relative = 1.0;  // residual over right-hand side and |A| |x|
    for (int step = 0; step < parameters::kPatience && relative > parameters::kRounding; ++step) {
      const double last = relative;
      solver_->solve_in_place(residual);
      for (std::size_t i = 0; i < rhs.size(); ++i) solution[i] += residual[i];
      matrix_.multiply(solution, product);
      for (std::size_t i = 0; i < rhs.size(); ++i) residual[i] = rhs[i] - product[i];
      const double size = norm + matrix_.max_norm() * max_norm(solution);
      relative = size > 0.0 ? max_norm(residual) / size : 0.0;
      if (!(relative < 0.5 * last)) break;
    }
    if (relative <= parameters::kZero) return true;
    if (!solver_->increase_quality()) return false;
    ++factorizations_;
    if (solver_->factorize(matrix_).status != FactorizationStatus::Ok) return false;
  }
}

bool ActiveSystem::solve(std::span<double> dv, std::span<const double> dg,
                         std::span<double> dlambda) {
  const std::size_t n = variable_players_.size();
  const std::size_t m = constraint_players_.size();
  for (std::size_t i = 0; i < n; ++i) {
    if (active_.variables[i] == Hold::Free) dv[i] = 0.0;
  }
  std::vector<double> rhs(n + m), solution(n + m), values(m);
  std::ranges::fill(dlambda, 0.0);
  multiply(dv, dlambda, std::span(rhs).first(n), values);
  for (std::size_t i = 0; i < n; ++i) {
    rhs[i] = active_.variables[i] == Hold::Free ? -rhs[i] : signs_[i] * dv[i];
  }
  for (std::size_t j = 0; j < m; ++j) {
    rhs[n + j] = active_.constraints[j] == Hold::Free ? 0.0 : dg[j] - values[j];
  }
  // (S A S) (S^-1 x) = S b
  for (std::size_t i = 0; i < n + m; ++i) rhs[i] *= scale_[i];
  if (n + m > 0 && !solve_refined(rhs, solution)) return false;
  for (std::size_t i = 0; i < n; ++i) {
    if (active_.variables[i] == Hold::Free) dv[i] = scale_[i] * solution[i];
  }
  for (std::size_t j = 0; j < m; ++j) {
    if (active_.constraints[j] != Hold::Free) dlambda[j] = scale_[n + j] * solution[n + j];
  }
  return true;
}

void ActiveSystem::multiply(std::span<const double> dv, std::span<const double> dlambda,
                            std::span<double> gradient, std::span<double> values) const {
  std::ranges::fill(gradient, 0.0);
  std::ranges::fill(values, 0.0);
  for (std::size_t k = 0; k < hessian_.size(); ++k) {
    const std::size_t row = at(hessian_pattern_[k].row), col = at(hessian_pattern_[k].col);
    gradient[row] += hessian_[k] * dv[col];
    if (row != col) gradient[col] += hessian_[k] * dv[row];
  }
  for (std::size_t k = 0; k < jacobian_.size(); ++k) {
    const std::size_t row = at(jacobian_pattern_[k].row), col = at(jacobian_pattern_[k].col);
    gradient[col] += jacobian_[k] * dlambda[row];
    values[row] += jacobian_[k] * dv[col];
  }
}

}  // namespace ipminmax
