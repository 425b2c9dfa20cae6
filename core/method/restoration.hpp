#pragma once

#include <functional>

#include "core/model/canonical_problem.hpp"
#include "core/options.hpp"
#include "core/point/merit.hpp"
#include "core/solver.hpp"

namespace ipminmax {

enum class RestorationOutcome : std::uint8_t {
  Restored,           ///< the point was moved to an acceptable one
  LocallyInfeasible,  ///< the violation is at a local minimum above the tolerance
  Failed,
  Stopped,  ///< by the iteration or time limit
  UserStop  ///< by the observer; the point was moved to where it happened
};

/// Told of each iteration of a restoration but the first: its v and c in the canonical problem, and
/// what the restoration's own solve says of it. False stops.
using RestorationObserver = std::function<bool(const IterationInfo& info, const Eigen::VectorXd& v,
                                               const Eigen::VectorXd& c)>;

/// Feasibility restoration, Waechter and Biegler 2006, section 3.3: minimizes over all variables of
/// both players
///
///     rho sum(p + n) + zeta/2 |D (v - v_R)|^2   s.t.  c(v) - p + n = 0,  bounds of v,  p, n >= 0
///
/// until acceptable(v, c) holds. Moves only v of the point; its values and multipliers are the
/// caller's to renew. on_iteration may be empty. iterations: those still allowed, reduced by those used.
[[nodiscard]] RestorationOutcome restore_feasibility(
    CanonicalProblem& canonical, const SolverOptions& options, double mu,
    const std::function<bool(const Eigen::VectorXd& v, const Eigen::VectorXd& c)>& acceptable,
    const RestorationObserver& on_iteration, Point& point, Index& iterations);

}  // namespace ipminmax
