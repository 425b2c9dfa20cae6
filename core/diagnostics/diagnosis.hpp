#pragma once

#include <string>
#include <vector>

#include "core/options.hpp"
#include "core/problem.hpp"
#include "core/result.hpp"

namespace ipminmax {

/// That one player has no free variables although the model distributes them; empty: both have.
/// The structure must be valid.
[[nodiscard]] std::string one_player_remark(const ProblemStructure& structure);

/// What looks like a mistake in who owns what, in sentences: Max's equalities that leave him no
/// choice or read what may be states that Max should own. The structure must be valid.
[[nodiscard]] std::vector<std::string> split_remarks(const ProblemStructure& structure);

/// Where a game ended without a local minmax: the constraint that is violated most there, of Max if
/// any of his is, else of Min. No price helps then. Empty: all hold.
[[nodiscard]] std::string unmet(const ProblemStructure& structure, const SolverOptions& options,
                                const Result& result);

/// Whether f or a constraint may join the players' variables; else max over y of f has no kink.
[[nodiscard]] bool joins_players(const ProblemStructure& structure);

/// Returns what may help a game that ended without a local minmax, in the user's terms: mistakes in
/// who owns what, the disturbance that f grows with, prices. Empty: no advice, or another status.
[[nodiscard]] std::string advice(const ProblemStructure& structure, const Result& result);

/// Names the first inequality of Max that reads both players' variables, in a model without robust
/// constraints. Such a row is Max's by default, and may have been meant for Min. Empty: there is
/// none.
[[nodiscard]] std::string coupled_remark(const ProblemStructure& structure);

/// For a solve that failed where wrong derivatives could be why: compares first and second
/// derivatives with differences along one direction at the returned point, and appends to the
/// message the function or variable where they disagree, and what may help a game (advice). A few
/// evaluations, which are counted; exceptions of the model pass through.
void diagnose_failure(Problem& problem, const SolverOptions& options, Result& result);

/// Compares values of the functions a small step beside a result with the first derivatives there.
/// Returns which gradient looks wrong, or nothing. Five values and one gradient of all functions,
/// counted in the result.
[[nodiscard]] std::string wrong_gradient_beside(Problem& problem, const SolverOptions& options,
                                                Result& result);

}  // namespace ipminmax
