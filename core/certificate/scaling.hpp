#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "core/model/canonical_problem.hpp"
#include "core/model/iterate.hpp"

namespace ipminmax {

using Vector = Eigen::VectorXd;

/// Lengths of variables in which no entry of W_yy exceeds 1, then none of W_xx and W_xy, and
/// variables with curvature have an entry of about that size, so that "little curvature" means the
/// same whatever the units of the model.
struct VariableScaling {
  Vector variable;    ///< per canonical variable; a slack's is its constraint's
  Vector constraint;  ///< per canonical constraint
};

struct ScalingRules {
  /// Min's variables are measured by W_xx alone, then Max's by W_yy and W_xy, too: a coupling with
  /// a y that constraints hold is no curvature of x.
  bool min_first = false;
  /// Variables without curvature of their own get lengths from what couples them to the other
  /// player's.
  bool by_coupling = false;
};

/// A scaling with what it is found by, kept from call to call.
struct ScalingArrays {
  VariableScaling scaling;
  Vector size;                       ///< of variables, here or at the start
  Vector diagonal, coupling, norms;  ///< of rows of W
  Vector rows, columns;              ///< of the Jacobian
  struct Terms {
    double largest = 0.0, second = 0.0;
    Index variable = -1;  ///< of the largest
  };
  std::vector<Terms> terms;  ///< of equations
};

/// Diagonal entries first, then rows without one by what couples them, then variables without
/// curvature by the constraints that tie them to others: each step depends on the units of the
/// model by the factor that it should. Variables that nothing ties keep the model's. Finally, a
/// variable's length is reduced if the other terms of one of its equations are negligible beside
/// it, down to the variable's size at v or at the start.
const VariableScaling& variable_scaling(const CanonicalProblem& canonical, const Vector& v,
                                        const Evaluation& evaluation, ScalingArrays& arrays,
                                        ScalingRules rules = {});
[[nodiscard]] VariableScaling variable_scaling(const CanonicalProblem& canonical, const Vector& v,
                                               const Evaluation& evaluation,
                                               ScalingRules rules = {});

/// A variable's own size, which does not grow with a shift of its origin: the least of its values,
/// the width of its box, and the way from the starting point or its length, whichever is longer.
[[nodiscard]] double own_size(const CanonicalProblem& canonical, double v, Index i,
                              const VariableScaling& scaling);

/// Longest entry of a vector of variables, slacks apart.
[[nodiscard]] double longest(const CanonicalProblem& canonical, const Vector& v,
                             const VariableScaling& scaling);
/// Of the point or the starting point, whichever is larger.
[[nodiscard]] double size_of_problem(const CanonicalProblem& canonical, const Vector& v,
                                     const VariableScaling& scaling);

/// Of right-hand sides and directions without the symmetries that a problem may have: of size 1/2
/// to 1, for beside an entry next to zero a large entry of the inverse would not show.
[[nodiscard]] inline double generic_entry(Index i) {
  const double turns = 0.6180339887498949 * static_cast<double>(i + 1);
  const double entry = turns - std::floor(turns) - 0.5;
  return entry + std::copysign(0.5, entry);
}

/// visit(row, column, value) for every entry of a matrix.
template <class Pattern, class Values, class Visit>
void for_each_entry(const Pattern& pattern, Values& values, Visit&& visit) {
  for (std::size_t k = 0; k < values.size(); ++k) visit(pattern[k].row, pattern[k].col, values[k]);
}

/// Scaled derivatives, with the values' call numbers forgotten.
void set_scaled(const CanonicalProblem& canonical, const Evaluation& evaluation,
                const VariableScaling& scaling, Evaluation& scaled);

}  // namespace ipminmax
