#pragma once

#include <functional>

#include "core/iteration.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/options.hpp"
#include "core/point/point.hpp"

namespace ipminmax {

enum class RestorationOutcome : std::uint8_t {
  Restored,           ///< the point was moved to an acceptable one
  LocallyInfeasible,  ///< the violation is at a local minimum above the tolerance
  Unproved,  ///< the same, or a saddle: only factorizations that pivot tell, and these do not
  Failed,
  Stopped,  ///< by the iteration or time limit
  UserStop  ///< by the observer; the point was moved to where it happened
};

/// A solve inside a solve: no feasibility restoration and no certificate of its own.
using NestedSolve =
    std::function<Result(Problem& problem, const SolverOptions&, const SolveObserver&)>;

/// Told of each iteration of a restoration but the first: what the restoration's own solve says of
/// it, the point that is restored, and v and c of the iteration in the canonical problem. False
/// stops.
using RestorationObserver = std::function<bool(const IterationInfo& nested, const Point& from,
                                               const Eigen::VectorXd& v, const Eigen::VectorXd& c)>;

/// How a method restores feasibility. Without solve: not at all; observe may be empty.
struct Restorer {
  NestedSolve solve;
  RestorationObserver observe;
};

/// Feasibility restoration, Waechter and Biegler 2006, section 3.3: minimizes over all variables of
/// both players
///
///     rho sum(p + n) + zeta/2 |D (v - v_R)|^2   s.t.  c(v) - p + n = 0,  bounds of v,  p, n >= 0
///
/// until acceptable(v, c) holds. Moves v of the point; its values are the caller's to renew, and so
/// are its multipliers, unless it is locally infeasible: they are then those of this problem.
/// iterations: those still allowed, reduced by those used.
/// Where the proximal term holds v back at the end, it goes on from there with less of it: what is
/// called a local minimum of the violation is one without that term.
[[nodiscard]] RestorationOutcome restore_feasibility(
    CanonicalProblem& canonical, const SolverOptions& options, double mu,
    const std::function<bool(const Eigen::VectorXd& v, const Eigen::VectorXd& c)>& acceptable,
    const Restorer& restorer, Point& point, Index& iterations);

}  // namespace ipminmax
