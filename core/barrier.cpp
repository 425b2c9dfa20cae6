#include <algorithm>
#include <cmath>
#include <ipminmax/core/barrier.hpp>

namespace ipminmax {

double final_barrier(const SolverOptions& options, double objective_scale) {
  const double target = std::min(options.tol, options.compl_inf_tol * std::abs(objective_scale)) /
                        (options.barrier_tol_factor + 1.0);
  return std::max(target, options.mu_target);
}

double next_barrier(double mu, double mu_final, const std::function<double(double)>& scaled_error,
                    const std::function<double(double)>& norm, const SolverOptions& options) {
  const double kappa_mu = options.mu_linear_decrease_factor;
  if (options.minmax_barrier_rule == BarrierRule::Paper) {
    // b <- sigma b when |g(z, b)| <= b, line 10 of Algorithm 1
    return mu > mu_final && norm(mu) <= mu ? std::max(mu_final, kappa_mu * mu) : mu;
  }
  // mu <- max(mu_final, min(kappa_mu mu, mu^theta_mu)), Waechter and Biegler 2006, eq. (7)
  while (mu > mu_final && scaled_error(mu) <= options.barrier_tol_factor * mu) {
    mu = std::max(mu_final,
                  std::min(kappa_mu * mu, std::pow(mu, options.mu_superlinear_decrease_power)));
  }
  return mu;
}

double boundary_fraction(double mu, const SolverOptions& options) {
  return std::max(options.tau_min, 1.0 - mu);
}

}  // namespace ipminmax
