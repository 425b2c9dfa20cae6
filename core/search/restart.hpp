#pragma once

#include <string>

#include "core/model/canonical_problem.hpp"
#include "core/model/iterate.hpp"

namespace ipminmax {

/// Whether a search with Max variables that fails is begun anew elsewhere.
[[nodiscard]] bool makes_new_starts(const SolverOptions& options);

/// The number-th other starting point (from 1) of a search that failed from the model's: uniform in
/// the box of the bounds; where a bound is missing or far away, within the reach of the model's
/// point around it (odd numbers) or around zero (even ones). The same for every run. Slacks and
/// multipliers are zero.
[[nodiscard]] Iterate restart_point(const CanonicalProblem& canonical, const Iterate& start,
                                    Index number);

/// Iterations after which no search is begun anew, for that many free variables: the volume to
/// search grows with the dimension; large problems are too costly to be searched at random.
[[nodiscard]] Index restart_iterations(Index variables);

/// Iterations of Algorithm 1, as a last resort, from the model's starting point: its undirected
/// steps search a box well. None where a variable lacks a bound, none for one variable a player,
/// none for large problems.
[[nodiscard]] Index last_resort_iterations(const CanonicalProblem& canonical);

/// "nor from 3 other starting points: ... ", with what ended the restarts after `made` of them.
[[nodiscard]] std::string describe_restarts(Index made, Index variables,
                                            const SolverOptions& options);

}  // namespace ipminmax
