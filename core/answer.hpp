#pragma once

#include <array>
#include <string>
#include <vector>

#include "multistart.hpp"
#include "options.hpp"
#include "problem.hpp"
#include "result.hpp"

namespace IPMINMAX_API ipminmax {

/// All that was found: the best point with its four statements (result.hpp), and the other points.
using Answer = MultistartResult;

/// Solves a model as its options ask: from minmax_starts starting points and the given ones (n
/// values each), over the worst cases of its robust constraints, over the branches of y
/// (minmax_epigraph, minmax_epigraph_at_kinks), with other y looked at (minmax_worst_case_starts).
/// Every front end calls this; solve, multistart and solve_robust are other names of it.
///
/// One budget serves all of it: times, factorizations, the observer's patience and the memory are
/// those of the whole; max_iter and tolerances hold for each solve. The observer is not called
/// again after it has said stop; std::bad_alloc gives OutOfMemory with the best point so far, other
/// exceptions pass through.
[[nodiscard]] Answer run(Problem& problem, const SolverOptions& options,
                         const MultistartObserver& observer = {},
                         const std::vector<std::vector<double>>& given = {});

/// What a result says, for people, without line ends: why the solve stopped; what the point is
/// locally; what was looked at over all of y; what was looked at over x.
[[nodiscard]] std::array<std::string, 4> statements(const Result& result);

}  // namespace ipminmax
