#pragma once

#include <cstdint>
#include <string>
#include <support/autodiff_problem.hpp>
#include <vector>

namespace ipminmax::testing {

/// Random problems whose worst case over y has several branches: phi(x) = max_y f(x, y) often has a
/// kink where it is smallest.
///
/// Response: residuals of a response to an uncertain y in a box and an ellipsoid, all maxima over y
/// on the boundary,
///
///     f = rho |x|^2 / 2 + sum_k (c_k + a_k'x + b_k'y + x'M_k y + s_k sin(p_k'x + q_k'y))^2 / 2
///
/// Network: a layer of units, x and y in boxes, nonconcave in y,
///
///     f = rho_x |x - x_0|^2 / 2 - rho_y |y|^2 / 2 + sum_h v_h tanh(w_h'x + u_h'y + b_h)
enum class BranchingFamily : std::uint8_t { Response, Network };

struct BranchingProblem {
  std::string name;
  Model model;
  std::vector<std::vector<double>> starts;  ///< uniform in the boxes
};

/// Sizes are drawn with the rest: Response 2 to 6 and 2 to 4 variables of Min and Max, Network 10
/// to 24 variables in all. The same seed gives the same problem everywhere.
[[nodiscard]] BranchingProblem branching_problem(BranchingFamily family, int starts,
                                                 std::uint64_t seed);

}  // namespace ipminmax::testing
