#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/certificate/scaling.hpp"
#include "core/kkt/system.hpp"
#include "core/point/workspace.hpp"
#include "linalg/numbers.hpp"

namespace ipminmax {

/// State of a bound at the solution nearby. Weakly active: multiplier and distance are both small,
/// so strict complementarity cannot be seen.
enum class BoundClass : std::uint8_t { Inactive, WeaklyActive, Active };

/// Classifies a bound by its multiplier and distance, both scaled. It is active, or inactive, if
/// one exceeds the other by more than the factor strict_ratio.
[[nodiscard]] inline BoundClass class_of(double multiplier, double distance, double strict_ratio) {
  if (multiplier > strict_ratio * distance) return BoundClass::Active;
  return strict_ratio * multiplier < distance ? BoundClass::Inactive : BoundClass::WeaklyActive;
}

/// Distance of v_i to its lower bound (side -1) or upper one.
[[nodiscard]] inline double distance_to_bound(const CanonicalProblem& canonical, const Vector& v,
                                              Index i, int side) {
  return side < 0 ? canonical.above_lower(i, v[i]) : canonical.below_upper(i, v[i]);
}

/// One class per canonical variable; a slack stands for its inequality. If a variable has two
/// bounds, the more active one counts. Words for what the test takes out of its system: a variable
/// is fixed at an active bound, and held (with side 0) where the test itself fixes it. A row is
/// left out because it is redundant or because its copies are held (held_rows).
struct ActiveBounds {
  std::vector<BoundClass> of;
  std::vector<std::int8_t> side;  ///< -1: of the lower bound, +1: of the upper one, 0: none
  /// Per canonical constraint, or empty: redundant rows. Their multipliers stay as they are.
  std::vector<bool> redundant;
  /// Per canonical constraint, or empty: Max's rows on copies that are held. Their multipliers are
  /// zero.
  std::vector<bool> held_rows;

  /// All bounds inactive, all rows counted.
  void reset(const CanonicalProblem& canonical) {
    redundant.clear();
    held_rows.clear();
    of.assign(at(canonical.variables()), BoundClass::Inactive);
    side.assign(at(canonical.variables()), 0);
  }
  /// One of a variable's bounds.
  void include(Index i, int side_of_bound, BoundClass found) {
    if (side_of(i) != 0 && found <= of[at(i)]) return;
    of[at(i)] = found;
    side[at(i)] = static_cast<std::int8_t>(side_of_bound);
  }
  /// Holds a variable where it is, at a bound or not.
  void hold(Index i) {
    of[at(i)] = BoundClass::Active;
    side[at(i)] = 0;
  }
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
  /// Whether active bounds and equations are so many more than the variables that they are no
  /// degenerate point's, but a wrong guess.
  [[nodiscard]] bool exceeds_variables(const CanonicalProblem& canonical) const;
  [[nodiscard]] bool is_clear(const CanonicalProblem& canonical) const {
    return is_strict() && !exceeds_variables(canonical);
  }
  /// Weakly active bounds of a player.
  [[nodiscard]] Index weak(const CanonicalProblem& canonical, Player player) const {
    Index count = 0;
    for (const Index i : each_variable(canonical)) {
      const bool own = canonical.owned_by_max(i) == (player == Player::Max);
      if (own && of[at(i)] == BoundClass::WeaklyActive) ++count;
    }
    return count;
  }
  [[nodiscard]] BoundClass operator[](Index i) const { return of[at(i)]; }
  [[nodiscard]] int side_of(Index i) const { return side[at(i)]; }
  /// Distance to the bound meant, and its multiplier.
  [[nodiscard]] double distance(const CanonicalProblem& canonical, const Iterate& z,
                                Index i) const {
    return distance_to_bound(canonical, z.v, i, side_of(i));
  }
  [[nodiscard]] double multiplier(const Iterate& z, Index i) const {
    return multiplier_of(z, i, side_of(i));
  }
};

[[nodiscard]] inline bool is_slack(const CanonicalProblem& canonical, Index variable) {
  return canonical.x_slacks().contains(variable) || canonical.y_slacks().contains(variable);
}
/// visit(constraint, slack) for every inequality.
template <class Visit>
void for_each_slack(const CanonicalProblem& canonical, Visit&& visit) {
  for (const Index j : each_constraint(canonical)) {
    if (canonical.slack_of(j) >= 0) visit(j, canonical.slack_of(j));
  }
}

/// The scaled KKT system of the active set. Variables at active bounds and rows of inactive
/// inequalities are taken out; active inequalities are equalities. It uses the matrices of a
/// KktSystem: rows that are taken out become rows of the identity with the expected signs.
class ActiveSetSystem {
 public:
  /// Whether weakly active bounds are fixed, per player.
  struct Weak {
    bool min_fixed = false, max_fixed = false;
  };
  /// Choice under which the sufficient conditions hold whatever the weakly active bounds turn out
  /// to be. Min's count as inactive: Min then has more directions. Max's count as active in K:
  /// phi(x) is at least the value with them.
  static constexpr Weak kSufficient{.min_fixed = false, .max_fixed = true};

