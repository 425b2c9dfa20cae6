#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "core/model/canonical_problem.hpp"
#include "core/model/indices.hpp"
#include "core/model/iterate.hpp"
#include "core/point/workspace.hpp"

namespace ipminmax {

using Vector = Eigen::VectorXd;

/// Scaled variables: between variables with curvature no entry of W exceeds 1, and each of these
/// has an entry of about that size. So "little curvature" means the same in all units of the model.
/// An entry of a variable whose length comes from constraints may be larger.
struct VariableScaling {
  Vector variable;    ///< per canonical variable; a slack's is its constraint's
  Vector constraint;  ///< per canonical constraint
};

/// Computes the scaling: first from diagonal entries, then for rows without one from their
/// couplings, then for variables without curvature from the constraints that tie them to others.
/// Each step transforms correctly when the units of the model change. Variables that nothing ties
/// keep the model's units. Finally, a variable's length is reduced if the other terms of one of its
/// equations are negligible beside it, down to the variable's size at v or at the start.
/// by_coupling: variables without curvature of their own get lengths from their coupling to the
/// other player's.
void scale_variables(const CanonicalProblem& canonical, const Vector& v,
                     const Evaluation& evaluation, Parts parts, VariableScaling& scaling,
                     bool by_coupling = false);
[[nodiscard]] VariableScaling variable_scaling(const CanonicalProblem& canonical, const Vector& v,
                                               const Evaluation& evaluation);

/// Returns a variable's own size, which does not grow with a shift of its origin: the least of its
/// value, the width of its box, and the larger of its scaled unit and its distance from the
/// starting point.
[[nodiscard]] double own_size(const CanonicalProblem& canonical, double v, Index i,
                              const VariableScaling& scaling);

/// Longest entry of a vector of variables, slacks apart.
[[nodiscard]] double longest(const CanonicalProblem& canonical, const Vector& v,
                             const VariableScaling& scaling);
/// Longest entry, scaled, of the point or of the starting point, whichever is larger; slacks apart.
[[nodiscard]] double size_of_problem(const CanonicalProblem& canonical, const Vector& v,
                                     const VariableScaling& scaling);

/// Entry i of a generic vector without symmetries. Its size is between 1/2 and 1, so that no large
/// entry of an inverse stays hidden.
[[nodiscard]] inline double generic_entry(Index i) {
  const double turns = 0.6180339887498949 * static_cast<double>(i + 1);
  const double entry = turns - std::floor(turns) - 0.5;
  return entry + std::copysign(0.5, entry);
}

/// visit(row, column, value) for every entry of a matrix.
template <class Pattern, class Values, class Visit>
void for_each_entry(const Pattern& pattern, Values& values, Visit&& visit) {
  for (const auto k : indices(values)) visit(pattern[k].row, pattern[k].col, values[k]);
}

/// The same for the derivatives at a point.
template <class Derivatives, class Visit>
void for_each_in_jacobian(const CanonicalProblem& canonical, Derivatives& at_point, Visit&& visit) {
  for_each_entry(canonical.jacobian(), at_point.jacobian, visit);
}
template <class Derivatives, class Visit>
void for_each_in_hessian(const CanonicalProblem& canonical, Derivatives& at_point, Visit&& visit) {
  for_each_entry(canonical.hessian(), at_point.hessian, visit);
}

/// The positions in a vector; all canonical variables; all canonical constraints.
[[nodiscard]] inline Numbers<Index> indices(const Vector& v) {
  return {0, static_cast<Index>(v.size())};
}
[[nodiscard]] inline Numbers<Index> each_variable(const CanonicalProblem& canonical) {
  return {0, canonical.variables()};
}
[[nodiscard]] inline Numbers<Index> each_constraint(const CanonicalProblem& canonical) {
  return {0, canonical.constraints()};
}

}  // namespace ipminmax
