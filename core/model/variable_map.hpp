#pragma once

#include <string>
#include <vector>

#include "core/model/indices.hpp"
#include "core/options.hpp"
#include "core/problem.hpp"
#include "linalg/array.hpp"

namespace ipminmax {

/// Half-open range of indices.
struct IndexRange {
  Index begin = 0;
  Index end = 0;
  [[nodiscard]] Index size() const { return end - begin; }
  [[nodiscard]] bool contains(Index i) const { return begin <= i && i < end; }
};

[[nodiscard]] inline Numbers<Index> indices(IndexRange range) { return {range.begin, range.end}; }

/// The entries of a vector in a range.
template <class Vector>
[[nodiscard]] auto part(Vector& v, IndexRange range) {
  return v.segment(range.begin, range.size());
}

/// visit(i, that of the model) for the canonical variables or constraints i that the model has.
/// of_model: per canonical one, -1 for others.
template <class Visit>
void for_each_of_model(const std::vector<Index>& of_model, const Visit& visit) {
  for (const auto i : indices(of_model)) {
    if (of_model[i] >= 0) visit(static_cast<Index>(i), at(of_model[i]));
  }
}

/// Copies of y: Max variables, slacks included, and Max constraints of one robust constraint alone,
/// which is named by its slack; all empty where there are none.
struct RowOwners {
  Array<Index> slack_of_variable;    ///< per canonical variable, -1: no copy
  Array<Index> slack_of_constraint;  ///< per canonical constraint, -1: of no copy
  Array<Index> constraint_of_slack;  ///< per canonical variable; -1: no slack of Min
  Array<bool> has_copies;            ///< per canonical variable: of slacks
  /// Entries of the Jacobian in the column of a Min variable: of a robust constraint, and of a
  /// constraint of its copy.
  struct Shared {
    std::size_t of_robust, of_copy;
    Index copy;  ///< the latter
  };
  std::vector<Shared> shared_entries;
  std::vector<std::size_t> own_entries;  ///< of the Jacobian: robust rows in their copies
};

/// Which variables and constraints of the model are which of the canonical problem, and their
/// patterns there; see CanonicalProblem.
struct VariableMap {
  IndexRange x, x_slacks, y, y_slacks, min_constraints, max_constraints;
  Array<Index> variable_of_model;          ///< canonical variable of a model variable, -1 if fixed
  Array<Index> model_variable;             ///< model variable of a canonical one, -1 for slacks
  Array<Index> constraint_of_model;        ///< -1 for constraints without bounds
  Array<Index> model_constraint;           ///< -1 where a variable is fixed by the constraint
  Array<Index> fixing_variable;            ///< canonical variable of such a constraint, else -1
  Array<Index> slack_of_constraint;        ///< -1 for equalities
  Array<bool> varies;                      ///< constraints of the model that read a free variable
  std::vector<Index> robust_constraints;   ///< of Min that read Max variables; ascending
  std::vector<Triplet> jacobian, hessian;  ///< without the slacks' entries
  RowOwners owners;
  /// Model triplet of each canonical one; -1 for the entry of a constraint that fixes a variable.
  Array<Index> jacobian_source, hessian_source;

  /// Of a checked structure. The error: a player has too few degrees of freedom.
  /// Of another structure before: nothing of that is left.
  [[nodiscard]] std::string build(const ProblemStructure& structure, const SolverOptions& options);

  [[nodiscard]] Index variables() const { return y_slacks.end; }
  [[nodiscard]] Index constraints() const { return max_constraints.end; }
  [[nodiscard]] bool owned_by_max(Index variable) const { return variable >= y.begin; }

 private:
  [[nodiscard]] std::string index_variables(const ProblemStructure& s,
                                            const SolverOptions& options);
  void index_constraints(const ProblemStructure& s, const SolverOptions& options);
  void map_entries(const ProblemStructure& s);
  void list_robust_constraints();
  void list_owners(const ProblemStructure& s);
};

/// Whether equal bounds of a model variable have become a constraint.
[[nodiscard]] bool is_fixed_by_constraint(const ProblemStructure& structure,
                                          const SolverOptions& options, Index model_variable);

}  // namespace ipminmax
