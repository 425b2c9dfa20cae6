#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <support/autodiff_problem.hpp>

#include "core/result.hpp"

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

/// What is true of a model.
enum class Truth : std::uint8_t {
  HasSolution,
  Infeasible,
  NoMinimum,  ///< unbounded, or an infimum at infinity
  Invalid     ///< bounds that contradict, or a start at which a function is undefined
};
[[nodiscard]] std::string_view describe(Truth truth);

/// A minimization without an answer, or hard to pose, and the honest verdicts.
struct IllPosed {
  std::string name{};
  Model model{};
  std::vector<double> start{};
  std::vector<Status> verdicts{};
  Truth truth = Truth::HasSolution;
};
[[nodiscard]] const std::vector<IllPosed>& ill_posed();

}  // namespace ipminmax::testing
