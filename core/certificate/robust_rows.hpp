#pragma once

#include <vector>

#include "core/certificate/active_set.hpp"
#include "core/point/point.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// Copies of y that serve inactive robust constraints (CanonicalProblem::owners): where they stand
/// does not matter to x, and they have no curvature of their own (lambda_r goes to 0). In the test
/// they are held, and Max's rows on them left out.
struct InactiveCopies {
  std::vector<Index> variables;
  std::vector<bool> rows;  ///< per canonical constraint, or empty
};
[[nodiscard]] InactiveCopies inactive_copies(const CanonicalProblem& canonical,
                                             const Iterate& iterate,
                                             const VariableScaling& scaling);

}  // namespace ipminmax
