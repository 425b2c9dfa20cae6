#pragma once

#include <cstdint>

#include "core/model/canonical_problem.hpp"
#include "core/model/iterate.hpp"

namespace ipminmax {

/// Step of zeros in the shapes of the problem.
[[nodiscard]] Step zero_step(const CanonicalProblem& canonical);
/// The same in a step that is there.
void set_zero(const CanonicalProblem& canonical, Step& step);
void set_zero(Step& step);

struct StepLength {
  double primal = 1.0;  ///< of v and lambda
  double dual = 1.0;    ///< of z_lower and z_upper
};

/// How far lambda of inequalities goes.
enum class InequalityLength : std::uint8_t {
  Primal,  ///< as v and all lambda: Ipopt's alpha_for_y primal
  Dual     ///< as the multipliers of the slack's bounds: the slack stays stationary
};

/// Largest steps in (0, 1] that keep at least (1 - tau) of every distance to a bound and of every
/// bound multiplier.
[[nodiscard]] StepLength largest_step(const CanonicalProblem& canonical, const Iterate& iterate,
                                      const Step& step, double tau);

/// iterate += alpha step; v stays where the step changes it by its rounding alone.
void advance(const CanonicalProblem& canonical, const Step& step, StepLength alpha,
             Iterate& iterate, InequalityLength inequalities = InequalityLength::Primal);

/// Keeps bound multipliers within [mu / (kappa s), kappa mu / s], s the distance to the bound:
/// Waechter and Biegler 2006, eq. (16).
void clip_bound_multipliers(const CanonicalProblem& canonical, double mu, double kappa,
                            Iterate& iterate);

}  // namespace ipminmax
