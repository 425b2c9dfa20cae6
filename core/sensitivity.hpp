#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "options.hpp"
#include "problem.hpp"
#include "result.hpp"

namespace IPMINMAX_API ipminmax {

/// A change of the model's bounds, which hold its parameters: the right-hand side of an equation
/// and the value of a fixed variable (equal bounds, to be moved by the same amount), or one bound
/// of a variable or an inequality. sIPOPT's parameters are variables held by an equation. An empty
/// vector changes nothing.
struct BoundChange {
  std::vector<double> variable_lower{}, variable_upper{};      ///< n or empty
  std::vector<double> constraint_lower{}, constraint_upper{};  ///< m or empty
};

/// Returns the change that moves both bounds of one variable or constraint by `by`. The index must
/// be in range.
[[nodiscard]] BoundChange move_variable(const ProblemStructure& structure, Index variable,
                                        double by = 1.0);
[[nodiscard]] BoundChange move_constraint(const ProblemStructure& structure, Index constraint,
                                          double by = 1.0);

/// The derivative of a solution along a change; signs and units as in Result.
struct SolutionDerivative {
  std::vector<double> v;                 ///< n
  std::vector<double> lambda;            ///< m
  std::vector<double> z_lower, z_upper;  ///< n
  double objective = 0.0;                ///< of the local minmax value
  double objective_curvature = 0.0;      ///< its second derivative
};

/// A bound that begins or ceases to be active on the way through a change.
struct ActiveSetChange {
  double share = 0.0;  ///< of the change after which it happens, in [0, 1]
  bool of_constraint = false;
  Index index = 0;     ///< of the variable or constraint
  bool upper = false;  ///< the upper bound
  bool enters = false;
  std::string text;  ///< "variable 3 reaches its upper bound"
};

/// The solution after a finite change, from the equations linearized at the present solution.
struct Prediction {
  std::vector<double> v, lambda, z_lower, z_upper;  ///< as in Result
  double objective = 0.0;                           ///< to second order
  /// Part of the change that was followed, in [0, 1]. Below 1 the linearized solution ends there,
  /// and message says why.
  double share = 0.0;
  std::vector<ActiveSetChange> changes;  ///< in the order in which they happen
  std::string message;
};

/// Derivatives of a local minmax with respect to the model's constants, predictions over a finite
/// change, and the maximizer's reaction to other values of the minimizer's variables.
///
/// At a certified point with strict complementarity the solution is a differentiable function of
/// the constants, and (y, lambda_y) is one of x. With A the active constraints and F the variables
/// at no bound, p the moved constants,
///
///     | W_FF  J_AF' | | dv_F / dp     |     | (W_F. dv / dp) of the variables at bounds         |
///     | J_AF  0     | | dlambda_A / dp| = - | (J_A. dv / dp) of these, less moved right sides   |
///
/// [Fiacco 1976; for a minmax the matrix is K of the paper with the barrier's limit mu = 0], and
/// dy / dx is the same with K_yy. The value moves by -lambda per constraint constant and by z_lower
/// and -z_upper per bound, which needs no factorization.
///
/// Cost: one evaluation of gradient, Jacobian and Hessian and one factorization per update, one
/// factorization per active set of a prediction, one back substitution per derivative.
class Sensitivity {
 public:
  Sensitivity();
  ~Sensitivity();
  Sensitivity(Sensitivity&&) noexcept;
  Sensitivity& operator=(Sensitivity&&) noexcept;

  /// Takes a solution of the problem. Returns an empty text, or why it has no derivatives: the
  /// result is no first-order point, a function is undefined there, K is singular (dependent active
  /// constraints, flat directions) or has the wrong inertia (no local minmax), or the model has
  /// robust constraints, which are not supported. A matrix of the same structure as the last one is
  /// not analyzed again. The problem is not used after the call. Exceptions of the model pass
  /// through.
  [[nodiscard]] std::string update(Problem& problem, const Result& result,
                                   const SolverOptions& options = {});

  /// Returns whether the last update succeeded; only then may the functions below be called.
  [[nodiscard]] bool available() const;

  /// Returns the names of weakly active bounds. If there are any, derivatives hold for the present
  /// active set, at best on one side; predictions choose the side.
  [[nodiscard]] const std::vector<std::string>& weakly_active() const;

  /// Returns the derivative of the solution along a change. Throws std::invalid_argument if a
  /// vector has the wrong length, a value is not finite or equal bounds are moved apart;
  /// std::runtime_error if the matrix is too ill-conditioned (or, in reaction, singular).
  [[nodiscard]] SolutionDerivative derivative(const BoundChange& direction);

  /// Follows the linearized solution through the change, from one active set to the next.
  /// Throws as derivative.
  [[nodiscard]] Prediction predict(const BoundChange& change);

  /// Returns the derivative of the maximizer's answer along dx (n entries, read at Min's
  /// variables). v holds dx and dy/dx dx; lambda and z the derivatives of Max's multipliers (0 for
  /// Min's); objective the slope of phi(x), the local maximum over y. Throws as derivative.
  [[nodiscard]] SolutionDerivative reaction(std::span<const double> dx);

  /// Predicts the maximizer's answer after a finite dx, through changes of Max's active set. Min's
  /// constraints are ignored.
  [[nodiscard]] Prediction react(std::span<const double> dx);

  /// Return the numbers of factorizations and of symbolic analyses since construction.
  [[nodiscard]] Index factorizations() const;
  [[nodiscard]] Index analyses() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace ipminmax
