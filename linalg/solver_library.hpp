#pragma once

#include <vector>

#include "linalg/solver_options.hpp"

namespace ipminmax {

/// A function that was found in a library, as a pointer of the type that it is put into.
struct LoadedFunction {
  void* address;
  template <class Function>
  operator Function*() const {
    return reinterpret_cast<Function*>(address);
  }
};

/// The library of a solver, which is loaded when the first function is looked for.
struct SolverLibrary {
  explicit SolverLibrary(LinearSolver of) : kind(of) {}
  /// names: alternatives, of which the first one found counts. Throws SolverUnavailable with the
  /// loader's words.
  [[nodiscard]] LoadedFunction find(const std::vector<const char*>& names) const;

  LinearSolver kind;
};

}  // namespace ipminmax
