#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "../linalg/triplet.hpp"

namespace IPMINMAX_API ipminmax {

/// Who chooses a variable or owns a constraint: the minimizer x or the maximizer y.
enum class Player : std::uint8_t { Min, Max };

/// What does not change during a solve. n variables v and m constraints g of both players, in any
/// order. Bounds outside (nlp_lower_bound_inf, nlp_upper_bound_inf) are absent bounds.
struct ProblemStructure {
  std::vector<Player> variable_players;       ///< n
  std::vector<Player> constraint_players;     ///< m; see implied_constraint_players
  std::vector<double> variable_lower;         ///< n
  std::vector<double> variable_upper;         ///< n
  std::vector<double> constraint_lower;       ///< m; equal to the upper bound for an equality
  std::vector<double> constraint_upper;       ///< m
  std::vector<Triplet> jacobian;              ///< row = constraint, col = variable; duplicates add
  std::vector<Triplet> hessian;               ///< one of (i,j) and (j,i); duplicates add
  std::vector<std::string> variable_names;    ///< n or empty; used in messages
  std::vector<std::string> constraint_names;  ///< m or empty; used in messages
  /// Indices that messages give, n and m, or empty: their own. A problem that is built from a model
  /// sets the model's; -1: none, the name stands alone.
  std::vector<Index> variable_numbers{};
  std::vector<Index> constraint_numbers{};
  bool has_hessian = true;  ///< false: the model has no second derivatives, hessian is empty
  /// Variables in which f or g are nonlinear, where the model says so; used when the structure of
  /// the Hessian is not given.
  std::optional<std::vector<Index>> nonlinear_variables{};
  /// n or empty: the robust constraint, with one bound, that alone a Max variable serves, and
  /// through Max's constraints the variables tied to it; -1: none. Such variables maximize their
  /// constraint however small its multiplier is.
  std::vector<Index> served_constraint{};
  /// n or empty: units in which a solve measures the variables unless the user scales them; a
  /// problem that is built from a model sets them.
  std::vector<double> variable_units{};
};

/// A constraint with a Jacobian entry in a Max variable belongs to Max, any other to Min.
/// Indices must be in range.
[[nodiscard]] std::vector<Player> implied_constraint_players(const ProblemStructure& structure);
/// The same in a vector that is there, of any size.
void implied_constraint_players(const ProblemStructure& structure, std::vector<Player>& players);

/// Where a solve starts. Spans are writable and hold zeros on entry.
struct StartingPoint {
  std::span<double> v;             ///< n
  bool needs_multipliers = false;  ///< whether the following are read (warm start)
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
/// Evaluations return false when the function is undefined at v; the solver then shortens its step.
/// new_v is false when v is the same as in the last evaluation call of any kind. Values are written
/// in the order of the structure's triplets.
class Problem {
 public:
  virtual ~Problem() = default;

  [[nodiscard]] virtual const ProblemStructure& structure() const = 0;

  /// False: no starting point can be given.
  [[nodiscard]] virtual bool starting_point(StartingPoint& start) = 0;

  /// False: the model has no scaling of its own.
  [[nodiscard]] virtual bool user_scaling(UserScaling&) { return false; }

  [[nodiscard]] virtual bool objective(std::span<const double> v, bool new_v, double& f) = 0;
  [[nodiscard]] virtual bool gradient(std::span<const double> v, bool new_v,
                                      std::span<double> grad) = 0;
  [[nodiscard]] virtual bool constraints(std::span<const double> v, bool new_v,
                                         std::span<double> g) = 0;
  [[nodiscard]] virtual bool jacobian(std::span<const double> v, bool new_v,
                                      std::span<double> values) = 0;
  /// Some rows alone, ascending: as constraints() and jacobian(), which evaluate all of them by
  /// default; only g of these rows and the values of their triplets have to be written. Maximizing a
  /// robust constraint over y asks for its row and Max's. A class that derives from a model with
  /// rows of its own and overrides constraints() or jacobian() overrides these, too.
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
  /// Hessian of sigma f + lambda' g. Where only some rows are asked for, the others' lambda is 0.
  [[nodiscard]] virtual bool hessian(std::span<const double> v, bool new_v, double sigma,
                                     std::span<const double> lambda, bool new_lambda,
                                     std::span<double> values) = 0;
  /// Errors of the Hessian at these arguments, n: row_errors[i] = sum over j of |error of H(i,j)|,
  /// entries that the structure misses included; infinity where nothing is known. False: the
  /// Hessian is exact up to rounding.
  [[nodiscard]] virtual bool hessian_errors(std::span<const double> /*v*/, double /*sigma*/,
                                            std::span<const double> /*lambda*/,
                                            std::span<double> /*row_errors*/) {
    return false;
  }
  /// The functions over boxes (proof.hpp), with the model's own numbers; null: there are none.
  [[nodiscard]] virtual const BoxFunctions* over_boxes() const { return nullptr; }
};

}  // namespace ipminmax
