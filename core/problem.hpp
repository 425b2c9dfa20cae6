#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "../linalg/triplet.hpp"

namespace IPMINMAX_API ipminmax {

/// Who chooses a variable or owns a constraint: the minimizer x or the maximizer y.
enum class Player : std::uint8_t { Min, Max };

/// Describes a model: n variables v and m constraints g of both players, in any order. It must not
/// change during a solve. A bound outside (nlp_lower_bound_inf, nlp_upper_bound_inf) is absent.
struct ProblemStructure {
  std::vector<Player> variable_players;       ///< n
  std::vector<Player> constraint_players;     ///< m; see implied_constraint_players
  std::vector<double> variable_lower;         ///< n
  std::vector<double> variable_upper;         ///< n
  std::vector<double> constraint_lower;       ///< m; equal to the upper bound for an equality
  std::vector<double> constraint_upper;       ///< m
  std::vector<Triplet> jacobian;              ///< row = constraint, col = variable; duplicates add
  std::vector<Triplet> hessian;               ///< (i,j) stands for (j,i), too; duplicates add
  std::vector<std::string> variable_names;    ///< n or empty; used in messages
  std::vector<std::string> constraint_names;  ///< m or empty; used in messages
  /// Indices that messages show, n and m entries, or empty: positions in these vectors. A problem
  /// that is built from another model sets that model's indices; -1: only the name is shown.
  std::vector<Index> variable_numbers{};
  std::vector<Index> constraint_numbers{};
  bool has_hessian = true;  ///< false: the model has no second derivatives, hessian is empty
  /// Variables in which f or g are nonlinear, if the model knows them. They are used if the model
  /// gives no structure of the Hessian.
  std::optional<std::vector<Index>> nonlinear_variables{};
  /// n or empty; models leave it empty. The search for worst cases gives robust constraints Max
  /// variables of their own. The entry of such a variable is the index of its constraint, any other
  /// is -1. It maximizes that constraint, however small its multiplier is, instead of f.
  std::vector<Index> served_constraint{};
  /// n or empty: units of the variables inside the solve, unless the user scales them. A problem
  /// that is built from another model sets them.
  std::vector<double> variable_units{};
  /// Factor by which the objective of the model that the problem is built from was multiplied. tol
  /// is meant for the model's own objective.
  double objective_factor = 1.0;
};

/// Returns the default owners of the constraints: Max for a constraint with a Jacobian entry in a
/// Max variable, else Min. Indices must be in range.
[[nodiscard]] std::vector<Player> implied_constraint_players(const ProblemStructure& structure);
/// Writes the same into `players`, which is resized to m.
void implied_constraint_players(const ProblemStructure& structure, std::vector<Player>& players);

/// The start of a solve, which the model fills in. Spans hold zeros on entry.
struct StartingPoint {
  std::span<double> v;             ///< n
  bool needs_multipliers = false;  ///< whether the multipliers below are read (warm start)
  std::span<double> lambda;        ///< m
  std::span<double> z_lower;       ///< n; signs as in Result
  std::span<double> z_upper;       ///< n
};

/// Scaling chosen by the model (nlp_scaling_method user-scaling).
struct UserScaling {
  double objective = 1.0;
  std::vector<double> variables;    ///< n, or empty: none
  std::vector<double> constraints;  ///< m, or empty: none
};

class BoxFunctions;

/// A model: min over x, max over y of f(v) subject to bounds on v and g(v).
///
/// Evaluations return false if the function is undefined at v (n values); the solver then shortens
/// its step. new_v is false if v is the same as in the last evaluation of any kind. Entries of
/// matrices are written in the order of the structure's triplets.
class Problem {
 public:
  virtual ~Problem() = default;

  /// Returns the players, bounds and patterns. They stay the same during a solve.
  [[nodiscard]] virtual const ProblemStructure& structure() const = 0;

  /// Fills in the start. Returns false if the model has none, or does not know the multipliers that
  /// are needed: it is not solved then.
  [[nodiscard]] virtual bool starting_point(StartingPoint& start) = 0;

  /// Fills in the model's scaling factors. Returns false if it has none.
  [[nodiscard]] virtual bool user_scaling(UserScaling&) { return false; }

  /// Evaluates f, which Min minimizes and Max maximizes.
  [[nodiscard]] virtual bool objective(std::span<const double> v, bool new_v, double& f) = 0;
  /// Evaluates the derivatives of f in all variables of both players (n entries).
  [[nodiscard]] virtual bool gradient(std::span<const double> v, bool new_v,
                                      std::span<double> grad) = 0;
  /// Evaluates the constraints of both players (m entries).
  [[nodiscard]] virtual bool constraints(std::span<const double> v, bool new_v,
                                         std::span<double> g) = 0;
  /// Evaluates their derivatives, an entry for each triplet of ProblemStructure::jacobian.
  [[nodiscard]] virtual bool jacobian(std::span<const double> v, bool new_v,
                                      std::span<double> values) = 0;
  /// Evaluates only these rows (ascending): writes their entries of g, or the values of their
  /// triplets; other entries may stay as they are. By default all rows are evaluated. A
  /// maximization of a robust constraint over y asks for its row and Max's rows. A class derived
  /// from a model with constraint_rows() and jacobian_rows() that overrides constraints() or
  /// jacobian() must override both row functions as well.
  [[nodiscard]] virtual bool constraint_rows(std::span<const Index> /*rows*/,
                                             std::span<const double> v, bool new_v,
                                             std::span<double> g) {
    return constraints(v, new_v, g);
  }
  [[nodiscard]] virtual bool jacobian_rows(std::span<const Index> /*rows*/,
                                           std::span<const double> v, bool new_v,
                                           std::span<double> values) {
    return jacobian(v, new_v, values);
  }
  /// Evaluates the Hessian of sigma f + lambda' g, an entry for each triplet of
  /// ProblemStructure::hessian. Constraints that are not needed have lambda 0.
  [[nodiscard]] virtual bool hessian(std::span<const double> v, bool new_v, double sigma,
                                     std::span<const double> lambda, bool new_lambda,
                                     std::span<double> values) = 0;
  /// Estimates the error of the Hessian at these arguments: row_errors[i] (n entries) is the sum
  /// over j of |error of H(i,j)|, entries that the structure misses included; infinity if it is not
  /// known. Returns false if the Hessian is exact up to rounding.
  [[nodiscard]] virtual bool hessian_errors(std::span<const double> /*v*/, double /*sigma*/,
                                            std::span<const double> /*lambda*/,
                                            std::span<double> /*row_errors*/) {
    return false;
  }
  /// Returns the functions over boxes (proof.hpp), or null if the model has none.
  [[nodiscard]] virtual const BoxFunctions* over_boxes() const { return nullptr; }
  /// Returns another object for the same model, or null if it makes none (the default). Its
  /// functions must give the same values as this one's, and may run while those of other objects
  /// do. With minmax_threads above 1 several threads, each with an object of its own, maximize the
  /// robust constraints over y.
  [[nodiscard]] virtual std::unique_ptr<Problem> clone() const { return nullptr; }
};

}  // namespace ipminmax
