#pragma once

#include <functional>

#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// Proves what the certificate of a result claims (minmax_certificate proved): that near the point
/// there is a strict local minmax of the formulas, with strict complementarity, and one only. Sets
/// proved, proved_within and proof of the certificate.
///
/// On the active bounds and constraints a first-order point is a zero w* of
///
///   F(w) = (grad_v L, g - b),  L = sigma f + lambda' g,  w = (free v, lambda of active rows).
///
/// With K = F' ~ Q^-T S Q^-1, S = diag(+-1), at the point w, let E = Q' K(w + Q t) Q - S for all
/// |t| <= tau (maximum norm, interval arithmetic). If
///
///   |E| < 1  and  |Q' F(w)| + |E| tau < tau
///
/// then t - S Q' F(w + Q t) contracts the ball into itself (Kantorovich's and Krawczyk's tests in
/// these coordinates), so w* is there; and by Gershgorin's theorem and Sylvester's law every K of
/// the ball has the inertia of S. The same of K_yy, and the signs of multipliers and slacks over
/// the ball, are the second-order sufficient conditions of docs/algorithm.md at w*.
///
/// R. Krawczyk, Computing 4 (1969); S. M. Rump, Acta Numerica 19 (2010), sections 10 and 13.
/// go_on: false ends it.
void prove_local_minmax(Problem& problem, const SolverOptions& options,
                        const std::function<bool()>& go_on, Result& result);

}  // namespace ipminmax
