#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"
#include "linalg/symmetric_matrix.hpp"
#include "linalg/symmetric_solver.hpp"

namespace bench {

/// A matrix that a solve factorizes, without shifts.
struct KktMatrix {
  ipminmax::SymmetricMatrix matrix;
  std::vector<std::int8_t> signs;  ///< expected signs of the pivots
};

/// Both matrices of an iteration; inner is empty when there are no Max variables.
struct KktMatrices {
  KktMatrix full;                          ///< K
  KktMatrix inner;                         ///< K_yy
  std::vector<ipminmax::Index> inner_row;  ///< per row of K its row of K_yy, or -1
};

/// The matrices at the point and multipliers of a result. Throws std::runtime_error when they
/// cannot be made.
[[nodiscard]] KktMatrices kkt_matrices_at(ipminmax::Problem& problem,
                                          const ipminmax::Result& result,
                                          const ipminmax::SolverOptions& options);

/// The matrices after the given number of iterations.
[[nodiscard]] KktMatrices kkt_matrices_after(ipminmax::Problem& problem, int iterations,
                                             ipminmax::SolverOptions options = {});

/// Seconds of one numerical factorization by a solver that has analyzed the matrix: mean of as many
/// as take about `seconds`.
[[nodiscard]] double time_factorization(ipminmax::SymmetricSolver& solver,
                                        const ipminmax::SymmetricMatrix& matrix,
                                        double seconds = 1e-3);

}  // namespace bench
