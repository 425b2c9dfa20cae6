#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/options.hpp"
#include "core/problem.hpp"

namespace ipminmax {

/// Bounds from here on are none, as nlp_upper_bound_inf has it by default.
inline constexpr double kUnbounded = 1e19;

/// Names of a variable and a constraint of the model for messages.
[[nodiscard]] std::string variable_name(const ProblemStructure& structure, Index i);
[[nodiscard]] std::string constraint_name(const ProblemStructure& structure, Index i);
[[nodiscard]] bool has_max_variables(const ProblemStructure& structure);
/// A number with all its digits.
[[nodiscard]] std::string number_text(double value, int digits = 17);

/// What is wrong with the sizes of bounds and the indices of patterns; empty: nothing.
[[nodiscard]] std::string check_indices(const ProblemStructure& structure);

/// What is wrong with sizes, bounds and patterns of a model, or with who reads whose variables;
/// empty: nothing.
[[nodiscard]] std::string check_structure(const ProblemStructure& structure,
                                          const SolverOptions& options);

/// All that the canonical problem's order and the patterns of the KKT matrices depend on: who owns
/// what, which bounds there are, what is fixed or an equality, and the patterns of the model. The
/// values of bounds do not enter.
struct ModelShape {
  std::vector<std::uint8_t> variables;    ///< n: player and kind of bounds
  std::vector<std::uint8_t> constraints;  ///< m: the same
  std::vector<Triplet> jacobian, hessian;
  FixedVariableTreatment fixed_variable_treatment{};
};

/// The structure's arrays must have one entry per variable or constraint.
[[nodiscard]] bool has_shape(const ProblemStructure& structure, const SolverOptions& options,
                             const ModelShape& shape);
[[nodiscard]] ModelShape shape_of(const ProblemStructure& structure, const SolverOptions& options);

}  // namespace ipminmax
