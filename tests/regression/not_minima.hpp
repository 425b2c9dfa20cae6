#pragma once

#include <string>
#include <vector>

#include <ipminmax/core/result.hpp>
#include <support/autodiff_problem.hpp>

namespace ipminmax::testing {

/// A minimization and a start from which Ipopt (3.11.9, default options) reports success at a
/// first-order point that is no local minimum.
struct NotMinimum {
  std::string name{};
  Model model{};
  std::vector<double> start{};
  std::vector<double> point{};  ///< where Ipopt stops
  bool second_order = true;     ///< false: curvature vanishes there, only higher orders tell
};
[[nodiscard]] const std::vector<NotMinimum>& not_minima();

/// A minimization without an answer, or hard to pose, and the honest verdicts.
struct IllPosed {
  std::string name{};
  Model model{};
  std::vector<double> start{};
  std::vector<Status> verdicts{};
};
[[nodiscard]] const std::vector<IllPosed>& ill_posed();

}  // namespace ipminmax::testing
