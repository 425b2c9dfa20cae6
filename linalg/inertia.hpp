#pragma once

#include "api.hpp"

namespace IPMINMAX_API ipminmax {

/// Index type of matrices, variables and constraints; 0-based everywhere.
using Index = int;

/// Numbers of positive, negative and zero eigenvalues of a symmetric matrix.
struct Inertia {
  Index positive = 0;
  Index negative = 0;
  Index zero = 0;

  friend bool operator==(const Inertia&, const Inertia&) = default;
};

}  // namespace ipminmax
