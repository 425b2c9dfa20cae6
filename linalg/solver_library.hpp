#pragma once

#include <initializer_list>

#include "linalg/solver_options.hpp"

namespace ipminmax {

/// Returns the address of a function of a solver's library, which is loaded at the first call.
/// names: alternatives, of which the first one found counts. Throws SolverUnavailable with the
/// loader's words.
[[nodiscard]] void* solver_function(LinearSolver kind, std::initializer_list<const char*> names);

}  // namespace ipminmax
