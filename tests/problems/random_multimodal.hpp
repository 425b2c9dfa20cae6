#pragma once

#include <cstdint>
#include <support/autodiff_problem.hpp>
#include <vector>

namespace ipminmax::testing {

/// Random problems with many first-order points, most of them no local minmax; some have none:
///
///     f = sum a_i x_i^2 / 2 - sum b_j y_j^2 / 2 + x'Cy
///         + sum_k A_k sin(w_k'(x, y) + phi_k),  k = 1..6
///
/// Free: no bounds. Box: [-3, 3] for every variable. Constrained: the box, a ball for x, a ball for
/// y and a nonlinear constraint of Max that couples both.
enum class MultimodalKind : std::uint8_t { Free, Box, Constrained };

struct MultimodalProblem {
  Model model;
  std::vector<std::vector<double>> starts;  ///< uniform in [-3, 3]
};

/// n variables for each player. The same seed gives the same problem everywhere.
[[nodiscard]] MultimodalProblem random_multimodal(MultimodalKind kind, int n, int starts,
                                                  std::uint64_t seed);

}  // namespace ipminmax::testing
