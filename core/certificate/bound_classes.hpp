#pragma once

#include <cstdint>
#include <vector>

#include "core/certificate/units.hpp"
#include "core/kkt/system.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/options.hpp"
#include "core/point/point.hpp"
#include "core/point/step_length.hpp"

namespace ipminmax {

/// Solves with the assembled K at a shift, factorized anew at a higher quality as often as needed.
[[nodiscard]] bool solve_accurately(KktSystem& kkt, const Evaluation& evaluation,
                                    const NewtonResidual& rhs, Step& step,
                                    const Regularization& shift = {});

/// One Newton step for the equations at mu from a point with all derivatives and dual residual,
/// which is left at its end, without f; dependent: constraints are, as is known before or found
/// out. False: it cannot be computed or evaluated.
[[nodiscard]] bool barrier_newton_step(CanonicalProblem& canonical, KktSystem& kkt, double mu,
                                       Point& point, StepLength& alpha, bool& dependent);

/// What a bound is at the solution nearby. Doubtful: multiplier and distance are both small, there
/// is no strict complementarity that could be seen.
enum class BoundClass : std::uint8_t { Inactive, Doubtful, Active };

/// Per canonical variable; a slack stands for its inequality. Of two bounds the more active one
/// counts.
struct BoundClasses {
  std::vector<BoundClass> of;
  std::vector<std::int8_t> side;     ///< -1: the lower bound is meant, +1: the upper one, 0: none
  Index weak_min = 0, weak_max = 0;  ///< doubtful bounds of each player
  /// Per canonical constraint, or empty: rows that say nothing beside others, whose multipliers are
  /// kept as they are.
  std::vector<bool> redundant;
  /// The same of Max's rows on copies that are held; their multipliers vanish.
  std::vector<bool> held_rows;

  [[nodiscard]] bool is_redundant(Index constraint) const {
    return !redundant.empty() && redundant[static_cast<std::size_t>(constraint)];
  }

  [[nodiscard]] bool is_held(Index constraint) const {
    return !held_rows.empty() && held_rows[static_cast<std::size_t>(constraint)];
  }
  [[nodiscard]] bool is_left_out(Index constraint) const {
    return is_redundant(constraint) || is_held(constraint);
  }
  /// Holds a variable where it is, at a bound or not.
  void hold(Index i);
  [[nodiscard]] bool clear() const { return weak_min + weak_max == 0; }
  [[nodiscard]] BoundClass operator[](Index i) const { return of[static_cast<std::size_t>(i)]; }
  /// Distance to the bound meant, and its multiplier.
  [[nodiscard]] double distance(const CanonicalProblem& canonical, const Iterate& z, Index i) const;
  [[nodiscard]] double multiplier(const Iterate& z, Index i) const;
};

/// weak_min, weak_max
void count_doubtful(const CanonicalProblem& canonical, BoundClasses& classes);

/// The one rule of what is active, by a multiplier and a distance in lengths in which both count
/// the same: no doubt where one is strict_ratio times the other.
[[nodiscard]] inline BoundClass class_of(double multiplier, double distance, double strict_ratio) {
  if (multiplier > strict_ratio * distance) return BoundClass::Active;
  return strict_ratio * multiplier < distance ? BoundClass::Inactive : BoundClass::Doubtful;
}

/// By z / s in units: a first guess, which a Newton step has to confirm. A bound no farther than
/// what it was relaxed by is never inactive. Doubtful where the ratio is no larger than
/// strict_ratio and no smaller than its inverse.
void guess_classes(const CanonicalProblem& canonical, const SolverOptions& options,
                   const Iterate& iterate, const Units& units, double strict_ratio,
                   BoundClasses& classes);

/// Follows the solution to smaller barrier parameters, where the distance of an active bound falls
/// as mu and its multiplier stays, and the other way round at an inactive one: until every bound
/// has shown what it is and the point hardly moves, a distance has lost its digits, 8 decreases or
/// most_steps Newton steps are done. Point (dual residual included) and mu are moved along.
[[nodiscard]] BoundClasses follow_barrier(CanonicalProblem& canonical, KktSystem& kkt,
                                          const SolverOptions& options, const Units& units,
                                          const BoundClasses& guess, int most_steps, Point& point,
                                          double& mu);

}  // namespace ipminmax
