#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/certificate/scaling.hpp"
#include "core/kkt/system.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

/// What a bound is at the solution nearby. Weakly active: multiplier and distance are both small,
/// there is no strict complementarity that could be seen.
enum class BoundClass : std::uint8_t { Inactive, WeaklyActive, Active };

/// The one rule of what is active, by a multiplier and a distance in lengths in which both count
/// the same: no doubt where one is strict_ratio times the other.
[[nodiscard]] inline BoundClass class_of(double multiplier, double distance, double strict_ratio) {
  if (multiplier > strict_ratio * distance) return BoundClass::Active;
  return strict_ratio * multiplier < distance ? BoundClass::Inactive : BoundClass::WeaklyActive;
}

/// Per canonical variable; a slack stands for its inequality. Of two bounds the more active one
/// counts.
struct ActiveBounds {
  std::vector<BoundClass> of;
  std::vector<std::int8_t> side;  ///< -1: the lower bound is meant, +1: the upper one, 0: none
  /// Per canonical constraint, or empty: rows that say nothing beside others, whose multipliers are
  /// kept as they are.
  std::vector<bool> redundant;
  /// The same of Max's rows on copies that are held; their multipliers vanish.
  std::vector<bool> held_rows;

  /// All bounds inactive, all rows counted.
  void reset(const CanonicalProblem& canonical);
  /// One of a variable's bounds.
  void include(Index i, int side_of_bound, BoundClass found);
  /// Holds a variable where it is, at a bound or not.
  void hold(Index i);
  [[nodiscard]] bool is_redundant(Index constraint) const {
    return !redundant.empty() && redundant[at(constraint)];
  }
  [[nodiscard]] bool is_held(Index constraint) const {
    return !held_rows.empty() && held_rows[at(constraint)];
  }
  [[nodiscard]] bool is_left_out(Index constraint) const {
    return is_redundant(constraint) || is_held(constraint);
  }
  /// Whether no bound is weakly active.
  [[nodiscard]] bool is_strict() const {
    return std::ranges::find(of, BoundClass::WeaklyActive) == of.end();
  }
  /// Weakly active bounds of a player.
  [[nodiscard]] Index weak(const CanonicalProblem& canonical, Player player) const;
  [[nodiscard]] BoundClass operator[](Index i) const { return of[at(i)]; }
  [[nodiscard]] int side_of(Index i) const { return side[at(i)]; }
  /// Distance to the bound meant, and its multiplier.
  [[nodiscard]] double distance(const CanonicalProblem& canonical, const Iterate& z, Index i) const;
  [[nodiscard]] double multiplier(const Iterate& z, Index i) const {
    return multiplier_of(z, i, side_of(i));
  }
};

/// By z / s, scaled: a first guess, which a Newton step has to confirm. A bound no farther than
/// what it was relaxed by is never inactive. Weakly active where the ratio is no larger than
/// strict_ratio and no smaller than its inverse.
void guess_active_set(const CanonicalProblem& canonical, const SolverOptions& options,
                      const Iterate& iterate, const VariableScaling& scaling, double strict_ratio,
                      ActiveBounds& set);
/// Whether a point of the model's own feasible set may lie on the bound: it was relaxed by so much.
[[nodiscard]] bool within_relaxation(const CanonicalProblem& canonical, Index i, int side,
                                     double distance, const SolverOptions& options);

[[nodiscard]] inline bool is_slack(const CanonicalProblem& canonical, Index variable) {
  return canonical.x_slacks().contains(variable) || canonical.y_slacks().contains(variable);
}
/// visit(constraint, slack) for every inequality.
template <class Visit>
void for_each_slack(const CanonicalProblem& canonical, Visit&& visit) {
  for (Index j = 0; j < canonical.constraints(); ++j) {
    if (canonical.slack_of(j) >= 0) visit(j, canonical.slack_of(j));
  }
}

/// What an ActiveSetSystem works with, kept from one to the next.
struct ActiveSetArrays {
  Evaluation scaled, reduced;
  std::vector<char> fixed;     ///< as bool, read often
  std::vector<bool> left_out;  ///< rows, or empty
  Vector curvature;
  NewtonResidual rhs;  ///< of whoever solves with the system
  Step step;
};

/// The scaled KKT system of the active set: fixed variables (at active bounds) and the rows of
/// inactive inequalities are taken out, active inequalities are equalities. Uses the matrices of a
/// KktSystem, with rows that are taken out replaced by those of the identity, signs as expected.
class ActiveSetSystem {
 public:
  /// Whether weakly active bounds are fixed, per player.
  struct Weak {
    bool min_fixed = false, max_fixed = false;
  };
  /// So that the verdict of the sufficient conditions holds whatever the weakly active bounds are:
  /// those of Min as inactive, for more directions are open to him; those of Max as active in K,
  /// for phi(x) is at least what he gets with them.
  static constexpr Weak kSufficient{.min_fixed = false, .max_fixed = true};

  /// The point's derivatives are copied. arrays: of no other system that is in use; null: its own.
  ActiveSetSystem(const CanonicalProblem& its_canonical, KktSystem& its_kkt,
                  const ActiveBounds& its_set, const VariableScaling& its_scaling,
                  const Evaluation& evaluation, ActiveSetArrays* arrays = nullptr);
  ActiveSetSystem(const ActiveSetSystem&) = delete;
  ActiveSetSystem& operator=(const ActiveSetSystem&) = delete;

  /// Assembles K and K_yy with min_times, max_times the error (per variable, scaled; may be empty)
  /// added to the curvature of the players' variables: to W for Min, taken from W for Max.
  void assemble(Weak fixed, const Vector& error = {}, double min_times = 0.0,
                double max_times = 0.0);

  const CanonicalProblem& canonical;
  KktSystem& kkt;
  const ActiveBounds& set;
  const VariableScaling& scaling;

  /// The matrices' derivatives of the last assemble.
  [[nodiscard]] const Evaluation& assembled() const { return arrays_.reduced; }
  /// Rows that are left out, or empty.
  [[nodiscard]] const std::vector<bool>& left_out() const { return arrays_.left_out; }
  /// Scaled derivatives, nothing taken out.
  [[nodiscard]] const Evaluation& derivatives() const { return arrays_.scaled; }
  /// A right-hand side, zero, and solution for the next solve with the system.
  [[nodiscard]] NewtonResidual& rhs() {
    set_zero(canonical, arrays_.step);
    set_zero(canonical, arrays_.rhs);
    return arrays_.rhs;
  }
  [[nodiscard]] Step& step() { return arrays_.step; }
  /// With K_yy or K as factorized last.
  [[nodiscard]] bool solve(bool inner, const NewtonResidual& rhs, Step& solution,
                           const Accuracy& accuracy = {}) {
    return inner ? kkt.solve_inner(assembled(), rhs, solution, accuracy)
                 : kkt.solve(assembled(), rhs, solution, accuracy);
  }

  /// With the weakly active bounds as in the last assemble.
  [[nodiscard]] bool is_fixed(Index variable) const { return arrays_.fixed[at(variable)] != 0; }
  /// Neither fixed nor a slack.
  [[nodiscard]] bool is_free(Index variable) const {
    return !is_fixed(variable) && !is_slack(canonical, variable);
  }
  /// Whether a constraint is an equality or an inequality counted as active, and not left out.
  [[nodiscard]] bool counts(Index constraint) const {
    const Index slack = canonical.slack_of(constraint);
    return !set.is_left_out(constraint) && (slack < 0 || is_fixed(slack));
  }

 private:
  std::optional<ActiveSetArrays> own_;
  ActiveSetArrays& arrays_;
};

}  // namespace ipminmax
