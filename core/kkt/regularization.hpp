#pragma once

#include <cstdint>

#include "linalg/symmetric_solver.hpp"

namespace ipminmax {

/// Shifts of the diagonal of the KKT matrix (the paper's E(z)): + x and - y on the players'
/// variables, not on slacks; - lambda_x and + lambda_y on the multiplier rows.
struct Regularization {
  double x = 0.0;
  double y = 0.0;
  double lambda_x = 0.0;
  double lambda_y = 0.0;
  double slacks = 0.0;  ///< of Min's slacks
  friend bool operator==(const Regularization&, const Regularization&) = default;
};

/// What a factorization of K or K_yy gave, inertia with the slack rows counted, and what its
/// factors are of. They serve until the same matrix is factorized with other values or another
/// shift.
struct KktFactors : Factorization {
  Regularization shift;
  Certainty certainty = Certainty::Certain;  ///< that was asked for
  bool by_schur_complement = false;          ///< K by way of K_yy
  std::uint64_t serial = 0;                  ///< of the factorization in its system; 0: none
};

}  // namespace ipminmax
