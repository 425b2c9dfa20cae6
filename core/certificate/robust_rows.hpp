#pragma once

#include <vector>

#include "core/certificate/active_set.hpp"

namespace ipminmax {

/// Inactive copies: copies of y that serve inactive robust constraints (CanonicalProblem::owners).
/// Their values do not matter to x, and they have no curvature because lambda_r goes to 0. The test
/// holds them and leaves out Max's rows on them.
struct InactiveCopies {
  std::vector<Index> variables;
  std::vector<bool> rows;  ///< per canonical constraint, or empty
};
[[nodiscard]] InactiveCopies inactive_copies(const CanonicalProblem& canonical,
                                             const Iterate& iterate,
                                             const VariableScaling& scaling);

}  // namespace ipminmax
