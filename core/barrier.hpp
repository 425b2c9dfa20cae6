#pragma once

#include <functional>
#include <ipminmax/core/options.hpp>

namespace ipminmax {

/// Least barrier parameter of a solve: min(tol, compl_inf_tol) / (kappa_epsilon + 1), as Ipopt's.
/// compl_inf_tol is unscaled, so the objective's scale factor multiplies it.
[[nodiscard]] double final_barrier(const SolverOptions& options, double objective_scale);

/// Barrier parameter after an accepted iterate. scaled_error(mu) is E_mu, norm(mu) is |g(z, mu)|.
[[nodiscard]] double next_barrier(double mu, double mu_final,
                                  const std::function<double(double)>& scaled_error,
                                  const std::function<double(double)>& norm,
                                  const SolverOptions& options);

/// Fraction-to-the-boundary parameter: tau = max(tau_min, 1 - mu).
[[nodiscard]] double boundary_fraction(double mu, const SolverOptions& options);

}  // namespace ipminmax
