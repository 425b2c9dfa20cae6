#pragma once

#include <cmath>
#include <vector>

#include "core/problem.hpp"
#include "core/result.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

/// The robust constraints of a model, ascending; none where indices cannot be followed.
[[nodiscard]] std::vector<Index> robust_constraints(const ProblemStructure& structure);

/// Indices of a player's variables, ascending.
[[nodiscard]] std::vector<std::size_t> variables_of(const ProblemStructure& structure,
                                                    Player player);

/// What a function with these slopes (n) changes by as each Min variable moves by size(i), beside
/// another change.
[[nodiscard]] double change_by_min(const ProblemStructure& s, const std::vector<double>& slopes,
                                   const auto& size, double change = 0.0) {
  for (const std::size_t i : variables_of(s, Player::Min)) change += std::abs(slopes[i]) * size(i);
  return change;
}

/// The same of each constraint. jacobian: the entries.
[[nodiscard]] std::vector<double> changes_by_min(const ProblemStructure& s,
                                                 const std::vector<double>& jacobian,
                                                 const auto& size) {
  std::vector<double> changes(s.constraint_players.size(), 0.0);
  for (std::size_t k = 0; k < jacobian.size(); ++k) {
    const auto [row, col] = s.jacobian[k];
    if (s.variable_players[at(col)] == Player::Min)
      changes[at(row)] += std::abs(jacobian[k]) * size(at(col));
  }
  return changes;
}

/// Indices that are marked, ascending.
[[nodiscard]] std::vector<Index> marked(const std::vector<bool>& marks);

/// Of each constraint its entries in the Jacobian.
[[nodiscard]] std::vector<std::vector<std::size_t>> entries_of_rows(const ProblemStructure& s);

/// An equation and the variable that it gives a value whatever the others are.
struct ExplicitEquation {
  Index constraint, variable;
};
using ExplicitEquations = std::vector<ExplicitEquation>;

/// What of Max a robust constraint involves: the Max variables that it reads, those tied to them by
/// Max constraints, and these constraints. Ascending.
struct RobustScope {
  std::vector<Index> variables;
  std::vector<Index> constraints;
  /// Of these variables those that move only others which Max's equations determine and which the
  /// constraint does not depend on: of a trajectory the disturbances behind the constraint's stage.
  std::vector<Index> irrelevant;
  /// Those that Max's equations determine, where these are all of the constraints: of a trajectory
  /// the states.
  std::vector<Index> dependent;
  /// What follows from the rest by explicit equations, each of which reads of these variables its
  /// own and those before it: of a trajectory the states. Those behind the constraint's stage and
  /// their equations are then in none of the lists above, and what is irrelevant is not in
  /// `variables`.
  ExplicitEquations follows{};
};

/// Of each Jacobian entry, whether it is the same and not zero at points around v (n values). Empty
/// where Max has no equation, or it is undefined there.
[[nodiscard]] std::vector<bool> linear_entries(Problem& model, const std::vector<double>& v,
                                               Counts& counts);

/// The scopes of a structure's robust constraints. A scope takes time linear in its entries.
class RobustScopes {
 public:
  /// linear: of each Jacobian entry; empty: no equation is known to be explicit.
  explicit RobustScopes(const ProblemStructure& structure, const std::vector<bool>& linear = {});
  [[nodiscard]] RobustScope of(Index constraint) const;
  /// The same where no equation is taken for explicit.
  [[nodiscard]] RobustScope all_of(Index constraint) const;
  /// What follows from the rest of Max's variables, as in a scope; empty: not all does explicitly.
  [[nodiscard]] ExplicitEquations follows() const;

 private:
  using Marks = std::vector<bool>;
  void match_from(Index row);
  Marks matters(Index constraint, const std::vector<Index>& constraints) const;
  std::vector<Index> dependent(const RobustScope& scope) const;
  ExplicitEquations in_order(const std::vector<Index>& variables, const Marks& without) const;

  const ProblemStructure* structure_;
  std::vector<std::vector<Index>> columns_;  ///< of each constraint, Max's
  std::vector<std::vector<Index>> rows_;     ///< of each variable, Max's
  std::vector<Index> determines_;            ///< of each constraint a variable, or -1
  std::vector<Index> determined_by_;         ///< of each variable a constraint, or -1
  Marks explicit_;                           ///< of each constraint, whether it always can
};

/// Gives variables that follow from the rest of v (n values), as in a scope, their values. False:
/// they have none.
[[nodiscard]] bool complete(Problem& model, const ExplicitEquations& follows,
                            std::vector<double>& v);

/// Whether y can be held, dependent states apart, as a scenario of a robust constraint: not where Y
/// moves with x in another way than by equations that determine these, for then no fixed y is in it
/// for every x.
[[nodiscard]] bool can_be_held(const ProblemStructure& structure, const RobustScope& scope);

}  // namespace ipminmax
