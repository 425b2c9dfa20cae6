#pragma once

#include <complex>
#include <string>
#include <vector>

#include "options.hpp"
#include "problem.hpp"
#include "result.hpp"

namespace IPMINMAX_API ipminmax {

/// Linearization of Algorithm 1's iteration z+ = z - (J_zz + E)^-1 S^-1 g(z, b) at a point with
/// g(z, b) = 0, for full steps and shifts E that stay as they are around it:
///
///     dz+ = (I - (J_zz + E)^-1 J_zz) dz = (J_zz + E)^-1 E dz
///
/// With a spectral radius below 1 the point attracts the iteration, above 1 it repels it (the
/// paper's four theorems).
struct IterationMap {
  std::string error;  ///< why there is no map; empty when there is
  /// Largest modulus first; one per free variable of the model. All other eigenvalues, those of
  /// slacks and multipliers, are zero.
  std::vector<std::complex<double>> eigenvalues;
  double spectral_radius = 0.0;
  double delta_x = 0.0, delta_y = 0.0;  ///< E
  Inertia inner, inner_expected;        ///< of K_yy (the paper's J_yy) without shift
  Inertia full, full_expected;          ///< of K (the paper's J_zz) without shift
  double residual = 0.0;                ///< |g(z, b)|_inf, which should be zero
};

/// The map at the point (v, lambda, z_lower, z_upper) of `at` with b = at.mu. The point must be
/// strictly inside its bounds and inequalities. E is what the options prescribe, else what
/// Algorithm 1 chooses with them there. Its units are those of the scaled problem, gradient-based
/// scaling being made at the point; nlp_scaling_method none is the paper's. Exceptions of the model
/// pass through.
[[nodiscard]] IterationMap iteration_map(Problem& problem, const Result& at,
                                         const SolverOptions& options = {});

}  // namespace ipminmax
