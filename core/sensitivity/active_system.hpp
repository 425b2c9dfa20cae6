#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/sensitivity/active_set.hpp"
#include "linalg/symmetric_matrix.hpp"
#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

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
  ActiveSystem(const ProblemStructure& structure, const SolverOptions& options);

  /// Whether this system has the pattern of the structure.
  [[nodiscard]] bool fits(const ProblemStructure& structure) const;

  /// Values at a solution, per triplet of the structure.
  void set_values(std::vector<double> hessian, std::vector<double> jacobian);

  /// Factors for the active set; those of the last call are kept where nothing has changed.
  [[nodiscard]] Outcome factorize(const ActiveSet& active);

  /// Given dv of held variables (other entries are ignored) and the change of the value of each
  /// active constraint (the others are ignored), finds dv and dlambda: the gradient of the
  /// Lagrangian stays zero in the free variables. False: no accurate solution.
  [[nodiscard]] bool solve(std::span<double> dv, std::span<const double> dg,
                           std::span<double> dlambda);

  /// gradient = W dv + J'dlambda, values = J dv.
  void multiply(std::span<const double> dv, std::span<const double> dlambda,
                std::span<double> gradient, std::span<double> values) const;

  [[nodiscard]] Index factorizations() const { return factorizations_; }
  [[nodiscard]] Index analyses() const { return analyses_; }

 private:
  void assemble(const ActiveSet& active);
  void equilibrate();
  [[nodiscard]] Outcome factorize_values();
  [[nodiscard]] bool solve_refined(std::span<const double> rhs, std::span<double> solution);

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
