#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "core/kkt/block.hpp"
#include "core/model/indices.hpp"
#include "core/model/parameters.hpp"
#include "core/options.hpp"
#include "core/problem.hpp"
#include "linalg/make_solver.hpp"
#include "linalg/numbers.hpp"
#include "linalg/symmetric_matrix.hpp"
#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

/// What holds a variable or constraint.
enum class Hold : std::uint8_t {
  Free,   ///< nothing: a free variable, an inactive or absent constraint
  Lower,  ///< its lower bound
  Upper,
  Fixed  ///< equal bounds; a variable held from outside
};

/// Per place: the variables, then the constraints, n + m.
using ActiveSet = std::vector<Hold>;

/// The equations of a solution with a given active set, linearized, over all variables and
/// constraints (v, lambda):
///
///     | W  J' |   with the rows and columns of held variables and of inactive constraints
///     | J  0  |   replaced by those of +-1, so that one pattern serves all active sets.
///
/// The +-1 have the signs that the rows have in K's expected inertia (n_x + m_y, n_y + m_x, 0),
/// which is therefore the expected one of every such matrix. Rows are equilibrated.
class ActiveSystem {
 public:
  enum class Outcome : std::uint8_t { Ok, OutOfMemory, Singular, WrongInertia };

  /// A copy of what it needs of the structure; analyzes at the first factorize.
  ActiveSystem(const ProblemStructure& structure, const SolverOptions& options)
      : variable_players_(structure.variable_players),
        constraint_players_(structure.constraint_players),
        hessian_pattern_(structure.hessian),
        jacobian_pattern_(structure.jacobian),
        solver_(make_symmetric_solver(options.linear_solver, solver_options(options))) {
    const auto n = static_cast<Index>(variable_players_.size());
    std::vector<Triplet> entries = hessian_pattern_;
    for (const auto& [row, col] : jacobian_pattern_) entries.push_back({n + row, col});
    for (const Player player : variable_players_) signs_.push_back(player == Player::Min ? 1 : -1);
    for (const Player player : constraint_players_)
      signs_.push_back(player == Player::Min ? -1 : 1);
    for (const std::int8_t sign : signs_) ++(sign > 0 ? expected_.positive : expected_.negative);
    matrix_ = SymmetricMatrix(static_cast<Index>(signs_.size()), entries);
    scale_.assign(signs_.size(), 1.0);
  }

  /// Whether this system has the pattern of the structure.
  [[nodiscard]] bool fits(const ProblemStructure& structure) const {
    return structure.variable_players == variable_players_ &&
           structure.constraint_players == constraint_players_ &&
           structure.hessian == hessian_pattern_ && structure.jacobian == jacobian_pattern_;
  }

  /// Values at a solution, per triplet of the structure.
  void set_values(std::vector<double> hessian, std::vector<double> jacobian) {
    hessian_ = std::move(hessian);
    jacobian_ = std::move(jacobian);
    factorized_ = false;
  }

  /// Factors for the active set; those of the last call are kept where nothing has changed.
  [[nodiscard]] Outcome factorize(const ActiveSet& active) {
    if (factorized_ && active == active_) return outcome_;
    active_ = active;
    assemble(active);
    equilibrate();
    outcome_ = factorize_values();
    factorized_ = true;
    return outcome_;
  }