  /// Of a point's derivatives. left: parts of the workspace that nobody works with.
  ActiveSetSystem(const CanonicalProblem& its_canonical, KktSystem& its_kkt,
                  const ActiveBounds& its_set, const VariableScaling& its_scaling,
                  const Evaluation& evaluation, const Parts& left)
      : canonical(its_canonical),
        kkt(its_kkt),
        set(its_set),
        scaling(its_scaling),
        parts(left),
        evaluation_(evaluation) {
    reduced_ = evaluation;
    fixed_.setZero(canonical.variables());
  }
  ActiveSetSystem(const ActiveSetSystem&) = delete;
  ActiveSetSystem& operator=(const ActiveSetSystem&) = delete;

  /// Assembles K and K_yy with W + error_times diag(error). error: per variable, scaled; or empty.
  void assemble(Weak fixed, const Vector& error = {}, double error_times = 0.0);

  const CanonicalProblem& canonical;
  KktSystem& kkt;
  const ActiveBounds& set;
  const VariableScaling& scaling;
  Parts parts;  ///< what the system leaves of the workspace

  /// Derivatives in the matrices of the last assemble().
  [[nodiscard]] const Evaluation& assembled() const { return reduced_; }
  /// Rows that are left out, or empty.
  [[nodiscard]] const std::vector<bool>& left_out() const { return left_out_; }
  /// Scaled derivatives, nothing taken out.
  [[nodiscard]] Evaluation derivatives() const {
    Evaluation scaled = evaluation_;
    scale(scaled);
    return scaled;
  }
  /// Returns a zero right-hand side and clears the solution, for the next solve.
  [[nodiscard]] NewtonResidual& rhs() {
    set_zero(canonical, step_);
    set_zero(canonical, rhs_);
    return rhs_;
  }
  [[nodiscard]] Step& step() { return step_; }
  /// Solves with K_yy (inner) or K as factorized last. False: not accurate.
  [[nodiscard]] bool solve(bool inner, const NewtonResidual& rhs, Step& solution,
                           const Accuracy& accuracy = {}) {
    return inner ? kkt.solve_inner(assembled(), rhs, solution, accuracy)
                 : kkt.solve(assembled(), rhs, solution, accuracy);
  }

  /// Whether a variable is at an active bound, weakly active bounds as in the last assemble().
  [[nodiscard]] bool is_fixed(Index variable) const { return fixed_[variable] != 0.0; }
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
  void scale(Evaluation& derivatives) const;

  const Evaluation& evaluation_;
  Evaluation& reduced_ = parts.point().evaluation;
  NewtonResidual& rhs_ = parts.step();
  Step &step_ = parts.step(), &more_ = parts.step();
  Vector &curvature_ = more_.v, &fixed_ = more_.z_lower;
  std::vector<bool> left_out_;
};

}  // namespace ipminmax
