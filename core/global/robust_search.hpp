#pragma once

#include <vector>

#include "core/global/robust_program.hpp"

namespace ipminmax {

/// Which Max variables f reads, from its gradient around the start. n.
[[nodiscard]] std::vector<bool> read_by_objective(Problem& model, const std::vector<double>& start);

/// The search for worst cases around a list of solves, from one start of x: an exchange of
/// scenarios, then worst cases that move with x.
/// start: n values of the solved form; empty: the model's. The y of the start is the first worst
/// case, unless worst cases of a constraint near this start are known, of the solved form.
/// at_kink: x is the answer of a solve, and the maxima over y there are the first worst cases.
[[nodiscard]] Result search_worst_cases(RobustProgram program, std::vector<double> start,
                                        const std::vector<RobustWorstCase>& known = {},
                                        bool at_kink = false);

}  // namespace ipminmax
