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

struct ActiveSet {
  std::vector<Hold> variables;    ///< n
  std::vector<Hold> constraints;  ///< m
  friend bool operator==(const ActiveSet&, const ActiveSet&) = default;
};

/// Bounds with absent ones at infinity.
struct Bounds {
  std::vector<double> variable_lower, variable_upper;      ///< n
  std::vector<double> constraint_lower, constraint_upper;  ///< m
};
[[nodiscard]] Bounds bounds_of(const ProblemStructure& structure, const SolverOptions& options);

/// +1 for Min, -1 for Max: times this, multipliers of lower bounds (z_lower, -lambda) and of upper
/// ones (z_upper, lambda) are >= 0.
[[nodiscard]] inline double sign_of(Player player) { return player == Player::Min ? 1.0 : -1.0; }

/// Lengths over which f bends by about one, as the certificate has them: units_of.
struct Lengths {
  std::vector<double> variables;    ///< n; 1 of fixed ones
  std::vector<double> constraints;  ///< m, of their values; 1 of those without a free variable
};
/// jacobian, hessian: of the Lagrangian at the point v, per triplet of the structure.
[[nodiscard]] Lengths lengths_of(Problem& problem, const ProblemStructure& structure,
                                 const SolverOptions& options, const std::vector<double>& v,
                                 const std::vector<double>& jacobian,
                                 const std::vector<double>& hessian);

/// The active set of a solution: a bound is active where its multiplier, times the square of the
/// length, exceeds the distance to it. weak: names of those where neither dominates.
/// reduced_gradient: grad f + J'lambda (n).
[[nodiscard]] ActiveSet active_set_of(const ProblemStructure& structure, const Bounds& bounds,
                                      const Result& result,
                                      const std::vector<double>& reduced_gradient,
                                      const Lengths& lengths, std::vector<std::string>& weak);

/// "variable 3", or the model's name for it.
[[nodiscard]] std::string place_name(const ProblemStructure& structure, bool of_constraint,
                                     Index index);

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
