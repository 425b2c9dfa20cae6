#include "core/sensitivity/active_system.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/certificate/active_set.hpp"
#include "core/certificate/parameters.hpp"
#include "core/certificate/scaling.hpp"
#include "core/kkt/block.hpp"
#include "core/model/forwarding_problem.hpp"
#include "core/model/parameters.hpp"
#include "core/point/point.hpp"
#include "linalg/make_solver.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

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

std::vector<double> signs_of(const ProblemStructure& structure) {
  std::vector<double> signs;
  for (const auto* players : {&structure.variable_players, &structure.constraint_players}) {
    for (const Player player : *players) signs.push_back(player == Player::Min ? 1.0 : -1.0);
  }
  return signs;
}

std::string place_name(const ProblemStructure& structure, std::size_t place) {
  const std::size_t n = structure.variable_players.size();
  const auto& names = place < n ? structure.variable_names : structure.constraint_names;
  const std::size_t i = place < n ? place : place - n;
  return (place < n ? "variable " : "constraint ") +
         (i < names.size() ? names[i] : std::to_string(i));
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

std::vector<double> lengths_of(Problem& problem, const ProblemStructure& structure,
                               const SolverOptions& options, const std::vector<double>& v,
                               const std::vector<double>& jacobian,
                               const std::vector<double>& hessian) {
  std::vector<double> lengths(v.size() + structure.constraint_lower.size(), 1.0);
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
  Point point = unevaluated_point(canonical, canonical.starting_point());
  const auto visit = [&](auto use) {
    for (const IndexRange own : {canonical.x(), canonical.y()}) {
      for (Index i = own.begin; i < own.end; ++i) use(i, at(canonical.model_variable(i)));
    }
  };
  visit([&](Index i, std::size_t place) { point.iterate.v[i] = v[place]; });
  if (evaluate_derivatives(canonical, point) != EvaluationStatus::Ok) return lengths;
  const VariableScaling scaling = variable_scaling(canonical, point.iterate.v, point.evaluation);
  visit([&](Index i, std::size_t place) { lengths[place] = scaling.variable[i]; });
  for (Index j = 0; j < canonical.constraints(); ++j) {
    const Index row = canonical.model_constraint(j);
    if (row >= 0) lengths[v.size() + at(row)] = 1.0 / scaling.constraint[j];
  }
  return lengths;
}

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
  const auto is_free = [&](Index variable) { return active[at(variable)] == Hold::Free; };
  for (std::size_t k = 0; k < hessian_.size(); ++k) {
    const auto [row, col] = hessian_pattern_[k];
    if (is_free(row) && is_free(col)) values[at(positions[k])] += hessian_[k];
  }
  for (std::size_t k = 0; k < jacobian_.size(); ++k) {
    const auto [row, col] = jacobian_pattern_[k];
    if (active[n + at(row)] != Hold::Free && is_free(col)) {
      values[at(positions[hessian_.size() + k])] += jacobian_[k];
    }
  }
  for (std::size_t i = 0; i < signs_.size(); ++i) {
    if ((active[i] == Hold::Free) == (i >= n))
      values[at(matrix_.diagonal_position(static_cast<Index>(i)))] = signs_[i];
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
    if (active_[i] == Hold::Free) dv[i] = 0.0;
  }
  std::vector<double> rhs(n + m), solution(n + m), values(m);
  std::ranges::fill(dlambda, 0.0);
  multiply(dv, dlambda, std::span(rhs).first(n), values);
  for (std::size_t i = 0; i < n; ++i) {
    rhs[i] = active_[i] == Hold::Free ? -rhs[i] : signs_[i] * dv[i];
  }
  for (std::size_t j = 0; j < m; ++j) {
    rhs[n + j] = active_[n + j] == Hold::Free ? 0.0 : dg[j] - values[j];
  }
  // (S A S) (S^-1 x) = S b
  for (std::size_t i = 0; i < n + m; ++i) rhs[i] *= scale_[i];
  if (n + m > 0 && !solve_refined(rhs, solution)) return false;
  for (std::size_t i = 0; i < n; ++i) {
    if (active_[i] == Hold::Free) dv[i] = scale_[i] * solution[i];
  }
  for (std::size_t j = 0; j < m; ++j) {
    if (active_[n + j] != Hold::Free) dlambda[j] = scale_[n + j] * solution[n + j];
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
