#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "core/model/canonical_problem.hpp"
#include "core/model/iterate.hpp"

namespace ipminmax {

/// Lengths in which no entry of W_yy exceeds 1, then none of W_xx and W_xy, and variables with
/// curvature have an entry of about that size, so that "little curvature" means the same whatever
/// the units of the model.
struct Units {
  Eigen::VectorXd variable;    ///< per canonical variable; a slack's is its constraint's
  Eigen::VectorXd constraint;  ///< per canonical constraint
};

struct LengthRules {
  /// Min's variables are measured by W_xx alone, then Max's by W_yy and W_xy, too: a coupling with
  /// a y that constraints hold is no curvature of x.
  bool min_first = false;
};

/// Units with what they are found by, kept from call to call.
struct UnitsArrays {
  Units units;
  Eigen::VectorXd size;                       ///< of variables, here or at the start
  Eigen::VectorXd diagonal, coupling, norms;  ///< of rows of W
  Eigen::VectorXd rows, columns;              ///< of the Jacobian
  struct Terms {
    double largest = 0.0, second = 0.0;
    Index variable = -1;  ///< of the largest
  };
  std::vector<Terms> terms;  ///< of equations
  struct Entry {
    Index row, col;
    double size;
  };
  std::vector<Entry> own, mixed;  ///< entries of W, mixed ones by the player's row
  std::vector<Entry> open;        ///< of the Jacobian: those that are still looked at

  /// One where nothing shows it.
  [[nodiscard]] double size_of(Index i) const { return size[i] > 0.0 ? size[i] : 1.0; }
};

/// Diagonal entries first, then rows without one by what couples them, then variables without
/// curvature by the constraints that tie them to others: each step depends on the units of the
/// model by the factor that it should. Variables that nothing ties keep the model's. At last
/// lengths that an equation does not allow are cut, down to the variable's size at v or at the
/// start.
[[nodiscard]] Units units_of(const CanonicalProblem& canonical, const Eigen::VectorXd& v,
                             const Evaluation& evaluation, LengthRules rules = {});
/// The same in arrays.
const Units& units_of(const CanonicalProblem& canonical, const Eigen::VectorXd& v,
                      const Evaluation& evaluation, UnitsArrays& arrays, LengthRules rules = {});

/// A variable's own size, which does not grow with a shift of its origin: the least of its values,
/// the width of its box, and the way from the starting point or its unit, whichever is longer.
[[nodiscard]] double own_size(const CanonicalProblem& canonical, double v, Index i,
                              const Units& units);

/// Longest entry of a vector of variables, slacks apart.
[[nodiscard]] double longest(const CanonicalProblem& canonical, const Eigen::VectorXd& v,
                             const Units& units);
/// Of the point or the starting point, whichever is larger.
[[nodiscard]] double size_of_problem(const CanonicalProblem& canonical, const Iterate& iterate,
                                     const Units& units);

/// Of right-hand sides and directions without the symmetries that a problem may have: of size 1/2
/// to 1, for beside an entry next to zero a large entry of the inverse would not show.
[[nodiscard]] inline double generic_entry(Index i) {
  const double turns = 0.6180339887498949 * static_cast<double>(i + 1);
  const double entry = turns - std::floor(turns) - 0.5;
  return entry + std::copysign(0.5, entry);
}

/// Derivatives in these units, with the values' call numbers forgotten.
void set_in_units(const CanonicalProblem& canonical, const Evaluation& evaluation,
                  const Units& units, Evaluation& scaled);

}  // namespace ipminmax
