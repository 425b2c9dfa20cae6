#pragma once

#include <array>
#include <string>
#include <vector>

#include "multistart.hpp"
#include "options.hpp"
#include "problem.hpp"
#include "result.hpp"

namespace IPMINMAX_API ipminmax {

/// Everything that was found: the best point and the other certified points.
using Answer = MultistartResult;

/// Solves a model as the options ask: from max(minmax_starts, 1 + given.size()) starting points,
/// among them the given ones (n values each), with robust constraints, f in epigraph form
/// (minmax_epigraph, minmax_epigraph_at_kinks) and a search over y (minmax_worst_case_starts).
/// Every front end calls this; solve, multistart and solve_robust are other names of it.
///
/// Limits of time, factorizations and memory hold for the whole run, max_iter and tolerances for
/// each solve. The observer is not called again after it has returned false. std::bad_alloc gives
/// OutOfMemory with the best point so far; other exceptions pass through.
[[nodiscard]] Answer run(Problem& problem, const SolverOptions& options,
                         const MultistartObserver& observer = {},
                         const std::vector<std::vector<double>>& given = {});

/// Returns a result in words, four texts without a line end: why the solve stopped (the first line
/// says what happened, further lines why and what to do); what the point is locally; what was
/// searched over all of y; what was searched over x.
[[nodiscard]] std::array<std::string, 4> statements(const Result& result);

}  // namespace ipminmax
