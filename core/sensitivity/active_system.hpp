#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"
#include "core/sensitivity.hpp"
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

/// Per place, absent ones at infinity.
struct Bounds {
  std::vector<double> lower, upper;
};
[[nodiscard]] Bounds bounds_of(const ProblemStructure& structure, const SolverOptions& options);

/// The values of variables and constraints in one vector per place.
[[nodiscard]] std::vector<double> joined(std::span<const double> variables,
                                         std::span<const double> constraints);

/// Per place +1 for Min, -1 for Max: times this, multipliers of lower bounds (z_lower, -lambda) and
/// of upper ones (z_upper, lambda) are >= 0.
[[nodiscard]] std::vector<double> signs_of(const ProblemStructure& structure);

/// Per place the length over which f bends by about one, as the certificate has it: its variable_scaling; 1 of
/// what is fixed. jacobian, hessian: at v, per triplet of the structure.
[[nodiscard]] std::vector<double> lengths_of(Problem& problem, const ProblemStructure& structure,
                                             const SolverOptions& options,
                                             const std::vector<double>& v,
                                             const std::vector<double>& jacobian,
                                             const std::vector<double>& hessian);

/// What holds a place: a bound whose multiplier, times the square of the length, exceeds the
/// distance to it. pressure: the multiplier, positive on the lower bound. weak: -1 or +1 where
/// neither exceeds the other clearly at the lower or the upper bound, else 0.
[[nodiscard]] Hold hold_of(double value, double lower, double upper, double pressure, double length,
                           int& weak);

/// "variable 3", or the model's name for it.
[[nodiscard]] std::string place_name(const ProblemStructure& structure, std::size_t place);

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