  /// Given dv of held variables (other entries are ignored) and the change of the value of each
  /// active constraint (the others are ignored), finds dv and dlambda: the gradient of the
  /// Lagrangian stays zero in the free variables. False: no accurate solution.
  [[nodiscard]] bool solve(std::span<double> dv, std::span<const double> dg,
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

  /// gradient = W dv + J'dlambda, values = J dv.
  void multiply(std::span<const double> dv, std::span<const double> dlambda,
                std::span<double> gradient, std::span<double> values) const {
    std::ranges::fill(gradient, 0.0);
    std::ranges::fill(values, 0.0);
    for (const auto k : indices(hessian_)) {
      const std::size_t row = at(hessian_pattern_[k].row), col = at(hessian_pattern_[k].col);
      gradient[row] += hessian_[k] * dv[col];
      if (row != col) gradient[col] += hessian_[k] * dv[row];
    }
    for (const auto k : indices(jacobian_)) {
      const std::size_t row = at(jacobian_pattern_[k].row), col = at(jacobian_pattern_[k].col);
      gradient[col] += jacobian_[k] * dlambda[row];
      values[row] += jacobian_[k] * dv[col];
    }
  }

  [[nodiscard]] Index factorizations() const { return factorizations_; }
  [[nodiscard]] Index analyses() const { return analyses_; }

 private:
  static double max_norm(std::span<const double> values) {
    double norm = 0.0;
    for (const double value : values) norm = std::max(norm, std::abs(value));
    return norm;
  }

  void assemble(const ActiveSet& active) {
    const std::size_t n = variable_players_.size();
    matrix_.set_zero();
    const auto values = matrix_.values();
    const auto positions = matrix_.triplet_positions();
    const auto is_free = [&](Index variable) { return active[at(variable)] == Hold::Free; };
    for (const auto k : indices(hessian_)) {
      const auto [row, col] = hessian_pattern_[k];
      if (is_free(row) && is_free(col)) values[at(positions[k])] += hessian_[k];
    }
    for (const auto k : indices(jacobian_)) {
      const auto [row, col] = jacobian_pattern_[k];
      if (active[n + at(row)] != Hold::Free && is_free(col)) {
        values[at(positions[hessian_.size() + k])] += jacobian_[k];
      }
    }
    for (const auto i : indices(signs_)) {
      if ((active[i] == Hold::Free) == (i >= n))
        values[at(matrix_.diagonal_position(static_cast<Index>(i)))] = signs_[i];
    }
  }

  /// Rows and columns are divided by the square roots of their largest entries, a few times.
  void equilibrate() {
    std::ranges::fill(scale_, 1.0);
    std::vector<double> largest(scale_.size());
    const auto values = matrix_.values();
    const auto visit = [&](auto entry) {
      matrix_.for_each_entry(
          [&](Index row, Index col, Index p) { entry(at(row), at(col), values[at(p)]); });
    };
    constexpr int kRounds = 3;
    for (int round = 0; round < kRounds; ++round) {
      std::ranges::fill(largest, 0.0);
      visit([&](std::size_t row, std::size_t col, double value) {
        const double size = std::abs(value) * scale_[row] * scale_[col];
        largest[row] = std::max(largest[row], size);
        largest[col] = std::max(largest[col], size);
      });
      for (const auto i : indices(scale_)) {
        if (largest[i] > 0.0) scale_[i] /= std::sqrt(largest[i]);
      }
    }
    visit([&](std::size_t row, std::size_t col, double& value) {
      value *= scale_[row] * scale_[col];
    });
  }

  [[nodiscard]] Outcome factorize_values() {
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

  [[nodiscard]] bool solve_refined(std::span<const double> rhs, std::span<double> solution) {
    std::vector<double> residual(rhs.size()), product(rhs.size());
    for (;;) {
      std::ranges::fill(solution, 0.0);
      std::copy(rhs.begin(), rhs.end(), residual.begin());
      const double norm = max_norm(rhs);
      double relative = 1.0;  // residual over right-hand side and |A| |x|
      constexpr int kMostRefinements = 10;
      for (int step = 0; step < kMostRefinements && relative > parameters::kRounding; ++step) {
        const double last = relative;
        solver_->solve_in_place(residual);
        for (const auto i : indices(rhs)) solution[i] += residual[i];
        matrix_.multiply(solution, product);
        for (const auto i : indices(rhs)) residual[i] = rhs[i] - product[i];
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

  std::vector<Player> variable_players_, constraint_players_;
  std::vector<Triplet> hessian_pattern_, jacobian_pattern_;
  std::vector<double> hessian_, jacobian_;
  SymmetricMatrix matrix_;
  std::vector<std::int8_t> signs_;
  Inertia expected_;
  std::unique_ptr<SymmetricSolver> solver_;
  std::vector<double> scale_;  ///< of rows and columns
  ActiveSet active_;           ///< factorized
  Outcome outcome_ = Outcome::Singular;
  bool analyzed_ = false, factorized_ = false;
  Index factorizations_ = 0, analyses_ = 0;
};

}  // namespace ipminmax
