#pragma once

#include <string>

#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// For a solve that failed where wrong derivatives could be why: compares first and second
/// derivatives with differences along one direction at the returned point, and appends to the
/// message the function or variable where they disagree, and what may help a game (remedies in
/// core/diagnostics/remarks.hpp). A few evaluations, which are counted;
/// exceptions of the model pass through.
void diagnose_failure(Problem& problem, const SolverOptions& options, Result& result);

/// Compares values of the functions a small step beside a result with the first derivatives there.
/// Returns which gradient looks wrong, or nothing. Five values and one gradient of all functions,
/// counted in the result.
[[nodiscard]] std::string wrong_gradient_beside(Problem& problem, const SolverOptions& options,
                                                Result& result);

}  // namespace ipminmax
