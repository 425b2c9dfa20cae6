#pragma once

#include <cstdint>
#include <vector>

#include "core/options.hpp"
#include "core/problem.hpp"

namespace ipminmax {

/// All that the canonical problem's order and the patterns of the KKT matrices depend on: who owns
/// what, which bounds there are, what is fixed or an equality, and the patterns of the model. The
/// values of bounds do not enter.
struct ModelShape {
  std::vector<std::uint8_t> variables;    ///< n: player and kind of bounds
  std::vector<std::uint8_t> constraints;  ///< m: the same
  std::vector<Triplet> jacobian, hessian;
  FixedVariableTreatment fixed_variable_treatment{};
  friend bool operator==(const ModelShape&, const ModelShape&) = default;
};

/// The structure's arrays must have one entry per variable or constraint.
[[nodiscard]] bool has_shape(const ProblemStructure& structure, const SolverOptions& options,
                             const ModelShape& shape);
[[nodiscard]] ModelShape shape_of(const ProblemStructure& structure, const SolverOptions& options);

}  // namespace ipminmax
