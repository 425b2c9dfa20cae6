#pragma once

#include "core/kkt/system.hpp"
#include "core/model/canonical_problem.hpp"
#include "core/options.hpp"
#include "core/point/iterate.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// Second-order test at a first-order point: the paper's Proposition "Second order sufficient
/// conditions for constrained minmax", all regularization off.
///
/// evaluation holds f, c, first and second derivatives at the iterate. Bounds are classed by
/// z / s: active ones keep their barrier curvature, inactive ones lose it, and those in between
/// (no strict complementarity) are tested without it for Satisfied and with it for Violated.
/// A wrong sign counts only beyond minmax_curvature_tol times the largest Hessian entry, a right
/// one only if it would survive that much curvature taken away and if Newton's method for the
/// equations at mu contracts fast: else the curvature may vanish at the solution nearby (f = x^3).
/// Where the Hessian is inexact, a sign counts only if every Hessian within the estimated error has
/// it.
/// The KKT matrices are left at the certificate's values.
[[nodiscard]] Certificate certify(CanonicalProblem& canonical, KktSystem& kkt,
                                  const Iterate& iterate, const Evaluation& evaluation, double mu,
                                  const SolverOptions& options);

}  // namespace ipminmax
