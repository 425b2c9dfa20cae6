#pragma once

#include <initializer_list>

#include "linalg/solver_options.hpp"

namespace ipminmax {

/// Address of a function of the library of a solver that has one, which is loaded at the first call.
/// names: alternatives, the first that is found. Throws SolverUnavailable with the loader's words.
[[nodiscard]] void* solver_function(LinearSolver kind, std::initializer_list<const char*> names);

}  // namespace ipminmax
